/**
 * Which images belong together: rules for the images of a folder, each with its reason.
 *
 * 1. Images of one volume are of one series (PS3.3, C.7.3.1), have the same size, pixel spacing and type of voxels, and
 *    are parallel (C.7.6.2). A localiser, which is often part of the series it was used to plan, is thereby a volume of
 *    its own, or a single image.
 * 2. A file that is there twice, with the same unique identifier (C.12.1), counts once.
 * 3. Images that differ in what was measured (echo, b-value, kernel, thickness, stack) are of different volumes, as are those
 *    of several files at the same position that are volumes of their own. Other images at the same position that differ in
 *    their type (magnitude and phase) are of different volumes, too; those that differ in time are frames of one volume.
 * 4. Images at the same position without any such difference are not read, since the right one is unknown.
 */
import type { Vec3 } from '../data.js';
import { shortened } from '../short-text.js';
import { cross, dot, evennessOf, largest } from './geometry.js';
import type { Frame } from './types.js';

/** Largest difference of directions of images that count as parallel: those in files are rounded, to three digits and more. */
const PARALLEL = 2e-3;
/** Least cosine between the normals of images that are no localisers for each other. */
const NEARLY_PARALLEL = 0.995;
/** Largest relative difference of pixel spacings that count as equal. */
const SAME_SPACING = 1e-4;
/** Part of a pixel by which images at the same position may differ: as much as rounding changes positions. */
const SAME_POSITION = 0.01;

/** Part of a pixel beyond which images at the same distance along the normal are beside each other. */
const BESIDE = 0.1;

/** Attributes of what was measured: images with different values are of different volumes. */
const MEASURED = [
  ...['stack', 'complex part', 'echo time', 'echo', 'b-value', 'inversion time', 'flip angle'],
  ...['kVp', 'kernel', 'thickness'],
];
/** Attributes by which images are of different volumes if they are at the same position. */
const KINDS = [...MEASURED, 'image type', 'frame type', 'file'];
/** Attributes with one value for each frame of a volume with time. */
const PHASES = ['temporal position', 'trigger time', 'frame reference time', 'acquisition'];
/** Attributes that are larger for later images at the same position, but may differ from slice to slice. */
const CLOCKS = ['trigger time', 'frame reference time', 'acquisition time', 'content time', 'instance'];

/** Most characters of a value in the name of a volume. */
const LONGEST_VALUE = 100;

/** The slices of a volume: of each of its frames, sorted along the normal. */
export interface Stack {
  frames: Frame[][];
  /** Attribute that differs from other volumes of the series; empty if there are none. */
  label: string;
  /** Warnings about the volume. */
  notes: string[];
  /** Facts about the volume that do not affect its voxels. */
  remarks?: string[];
}

/** Images that do not form a volume, and why. */
export interface Conflict {
  images: Frame[];
  reason: string;
}

/** Returns entries by a key, in the order in which each key is first found. */
export function grouped<T, Key>(entries: readonly T[], keyOf: (entry: T) => Key): Map<Key, T[]> {
  const groups = new Map<Key, T[]>();
  for (const entry of entries) {
    const key = keyOf(entry);
    const group = groups.get(key) ?? [];
    groups.set(key, group);
    group.push(entry);
  }
  return groups;
}

/** Returns the normal of an image: along it, slices are sorted. */
export const normalOf = ({ along, down }: Frame): Vec3 => cross(along, down);

/** Sorts images into volumes. */
export function stacksOf(images: readonly Frame[]): (Stack | Conflict)[] {
  const groups = [...grouped(images, kindOf).values()].flatMap((kind) => gathered(kind, isAlike));
  return groups.flatMap((group) => {
    const { kept, copies } = withoutCopies(group);
    const parts = separated(kept, '');
    const text = `${copies === 1 ? 'One file was' : `${copies} files were`} there twice and counted once.`;
    if (copies > 0) for (const part of parts) if ('notes' in part) part.notes.push(text);
    return parts;
  });
}

/** Groups that an image may belong to: damaged files have as many as images, and comparing them all would not end. */
const RECENT = 500;

/** Returns images in groups, of which each is alike the first one, and one of the last groups before it. */
function gathered(images: readonly Frame[], isOne: (one: Frame, other: Frame) => boolean): Frame[][] {
  const groups: Frame[][] = [];
  for (const image of images) {
    // Images of a folder come series by series, mostly, so that the last group is the likely one.
    let k = groups.length - 1;
    const end = Math.max(0, groups.length - RECENT);
    while (k >= end && !isOne(groups[k]?.[0] as Frame, image)) k -= 1;
    const group = k >= end ? groups[k] : undefined;
    if (group) group.push(image);
    else groups.push([image]);
  }
  return groups;
}

/** Returns what of an image is exactly the same in all others of a volume (rule 1). */
function kindOf({ series, format }: Frame): string {
  const known = kinds.get(series);
  if (known !== undefined) return known;
  const { uid, origin, sopClass, frameOfReference, inverted } = series;
  const { rows, columns, bitsAllocated, signed, float } = format;
  const kind = JSON.stringify([
    ...[uid, origin, sopClass, frameOfReference, inverted],
    ...[rows, columns, bitsAllocated, signed, float],
  ]);
  kinds.set(series, kind);
  return kind;
}

/** Kinds of the images of each file, which share their series and format. */
const kinds = new WeakMap<Frame['series'], string>();

/** Whether two images of the same kind may be of one volume (rule 1). */
export function isAlike(one: Frame, other: Frame): boolean {
  const isSameSize = one.spacing.every((size, k) => Math.abs(size - (other.spacing[k] ?? 0)) <= SAME_SPACING * size);
  return isSameSize && isParallel(one, other);
}

/** Whether two images have the same directions. */
export const isParallel = (one: Frame, other: Frame) => isNear(one.along, other.along) && isNear(one.down, other.down);

/** Whether two images may be of one volume, but for a mistake in their directions. */
export const isNearlyParallel = (one: Frame, other: Frame) =>
  Math.abs(dot(normalOf(one), normalOf(other))) >= NEARLY_PARALLEL;

const isNear = (a: Vec3, b: Vec3) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) <= PARALLEL;

/** Rule 2. Files that lost their identifiers all have the same; those at other positions are no copies. */
function withoutCopies(group: Frame[]): { kept: Frame[]; copies: number } {
  const seen = new Set<string>();
  const texts = new Map<object, string>();
  const kept = group.filter(({ uid, index, position, instance, marks }) => {
    if (uid === '') return true;
    // Many frames may have the same ones.
    const text = texts.get(marks) ?? JSON.stringify(marks);
    texts.set(marks, text);
    const key = JSON.stringify([uid, index, position, instance, text]);
    return !seen.has(key) && seen.add(key);
  });
  return { kept, copies: group.length - kept.length };
}

/** Rules 3 and 4. */
function separated(images: Frame[], label: string): (Stack | Conflict)[] {
  const measured = byMeasure(images) ?? beside(images);
  if (measured) return measured.flatMap(([name, part]) => separated(part, joined(label, name)));
  const slots = slotsOf(images);
  const most = largestSlot(slots);
  if (most > 1) {
    const parts = byKind(images, most);
    if (parts) return parts.flatMap(([name, part]) => separated(part, joined(label, name)));
    const timed = inTime(images, slots, most, label);
    return (
      timed ?? [
        { images, reason: 'several images at the same position, without any attribute that distinguishes them' },
      ]
    );
  }
  const slices = images.toSorted((a, b) => along(a) - along(b));
  return apart(slices, label) ?? [{ frames: [slices], label, notes: [] }];
}

const along = (image: Frame) => dot(image.position, normalOf(image));

const joined = (label: string, name: string) => (label === '' ? name : `${label}, ${name}`);

/** Returns for each image the number of its position, counted along the normal. */
function slotsOf(images: readonly Frame[]): number[] {
  const [first] = images;
  if (!first) return [];
  const normal = normalOf(first);
  const order = images.map((image, k) => [dot(image.position, normal), k] as const).toSorted((a, b) => a[0] - b[0]);
  const tolerance = SAME_POSITION * Math.min(...first.spacing);
  const slots = new Array<number>(images.length).fill(0);
  let [slot, start] = [-1, -Infinity];
  for (const [at, k] of order) {
    if (at - start > tolerance) [slot, start] = [slot + 1, at];
    slots[k] = slot;
  }
  return slots;
}

/** Returns the largest number of images at one position. */
function largestSlot(slots: readonly number[]): number {
  const counts = new Map<number, number>();
  for (const slot of slots) counts.set(slot, (counts.get(slot) ?? 0) + 1);
  return largest(counts.values());
}

/** Returns the value of an attribute, rounded, if it is a number; of a file with one image alone, none that is its own. */
function attributeOf({ marks, file, count }: Frame, mark: string): string | number {
  if (mark === 'file') return count > 1 ? file.name : '';
  const value = marks[mark] ?? '';
  return typeof value === 'number' && MEASURED.includes(mark) ? Number(value.toPrecision(3)) : value;
}

/** Returns the images by the values of an attribute, in the order of these. */
function byMark(images: readonly Frame[], mark: string): [string, Frame[]][] {
  const [first] = images;
  // As all frames of a file without attributes of their own.
  const areEqual = mark !== 'file' && first && images.every(({ marks }) => marks === first.marks);
  const groups = areEqual
    ? new Map([[attributeOf(first, mark), [...images]]])
    : grouped(images, (image) => attributeOf(image, mark));
  const sorted = [...groups].toSorted(([a], [b]) => (a < b ? -1 : 1));
  const name = (value: string | number) => (value === '' ? 'not stated' : shortened(String(value), LONGEST_VALUE));
  return sorted.map(([value, group]) => [`${mark} ${name(value)}`, group]);
}

/** Returns the images by the first attribute of what was measured of which there are several values, for two images and more. */
function byMeasure(images: readonly Frame[]): [string, Frame[]][] | undefined {
  for (const mark of MEASURED) {
    const groups = byMark(images, mark);
    if (groups.length > 1 && groups.every(([, group]) => group.length > 1)) return groups;
  }
  return undefined;
}

/** Returns the images by their position within their plane, if some are beside each other: at one distance along the normal. */
function beside(images: readonly Frame[]): [string, Frame[]][] | undefined {
  const slots = slotsOf(images);
  const size = BESIDE * Math.min(...(images[0]?.spacing ?? [1]));
  const firsts = new Map<number, Frame>();
  const isBeside = images.some((image, k) => {
    const first = firsts.get(slots[k] ?? 0);
    firsts.set(slots[k] ?? 0, first ?? image);
    return first !== undefined && inPlane(first, image) > size;
  });
  if (!isBeside) return undefined;
  const groups = gathered(images, (first, image) => inPlane(first, image) <= size);
  // Images between two others may be near both of them.
  return groups.length > 1 ? groups.map((group, k) => [`place ${k + 1}`, group]) : undefined;
}

/** Returns the distance of two images within their plane. */
function inPlane(one: Frame, other: Frame): number {
  const off = one.position.map((x, k) => x - (other.position[k] ?? 0)) as Vec3;
  return Math.hypot(dot(off, one.along), dot(off, one.down));
}

/** Returns the images by the first attribute that leaves fewer at the same position. */
function byKind(images: readonly Frame[], most: number): [string, Frame[]][] | undefined {
  for (const mark of KINDS) {
    const groups = byMark(images, mark);
    if (groups.length < 2 || groups.length > most) continue;
    if (groups.every(([, group]) => largestSlot(slotsOf(group)) < most)) return groups;
  }
  return undefined;
}

/** Returns the volume whose frames are the images at one position, or volumes if some frames lack slices. */
function inTime(images: Frame[], slots: number[], most: number, label: string): Stack[] | undefined {
  const places = largest(slots) + 1;
  for (const mark of PHASES) {
    const groups = byMark(images, mark);
    if (groups.length !== most || !groups.every(([, group]) => largestSlot(slotsOf(group)) === 1)) continue;
    const frames = groups.map(([, group]) => group.toSorted((a, b) => along(a) - along(b)));
    const complete = frames.filter(({ length }) => length === places);
    if (complete.length === frames.length) return [{ frames, label, notes: [] }];
    const left = frames.length - complete.length;
    const note = `${left} of ${frames.length} frames ${left === 1 ? 'lacks' : 'lack'} slices, and ${left === 1 ? 'was' : 'were'} left out.`;
    // Recordings may have been stopped early.
    if (complete.length > 1) return [{ frames: complete, label, notes: [note] }];
    // Frames that lack slices are no frames of one volume.
    return groups.map(([name], k) => ({ frames: [frames[k] ?? []], label: joined(label, name), notes: [] }));
  }
  if (images.length !== most * places) return undefined;
  for (const mark of CLOCKS) {
    const frames = byClock(images, slots, mark, most);
    const note = 'Frames were distinguished by the numbers of the images only.';
    if (frames) return [{ frames, label, notes: mark === 'instance' ? [note] : [] }];
  }
  return undefined;
}

/** Returns the k-th of the images at each position, by a clock, as frame k; undefined if two have the same time. */
function byClock(images: Frame[], slots: number[], mark: string, most: number): Frame[][] | undefined {
  const order = slots.map((slot, k) => [slot, images[k] as Frame] as const).toSorted((a, b) => a[0] - b[0]);
  const places = [...grouped(order, ([slot]) => slot).values()].map((place) => place.map(([, image]) => image));
  const times = ({ marks, index }: Frame) => (mark === 'instance' ? [marks[mark] ?? 0, index] : [marks[mark] ?? '']);
  const compared = (a: Frame, b: Frame) => {
    const [one, other] = [times(a), times(b)];
    const k = one[0] === other[0] ? 1 : 0;
    return one[k] === other[k] ? 0 : (one[k] ?? 0) < (other[k] ?? 0) ? -1 : 1;
  };
  const sorted = places.map((place) => place.toSorted(compared));
  const isTold = sorted.every((place) =>
    place.every((image, k) => k === 0 || compared(place[k - 1] as Frame, image) !== 0),
  );
  return isTold ? Array.from({ length: most }, (_, k) => sorted.map((place) => place[k] as Frame)) : undefined;
}

/** Returns the volumes of slices at uneven distances that are even by themselves: parts of what was measured twice. */
function apart(slices: Frame[], label: string): Stack[] | undefined {
  if (slices.length < 4 || evennessOf(slices).kind === 'even') return undefined;
  for (const mark of [...KINDS, ...PHASES]) {
    const groups = byMark(slices, mark);
    const isEven = (part: Frame[]) => part.length > 1 && evennessOf(part).kind === 'even';
    if (groups.length > 1 && groups.every(([, part]) => isEven(part)))
      return groups.map(([name, part]) => ({ frames: [part], label: joined(label, name), notes: [] }));
  }
  return undefined;
}
