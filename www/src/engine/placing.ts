/**
 * Positions far from the origin of world space for their extent, as surveyed coordinates are. Single precision, in which
 * the GPU draws, is too coarse for them: it gets positions relative to an origin, at which the object then is. Everything
 * else is in world space, in double precision where it is needed.
 */
import type { PointArray } from 'vesicle';
import type { Vec3 } from './protocol';

/**
 * The largest coordinate, in sizes of the box around the points, up to which positions are relative to the origin of
 * world space, as in the package: with more, what is drawn begins to jitter; with less, data beside the origin would be
 * rounded differently without need.
 */
const FAR = 16;

/** Positions in single precision, packed xyz, relative to an origin in world space. */
export interface Placed {
  points: Float32Array;
  origin: Vec3;
}

/**
 * Returns the origin for points in world space, packed xyz: 0 unless they are far away for their extent, else a point
 * near their middle, with few digits.
 */
export function originOf(points: ArrayLike<number>): Vec3 {
  const [low, high] = bounds(points);
  const furthest = Math.max(...[...low, ...high].map(Math.abs));
  const size = Math.max(...high.map((value, axis) => value - (low[axis] ?? 0)));
  if (!(furthest > FAR * size && Number.isFinite(furthest))) return [0, 0, 0];
  // Points all in one place have that place as their origin.
  const step = 2 ** Math.ceil(Math.log2(size > 0 ? size : furthest * 1e-9));
  return low.map((value, axis) => Math.round((value / 2 + (high[axis] ?? 0) / 2) / step) * step) as Vec3;
}

/** Returns the lowest and the highest coordinates of points, packed xyz. */
function bounds(points: ArrayLike<number>): [Vec3, Vec3] {
  const { POSITIVE_INFINITY: most, NEGATIVE_INFINITY: least } = Number;
  const [low, high]: [Vec3, Vec3] = [
    [most, most, most],
    [least, least, least],
  ];
  for (const axis of [0, 1, 2] as const)
    for (let i = axis; i < points.length; i += 3) {
      const value = points[i] ?? 0;
      if (value < low[axis]) low[axis] = value;
      if (value > high[axis]) high[axis] = value;
    }
  return [low, high];
}

const isZero = (origin: Vec3) => origin.every((value) => value === 0);

/** Returns points in world space, packed xyz, relative to an origin; an array that is so already is not copied. */
export function relativeTo(origin: Vec3, points: ArrayLike<number>): Float32Array {
  if (points instanceof Float32Array && isZero(origin)) return points;
  const out = new Float32Array(points.length);
  for (let i = 0; i < out.length; i++) out[i] = (points[i] ?? 0) - (origin[i % 3] ?? 0);
  return out;
}

/** Returns points that are relative to an origin in world space: in double precision, unless the origin is 0. */
export function inWorld(points: Float32Array, origin: Vec3): PointArray {
  return isZero(origin) ? points : Float64Array.from(points, (value, i) => value + (origin[i % 3] ?? 0));
}

/** Returns points in world space, packed xyz, as they are drawn. */
export function placed(points: ArrayLike<number>): Placed {
  const origin = originOf(points);
  return { points: relativeTo(origin, points), origin };
}

/** Returns those of some points, packed xyz, that have these indices, in the same precision. */
export function pointsAt<Points extends PointArray>(points: Points, indices: ArrayLike<number>): Points {
  const out = likewise(points, 3 * indices.length);
  for (let to = 0; to < indices.length; to++)
    for (let axis = 0; axis < 3; axis++) out[3 * to + axis] = points[3 * (indices[to] ?? 0) + axis] ?? 0;
  return out;
}

/** Returns an array of zeros in the precision of `points`. */
export function likewise<Points extends PointArray>(points: Points, length: number): Points {
  return new (points.constructor as new (length: number) => Points)(length);
}

/**
 * Rounds a coordinate of something of this size to some significant digits. Far from the origin these are too few, and
 * it is rounded to as many decimals as say as much of the thing as they do beside the origin.
 */
export function shortened(value: number, digits: number, size: number): number {
  const short = Number(value.toPrecision(digits));
  // Up to 16 sizes away, the digits lose at most 8 units of the last but two.
  if (Math.abs(short - value) <= size * 10 ** (2 - digits) || !(size > 0)) return short;
  return Number(value.toFixed(decimals(size, digits)));
}

/** Rounds a point of something of this size, as {@link shortened} does; if one coordinate needs decimals, all get them. */
export function shortenedPoint(point: Vec3, digits: number, size: number): Vec3 {
  const short = point.map((value) => shortened(value, digits, size)) as Vec3;
  if (short.every((value, axis) => value === Number((point[axis] ?? 0).toPrecision(digits)))) return short;
  return point.map((value) => Number(value.toFixed(decimals(size, digits)))) as Vec3;
}

/** Returns the number of decimals of coordinates that say as much of something of this size as some digits do of it. */
export function decimals(size: number, digits: number): number {
  return Math.min(100, Math.max(0, digits - Math.floor(Math.log10(size))));
}
