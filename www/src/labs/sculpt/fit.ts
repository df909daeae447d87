/** Fits control ellipsoids to an arbitrary mesh: a row of them along the mesh's longest principal axis. */
import type { ControlEllipsoid, Mesh } from 'vesicle';
import type { Vec3 } from '../../engine/protocol';
import { added, times } from './ellipsoids';

/** Largest number of ellipsoids that are fitted to a mesh. */
const MAX_ELLIPSOIDS = 5;
/**
 * Semi-axes of a fitted ellipsoid as a share of the half widths of its slice of the mesh. If larger, the membrane
 * bulges where the mesh is concave; if smaller, it is slack.
 */
const FILL = 0.9;
/**
 * Least semi-axis of a fitted ellipsoid across the row, as a share of the longest extent of the mesh; shorter ones
 * would make needles.
 */
const MIN_SEMI_AXIS = 0.03;

/**
 * Returns a row of ellipsoids from one end of the mesh to the other along its longest principal axis; their number is
 * 1.5 times the mesh's length over its width, rounded, between 1 and `MAX_ELLIPSOIDS`.
 */
export function fitted(mesh: Mesh): ControlEllipsoid[] {
  const { centroid, inertia } = mesh.info();
  const { positions } = mesh.arrays({ relative: true });
  const axes = principalAxes(inertia);
  const local = project(positions, added(centroid, times(mesh.origin, -1)), axes);
  const spans = [0, 1, 2].map((k) => spanOf(local, k));
  const [long = 1, ...others] = spans.map(([low, high]) => high - low);
  const size = Math.max(long, ...others);
  const number = Math.min(MAX_ELLIPSOIDS, Math.max(1, Math.round((1.5 * long) / Math.max(...others, 1e-9))));
  const [low] = spans[0] ?? [0, 0];
  return Array.from({ length: number }, (_, slice) => {
    const [from, to] = [low + (slice * long) / number, low + ((slice + 1) * long) / number];
    return sliceEllipsoid(local, [from, to], number === 1, MIN_SEMI_AXIS * size);
  }).map(({ middle, halves }) => ({
    center: axes.reduce((sum, axis, k) => added(sum, times(axis, middle[k] ?? 0)), centroid),
    axes: axes.map((axis, k) => times(axis, halves[k] ?? 1)) as ControlEllipsoid['axes'],
  }));
}

/**
 * Returns the centre and semi-axes of an ellipsoid for the vertices with `from` ≤ x ≤ `to`, in coordinates along the
 * mesh's principal axes, as in `local`. `least` is the least length of the semi-axes along y and z; `isWhole` tells
 * that these are all vertices.
 */
function sliceEllipsoid(local: Float32Array, [from, to]: [number, number], isWhole: boolean, least: number) {
  const sums = [0, 0, 0, 0, 0];
  for (let i = 0; i < local.length; i += 3) {
    const [x = 0, y = 0, z = 0] = [local[i], local[i + 1], local[i + 2]];
    if (x < from || x > to) continue;
    for (const [k, value] of [1, y, z, y * y, z * z].entries()) sums[k] = (sums[k] ?? 0) + value;
  }
  const [n = 0, y = 0, z = 0, yy = 0, zz = 0] = sums;
  const count = Math.max(1, n);
  const [meanY, meanZ] = [y / count, z / count];
  // Along one coordinate, the points of a circle of radius r have a root mean square of r/√2, those of a sphere r/√3.
  const width = (squares: number, mean: number) =>
    Math.max(least, FILL * Math.sqrt((isWhole ? 3 : 2) * Math.max(0, squares / count - mean * mean)));
  const half = (FILL * (to - from)) / 2;
  const middle: Vec3 = [(from + to) / 2, meanY, meanZ];
  return { middle, halves: [half, width(yy, meanY), width(zz, meanZ)] as Vec3 };
}

function project(positions: Float32Array, origin: Vec3, axes: Vec3[]): Float32Array {
  const out = new Float32Array(positions.length);
  for (let i = 0; i < positions.length; i++) {
    const [x, y, z] = axes[i % 3] ?? [0, 0, 0];
    const at = i - (i % 3);
    const from = (k: number) => (positions[at + k] ?? 0) - (origin[k] ?? 0);
    out[i] = x * from(0) + y * from(1) + z * from(2);
  }
  return out;
}

function spanOf(local: Float32Array, k: number): [number, number] {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let i = k; i < local.length; i += 3) {
    low = Math.min(low, local[i] ?? low);
    high = Math.max(high, local[i] ?? high);
  }
  return [low, high];
}

/**
 * Returns the eigenvectors of a symmetric 3 × 3 matrix, given row by row, such as the second moments of a mesh: that of
 * the largest eigenvalue first, and right-handed. Computed by Jacobi rotations.
 */
export function principalAxes(matrix: number[]): Vec3[] {
  const a = [matrix.slice(0, 3), matrix.slice(3, 6), matrix.slice(6, 9)];
  const v = [0, 1, 2].map((i) => [0, 1, 2].map((j) => (i === j ? 1 : 0)));
  // Each sweep squares the off-diagonal remainder: eight are more than enough.
  for (let sweep = 0; sweep < 8; sweep++)
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ] as const)
      rotate(a, v, p, q);
  const order = [0, 1, 2].sort((i, j) => (a[j]?.[j] ?? 0) - (a[i]?.[i] ?? 0));
  const [x = [1, 0, 0], y = [0, 1, 0]] = order.map((k) => v.map((row) => row[k] ?? 0) as Vec3);
  return [x, y, [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]];
}

/** Applies the Jacobi rotation that makes entry (p, q) of `a` zero, and accumulates it in `v`. */
function rotate(a: number[][], v: number[][], p: number, q: number): void {
  const get = (m: number[][], i: number, j: number) => m[i]?.[j] ?? 0;
  const put = (m: number[][], i: number, j: number, value: number) => {
    const row = m[i];
    if (row) row[j] = value;
  };
  if (get(a, p, q) === 0) return;
  const angle = 0.5 * Math.atan2(2 * get(a, p, q), get(a, q, q) - get(a, p, p));
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const mix = (m: number[][], byRow: boolean) => {
    for (let k = 0; k < 3; k++) {
      const [x, y] = byRow ? [get(m, p, k), get(m, q, k)] : [get(m, k, p), get(m, k, q)];
      const [first, second] = [c * x - s * y, s * x + c * y];
      put(m, byRow ? p : k, byRow ? k : p, first);
      put(m, byRow ? q : k, byRow ? k : q, second);
    }
  };
  mix(a, false);
  mix(a, true);
  mix(v, false);
}
