// `vesicle/zarr` on images that were written by ome-zarr and zarr-python; see tests/data/README.md.
import { describe, expect, test } from 'vitest';
import type { Volume } from '../../pkg/index.js';
import { openZarr, type ZarrVolume } from '../../pkg/zarr/index.js';
import { rejection } from './helpers.js';
import { DIMS, IMAGES, sourceVoxels, storeOf, zipOf } from './zarr-stores.js';

const SOURCE = sourceVoxels();

/** Factor of the values of each image, as in scripts/make_test_zarr.py. */
const FACTORS: Record<string, number> = {
  ...{ 'v2-gzip-fortran': 100, 'v3-blosc-xyz': -3, 'v3-raw-float': 0.25, 'v3-sharded-zstd-yxzc': 7 },
};

const TYPES: Record<string, string> = {
  ...{ 'v2-gzip-fortran': 'u16', 'v3-blosc-xyz': 'i16', 'v3-raw-float': 'f32', 'v3-sharded-zstd-yxzc': 'u16' },
};

type Triple = [number, number, number];
type Box = { min: Triple; max: Triple };

/** Returns the voxels of a box of a level, as the source has them. */
function expected(image: string, level: number, { min, max }: Box, { channel = 0, time = 0 } = {}): number[] {
  const [nx, ny] = DIMS;
  const step = 2 ** level;
  const values: number[] = [];
  for (let z = min[2]; z < max[2]; z++) {
    for (let y = min[1]; y < max[1]; y++) {
      for (let x = min[0]; x < max[0]; x++) {
        const column = time === 1 ? nx - 1 - x * step : x * step;
        const value = SOURCE[column + nx * (y * step + ny * z * step)] as number;
        values.push((channel === 1 ? 255 - value : value) * (FACTORS[image] ?? 1));
      }
    }
  }
  return values;
}

/** Boxes of level 0: the whole, one voxel, one chunk, and one that begins and ends inside chunks. */
const BOXES: Box[] = [
  { min: [0, 0, 0], max: [...DIMS] },
  { min: [25, 21, 13], max: [26, 22, 14] },
  { min: [11, 9, 6], max: [22, 18, 12] },
  { min: [3, 5, 2], max: [24, 20, 13] },
];

const voxelsOf = (volume: Volume): number[] => [...volume.intensities()];

describe.each(IMAGES)('%s', (image) => {
  test('regions are the voxels of the source, at their place in the world', async () => {
    const zarr = await openZarr(zipOf(image));
    const { dims, voxelType, affine } = zarr.levels[0] as ZarrVolume['levels'][0];
    expect(dims).toEqual(DIMS);
    expect(voxelType).toBe(TYPES[image] ?? 'u8');
    for (const box of BOXES) {
      const region = await zarr.region(0, box);
      expect(region.dims).toEqual(box.max.map((end, axis) => end - (box.min[axis] as number)));
      expect(voxelsOf(region)).toEqual(expected(image, 0, box));
      const first = box.min.map((index, axis) => index * (affine[5 * axis] as number) + (affine[12 + axis] as number));
      for (const [axis, at] of first.entries()) expect(region.affine[12 + axis]).toBeCloseTo(at, 12);
    }
  });

  test('world coordinates are millimetres', async () => {
    const { levels, unit } = await openZarr(await storeOf(image));
    expect(unit).toBe('mm');
    const shift = ['v2-gzip-fortran', 'v3-blosc-xyz', 'v3-raw-float', 'v3-sharded-gzip', 'v3-sharded-zstd-yxzc'];
    // The translation of 10 is in voxels of level 0: the scale of the whole image comes after it.
    const x = shift.includes(image) ? 1.5e-3 : 0;
    for (const [level, { spacing, affine }] of levels.entries()) {
      const factors = image === 'v3-scaled-zyx' && level === 1 ? [2, 2, 1] : [2 ** level, 2 ** level, 2 ** level];
      const sizes = [0.15e-3, 0.15e-3, 0.235e-3].map((size, axis) => size * (factors[axis] as number));
      const half = image === 'v3-scaled-zyx' && level === 1 ? 0.075e-3 : 0;
      const matrix = [sizes[0], 0, 0, 0, 0, sizes[1], 0, 0, 0, 0, sizes[2], 0, x + half, half, 0, 1];
      for (const [i, entry] of matrix.entries()) expect(affine[i]).toBeCloseTo(entry as number, 14);
      for (const [axis, size] of sizes.entries()) expect(spacing[axis]).toBeCloseTo(size, 14);
    }
  });
});

test('coarser levels are read like the finest', async () => {
  for (const image of IMAGES.filter((name) => name !== 'v3-scaled-zyx')) {
    const zarr = await openZarr(zipOf(image));
    for (const [level, { dims }] of zarr.levels.entries()) {
      const box: Box = { min: [1, 0, 1], max: [...dims] };
      expect(voxelsOf(await zarr.region(level, box))).toEqual(expected(image, level, box));
    }
  }
});

test('channel and time are selected', async () => {
  const box = BOXES[3] as Box;
  for (const channel of [0, 1]) {
    for (const time of [0, 1]) {
      const zarr = await openZarr(zipOf('v2-blosc-tczyx'), { channel, time });
      expect(voxelsOf(await zarr.region(0, box))).toEqual(expected('v2-blosc-tczyx', 0, box, { channel, time }));
    }
    const sharded = await openZarr(zipOf('v3-sharded-zstd-yxzc'), { channel });
    expect(voxelsOf(await sharded.region(0, box))).toEqual(expected('v3-sharded-zstd-yxzc', 0, box, { channel }));
  }
  for (const options of [{ channel: 2 }, { time: 2 }, { channel: -1 }]) {
    const error = await rejection(openZarr(zipOf('v2-blosc-tczyx'), options));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toMatch(/(channel|time): must be an integer/);
  }
});
