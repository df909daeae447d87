/** Sampling functions and noise shared by the computed volumes. */

import { uniform } from '../random';

export interface ShapeVoxels {
  data: Uint8Array;
  dims: [number, number, number];
}

type Point = readonly [number, number, number];

/**
 * Samples a function of voxel indices into a volume of bytes, x fastest, clamped to 0..255; a single number as `size`
 * gives a cube.
 */
export function sample(
  size: number | [number, number, number],
  value: (i: number, j: number, k: number) => number,
): ShapeVoxels {
  const dims: [number, number, number] = typeof size === 'number' ? [size, size, size] : size;
  const data = new Uint8Array(dims[0] * dims[1] * dims[2]);
  let voxel = 0;
  for (let k = 0; k < dims[2]; k++) {
    for (let j = 0; j < dims[1]; j++) {
      for (let i = 0; i < dims[0]; i++) data[voxel++] = Math.min(255, Math.max(0, value(i, j, k)));
    }
  }
  return { data, dims };
}

/**
 * Returns a generator of approximately normal noise with mean 0 and the given standard deviation: the sum of four
 * uniform numbers.
 */
export function noise(seed: number, deviation: number): () => number {
  const next = uniform(seed);
  return () => deviation * Math.sqrt(3) * (next() + next() + next() + next() - 2);
}

export function distance(a: Point, b: Point): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/**
 * Linear ramp at the surface of a shape, from 0 (outside) to 1 (inside), three voxels wide, ½ at the border; `depth` in
 * voxels, positive inside.
 */
export function smoothStep(depth: number): number {
  return Math.min(1, Math.max(0, 0.5 + depth / 3));
}
