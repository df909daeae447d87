/** Boxes of voxels. */
import type { Region, Vec3 } from './protocol';

/** Returns the smallest box that contains both; `undefined` counts as empty. */
export function union(one: Region | undefined, other: Region): Region {
  if (!one) return other;
  const min = one.min.map((low, axis) => Math.min(low, other.min[axis] ?? low)) as Vec3;
  const ends = [0, 1, 2].map((axis) => Math.max(endOf(one, axis), endOf(other, axis)));
  return { min, dims: ends.map((end, axis) => end - (min[axis] ?? 0)) as Vec3 };
}

/** Returns the box grown by `count` voxels on all sides, within a grid of dimensions `dims`. */
export function grown(region: Region, count: number, dims: Vec3): Region {
  const min = region.min.map((low) => Math.max(0, low - count)) as Vec3;
  const ends = dims.map((size, axis) => Math.min(size, endOf(region, axis) + count));
  return { min, dims: ends.map((end, axis) => end - (min[axis] ?? 0)) as Vec3 };
}

/** Calls `visit` with the index of the first voxel of each row of a box, in a grid of dimensions `dims`. */
export function forEachRow({ min, dims: [, ny, nz] }: Region, dims: Vec3, visit: (first: number) => void): void {
  for (let z = min[2]; z < min[2] + nz; z++)
    for (let y = min[1]; y < min[1] + ny; y++) visit((z * dims[1] + y) * dims[0] + min[0]);
}

/** Returns the box of the voxels with the given indices; undefined if there are none. */
export function boxOf(indices: ArrayLike<number>, dims: Vec3): Region | undefined {
  if (indices.length === 0) return undefined;
  const low: Vec3 = [...dims];
  const high: Vec3 = [0, 0, 0];
  for (let k = 0; k < indices.length; k++) {
    const index = indices[k] ?? 0;
    const row = Math.floor(index / dims[0]);
    const at = [index - row * dims[0], row % dims[1], Math.floor(row / dims[1])];
    for (const axis of [0, 1, 2] as const) {
      low[axis] = Math.min(low[axis], at[axis] ?? 0);
      high[axis] = Math.max(high[axis], at[axis] ?? 0);
    }
  }
  return { min: low, dims: high.map((end, axis) => end - (low[axis] ?? 0) + 1) as Vec3 };
}

function endOf({ min, dims }: Region, axis: number): number {
  return (min[axis] ?? 0) + (dims[axis] ?? 0);
}
