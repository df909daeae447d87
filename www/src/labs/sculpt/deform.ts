/**
 * Approximate deformation of a surface by its control ellipsoids, the same as the first stage of a step of the model.
 * Makes the displayed surface follow a dragged ellipsoid before the model's result arrives.
 */
import { lengthsOf, moved, times } from './ellipsoids';
import type { ControlEllipsoid, Pose, Surface, Vec3 } from './protocol';

/**
 * Softening term of the weight of an ellipsoid at a point, 1 / (term + d²), where d is the point's distance in units of
 * the ellipsoid's shortest semi-axis: the weight at the surface of the ellipsoid is eleven times that at d = 1.
 */
const WEIGHT_SOFTENING = 0.1;

/**
 * Moves points, packed xyz, along with the ellipsoids that move from the pose `before` to the pose `after`: by the mean
 * of the ellipsoids' affine maps, weighted by proximity. Returns an array as long as `points`, with only the first
 * `count` points set.
 */
export function deformPoints(points: Float32Array, before: Pose, after: Pose, count = points.length / 3): Float32Array {
  const maps = before.map((one, k) => mapBetween(one, after[k] ?? one));
  const out = new Float32Array(points.length);
  for (let i = 0; i < 3 * count; i += 3) deformPoint(points, i, maps, out);
  return out;
}

/** Returns the positions of the vertices of a surface, moved as by {@link deformPoints}, relative to its origin. */
export function deformSurface({ positions, vertices, origin }: Surface, before: Pose, after: Pose): Float32Array {
  const [from, to] = [before, after].map((pose) => pose.map((one) => moved(one, times(origin, -1)))) as [Pose, Pose];
  return deformPoints(positions, from, to, vertices);
}

/**
 * Affine map from an ellipsoid before a motion to the same ellipsoid after it, with the data for its weight at a point.
 */
interface EllipsoidMap {
  center: Vec3;
  /**
   * Rows of the matrix that maps offsets from the centre of the ellipsoid before the motion to the frame in which it is
   * the unit ball.
   */
  toUnit: [Vec3, Vec3, Vec3];
  /** Centre of the ellipsoid after the motion; with its semi-axes `axes` it maps the unit ball to that ellipsoid. */
  newCenter: Vec3;
  axes: [Vec3, Vec3, Vec3];
  thinnest: number;
}

function mapBetween(one: ControlEllipsoid, other: ControlEllipsoid): EllipsoidMap {
  const lengths = lengthsOf(one);
  const row = (axis: Vec3, length: number): Vec3 => [
    axis[0] / length ** 2,
    axis[1] / length ** 2,
    axis[2] / length ** 2,
  ];
  return {
    center: one.center,
    toUnit: [row(one.axes[0], lengths[0]), row(one.axes[1], lengths[1]), row(one.axes[2], lengths[2])],
    newCenter: other.center,
    axes: other.axes,
    thinnest: Math.min(...lengths),
  };
}

function deformPoint(points: Float32Array, i: number, maps: EllipsoidMap[], out: Float32Array): void {
  const [x, y, z] = [points[i] ?? 0, points[i + 1] ?? 0, points[i + 2] ?? 0];
  let [sumX, sumY, sumZ, total] = [0, 0, 0, 0];
  for (const { center, toUnit, newCenter, axes, thinnest } of maps) {
    const offset: Vec3 = [x - center[0], y - center[1], z - center[2]];
    const u = dot(toUnit[0], offset);
    const v = dot(toUnit[1], offset);
    const w = dot(toUnit[2], offset);
    const size = Math.sqrt(u * u + v * v + w * w);
    const clearance = size > 1 ? (Math.sqrt(dot(offset, offset)) * (1 - 1 / size)) / thinnest : 0;
    const weight = 1 / (WEIGHT_SOFTENING + clearance * clearance);
    sumX += weight * (newCenter[0] + u * axes[0][0] + v * axes[1][0] + w * axes[2][0]);
    sumY += weight * (newCenter[1] + u * axes[0][1] + v * axes[1][1] + w * axes[2][1]);
    sumZ += weight * (newCenter[2] + u * axes[0][2] + v * axes[1][2] + w * axes[2][2]);
    total += weight;
  }
  out[i] = sumX / total;
  out[i + 1] = sumY / total;
  out[i + 2] = sumZ / total;
}

function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
