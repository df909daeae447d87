/** The tools that change a label map: which voxels a brush or a fill reaches. */

import type { LabelArray } from '../../engine/labels';
import type { Axis } from '../../scene/anatomy';
import type { Region, Vec3 } from './protocol';
import { boxOf, forEachRow } from './region';

/** The grid of a label map. */
export interface Grid {
  dims: Vec3;
  /** Voxel size along x, y and z, world units. */
  spacing: Vec3;
}

/** A brush: a ball, or with `axis` a disc in the slices across that voxel axis. */
export interface Brush {
  /** Radius in shortest sides of a voxel; 0 reaches one voxel. */
  radius: number;
  axis: Axis | undefined;
}

/**
 * Calls `visit` with the index of each voxel whose centre a brush covers while it moves from one point to another, given
 * in voxels. Returns the box of the voxels that it may reach; undefined if that is outside the grid.
 */
export function sweep(
  { dims, spacing }: Grid,
  brush: Brush,
  from: Vec3,
  to: Vec3,
  visit: (index: number) => void,
): Region | undefined {
  const unit = Math.min(...spacing);
  const scale = spacing.map((side) => side / unit) as Vec3;
  // Half a voxel more: a brush of radius 0 covers the voxel under it.
  const reach = brush.radius + 0.5;
  const [low, high] = [0, 1, 2].reduce<[Vec3, Vec3]>(
    ([low, high], axis) => {
      const [a, b, size, step] = [from[axis] ?? 0, to[axis] ?? 0, dims[axis] ?? 1, scale[axis] ?? 1];
      const margin = axis === brush.axis ? 0 : reach / step;
      low[axis] = Math.max(0, Math.ceil(Math.min(a, b) - margin));
      high[axis] = Math.min(size - 1, Math.floor(Math.max(a, b) + margin));
      return [low, high];
    },
    [
      [0, 0, 0],
      [0, 0, 0],
    ],
  );
  // A brush smaller than a voxel covers the voxel that it is in.
  if (brush.axis !== undefined) low[brush.axis] = high[brush.axis] = Math.round(from[brush.axis]);
  if (low.some((first, axis) => first > (high[axis] ?? 0))) return undefined;
  const distance = distanceTo(from, to, scale, brush.axis);
  for (let z = low[2]; z <= high[2]; z++)
    for (let y = low[1]; y <= high[1]; y++)
      for (let x = low[0]; x <= high[0]; x++) if (distance(x, y, z) <= reach) visit((z * dims[1] + y) * dims[0] + x);
  return { min: low, dims: high.map((last, axis) => last - (low[axis] ?? 0) + 1) as Vec3 };
}

/** Returns the function that measures the distance of a voxel from a segment; a disc ignores the axis across it. */
function distanceTo(
  from: Vec3,
  to: Vec3,
  scale: Vec3,
  across: Axis | undefined,
): (x: number, y: number, z: number) => number {
  const weights = scale.map((side, axis) => (axis === across ? 0 : side)) as Vec3;
  const [ax, ay, az] = from.map((x, axis) => x * (weights[axis] ?? 0)) as Vec3;
  const [bx, by, bz] = to.map((x, axis) => x * (weights[axis] ?? 0)) as Vec3;
  const [dx, dy, dz] = [bx - ax, by - ay, bz - az];
  const length = dx * dx + dy * dy + dz * dz;
  return (x, y, z) => {
    const [px, py, pz] = [x * weights[0] - ax, y * weights[1] - ay, z * weights[2] - az];
    const share = length === 0 ? 0 : Math.min(1, Math.max(0, (px * dx + py * dy + pz * dz) / length));
    return Math.hypot(px - share * dx, py - share * dy, pz - share * dz);
  };
}

/**
 * Fills a region of a slice: calls `visit` with the voxel `seed` and all voxels of the slice across `axis` that are
 * connected to it, side by side, by voxels of the same label. Returns the box of these voxels.
 */
export function flood(
  voxels: LabelArray,
  { dims }: Pick<Grid, 'dims'>,
  axis: Axis,
  seed: Vec3,
  visit: (index: number) => void,
): Region | undefined {
  const strides = [1, dims[0], dims[0] * dims[1]];
  const sides = [0, 1, 2].filter((side) => side !== axis);
  const indexOf = (at: Vec3) => at.reduce((sum, x, side) => sum + x * (strides[side] ?? 0), 0);
  const label = voxels[indexOf(seed)];
  const found = new Set([indexOf(seed)]);
  const queue: Vec3[] = [seed];
  for (const at of queue)
    for (const side of sides)
      for (const step of [-1, 1]) {
        const next = at.map((x, one) => (one === side ? x + step : x)) as Vec3;
        const index = indexOf(next);
        const x = next[side] ?? -1;
        if (x < 0 || x >= (dims[side] ?? 0) || voxels[index] !== label || found.has(index)) continue;
        found.add(index);
        queue.push(next);
      }
  const indices = [...found];
  for (const index of indices) visit(index);
  return boxOf(indices, dims);
}

/** A region that a fill in three dimensions may reach. */
export interface Fillable {
  /** Box that the fill does not leave. */
  box: Region;
  /** Not 0 for the voxels that it may reach; all in the box if undefined. */
  mask?: Uint8Array;
}

/**
 * Fills a region in three dimensions: calls `visit` with the voxel `seed`, in the box, and all voxels connected to it, side by
 * side, by voxels of the same label that the fill may reach. Returns the box of these voxels; undefined if the seed is none.
 */
export function floodBox(
  voxels: LabelArray,
  { dims }: Pick<Grid, 'dims'>,
  { box, mask }: Fillable,
  seed: Vec3,
  visit: (index: number) => void,
): Region | undefined {
  const strides = [1, dims[0], dims[0] * dims[1]] as const;
  const first = seed.reduce((sum, x, axis) => sum + x * (strides[axis] ?? 0), 0);
  const label = voxels[first];
  const open = new Uint8Array(voxels.length);
  forEachRow(box, dims, (start) => {
    for (let index = start; index < start + box.dims[0]; index++)
      if (voxels[index] === label && mask?.[index] !== 0) open[index] = 1;
  });
  if (!open[first]) return undefined;
  open[first] = 0;
  const found = [first];
  for (const index of found) {
    const row = Math.floor(index / dims[0]);
    const at = [index - row * dims[0], row % dims[1], Math.floor(row / dims[1])];
    for (const [axis, stride] of strides.entries())
      for (const step of [-1, 1]) {
        const [x, next] = [(at[axis] ?? 0) + step, index + step * stride];
        if (x < 0 || x >= (dims[axis] ?? 0) || !open[next]) continue;
        open[next] = 0;
        found.push(next);
      }
  }
  for (const index of found) visit(index);
  return boxOf(found, dims);
}
