/**
 * Sessions as files: a ZIP with `session.json` and binary parts; `docs/sessions.md` describes the format. Nothing of a file
 * is used before it is checked, since it may come from anywhere.
 */
import { strFromU8, strToU8 } from 'three/addons/libs/fflate.module.js';
import type { FileNotes, NamedBytes } from '../../engine/protocol';
import { SMALL } from '../../engine/small-files';
import { INDEX } from '../../importers/sessions';
import { ArchiveTooLarge, MOST_FILES, unpack } from '../../kit/archive';
import { text } from '../../texts';
import { checked, type Session, type SessionSchema, shown } from './check';
import { decode, encode, type Parts } from './codec';
import { zipped } from './zip';

const FORMAT = 'vesicle-session';
/** Version of the format that is written; older ones are read. */
const VERSION = 1;

/** Largest number of bytes that are unpacked. A session without its data is far below. */
const MOST_BYTES = 2 ** 30;
/** Largest size of `session.json` in bytes, and most values in it. */
const MOST_INDEX = 2 ** 27;
const MOST_VALUES = 5e6;
/** Largest size of the `session.json` in a small file. */
const MOST_INDEX_OF_SMALL = 2 ** 23;

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

/** A session that a lab has made, to be written. */
export interface NewSession {
  lab: Session['lab'];
  /** The settings in force, as the hash of a link. */
  hash: string;
  source: {
    name: string;
    /** Id of the example, if it is one. */
    example?: string;
    /** The files of the data; none if they are computed. */
    files: SourceFile[];
  };
  /** The lab's own part of the session: its model, history, undo and view. */
  content: object;
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
export async function writeSession({ lab, hash, source, content }: NewSession): Promise<Uint8Array> {
  const parts: Parts = {};
  const body = encode({ lab, hash, source, ...content }, parts) as object;
  const sums: Record<string, string> = {};
  // One by one, since the browser copies what it computes them of.
  for (const [name, part] of Object.entries(parts)) sums[name] = await sha256(part);
  const packed = strToU8(JSON.stringify({ format: FORMAT, version: VERSION, ...body, parts: sums }));
  requireSize(packed, MOST_INDEX);
  const files = Object.entries(parts).map(([name, bytes]) => {
    // Most data are compressed already.
    return { name, bytes, compressed: !name.startsWith('source/') };
  });
  const archive = await zipped([{ name: INDEX, bytes: packed, compressed: true }, ...files]);
  if (packed.length <= mostIndex(archive)) return archive;
  // One that repeats itself so much is not compressed, so that it can be read.
  return zipped([{ name: INDEX, bytes: packed, compressed: false }, ...files]);
}

/** Returns the largest size of the `session.json` in a file: a small file could unpack to a thousand times its size. */
const mostIndex = (file: Uint8Array) => (file.length <= SMALL ? MOST_INDEX_OF_SMALL : MOST_INDEX);

/** Unpacks an archive; see {@link unpack}. */
type Unpack = (archive: Uint8Array, mostBytes: number, refusal: string) => Parts;

/**
 * Reads a session of one of the labs in `schemas`, which `unpacking` unpacks. Throws an Error whose message says what is wrong
 * with the file.
 */
export async function readSession(
  bytes: Uint8Array,
  schemas: ReadonlyMap<unknown, SessionSchema>,
  unpacking: Unpack = unpack,
): Promise<Session> {
  const { [INDEX]: packed, ...parts } = partsOf(bytes, unpacking);
  if (!packed) throw new Error(text('sessions.noIndex'));
  requireSize(packed, mostIndex(bytes));
  const { format: _, version, parts: sums, ...body } = indexOf(strFromU8(packed));
  if (version > VERSION) throw new Error(text('sessions.newer', { version, known: VERSION }));
  const verified = await verify(new Map(Object.entries(parts)), sums);
  const found = new Set<string>();
  const find = (name: string) => {
    const part = verified.get(name);
    if (!part) throw new Error(text('sessions.missingPart', { part: shown(name) }));
    // Each part stands for one array, so that a small file cannot become many.
    if (found.has(name)) throw new Error(text('sessions.repeatedPart', { part: shown(name) }));
    found.add(name);
    return part;
  };
  return checked(decoded(body, find), schemas);
}

/** Throws an Error if a `session.json` is too large. */
function requireSize(index: Uint8Array, most: number): void {
  let values = 1;
  // Each value but the first follows a comma or a bracket; those in texts are counted, too.
  if (index.length <= most)
    for (const byte of index) if (byte === COMMA || byte === LIST || byte === OBJECT) values += 1;
  if (index.length <= most && values <= MOST_VALUES) return;
  throw new Error(text('sessions.indexTooLarge', { megabytes: most / 2 ** 20, millions: MOST_VALUES / 1e6 }));
}

/** Returns the parts that are listed, all of which have the checksums of the list. */
async function verify(parts: Map<string, Uint8Array>, sums: Index['parts']): Promise<Map<string, Uint8Array>> {
  const verified = new Map<string, Uint8Array>();
  for (const [name, sum] of Object.entries(sums)) {
    const part = parts.get(name);
    if (!part) throw new Error(text('sessions.missingPart', { part: shown(name) }));
    if ((await sha256(part)) !== sum) throw new Error(text('sessions.damagedPart', { part: shown(name) }));
    verified.set(name, part);
  }
  return verified;
}

function decoded(body: unknown, find: (part: string) => Uint8Array): Record<string, unknown> {
  try {
    return decode(body, find) as Record<string, unknown>;
  } catch (error) {
    if (error instanceof TypeError || error instanceof RangeError) throw new Error(text('sessions.badIndex'));
    throw error;
  }
}

function partsOf(bytes: Uint8Array, unpacking: Unpack): Parts {
  try {
    return unpacking(bytes, MOST_BYTES, TOO_LARGE);
  } catch (error) {
    throw error instanceof ArchiveTooLarge ? error : new Error(text('sessions.notZip'));
  }
}

const TOO_LARGE = text('sessions.tooLarge', { parts: MOST_FILES, gigabytes: MOST_BYTES / 2 ** 30 });

/** Content of `session.json`: what it has besides these is the session itself. */
interface Index {
  version: number;
  parts: Record<string, unknown>;
}

function indexOf(json: string): Index & Record<string, unknown> {
  let index: unknown;
  try {
    index = JSON.parse(json);
  } catch {
    throw new Error(text('sessions.badIndex'));
  }
  const { format, version, parts = {} } = isRecord(index) ? index : {};
  if (format !== FORMAT || typeof version !== 'number' || !(version >= 1))
    throw new Error(text('sessions.otherFormat'));
  if (!isRecord(parts)) throw new Error(text('sessions.badIndex'));
  return { ...(index as object), version, parts };
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

/** Bytes of `,`, `[` and `{`. */
const [COMMA, LIST, OBJECT] = [0x2c, 0x5b, 0x7b];

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}
