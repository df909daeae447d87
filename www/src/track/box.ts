/** Boxes of voxels, as they are drawn on slices, and boxes of the world, as the tracker takes them. */
import type { Vec3 } from '../protocol';
import { toWorld } from '../view/anatomy';
import type { Box } from './protocol';

/** First and last voxel along each axis. */
export interface VoxelBox {
  low: Vec3;
  high: Vec3;
}

/** So much beyond the centres of the outermost voxels, in voxels: they are in it, their neighbours are not. */
const RIM = 0.25;
const ROUNDS = 200;

/** The voxels that the tracker looks at for a box of the world: those within the box of voxels around it. */
export function voxelsOf(box: Box, inverse: ArrayLike<number>, dims: Vec3): VoxelBox {
  const middle = toWorld(inverse, mean(box));
  const reach = reaches(inverse, halves(box));
  const inside = (value: number, axis: number) => Math.min((dims[axis] ?? 1) - 1, Math.max(0, value));
  const low = middle.map((x, k) => inside(Math.ceil(x - (reach[k] ?? 0) - 1e-6), k)) as Vec3;
  const high = middle.map((x, k) => inside(Math.floor(x + (reach[k] ?? 0) + 1e-6), k)) as Vec3;
  return { low, high };
}

/**
 * The box of the world for which the tracker looks at these voxels. Where the image stands askew in the world no box may be
 * right for them all; then it is the nearest that holds them as well as can be.
 */
export function boxOf({ low, high }: VoxelBox, affine: ArrayLike<number>, inverse: ArrayLike<number>): Box {
  const wanted = low.map((from, k) => ((high[k] ?? 0) - from) / 2 + RIM) as Vec3;
  const middle = toWorld(affine, low.map((from, k) => (from + (high[k] ?? 0)) / 2) as Vec3);
  // Non-negative halves whose reaches come nearest, by multiplicative steps: they never change sign.
  let half: Vec3 = [1, 1, 1];
  const scale = Math.max(...wanted.map((want, k) => want / (reaches(inverse, half)[k] || 1)));
  half = half.map((x) => x * scale) as Vec3;
  for (let round = 0; round < ROUNDS; round++) {
    const [target, found] = [transposed(inverse, wanted), transposed(inverse, reaches(inverse, half))];
    half = half.map((x, k) => x * ((target[k] ?? 0) / (found[k] || 1))) as Vec3;
  }
  half = half.map((x) => Math.max(x, 1e-3)) as Vec3;
  const corner = (sign: number) => middle.map((x, k) => x + sign * (half[k] ?? 0)) as Vec3;
  return { min: corner(-1), max: corner(1) };
}

/** How far a box of the world reaches along the axes of the voxels, in voxels. */
function reaches(inverse: ArrayLike<number>, half: Vec3): Vec3 {
  const row = (k: number) => [0, 1, 2].reduce((sum, c) => sum + Math.abs(inverse[4 * c + k] ?? 0) * (half[c] ?? 0), 0);
  return [row(0), row(1), row(2)];
}

function transposed(inverse: ArrayLike<number>, values: Vec3): Vec3 {
  const column = (c: number) =>
    [0, 1, 2].reduce((sum, k) => sum + Math.abs(inverse[4 * c + k] ?? 0) * (values[k] ?? 0), 0);
  return [column(0), column(1), column(2)];
}

function mean({ min, max }: Box): Vec3 {
  return min.map((x, k) => (x + (max[k] ?? 0)) / 2) as Vec3;
}

function halves({ min, max }: Box): Vec3 {
  return min.map((x, k) => ((max[k] ?? 0) - x) / 2) as Vec3;
}
