// The data sets of DICOM files, by dicom-parser.
import type { DataSet, Element } from 'dicom-parser';
import { invalid } from '../check.js';
import { isSmall, limitOfSmall, mostUnpacked } from '../small-files.js';
import { badDicom, reasonOf } from './error.js';
import type { Source } from './source.js';

export type Parser = typeof import('dicom-parser');

/** Imports dicom-parser; throws `invalid-argument` if it is missing. */
export async function importParser(): Promise<Parser> {
  const imported = await import('dicom-parser').catch(() => undefined);
  // A module of CommonJS, whose exports some loaders put into `default` only.
  const parser = (imported as { default?: Parser } | undefined)?.default ?? imported;
  if (typeof parser?.parseDicom === 'function') return parser;
  throw invalid('dicom-parser', 'this package, 1.8 or newer, is needed to read DICOM: npm install dicom-parser');
}

const PIXEL_DATA = 'x7fe00010';
/** Float and Double Float Pixel Data (PS3.3, C.7.6.24 and C.7.6.25). */
export const FLOAT_PIXELS = ['x7fe00008', 'x7fe00009'] as const;

/** Returns the element with the voxels of a data set, of whichever type; undefined if there is none. */
export function pixelsOf(data: DataSet): Element | undefined {
  return [PIXEL_DATA, ...FLOAT_PIXELS].map((tag) => data.elements[tag]).find(Boolean);
}

/** Explicit little-endian, implicit little-endian, and explicit little-endian compressed as a whole (PS3.5, annex A). */
export const EXPLICIT = '1.2.840.10008.1.2.1';
export const IMPLICIT = '1.2.840.10008.1.2';
const DEFLATED = '1.2.840.10008.1.2.1.99';
export const BIG_ENDIAN = '1.2.840.10008.1.2.2';
/** Transfer syntaxes without compression of voxels. */
export const PLAIN = [IMPLICIT, EXPLICIT, DEFLATED, BIG_ENDIAN];

/** Bytes at the start of a file that are read first, which are all before the pixels of most images. */
const HEAD = 2 ** 16;
/** Factor by which more is read while the pixels are not reached. */
const MORE = 8;
/** Most bytes that a compressed dataset may have. */
const MOST_INFLATED = 2 ** 31 - 1;
/**
 * Elements and items that a compressed data set may have, however few bytes it has, and how many more for each byte. Each
 * takes hundreds of bytes of memory, and a thousand equal ones a dozen bytes of the file.
 */
const FREE_ELEMENTS = 20_000;
const ELEMENTS_PER_BYTE = 4;
/** Integers of 16 bits that are read of an element at most: its tag, twice, and its length. */
const READS = 5;

/** A data set up to its pixels, the bytes that offsets in it refer to, and its transfer syntax. */
export interface Header {
  data: DataSet;
  transferSyntax: string;
  deflated: boolean;
}

/** Returns whether a file begins as DICOM files do: with a preamble of 128 bytes, or, as some old ones, without. */
export function looksLikeDicom(head: Uint8Array): boolean {
  return hasPreamble(head) || syntaxWithout(head) !== undefined;
}

const hasPreamble = (head: Uint8Array) => [0x44, 0x49, 0x43, 0x4d].every((byte, k) => head[128 + k] === byte);

/**
 * Returns the transfer syntax of a file without preamble and meta header, told by its first element, which is one of the
 * group that identifies the image; undefined if it is none.
 */
function syntaxWithout(head: Uint8Array): string | undefined {
  const [group, element] = [(head[0] ?? 0) + 256 * (head[1] ?? 0), (head[2] ?? 0) + 256 * (head[3] ?? 0)];
  if (group !== 8 || element > 0x20 || head.length < 132) return undefined;
  const letters = String.fromCharCode(head[4] ?? 0, head[5] ?? 0);
  if (/^(UI|UL|CS|DA|TM|DT)$/.test(letters)) return EXPLICIT;
  const length = (head[4] ?? 0) + 256 * (head[5] ?? 0) + 65536 * ((head[6] ?? 0) + 256 * (head[7] ?? 0));
  return length <= 64 ? IMPLICIT : undefined;
}

/** Reads the data set of a file up to its pixels; undefined if the file is no DICOM. */
export async function readHeader(parser: Parser, file: Source): Promise<Header | undefined> {
  for (let size = HEAD; ; size *= MORE) {
    const bytes = await file.read(0, size);
    if (!looksLikeDicom(bytes)) return undefined;
    const whole = bytes.length === file.size;
    const header = await parsedHead(parser, file, bytes, whole);
    if (header) return header;
  }
}

/** Parses the first bytes of a file; undefined if its pixels are not among them. */
async function parsedHead(
  parser: Parser,
  file: Source,
  bytes: Uint8Array,
  whole: boolean,
): Promise<Header | undefined> {
  try {
    const header = await parse(parser, file, bytes, { untilTag: PIXEL_DATA });
    const found = pixelsOf(header.data) !== undefined;
    return found || whole || header.deflated ? header : undefined;
  } catch (error) {
    if (whole) throw badDicom(file.name, `could not be read: ${reasonOf(error)}`);
    return undefined;
  }
}

/** Parses all of a file, with the places of its compressed frames. */
export async function readWhole(parser: Parser, file: Source): Promise<Header> {
  try {
    return await parse(parser, file, await file.read(), {});
  } catch (error) {
    throw badDicom(file.name, `could not be read: ${reasonOf(error)}`);
  }
}

/** Where the meta header begins. */
const META = 132;

/** Reads the meta header. The parser looks at what comes after it, which may be compressed, and like anything. */
function readMeta(parser: Parser, bytes: Uint8Array, options: { untilTag: string }): DataSet {
  try {
    return parser.readPart10Header(bytes, options);
  } catch (error) {
    const end = metaEnd(bytes);
    if (end === undefined) throw error;
    return parser.readPart10Header(bytes.subarray(0, end), options);
  }
}

/** Returns where the meta header ends, by the length that it begins with; undefined if it states none. */
function metaEnd(bytes: Uint8Array): number | undefined {
  if (bytes.length < META + 12) return undefined;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isLength = view.getUint32(META, true) === 0x0002 && view.getUint32(META + 4) === 0x554c0400;
  const end = META + 12 + view.getUint32(META + 8, true);
  return isLength && end <= bytes.length ? end : undefined;
}

async function parse(parser: Parser, file: Source, bytes: Uint8Array, options: { untilTag?: string }): Promise<Header> {
  if (!hasPreamble(bytes)) return parseWithout(parser, bytes, options);
  // With a tag that ends it, only the meta header is parsed.
  const meta = readMeta(parser, bytes, options as { untilTag: string });
  const transferSyntax = meta.string('x00020010') ?? IMPLICIT;
  if (transferSyntax !== DEFLATED) {
    const given = { ...options, TransferSyntaxUID: transferSyntax };
    return { data: parser.parseDicom(bytes, given), transferSyntax, deflated: false };
  }
  const start = (meta as unknown as { position: number }).position;
  const stored = await file.read(start);
  const most = FREE_ELEMENTS + ELEMENTS_PER_BYTE * stored.length;
  return { data: parseLimited(parser, await inflate(stored), options, most), transferSyntax, deflated: true };
}

/** Exports of dicom-parser beyond its types. */
type Internals = {
  DataSet: new (parser: DataSet['byteArrayParser'], bytes: Uint8Array, elements: object) => DataSet;
  littleEndianByteArrayParser: DataSet['byteArrayParser'];
};

/** Parses a data set, explicit little-endian, that may have `most` elements and items. */
function parseLimited(parser: Parser, bytes: Uint8Array, options: { untilTag?: string }, most: number): DataSet {
  const { DataSet, littleEndianByteArrayParser: little } = parser as unknown as Internals;
  const stream = new parser.ByteStream(little, bytes, 0);
  const read = stream.readUint16.bind(stream);
  let left = READS * most;
  stream.readUint16 = () => {
    if (left-- > 0) return read();
    throw new Error('the compressed data set has more elements than a file of its size can describe');
  };
  const data = new DataSet(little, bytes, {});
  data.warnings = [];
  parser.parseDicomDataSetExplicit(data, stream, bytes.length, options as { untilTag: string });
  return data;
}

function parseWithout(
  parser: Parser,
  bytes: Uint8Array,
  options: { untilTag?: string },
  transferSyntax = syntaxWithout(bytes) ?? IMPLICIT,
): Header {
  const data = parser.parseDicom(bytes, { ...options, TransferSyntaxUID: transferSyntax });
  return { data, transferSyntax, deflated: false };
}

/** Returns the bytes of a raw deflate stream. */
export async function inflate(bytes: Uint8Array): Promise<Uint8Array> {
  const stream = new Blob([bytes as Uint8Array<ArrayBuffer>])
    .stream()
    .pipeThrough(new DecompressionStream('deflate-raw'));
  const parts: Uint8Array[] = [];
  let size = 0;
  const most = Math.min(MOST_INFLATED, mostUnpacked(bytes.length));
  for (const reader = stream.getReader(); ; ) {
    const { done, value } = await reader.read();
    if (done) break;
    size += value.length;
    if (size > most) {
      await reader.cancel();
      throw new Error(inflatedProblem(bytes.length));
    }
    parts.push(value);
  }
  const all = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

function inflatedProblem(stored: number): string {
  return isSmall(stored) ? `it unpacks to too much; ${limitOfSmall()}` : 'the compressed data set has more than 2 GB';
}
