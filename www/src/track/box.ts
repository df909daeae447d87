/** Boxes of voxels, as they are drawn on slices and as the tracker takes them, and their corners in the world, which stay where
 * voxels are made larger or smaller. */
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

/** The voxels between two corners. */
export function voxelsOf({ min, max }: Box, inverse: ArrayLike<number>, dims: Vec3): VoxelBox {
  const corners = [toWorld(inverse, min), toWorld(inverse, max)];
  const inside = (value: number, axis: number) => Math.min((dims[axis] ?? 1) - 1, Math.max(0, value));
  const along = (axis: number) => corners.map((corner) => corner[axis] ?? 0);
  const low = [0, 1, 2].map((k) => inside(Math.ceil(Math.min(...along(k)) - 1e-6), k)) as Vec3;
  const high = [0, 1, 2].map((k) => Math.max(low[k] ?? 0, inside(Math.floor(Math.max(...along(k)) + 1e-6), k))) as Vec3;
  return { low, high };
}

/** The corners of voxels. */
export function boxOf({ low, high }: VoxelBox, affine: ArrayLike<number>): Box {
  return {
    min: toWorld(affine, low.map((at) => at - RIM) as Vec3),
    max: toWorld(affine, high.map((at) => at + RIM) as Vec3),
  };
}
