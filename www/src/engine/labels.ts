/** Labels: their names and colours, and the voxels of label maps. */
import { text } from '../texts';

/** A label as the list shows it. */
export interface Label {
  value: number;
  name: string;
  /** As #rrggbb. */
  color: string;
}

/** A label of a file or an example, as far as that describes it. */
export interface KnownLabel {
  value: number;
  name?: string;
  /** As #rrggbb. */
  color?: string;
}

/** Distinct colours, also for most colour-blind people; labels beyond repeat them. */
const PALETTE = [
  '#e69f00',
  '#56b4e9',
  '#d6406d',
  '#2fa572',
  '#f0e442',
  '#9467d8',
  '#d55e00',
  '#0d7fc4',
  '#a6cf5b',
  '#e89bc7',
  '#8c6d4f',
  '#7fd6cf',
];

/** Most characters of a label's name. */
const MOST_NAME = 200;

/** Returns a name of a file as one line of bounded length, without marks that turn the direction of writing. */
export function shortName(name: string): string {
  return name
    .slice(0, 2 * MOST_NAME)
    .replace(/[\p{Cc}\u2028-\u202e\u2066-\u2069]+/gu, ' ')
    .trim()
    .slice(0, MOST_NAME);
}

/** Returns a label with the given value, with the name and colour that are known of it, or others by its value. */
export function newLabel(value: number, { name, color }: Omit<KnownLabel, 'value'> = {}): Label {
  const index = (((value - 1) % PALETTE.length) + PALETTE.length) % PALETTE.length;
  return {
    value,
    name: shortName(name ?? '') || text('segment.labelName', { value }),
    color: color ?? PALETTE[index] ?? '#888888',
  };
}

/** Returns the smallest value above 0 that none of the labels has. */
export function freeValue(labels: readonly Label[]): number {
  const taken = new Set(labels.map(({ value }) => value));
  let value = 1;
  while (taken.has(value)) value += 1;
  return value;
}

/** Returns a label's colour as red, green and blue, 0..255. */
export function rgbOf({ color }: Pick<Label, 'color'>): [number, number, number] {
  const number = Number.parseInt(color.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}

/** Voxels of a label map, in the type in which they are stored in a file; 0 is the background. */
export type LabelArray = Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array;

type LabelArrayType = new (length: number) => LabelArray;

/** Returns an array of the type of `like`, for `length` labels. */
export function arrayLike(like: LabelArray, length: number): LabelArray {
  return new (like.constructor as LabelArrayType)(length);
}

/** Smallest and largest label that fits a type of array. */
export function rangeOf(voxels: LabelArray): [number, number] {
  const probe = arrayLike(voxels, 1);
  probe[0] = -1;
  const isSigned = (probe[0] ?? 0) < 0;
  const values = 2 ** (8 * voxels.BYTES_PER_ELEMENT);
  return isSigned ? [-values / 2, values / 2 - 1] : [0, values - 1];
}
