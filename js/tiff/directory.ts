// The directories of a TIFF file: the tags of its pages.

import type { Pause } from '../pause.js';
import { shortened } from '../short-text.js';
import { badTiff } from './error.js';
import type { Source } from './source.js';

/** Numbers of the tags that are read. */
export const TAG = {
  newSubfileType: 254,
  width: 256,
  height: 257,
  bits: 258,
  compression: 259,
  photometric: 262,
  fillOrder: 266,
  description: 270,
  stripOffsets: 273,
  orientation: 274,
  samples: 277,
  rowsPerStrip: 278,
  stripBytes: 279,
  xResolution: 282,
  yResolution: 283,
  planar: 284,
  resolutionUnit: 296,
  predictor: 317,
  tileWidth: 322,
  tileHeight: 323,
  tileOffsets: 324,
  tileBytes: 325,
  extraSamples: 338,
  sampleFormat: 339,
  jpegTables: 347,
  /** MetaMorph: one value per slice, all of which follow the first page. */
  metaMorphPlanes: 33629,
  /** Zeiss LSM. */
  lsm: 34412,
} as const;

/** Number of bytes of a value of each type. */
const SIZES = new Map([
  ...[1, 2, 6, 7].map((type) => [type, 1] as const),
  ...[3, 8].map((type) => [type, 2] as const),
  ...[4, 9, 11, 13].map((type) => [type, 4] as const),
  ...[5, 10, 12, 16, 17, 18].map((type) => [type, 8] as const),
]);

/** How numbers of a file are stored. */
interface Order {
  isLittle: boolean;
  isBig: boolean;
}

/** The value of a tag. */
interface Field {
  type: number;
  count: number;
  /** Number of bytes. */
  length: number;
  /** The bytes, if they are in the directory, or else their offset. */
  value: Uint8Array | number;
}

/** Reads a 64-bit integer, which must be exact. */
function long(view: DataView, at: number, little: boolean): number {
  return view.getUint32(at + (little ? 4 : 0), little) * 2 ** 32 + view.getUint32(at + (little ? 0 : 4), little);
}

/** Returns the value at an offset in `view`; of a fraction its quotient. */
function valueAt(view: DataView, at: number, type: number, little: boolean): number {
  switch (type) {
    case 3:
      return view.getUint16(at, little);
    case 4:
    case 13:
      return view.getUint32(at, little);
    case 5:
      return view.getUint32(at, little) / view.getUint32(at + 4, little);
    case 6:
      return view.getInt8(at);
    case 8:
      return view.getInt16(at, little);
    case 9:
      return view.getInt32(at, little);
    case 10:
      return view.getInt32(at, little) / view.getInt32(at + 4, little);
    case 11:
      return view.getFloat32(at, little);
    case 12:
      return view.getFloat64(at, little);
    case 16:
    case 17:
    case 18:
      return long(view, at, little);
    default:
      return view.getUint8(at);
  }
}

const viewOf = (bytes: Uint8Array) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

/** Numbers of bytes of a directory: of the number of entries, of an entry, and of an offset. */
const layoutOf = ({ isBig }: Order) => (isBig ? { head: 8, entry: 20, offset: 8 } : { head: 2, entry: 12, offset: 4 });

/** Returns the field at `start` of the entries of a directory; undefined if its type is not known. */
function fieldAt(entries: Uint8Array, start: number, order: Order): Field | undefined {
  const { isLittle, isBig } = order;
  const { entry, offset } = layoutOf(order);
  const view = viewOf(entries);
  const type = view.getUint16(start + 2, isLittle);
  const size = SIZES.get(type);
  if (size === undefined) return undefined;
  const count = isBig ? long(view, start + 4, isLittle) : view.getUint32(start + 4, isLittle);
  const [at, length] = [start + entry - offset, count * size];
  const elsewhere = () => (isBig ? long(view, at, isLittle) : view.getUint32(at, isLittle));
  return { type, count, length, value: length <= offset ? entries.subarray(at, at + length) : elsewhere() };
}

/** One page of a file: an image, and the tags that describe it. There may be very many, so that it is small. */
export class Page {
  readonly source: Source;
  readonly #index: number;
  readonly #at: number;
  readonly #order: Order;
  /** Entries of its directory. */
  readonly #entries: Uint8Array;

  constructor(source: Source, index: number, at: number, order: Order, entries: Uint8Array) {
    this.source = source;
    this.#index = index;
    this.#at = at;
    this.#order = order;
    this.#entries = entries;
  }

  /** Whether the file's numbers are little-endian. */
  get isLittle(): boolean {
    return this.#order.isLittle;
  }

  /** Name for messages: that of the file, and the number of the page from 1. */
  get label(): string {
    return `${shortened(this.source.name)}: page ${this.#index + 1}`;
  }

  /** Returns whether the directory, or a value of a tag, begins in a part of the file. */
  isWithin(start: number, end: number): boolean {
    const isInside = (at: unknown) => typeof at === 'number' && at >= start && at < end;
    const { entry } = layoutOf(this.#order);
    for (let at = 0; at < this.#entries.length; at += entry)
      if (isInside(fieldAt(this.#entries, at, this.#order)?.value)) return true;
    return isInside(this.#at);
  }

  #field(tag: number): Field | undefined {
    const { isLittle } = this.#order;
    const [view, { entry }] = [viewOf(this.#entries), layoutOf(this.#order)];
    for (let at = 0; at < this.#entries.length; at += entry)
      if (view.getUint16(at, isLittle) === tag) return fieldAt(this.#entries, at, this.#order);
    return undefined;
  }

  has(tag: number): boolean {
    return this.#field(tag) !== undefined;
  }

  /** Returns the number of values of a tag; 0 if the page does not have it. */
  count(tag: number): number {
    return this.#field(tag)?.count ?? 0;
  }

  /** Returns the bytes of the first `most` values of a tag. */
  async bytes(tag: number, most = Infinity): Promise<Uint8Array> {
    const field = this.#field(tag);
    if (!field) return new Uint8Array();
    const length = Math.min(field.length, most * (SIZES.get(field.type) ?? 1));
    return typeof field.value === 'number' ? this.source.peek(field.value, length) : field.value.subarray(0, length);
  }

  /** Returns the first `most` values of a tag; none if the page does not have it. */
  async numbers(tag: number, most = Infinity): Promise<number[]> {
    const { type = 1 } = this.#field(tag) ?? {};
    const size = SIZES.get(type) ?? 1;
    const view = viewOf(await this.bytes(tag, most));
    return Array.from({ length: view.byteLength / size }, (_, k) => valueAt(view, k * size, type, this.isLittle));
  }

  /** Returns the first value of a tag, or `missing`. */
  async number(tag: number, missing: number): Promise<number> {
    return (await this.numbers(tag, 1))[0] ?? missing;
  }

  /** Returns the first value of a tag, or `missing`; throws `bad-file` unless it is a whole number, 0 or larger. */
  async integer(tag: number, missing: number): Promise<number> {
    return this.checked(tag, await this.number(tag, missing));
  }

  /** Returns a value of a tag; throws `bad-file` unless it is a whole number, 0 or larger. */
  checked(tag: number, value: number): number {
    if (Number.isSafeInteger(value) && value >= 0) return value;
    throw badTiff(this.label, `tag ${tag} must be a whole number, got ${value}`);
  }

  /** Returns the text of a tag up to its end, or to the first zero. */
  async text(tag: number): Promise<string> {
    const bytes = await this.bytes(tag);
    const end = bytes.indexOf(0);
    return decoded(end < 0 ? bytes : bytes.subarray(0, end));
  }
}

/** Decodes text, which should be ASCII: UTF-8, or else Latin-1, in which ImageJ writes its sign for micro. */
function decoded(bytes: Uint8Array): string {
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder('latin1').decode(bytes);
  }
}

/** Returns whether a file begins like a TIFF of either byte order, with offsets of 32 or 64 bits. */
export async function isTiff(source: Source): Promise<boolean> {
  return source.size >= 8 && orderOf(await source.peek(0, 4)) !== undefined;
}

function orderOf(bytes: Uint8Array): Order | undefined {
  const [a, b, c, d] = bytes;
  const isLittle = a === 0x49 && b === 0x49;
  if (!isLittle && !(a === 0x4d && b === 0x4d)) return undefined;
  const [kind, zero] = isLittle ? [c, d] : [d, c];
  return zero === 0 && (kind === 42 || kind === 43) ? { isLittle, isBig: kind === 43 } : undefined;
}

/** Reads the directories of all pages, but not of those that are parts of another one. */
export async function readPages(source: Source, pause: Pause): Promise<Page[]> {
  const order = source.size < 8 ? undefined : orderOf(await source.peek(0, 4));
  if (!order) throw badTiff(source.name, 'not a TIFF file: it must begin with II or MM and the number 42 or 43');
  const pages: Page[] = [];
  const seen = new Set<number>();
  let bytes = 0;
  for (let at = await firstOffset(source, order); at !== 0; ) {
    if (seen.has(at))
      throw badTiff(source.name, `the directories form a cycle: page ${pages.length + 1} was read before`);
    seen.add(at);
    const { entries, next } = await readDirectory(source, at, order);
    // Directories that overlap could be as many as bytes.
    bytes += entries.length + 6;
    if (entries.length === 0) throw badTiff(source.name, `the directory of page ${pages.length + 1} is empty`);
    if (bytes > source.size) throw badTiff(source.name, 'the directories of its pages overlap');
    pages.push(new Page(source, pages.length, at, order, entries));
    at = next;
    await pause.turn();
  }
  if (pages.length === 0) throw badTiff(source.name, 'the file has no pages');
  return pages;
}

async function firstOffset(source: Source, { isLittle, isBig }: Order): Promise<number> {
  const view = viewOf(await source.peek(0, isBig ? 16 : 8));
  if (!isBig) return view.getUint32(4, isLittle);
  if (view.getUint16(4, isLittle) === 8) return long(view, 8, isLittle);
  throw badTiff(source.name, `offsets must have 8 bytes in BigTIFF, got ${view.getUint16(4, isLittle)}`);
}

interface Directory {
  entries: Uint8Array;
  /** Offset of the next directory; 0 for none. */
  next: number;
}

async function readDirectory(source: Source, at: number, order: Order): Promise<Directory> {
  const { isLittle, isBig } = order;
  const { head, entry, offset } = layoutOf(order);
  const first = viewOf(await source.peek(at, head));
  const count = isBig ? long(first, 0, isLittle) : first.getUint16(0, isLittle);
  const end = head + count * entry;
  const bytes = await source.peek(at, end + offset);
  const view = viewOf(bytes);
  const next = isBig ? long(view, end, isLittle) : view.getUint32(end, isLittle);
  return { entries: bytes.slice(head, end), next };
}
