/**
 * Conversions between the region of interest in voxels, used for drawing and by the tracker, and its corners in the
 * world, which remain valid when the image is binned or enriched.
 */
import type { Vec3 } from '../../engine/protocol';
import { toWorld } from '../../scene/anatomy';
import type { Box } from './protocol';

/** A region of interest by its first and last voxel along each axis, both inclusive. */
export interface VoxelBox {
  low: Vec3;
  high: Vec3;
}

/**
 * Distance by which a region of interest extends beyond the centres of its outermost voxels, in voxels: it contains
 * these centres, but not those of their neighbours.
 */
const RIM = 0.25;

/**
 * Returns the voxels whose centres lie in a region of interest in world coordinates, clamped to the image; at least one
 * along each axis. `inverse` maps world coordinates to voxel indices.
 */
export function voxelsOf({ min, max }: Box, inverse: ArrayLike<number>, dims: Vec3): VoxelBox {
  const corners = [toWorld(inverse, min), toWorld(inverse, max)];
  const inside = (value: number, axis: number) => Math.min((dims[axis] ?? 1) - 1, Math.max(0, value));
  const along = (axis: number) => corners.map((corner) => corner[axis] ?? 0);
  const low = [0, 1, 2].map((k) => inside(Math.ceil(Math.min(...along(k)) - 1e-6), k)) as Vec3;
  const high = [0, 1, 2].map((k) => Math.max(low[k] ?? 0, inside(Math.floor(Math.max(...along(k)) + 1e-6), k))) as Vec3;
  return { low, high };
}

/**
 * Returns the region of interest with the given first and last voxels as opposite corners in world coordinates, `RIM`
 * beyond the voxels' centres; `affine` maps voxel indices to world coordinates.
 */
export function boxOf({ low, high }: VoxelBox, affine: ArrayLike<number>): Box {
  return {
    min: toWorld(affine, low.map((at) => at - RIM) as Vec3),
    max: toWorld(affine, high.map((at) => at + RIM) as Vec3),
  };
}
