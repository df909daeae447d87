/** Arithmetic of control ellipsoids: translation, rotation, scaling, interpolation, and conversion to plain numbers. */
import type { ControlEllipsoid } from 'vesicle';
import type { Vec3 } from '../../engine/protocol';

/** Least factor by which a semi-axis is scaled; 0 would make the ellipsoid degenerate. */
const LEAST_FACTOR = 1e-3;

/** Returns a ball, given by its centre and radius, as an ellipsoid. */
export function ball(x: number, y: number, z: number, radius: number): ControlEllipsoid {
  return upright([x, y, z], [radius, radius, radius]);
}

/** Returns an ellipsoid with semi-axes of the lengths a, b and c along x, y and z. */
export function upright(center: Vec3, [a, b, c]: Vec3): ControlEllipsoid {
  return {
    center,
    axes: [
      [a, 0, 0],
      [0, b, 0],
      [0, 0, c],
    ],
  };
}

/** Returns the lengths of the three semi-axes of an ellipsoid. */
export function lengthsOf({ axes }: ControlEllipsoid): Vec3 {
  return axes.map((axis) => Math.hypot(...axis)) as Vec3;
}

/** Returns the ellipsoid translated by a vector. */
export function moved({ center, axes }: ControlEllipsoid, by: Vec3): ControlEllipsoid {
  return { center: added(center, by), axes };
}

/**
 * Returns the ellipsoid rotated by `angle`, in radians, about the axis through its centre in direction of the unit
 * vector `about`.
 */
export function turned({ center, axes }: ControlEllipsoid, about: Vec3, angle: number): ControlEllipsoid {
  return { center, axes: axes.map((axis) => rotated(axis, about, angle)) as ControlEllipsoid['axes'] };
}

/**
 * Returns the ellipsoid rotated by `angle`, in radians, about the axis through the point `place` in direction of the
 * unit vector `about`.
 */
export function turnedAbout(ellipsoid: ControlEllipsoid, place: Vec3, about: Vec3, angle: number): ControlEllipsoid {
  const { axes } = turned(ellipsoid, about, angle);
  const arm = added(ellipsoid.center, times(place, -1));
  return { center: added(place, rotated(arm, about, angle)), axes };
}

/**
 * Returns the ellipsoid with each semi-axis multiplied by the absolute value of its factor or, if that is less, by
 * `LEAST_FACTOR`.
 */
export function scaled({ center, axes }: ControlEllipsoid, factors: Vec3): ControlEllipsoid {
  const longer = axes.map((axis, k) => times(axis, Math.max(LEAST_FACTOR, Math.abs(factors[k] ?? 1))));
  return { center, axes: longer as ControlEllipsoid['axes'] };
}

/** Returns the ellipsoid with semi-axes of the given lengths, in their present directions. */
export function withLengths(ellipsoid: ControlEllipsoid, lengths: Vec3): ControlEllipsoid {
  const are = lengthsOf(ellipsoid);
  return scaled(ellipsoid, lengths.map((length, k) => length / (are[k] || 1)) as Vec3);
}

/**
 * Interpolates between two ellipsoids, `t` from 0 to 1: the centre linearly, the axes by a rotation, the lengths
 * geometrically. Values of `t` outside this range give the nearer ellipsoid.
 */
export function between(from: ControlEllipsoid, to: ControlEllipsoid, t: number): ControlEllipsoid {
  if (t <= 0) return from;
  if (t >= 1) return to;
  const [before, after] = [lengthsOf(from), lengthsOf(to)];
  const { about, angle } = rotationFrom(from, to);
  const whole = turned(from, about, t * angle);
  const center = added(times(from.center, 1 - t), times(to.center, t));
  const factors = before.map((length, k) => ((after[k] ?? length) / length) ** t) as Vec3;
  return scaled({ center, axes: whole.axes }, factors);
}

/**
 * Returns the rotation from the axis directions of one ellipsoid to those of another: unit vector and angle in radians.
 */
function rotationFrom(from: ControlEllipsoid, to: ControlEllipsoid): { about: Vec3; angle: number } {
  const [a, b] = [unitAxes(from), unitAxes(to)];
  const entry = (i: number, j: number) => a.reduce((sum, axis, k) => sum + (b[k]?.[i] ?? 0) * (axis[j] ?? 0), 0);
  const skew: Vec3 = [entry(2, 1) - entry(1, 2), entry(0, 2) - entry(2, 0), entry(1, 0) - entry(0, 1)];
  const size = Math.hypot(...skew);
  const angle = Math.atan2(size, entry(0, 0) + entry(1, 1) + entry(2, 2) - 1);
  if (size > 1e-9) return { about: times(skew, 1 / size), angle };
  // No rotation, or one by half a turn: then the matrix is 2 n nᵀ − 1.
  const diagonal = [0, 1, 2].map((i) => entry(i, i));
  const k = diagonal.indexOf(Math.max(...diagonal));
  const column: Vec3 = [0, 1, 2].map((i) => entry(i, k) + (i === k ? 1 : 0)) as Vec3;
  return { about: times(column, 1 / (Math.hypot(...column) || 1)), angle };
}

function unitAxes({ axes }: ControlEllipsoid): Vec3[] {
  return axes.map((axis) => times(axis, 1 / (Math.hypot(...axis) || 1)));
}

/** Returns the sum of two vectors. */
export function added(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/** Returns a vector times a number. */
export function times(a: Vec3, factor: number): Vec3 {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Rotates a vector about a unit vector by `angle`, in radians, with Rodrigues' formula. */
function rotated(vector: Vec3, about: Vec3, angle: number): Vec3 {
  const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
  const along = about[0] * vector[0] + about[1] * vector[1] + about[2] * vector[2];
  const sideways = added(times(vector, cosine), times(cross(about, vector), sine));
  return added(sideways, times(about, along * (1 - cosine)));
}

/** Returns an ellipsoid as twelve numbers, its centre and its three semi-axes, for a shareable link to the scene. */
export function toNumbers({ center, axes }: ControlEllipsoid): number[] {
  return [...center, ...axes.flat()];
}

/**
 * Converts the twelve numbers of {@link toNumbers} back to an ellipsoid; undefined if they are too few, too many or not
 * finite.
 */
export function fromNumbers(numbers: number[]): ControlEllipsoid | undefined {
  if (numbers.length !== 12 || !numbers.every(Number.isFinite)) return undefined;
  const vector = (at: number) => numbers.slice(at, at + 3) as Vec3;
  return { center: vector(0), axes: [vector(3), vector(6), vector(9)] };
}

/** Returns the bounding box of all ellipsoids of a pose: its least and largest corner. */
export function boxOf(pose: readonly ControlEllipsoid[]): { min: Vec3; max: Vec3 } {
  const corner = (sign: number, choose: (...values: number[]) => number) =>
    [0, 1, 2].map((k) => choose(...pose.map((one) => (one.center[k] ?? 0) + sign * halfWidth(one, k)))) as Vec3;
  return { min: corner(-1, Math.min), max: corner(1, Math.max) };
}

/** Returns the half width of an ellipsoid along coordinate axis `k`, 0 to 2. */
function halfWidth({ axes }: ControlEllipsoid, k: number): number {
  return Math.hypot(...axes.map((axis) => axis[k] ?? 0));
}

/**
 * Tests whether two poses are equal up to rounding: the model stores ellipsoids in another form, so its poses differ
 * slightly from those set.
 */
export function samePose(one: readonly ControlEllipsoid[], other: readonly ControlEllipsoid[]): boolean {
  return one.length === other.length && one.every((ellipsoid, k) => isSame(ellipsoid, other[k] ?? ellipsoid));
}

function isSame(one: ControlEllipsoid, other: ControlEllipsoid): boolean {
  const least = 1e-5 * Math.min(...lengthsOf(one));
  const numbers = toNumbers(other);
  return toNumbers(one).every((value, k) => Math.abs(value - (numbers[k] ?? value)) <= least);
}
