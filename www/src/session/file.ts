/**
 * Sessions as files: a ZIP with `session.json` and binary parts; `docs/sessions.md` describes the format. Nothing of a file
 * is believed before it is checked, since it may come from anywhere.
 */
import { strFromU8, strToU8, type Zippable, zipSync } from 'three/addons/libs/fflate.module.js';
import { ArchiveTooLarge, MOST_FILES, unpack } from '../archive';
import { LAB_IDS } from '../labs/address';
import type { FileNotes, NamedBytes } from '../protocol';
import { text } from '../texts';
import { warningsIn } from '../warnings';
import { decode, encode, type Parts } from './codec';
import { INDEX, isRecord } from './recognise';

const FORMAT = 'vesicle-session';
/** Version of the format that is written; older ones are read. */
const VERSION = 1;

/** Largest number of bytes that are unpacked. A session without its data is far below. */
const MOST_BYTES = 2 ** 30;

/** Description of a file of the data that a session was made with; `content` if the session includes it. */
export interface SourceFile {
  name: string;
  size: number;
  /** SHA-256 of its bytes in hexadecimal digits. */
  sha256: string;
  content?: Uint8Array;
  /** Notes on a file that was written from one of another program. */
  notes?: FileNotes;
}

/** A lab as the user left it. */
export interface Session {
  lab: (typeof LAB_IDS)[number];
  /** The settings in force, as the hash of a link. */
  hash: string;
  source: {
    name: string;
    /** Id of the example, if it is one. */
    example?: string;
    /** The files of the data; none if they are computed. */
    files: SourceFile[];
  };
  /** The lab's own part: its model, history, undo and view. */
  content: Record<string, unknown>;
}

/** Returns SHA-256 of bytes in hexadecimal digits. */
export async function sha256(bytes: Uint8Array): Promise<string> {
  const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes as Uint8Array<ArrayBuffer>));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/** Describes files of data, with their content if a session is to include it. */
export function describe(files: NamedBytes[], included: boolean): Promise<SourceFile[]> {
  return Promise.all(
    files.map(async ({ name, bytes, notes }) => ({
      ...{ name, size: bytes.length, sha256: await sha256(bytes) },
      ...(included && { content: bytes }),
      ...(notes && { notes }),
    })),
  );
}

/** Returns a session as the bytes of a file. */
export async function writeSession({ lab, hash, source, content }: Session): Promise<Uint8Array> {
  const parts: Parts = {};
  const body = encode({ lab, hash, source, ...content }, parts) as object;
  const sums = Object.entries(parts).map(async ([name, part]) => [name, await sha256(part)] as const);
  const index = { format: FORMAT, version: VERSION, ...body, parts: Object.fromEntries(await Promise.all(sums)) };
  const files: Zippable = { [INDEX]: strToU8(JSON.stringify(index)) };
  // Most data are compressed already.
  for (const [name, part] of Object.entries(parts)) files[name] = [part, { level: name.startsWith('source/') ? 0 : 1 }];
  return zipSync(files);
}

/** Unpacks an archive; see {@link unpack}. */
type Unpack = (archive: Uint8Array, mostBytes: number, refusal: string) => Parts | Promise<Parts>;

/**
 * Reads a session, which `unpacking` unpacks: the page has a worker do it. Throws an Error whose message says what is wrong
 * with the file.
 */
export async function readSession(bytes: Uint8Array, unpacking: Unpack = unpack): Promise<Session> {
  const { [INDEX]: packed, ...parts } = await partsOf(bytes, unpacking);
  if (!packed) throw new Error(text('sessions.noIndex'));
  const { version, parts: sums, ...body } = indexOf(strFromU8(packed));
  if (typeof version === 'number' && version > VERSION)
    throw new Error(text('sessions.newer', { version, known: VERSION }));
  for (const [name, sum] of Object.entries(sums ?? {})) {
    const part = parts[name];
    if (!part) throw new Error(text('sessions.missingPart', { part: name }));
    if ((await sha256(part)) !== sum) throw new Error(text('sessions.damagedPart', { part: name }));
  }
  const find = (name: string) => {
    const part = Object.hasOwn(sums ?? {}, name) ? parts[name] : undefined;
    // Each part stands for one array, so that a small file cannot become many.
    delete parts[name];
    if (!part) throw new Error(text('sessions.missingPart', { part: name }));
    return part;
  };
  return checked(decoded(body, find));
}

function decoded(body: unknown, find: (part: string) => Uint8Array): Record<string, unknown> {
  try {
    return decode(body, find) as Record<string, unknown>;
  } catch (error) {
    if (error instanceof TypeError || error instanceof RangeError) throw new Error(text('sessions.badIndex'));
    throw error;
  }
}

async function partsOf(bytes: Uint8Array, unpacking: Unpack): Promise<Parts> {
  try {
    return await unpacking(bytes, MOST_BYTES, TOO_LARGE);
  } catch (error) {
    throw error instanceof ArchiveTooLarge ? error : new Error(text('sessions.notZip'));
  }
}

const TOO_LARGE = text('sessions.tooLarge', { parts: MOST_FILES, gigabytes: MOST_BYTES / 2 ** 30 });

function indexOf(json: string): { version?: unknown; parts?: Record<string, string> } {
  let index: unknown;
  try {
    index = JSON.parse(json);
  } catch {
    throw new Error(text('sessions.badIndex'));
  }
  if (!isRecord(index) || index.format !== FORMAT || !(Number(index.version) >= 1))
    throw new Error(text('sessions.otherFormat'));
  return index as { version: number; parts: Record<string, string> };
}

/** Checks what all labs need of a session, and returns it. */
function checked({ format: _, lab, hash, source, ...content }: Record<string, unknown>): Session {
  const of = LAB_IDS.find((id) => id === lab);
  if (!of) throw new Error(text('sessions.otherLab', { lab: String(lab) }));
  const { name, example, files } = isRecord(source) ? source : {};
  const isSound = typeof hash === 'string' && typeof name === 'string' && Array.isArray(files) && files.every(isFile);
  if (!isSound) throw new Error(text('sessions.badIndex'));
  const known = files.map((file: SourceFile) => ({ ...file, ...notesIn(file.notes) }));
  return { lab: of, hash, source: { name, files: known, ...(typeof example === 'string' && { example }) }, content };
}

/** Returns the notes on a file that are sound. */
function notesIn(value: unknown): { notes?: FileNotes } {
  if (!isRecord(value)) return {};
  const { warnings, remarks, space, inverted } = value;
  const texts = Array.isArray(remarks) ? remarks.filter((one) => typeof one === 'string') : [];
  const isLps = space === 'LPS' && { space: 'LPS' as const };
  return {
    notes: { warnings: warningsIn(warnings), remarks: texts, ...isLps, ...(inverted === true && { inverted }) },
  };
}

function isFile(value: unknown): value is SourceFile {
  if (!isRecord(value)) return false;
  const { name, size, sha256, content } = value;
  const isContent = content === undefined || content instanceof Uint8Array;
  return typeof name === 'string' && typeof size === 'number' && typeof sha256 === 'string' && isContent;
}

/**
 * Returns, in the order of the session's source, those of `files` that it was made with. Throws an Error that names
 * the file that is missing or another.
 */
export async function matching(wanted: readonly SourceFile[], files: NamedBytes[]): Promise<NamedBytes[]> {
  const sums = await Promise.all(files.map(({ bytes }) => sha256(bytes)));
  return wanted.map(({ name, sha256, notes }) => {
    const file = files[sums.indexOf(sha256)];
    if (file) return { name, bytes: file.bytes, ...(notes && { notes }) };
    const other = files.some((one) => one.name === name);
    throw new Error(text(other ? 'sessions.otherContent' : 'sessions.wanted', { name }));
  });
}
