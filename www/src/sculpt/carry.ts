/** How a surface goes along with ellipsoids at once, as the first thing that a step of the model does. */
import { lengthsOf } from './ellipsoids';
import type { ControlEllipsoid, Pose, Vec3 } from './protocol';

/** How much an ellipsoid that a point lies on counts: ten times as much as one that is its own size away. */
const SOFTNESS = 0.1;

/**
 * Where points (x, y, z of each) go as the ellipsoids go from `before` to `after`: with each by its own map, near ones
 * counting more. Only the first `count` points; there is as much room behind them as before.
 */
export function carried(points: Float32Array, before: Pose, after: Pose, count = points.length / 3): Float32Array {
  const maps = before.map((one, k) => mapBetween(one, after[k] ?? one));
  const out = new Float32Array(points.length);
  for (let i = 0; i < 3 * count; i += 3) carry(points, i, maps, out);
  return out;
}

/** The map of one ellipsoid. */
interface EllipsoidMap {
  center: Vec3;
  /** Rows that take what is seen from the middle to the frame in which the ellipsoid is the unit ball. */
  toUnit: [Vec3, Vec3, Vec3];
  /** The other middle, and the axes that take the unit ball to it. */
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

function carry(points: Float32Array, i: number, maps: EllipsoidMap[], out: Float32Array): void {
  const [x, y, z] = [points[i] ?? 0, points[i + 1] ?? 0, points[i + 2] ?? 0];
  let [sumX, sumY, sumZ, total] = [0, 0, 0, 0];
  for (const { center, toUnit, newCenter, axes, thinnest } of maps) {
    const seen: Vec3 = [x - center[0], y - center[1], z - center[2]];
    const u = dot(toUnit[0], seen);
    const v = dot(toUnit[1], seen);
    const w = dot(toUnit[2], seen);
    const size = Math.sqrt(u * u + v * v + w * w);
    const clearance = size > 1 ? (Math.sqrt(dot(seen, seen)) * (1 - 1 / size)) / thinnest : 0;
    const weight = 1 / (SOFTNESS + clearance * clearance);
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
