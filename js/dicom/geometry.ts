/**
 * Where the slices of a volume lie (PS3.3, C.7.6.2.1.1): the centre of voxel (column i, row j) of a slice is at
 * position + i · spacing · along + j · spacing · down. Slices are sorted by their distance along the normal; the distance
 * between slices is that of their positions, since the attributes Slice Thickness and Spacing Between Slices may be
 * another. A tilted gantry moves each slice sideways: the volume is sheared, and its axes are not perpendicular.
 */
import type { Vec3 } from '../data.js';
import { listed } from './error.js';
import type { Frame } from './types.js';

/** Part of the distance between slices by which a slice may be off without notice: less than interpolation shows. */
const UNNOTICED = 0.01;
/** Part of the distance between slices up to which slices count as even, with a warning: rounded positions. */
const EVEN = 0.1;
/** Part of a pixel by which a slice may lie beside the line of all others. */
const SIDEWAYS = 0.1;
/** Largest factor by which resampling adds slices. */
const MOST_ADDED = 4;

/**
 * Smallest and largest distance of voxels, millimetres, and smallest volume that their three directions span: those of
 * volumes.
 */
const [NEAREST, FURTHEST, FLATTEST] = [1e-12, 1e12, 1e-8];

/** How slices are spaced. */
export type Evenness =
  /** At equal distances; `note` says if some are slightly off. */
  | { kind: 'even'; note?: string }
  /** Some are missing, or distances differ; `count` slices at equal distances have the same ends. */
  | { kind: 'uneven'; reason: string; count: number; missing: boolean }
  /** Not in a line. */
  | { kind: 'shifted'; reason: string };

export const dot = (a: Vec3, b: Vec3) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export const cross = ([a, b, c]: Vec3, [x, y, z]: Vec3): Vec3 => [b * z - c * y, c * x - a * z, a * y - b * x];

const minus = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const mix = (a: Vec3, b: Vec3, t: number): Vec3 => [
  a[0] + t * (b[0] - a[0]),
  a[1] + t * (b[1] - a[1]),
  a[2] + t * (b[2] - a[2]),
];

/** Returns the largest of numbers, at least 0; there may be more than a call has room for as arguments. */
export function largest(numbers: Iterable<number>): number {
  let most = 0;
  for (const number of numbers) most = Math.max(most, number);
  return most;
}

/** Returns the smallest of numbers, and infinity if there are none. */
export function smallest(numbers: Iterable<number>): number {
  let least = Infinity;
  for (const number of numbers) least = Math.min(least, number);
  return least;
}

/** Returns a length in words. */
export const shown = (length: number) => `${Number(length.toPrecision(4))} mm`;

/** Returns the distances of sorted slices from the first one, along the normal. */
export function distancesOf(slices: readonly Frame[]): number[] {
  const [first] = slices;
  if (!first) return [];
  const [nx, ny, nz] = cross(first.along, first.down);
  const [x, y, z] = first.position;
  return slices.map(({ position }) => (position[0] - x) * nx + (position[1] - y) * ny + (position[2] - z) * nz);
}

/** Returns how sorted slices are spaced. */
export function evennessOf(slices: readonly Frame[]): Evenness {
  const [first, last] = [slices[0], slices.at(-1)];
  if (!first || !last || slices.length < 3) return { kind: 'even' };
  const reason = shiftOf(slices);
  if (reason !== undefined) return { kind: 'shifted', reason };
  const distances = distancesOf(slices);
  const extent = distances.at(-1) ?? 0;
  const step = extent / (slices.length - 1);
  const off = largest(distances.map((distance, k) => Math.abs(distance - k * step)));
  if (off > EVEN * step) return uneven(distances);
  if (off <= UNNOTICED * step) return { kind: 'even' };
  return {
    kind: 'even',
    note: `Slices are up to ${shown(off)} off equal distances of ${shown(step)}, and count as even.`,
  };
}

/** Returns how far sorted slices are from a line, if that is too far for one volume. */
export function shiftOf(slices: readonly Frame[]): string | undefined {
  const [first, last] = [slices[0], slices.at(-1)];
  if (!first || !last) return undefined;
  const distances = distancesOf(slices);
  const extent = distances.at(-1) ?? 0;
  const along = (k: number) => (extent === 0 ? 0 : (distances[k] ?? 0) / extent);
  let sideways = 0;
  for (const [k, { position }] of slices.entries())
    sideways = Math.max(sideways, besideLine(position, first, last, along(k)));
  if (sideways <= SIDEWAYS * Math.min(...first.spacing)) return undefined;
  return `slices are shifted sideways by up to ${shown(sideways)} from the line through the first and last`;
}

/** Returns the distance of a position from the line through the first and last slice, within the plane of the slice. */
function besideLine(position: Vec3, first: Frame, last: Frame, t: number): number {
  const off = minus(position, mix(first.position, last.position, t));
  return Math.hypot(dot(off, first.along), dot(off, first.down));
}

function uneven(distances: number[]): Evenness {
  const steps = distances.slice(1).map((distance, k) => distance - (distances[k] ?? 0));
  const sorted = steps.toSorted((a, b) => a - b);
  const [least = 1, median = 1, most = 1] = [sorted[0], sorted[sorted.length >> 1], sorted.at(-1)];
  const extent = distances.at(-1) ?? 0;
  for (const step of [median, least]) {
    const numbers = distances.map((distance) => Math.round(distance / step));
    const count = (numbers.at(-1) ?? 0) + 1;
    const fits = distances.every((distance, k) => Math.abs(distance / step - (numbers[k] ?? 0)) <= EVEN);
    const isNew = numbers.every((number, k) => k === 0 || number > (numbers[k - 1] ?? 0));
    if (fits && isNew && count <= MOST_ADDED * distances.length)
      return { kind: 'uneven', reason: missingAt(numbers, count), count, missing: true };
  }
  const count = Math.min(Math.round(extent / least) + 1, MOST_ADDED * distances.length);
  return {
    kind: 'uneven',
    reason: `the distances between slices differ: ${shown(least)} to ${shown(most)}`,
    count,
    missing: false,
  };
}

/** Returns which slices are missing, of those that are there numbered as if all were. */
function missingAt(numbers: number[], count: number): string {
  const gaps = numbers.flatMap((number, k) => {
    const before = numbers[k - 1] ?? number;
    return number - before > 1 ? [`${before + 1} and ${number + 1}`] : [];
  });
  const missing = count - numbers.length;
  return `${missing} of ${count} slices ${missing === 1 ? 'is' : 'are'} missing: between ${listed(gaps)}`;
}

/**
 * Returns the transform from voxel indices to LPS of `count` slices with the ends of these, column-major; `single` is the
 * thickness of one alone.
 */
export function affineOf(slices: readonly Frame[], count: number, single = 1): number[] {
  const [first, last] = [slices[0] as Frame, slices.at(-1) as Frame];
  const { along, down, spacing, position } = first;
  const normal = cross(along, down);
  const step = count > 1 ? minus(last.position, position).map((x) => x / (count - 1)) : normal.map((x) => x * single);
  return [...along.map((x) => x * spacing[0]), 0, ...down.map((x) => x * spacing[1]), 0, ...step, 0, ...position, 1];
}

/** Returns why no volume can be where this transform places it; undefined if one can. */
export function placementProblem(affine: readonly number[]): string | undefined {
  const axes = [0, 4, 8].map((at) => affine.slice(at, at + 3) as Vec3) as [Vec3, Vec3, Vec3];
  const lengths = axes.map((axis) => Math.hypot(...axis)) as Vec3;
  const wrong = lengths.findIndex((length) => !(length > NEAREST && length < FURTHEST));
  const what = wrong === 2 ? 'slices' : 'pixels';
  if (wrong >= 0) return `${what} are ${shown(lengths[wrong] ?? 0)} apart, which cannot be`;
  const [along, down, through] = axes.map((axis, k) => axis.map((x) => x / (lengths[k] ?? 1))) as [Vec3, Vec3, Vec3];
  return Math.abs(dot(cross(along, down), through)) < FLATTEST ? 'all slices are in one plane' : undefined;
}

/** Returns the angle between the normal of slices and the line through them, degrees: the tilt of the gantry. */
export function tiltOf(slices: readonly Frame[]): number {
  const [first, last] = [slices[0] as Frame, slices.at(-1) as Frame];
  const line = minus(last.position, first.position);
  const length = Math.hypot(...line);
  if (length === 0) return 0;
  return (Math.acos(Math.min(1, Math.abs(dot(line, cross(first.along, first.down))) / length)) * 180) / Math.PI;
}
