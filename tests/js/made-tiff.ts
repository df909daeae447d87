// TIFF files for the property tests: a writer of its own, compressors, and generators of faults in directories.
import { deflateSync } from 'node:zlib';
import fc from 'fast-check';

/** A tag as it is written: numbers of a type, and a count or place that may be wrong. */
export interface Entry {
  tag: number;
  type: number;
  values: number[];
  count?: number;
  /** Offset of the values, instead of where they are. */
  at?: number;
}

/** Form of a file. */
export interface Form {
  isBig: boolean;
  isLittle: boolean;
}

const SIZES: Record<number, number> = { 1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 11: 4, 12: 8, 16: 8 };

/** Returns numbers as bytes in the order of a file. */
export function numbersIn(values: readonly number[], size: number, isLittle: boolean, isFloat = false): Buffer {
  const bytes = Buffer.alloc(values.length * size);
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  for (const [k, value] of values.entries()) {
    const at = k * size;
    if (isFloat && size === 4) view.setFloat32(at, value, isLittle);
    else if (isFloat) view.setFloat64(at, value, isLittle);
    else if (size === 8) view.setBigUint64(at, BigInt(Math.trunc(value) || 0) & 0xffffffffffffffffn, isLittle);
    else if (size === 4) view.setUint32(at, value, isLittle);
    else if (size === 2) view.setUint16(at, value, isLittle);
    else view.setUint8(at, value);
  }
  return bytes;
}

function bytesOf({ type, values }: Entry, isLittle: boolean): Buffer {
  const size = SIZES[type] ?? 4;
  // A fraction of 1 as denominator.
  if (type === 5)
    return numbersIn(
      values.flatMap((value) => [value * 1000, 1000]),
      4,
      isLittle,
    );
  return numbersIn(values, size, isLittle, type === 11 || type === 12);
}

/** Returns a file whose data come first, then the values of tags and the directories of its pages. */
export function tiffOf(data: readonly Uint8Array[], pages: readonly Entry[][], { isBig, isLittle }: Form): Buffer {
  const [head, width, entry] = isBig ? [16, 8, 20] : [8, 4, 12];
  const parts = [...data];
  let end = head + data.reduce((sum, { length }) => sum + length, 0);
  const put = (bytes: Uint8Array) => {
    parts.push(bytes);
    end += bytes.length;
    return end - bytes.length;
  };
  const number = (value: number, size: number) => numbersIn([value], size, isLittle);
  const encoded = pages.map((entries) =>
    entries.map((one) => {
      const bytes = bytesOf(one, isLittle);
      const isInside = bytes.length <= width && one.at === undefined;
      const value = isInside ? Buffer.concat([bytes, Buffer.alloc(width - bytes.length)]) : undefined;
      const place = value ?? number(one.at ?? put(bytes), width);
      return Buffer.concat([
        number(one.tag, 2),
        number(one.type, 2),
        number(one.count ?? one.values.length, width),
        place,
      ]);
    }),
  );
  const first = end;
  for (const [k, entries] of encoded.entries()) {
    const length = (isBig ? 8 : 2) + entries.length * entry + width;
    const next = k + 1 < encoded.length ? end + length : 0;
    put(Buffer.concat([number(entries.length, isBig ? 8 : 2), ...entries, number(next, width)]));
  }
  const order = Buffer.from(isLittle ? 'II' : 'MM');
  const start = isBig
    ? [number(43, 2), number(8, 2), number(0, 2), number(first, 8)]
    : [number(42, 2), number(first, 4)];
  return Buffer.concat([order, ...start, ...parts]);
}

/** Returns the offset of the data that `data` begins with. */
export const dataStart = ({ isBig }: Form) => (isBig ? 16 : 8);

export const text = (content: string): number[] => [...Buffer.from(`${content}\0`, 'utf8')];

/** Compressions by their number. */
export const COMPRESS: Record<number, (bytes: Uint8Array) => Uint8Array> = {
  1: (bytes) => bytes,
  5: lzw,
  8: (bytes) => deflateSync(bytes),
  32773: packBits,
};

function packBits(bytes: Uint8Array): Uint8Array {
  const out: number[] = [];
  for (let at = 0; at < bytes.length; ) {
    let end = at + 1;
    while (end < bytes.length && end - at < 128 && bytes[end] === bytes[at]) end += 1;
    if (end - at > 1) out.push(257 - (end - at), bytes[at] ?? 0);
    else out.push(0, bytes[at] ?? 0);
    at = end;
  }
  return Uint8Array.from(out);
}

/** Compresses with codes of 9 to 12 bits. */
function lzw(bytes: Uint8Array): Uint8Array {
  const out: number[] = [];
  let [held, word, bits] = [0, 0, 9];
  const put = (code: number) => {
    word = (word << bits) | code;
    held += bits;
    for (; held >= 8; held -= 8) out.push((word >> (held - 8)) & 255);
    word &= (1 << held) - 1;
  };
  // By the code of a string, and the byte that follows it.
  const codes = new Map<number, number>();
  let [next, before] = [258, -1];
  put(256);
  for (const byte of bytes) {
    const key = before * 256 + byte;
    const known = before < 0 ? byte : codes.get(key);
    if (known !== undefined) {
      before = known;
      continue;
    }
    put(before);
    codes.set(key, next++);
    if (next + 1 > 1 << bits && bits < 12) bits += 1;
    if (next > 4093) {
      put(256);
      codes.clear();
      [next, bits] = [258, 9];
    }
    before = byte;
  }
  if (before >= 0) {
    put(before);
    next += 1;
    if (next + 1 > 1 << bits && bits < 12) bits += 1;
  }
  put(257);
  if (held > 0) out.push((word << (8 - held)) & 255);
  return Uint8Array.from(out);
}

/** A change of one tag of one page. */
export interface TagFault {
  page: number;
  at: number;
  change: (entry: Entry) => Entry[];
}

const ODD = fc.constantFrom(
  0,
  1,
  2,
  3,
  7,
  8,
  9,
  255,
  256,
  65_535,
  65_536,
  2 ** 31 - 1,
  2 ** 31,
  2 ** 32 - 1,
  1.5,
  Number.NaN,
);
const TAGS = [
  254, 256, 257, 258, 259, 262, 266, 273, 274, 277, 278, 279, 284, 317, 322, 323, 324, 325, 338, 339, 33_629, 34_412,
];
const CHANGE: fc.Arbitrary<TagFault['change']> = fc.oneof(
  fc
    .constantFrom(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 16, 99)
    .map((type) => (one: Entry) => [{ ...one, type }]),
  ODD.map((value) => (one: Entry) => [{ ...one, values: [value] }]),
  fc.array(ODD, { maxLength: 5 }).map((values) => (one: Entry) => [{ ...one, values }]),
  ODD.map((count) => (one: Entry) => [{ ...one, count }]),
  ODD.map((at) => (one: Entry) => [{ ...one, at }]),
  fc.constant(() => []),
  fc.constant((one: Entry) => [one, one]),
  fc.tuple(fc.constantFrom(...TAGS), ODD).map(([tag, value]) => (one: Entry) => [
    one,
    { tag, type: 4, values: [value] },
  ]),
  fc.constantFrom(...TAGS).map((tag) => (one: Entry) => [{ ...one, tag }]),
);

export const TAG_FAULTS: fc.Arbitrary<TagFault[]> = fc.array(
  fc.record({ page: fc.nat(), at: fc.nat(), change: CHANGE }),
  {
    minLength: 1,
    maxLength: 4,
  },
);

/** Returns pages with faults in their tags. */
export function withTagFaults(pages: readonly Entry[][], faults: readonly TagFault[]): Entry[][] {
  const found = pages.map((entries) => [...entries]);
  for (const { page, at, change } of faults) {
    const entries = found[page % Math.max(1, found.length)];
    if (!entries || entries.length === 0) continue;
    const index = at % entries.length;
    entries.splice(index, 1, ...change(entries[index] as Entry));
  }
  return found;
}

/** Returns a TIFF with a page of `side` × `side` bytes for each slice, deflated. */
export function deflatedStack(slices: readonly Uint8Array[], side: number): Uint8Array {
  const form = { isBig: false, isLittle: true };
  const packed = slices.map((slice) => new Uint8Array(deflateSync(slice)));
  let start = dataStart(form);
  const pages = packed.map(({ length }) => {
    const tags: [number, number][] = [
      ...([
        [256, side],
        [257, side],
        [258, 8],
        [259, 8],
        [262, 1],
      ] as [number, number][]),
      ...([
        [273, start],
        [278, side],
        [279, length],
      ] as [number, number][]),
    ];
    start += length;
    return tags.map(([tag, value]) => ({ tag, type: 4, values: [value] }));
  });
  return new Uint8Array(tiffOf(packed, pages, form));
}
