// Values of the elements of a data set, by dicom-parser.
import type { DataSet } from 'dicom-parser';

/** Returns the text of an element, without the padding; empty if there is none. */
export function textOf(data: DataSet | undefined, tag: string): string {
  const element = data?.elements[tag];
  if (!data || !element || element.items) return '';
  const end = Math.min(element.dataOffset + element.length, data.byteArray.length);
  const bytes = data.byteArray.subarray(element.dataOffset, end);
  return decoder(data).decode(bytes).split('\0', 1)[0]?.trim() ?? '';
}

/** Returns the decoder of the character set that a data set declares (PS3.3, C.12.1.1.2), by default Latin-1. */
function decoder(data: DataSet): TextDecoder {
  const element = data.elements.x00080005;
  const name = element ? data.string('x00080005')?.split('\\')[0]?.trim() : '';
  return new TextDecoder(CHARACTER_SETS[name ?? ''] ?? 'latin1');
}

const CHARACTER_SETS: Record<string, string> = {
  'ISO_IR 192': 'utf-8',
  'ISO_IR 101': 'iso-8859-2',
  'ISO_IR 144': 'iso-8859-5',
  'ISO_IR 126': 'iso-8859-7',
  'ISO_IR 13': 'shift_jis',
  GB18030: 'gb18030',
  GBK: 'gbk',
};

/** Returns the numbers of an element of any type that has numbers; empty if it is missing or has others than numbers. */
export function numbersOf(data: DataSet | undefined, tag: string): number[] {
  const element = data?.elements[tag];
  if (!data || !element || element.length === 0 || element.items) return [];
  if (element.vr === 'FD' || BINARY_DOUBLES.has(tag))
    return Array.from({ length: element.length / 8 }, (_, k) => data.double(tag, k) ?? Number.NaN);
  if (element.vr === 'US')
    return Array.from({ length: element.length / 2 }, (_, k) => data.uint16(tag, k) ?? Number.NaN);
  if (element.vr === 'UL' || BINARY_LONGS.has(tag))
    return Array.from({ length: element.length / 4 }, (_, k) => data.uint32(tag, k) ?? Number.NaN);
  const numbers = textOf(data, tag)
    .split('\\')
    .map((part) => (part.trim() === '' ? Number.NaN : Number(part.replace(',', '.'))));
  return numbers.every((number) => !Number.isNaN(number)) ? numbers : [];
}

/** Elements of binary numbers, whose type implicit files do not state. */
const BINARY_DOUBLES = new Set(['x00189082', 'x00189087', 'x00209153']);
const BINARY_LONGS = new Set(['x00209128']);

export const numberOf = (data: DataSet, tag: string) => numbersOf(data, tag)[0];
