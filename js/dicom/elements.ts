// Values of the elements of a data set, by dicom-parser.
import type { DataSet, Element } from 'dicom-parser';

/** Returns the number of bytes of an element that its file has: the length that a damaged one states may be larger. */
export function lengthOf(data: DataSet, element: Element): number {
  return Math.max(0, Math.min(element.length, data.byteArray.length - element.dataOffset));
}

/**
 * Returns the text of an element, without the padding; empty if there is none. The data set of an item has the character
 * set of its file, unless it declares another.
 */
export function textOf(data: DataSet | undefined, tag: string, file?: DataSet): string {
  const element = data?.elements[tag];
  if (!data || !element || element.items) return '';
  const length = lengthOf(data, element);
  if (length === 0) return '';
  const bytes = data.byteArray.subarray(element.dataOffset, element.dataOffset + length);
  return (
    decoder(file && !data.elements.x00080005 ? file : data)
      .decode(bytes)
      .split('\0', 1)[0]
      ?.trim() ?? ''
  );
}

/** Returns the decoder of the character set that a data set declares (PS3.3, C.12.1.1.2), by default Latin-1. */
function decoder(data: DataSet): TextDecoder {
  const element = data.elements.x00080005;
  const declared = element && !element.items && lengthOf(data, element) <= LONGEST_SETS;
  const name = declared ? data.string('x00080005')?.split('\\')[0]?.trim() : '';
  const set = CHARACTER_SETS.get(name ?? '') ?? 'latin1';
  const known = decoders.get(set) ?? new TextDecoder(set);
  decoders.set(set, known);
  return known;
}

/** Most bytes of a list of character sets. */
const LONGEST_SETS = 256;

/** Decoders by character set, each of which takes longer to make than a text to decode. */
const decoders = new Map<string, TextDecoder>();

const CHARACTER_SETS = new Map([
  ['ISO_IR 192', 'utf-8'],
  ['ISO_IR 101', 'iso-8859-2'],
  ['ISO_IR 144', 'iso-8859-5'],
  ['ISO_IR 126', 'iso-8859-7'],
  ['ISO_IR 13', 'shift_jis'],
  ['GB18030', 'gb18030'],
  ['GBK', 'gbk'],
]);

/** Returns the numbers of an element of any type that has numbers; empty if it is missing or has others than finite ones. */
export function numbersOf(data: DataSet | undefined, tag: string): number[] {
  const element = data?.elements[tag];
  if (!data || !element || element.items) return [];
  const numbers = binaryOf(data, element) ?? textOf(data, tag).split('\\').map(decimal);
  return numbers.every(Number.isFinite) ? numbers : [];
}

/** Types of binary numbers: their size, and how dicom-parser reads them. */
const BINARY = new Map<string, [size: number, read: 'uint16' | 'int16' | 'uint32' | 'int32' | 'float' | 'double']>([
  ['US', [2, 'uint16']],
  ['SS', [2, 'int16']],
  ['UL', [4, 'uint32']],
  ['SL', [4, 'int32']],
  ['FL', [4, 'float']],
  ['FD', [8, 'double']],
]);

/** Elements of binary numbers, whose type implicit files do not state. */
const IMPLICIT = new Map([
  ['x00189082', 'FD'],
  ['x00189087', 'FD'],
  ['x00209153', 'FD'],
  ['x00209128', 'UL'],
]);

/** Returns the numbers of an element that has binary ones; undefined if it has text. */
function binaryOf(data: DataSet, element: Element): number[] | undefined {
  const { tag, vr = '' } = element;
  const type = BINARY.get(vr) ?? BINARY.get(IMPLICIT.get(tag) ?? '');
  if (!type) return undefined;
  const [size, read] = type;
  const count = Math.floor(lengthOf(data, element) / size);
  return Array.from({ length: count }, (_, k) => data[read](tag, k) ?? Number.NaN);
}

/** Longest text of a number: 16 characters, but for files that do not comply. */
const LONGEST_NUMBER = 64;

/** Returns a number in decimal notation, some of which have a comma; NaN for all other text. */
function decimal(text: string): number {
  const part = text.length <= LONGEST_NUMBER ? text.trim().replace(',', '.') : '';
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(part) ? Number(part) : Number.NaN;
}

export const numberOf = (data: DataSet, tag: string) => numbersOf(data, tag)[0];

/** Types of bytes that may be an integer of 16 bits: those that are not stated, and those of other elements. */
const UNTYPED = ['US', 'SS', 'UN', 'OB', 'OW'];

/** Returns value `k` of an element of unsigned integers of 16 bits; undefined if it has none. */
export function integerOf(data: DataSet | undefined, tag: string, k = 0): number | undefined {
  const element = data?.elements[tag];
  if (!data || !element || element.items) return undefined;
  if (element.vr === undefined || UNTYPED.includes(element.vr))
    return lengthOf(data, element) >= 2 * k + 2 ? data.uint16(tag, k) : undefined;
  // Some files have it as another type.
  const number = numbersOf(data, tag)[k];
  return number !== undefined && Number.isInteger(number) && number >= 0 && number < 65_536 ? number : undefined;
}
