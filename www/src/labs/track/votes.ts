/**
 * Displays boundary votes, which mark faces between two voxels that windows of the tracker separate, as points in space
 * and on slices, coloured by the share of windows that voted for them.
 */
import { pointsAt, relativeTo } from '../../engine/placing';
import type { Surface, Vec3, VolumeView } from '../../engine/protocol';
import { type SliceOrientation, toWorld } from '../../scene/anatomy';
import type { BoundaryVotes } from './protocol';

/**
 * Colour of the boundary votes of weight 0, for which no window voted, sRGB 0..1; weights in between are interpolated.
 */
const FEW: Vec3 = [0.99, 0.82, 0.38];
/** Colour of the boundary votes of weight 1, for which all windows voted, sRGB 0..1. */
const MANY: Vec3 = [0.78, 0.1, 0.24];
/** Number of colour steps of boundary votes drawn on slices. */
const SHADES = 6;

export function voteColors(weights: Float32Array): Float32Array {
  const out = new Float32Array(3 * weights.length);
  for (let i = 0; i < weights.length; i++) {
    const part = Math.min(1, weights[i] ?? 0);
    for (let k = 0; k < 3; k++) out[3 * i + k] = (FEW[k] ?? 0) + part * ((MANY[k] ?? 0) - (FEW[k] ?? 0));
  }
  return out;
}

/**
 * Returns the boundary votes near the surface, for display: all within `reach` (world units) of a vertex, some up to
 * twice as far along an axis, and rarely others.
 */
export function votesNear(
  { frame, points, weights }: BoundaryVotes,
  { positions, vertices, origin }: Surface,
  reach: number,
): BoundaryVotes {
  const local = relativeTo(origin, points);
  const cell = (p: Float32Array, i: number, k: number, off = 0) => Math.floor((p[3 * i + k] ?? 0) / reach) + off;
  // Hash collisions are harmless: a distant point is shown as well.
  const key = (x: number, y: number, z: number) =>
    Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791);
  const taken = new Set<number>();
  for (let i = 0; i < vertices; i++)
    for (let off = 0; off < 27; off++) {
      const [dx, dy, dz] = [(off % 3) - 1, (Math.floor(off / 3) % 3) - 1, Math.floor(off / 9) - 1];
      taken.add(key(cell(positions, i, 0, dx), cell(positions, i, 1, dy), cell(positions, i, 2, dz)));
    }
  const near = [...weights.keys()].filter((i) =>
    taken.has(key(cell(local, i, 0), cell(local, i, 1), cell(local, i, 2))),
  );
  return { frame, points: pointsAt(points, near), weights: Float32Array.from(near, (i) => weights[i] ?? 0) };
}

interface OnSlice {
  volume: VolumeView;
  inverse: ArrayLike<number>;
  orientation: SliceOrientation;
  slice: number;
  scaleX: number;
  scaleY: number;
}

/**
 * Returns the boundary votes that lie within a quarter of a voxel of a slice, with positions in pixels of its image.
 */
export function votesIn(
  { points, weights }: BoundaryVotes,
  { volume, inverse, orientation, slice }: Omit<OnSlice, 'scaleX' | 'scaleY'>,
): { x: number; y: number; weight: number }[] {
  const out = [];
  const place = ({ axis, flip }: SliceOrientation['horizontal'], index: Vec3) =>
    (flip ? volume.dims[axis] - 1 - index[axis] : index[axis]) + 0.5;
  for (let i = 0; i < weights.length; i++) {
    const point: Vec3 = [points[3 * i] ?? 0, points[3 * i + 1] ?? 0, points[3 * i + 2] ?? 0];
    const index = toWorld(inverse, point);
    // Votes for faces between slices lie half a voxel off.
    if (Math.abs(index[orientation.axis] - slice) > 0.25) continue;
    out.push({
      x: place(orientation.horizontal, index),
      y: place(orientation.vertical, index),
      weight: weights[i] ?? 0,
    });
  }
  return out;
}

export function drawVotes(context: CanvasRenderingContext2D, votes: BoundaryVotes, on: OnSlice): void {
  drawFaces(context, votesIn(votes, on), on.scaleX, on.scaleY);
}

/**
 * Draws boundary votes, given in pixels of a slice's image, as small squares coloured by weight; a position times the
 * scales is the position on the canvas.
 */
export function drawFaces(
  context: CanvasRenderingContext2D,
  faces: readonly { x: number; y: number; weight: number }[],
  scaleX: number,
  scaleY: number,
): void {
  const colors = voteColors(Float32Array.from({ length: SHADES }, (_, i) => i / (SHADES - 1)));
  const size = Math.max(1.5, 0.5 * Math.min(scaleX, scaleY));
  for (let shade = 0; shade < SHADES; shade++) {
    const [r = 0, g = 0, b = 0] = colors.subarray(3 * shade, 3 * shade + 3);
    context.fillStyle = `rgb(${255 * r} ${255 * g} ${255 * b})`;
    for (const { x, y, weight } of faces)
      if (Math.round(Math.min(1, weight) * (SHADES - 1)) === shade)
        context.fillRect(x * scaleX - size / 2, y * scaleY - size / 2, size, size);
  }
}
