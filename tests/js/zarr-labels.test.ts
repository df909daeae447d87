// `vesicle/zarr` on integers of 64 bits, NaN as fill value, and axes without a unit.
import { describe, expect, test } from 'vitest';
import { DeformableModel } from '../../pkg/index.js';
import { openZarr } from '../../pkg/zarr/index.js';
import { rejection } from './helpers.js';
import { TestStore } from './zarr-stores.js';

const json = (value: unknown) => new TextEncoder().encode(JSON.stringify(value));

interface Image {
  dtype: string;
  fill: unknown;
  chunks: Record<string, { buffer: ArrayBufferLike }>;
  units?: (string | undefined)[];
}

/** Returns a store of an image of 4 × 2 × 2 voxels on z, y, x, in chunks of 2 × 2 × 2. */
function imageOf({ dtype, fill, chunks, units = [] }: Image): TestStore {
  const axes = ['z', 'y', 'x'].map((name, at) => ({ name, type: 'space', ...(units[at] && { unit: units[at] }) }));
  const datasets = [{ path: '0', coordinateTransformations: [{ type: 'scale', scale: [4, 2, 1] }] }];
  const array = {
    ...{ zarr_format: 2, shape: [2, 2, 4], chunks: [2, 2, 2], dtype, fill_value: fill },
    ...{ order: 'C', filters: null, compressor: null },
  };
  const files = new Map([
    ['/.zgroup', json({ zarr_format: 2 })],
    ['/.zattrs', json({ multiscales: [{ version: '0.4', axes, datasets }] })],
    ['/0/.zarray', json(array)],
  ]);
  for (const [key, { buffer }] of Object.entries(chunks)) files.set(`/0/${key}`, new Uint8Array(buffer as ArrayBuffer));
  return new TestStore(files);
}

const WHOLE = { min: [0, 0, 0] as [number, number, number], max: [4, 2, 2] as [number, number, number] };

const long = (...values: number[]) => BigInt64Array.from(values, BigInt);

describe('integers of 64 bits', () => {
  test('are read if they fit into 32 bits', async () => {
    const chunks = { '0.0.0': long(0, -1, 2, 3, 4, 5, 6, 2 ** 31 - 1) };
    const zarr = await openZarr(imageOf({ dtype: '<i8', fill: 9, chunks }));
    expect(zarr.levels[0]?.voxelType).toBe('i32');
    const { data } = await zarr.voxels(0, WHOLE);
    expect(data).toEqual(Int32Array.of(0, -1, 9, 9, 2, 3, 9, 9, 4, 5, 9, 9, 6, 2 ** 31 - 1, 9, 9));
    const region = await zarr.region(0, WHOLE);
    expect(region.labels()).toHaveLength(8);
    const big = new DataView(new ArrayBuffer(64));
    big.setBigUint64(56, 4294967295n);
    const unsigned = await openZarr(imageOf({ dtype: '>u8', fill: 0, chunks: { '0.0.1': big } }));
    expect(unsigned.levels[0]?.voxelType).toBe('u32');
    expect((await unsigned.voxels(0, WHOLE)).data.at(-1)).toBe(4294967295);
  });

  test('are refused if they do not, with the chunk', async () => {
    for (const [dtype, value] of [
      ['<i8', 2 ** 31],
      ['<i8', -(2 ** 31) - 1],
      ['<u8', 2 ** 32],
      ['<i8', Number.MAX_SAFE_INTEGER],
    ] as const) {
      const chunks = { '0.0.1': long(0, 1, 2, 3, 4, 5, 6, value) };
      const error = await rejection(openZarr(imageOf({ dtype, fill: 0, chunks })));
      expect(error.code).toBe('bad-file');
      expect(error.message).toContain(`chunk 0,0,1: integers of 64 bits must fit into 32 bits, got ${value}`);
    }
    const filled = await rejection(openZarr(imageOf({ dtype: '<i8', fill: 2 ** 40, chunks: {} })));
    expect(filled.message).toContain(`array "0".fill_value: integers of 64 bits must fit into 32 bits, got ${2 ** 40}`);
  });
});

test('voxels of chunks that are not stored are NaN if the fill value is', async () => {
  const chunks = { '0.0.0': Float32Array.of(1, 2, 3, 4, 5, 6, 7, 8) };
  const zarr = await openZarr(imageOf({ dtype: '<f4', fill: 'NaN', chunks }));
  const values = [...(await zarr.region(0, WHOLE)).intensities()];
  const { NaN: none } = Number;
  expect(values).toEqual([1, 2, none, none, 3, 4, none, none, 5, 6, none, none, 7, 8, none, none]);
  expect(zarr.range).toEqual([1, 8]);
  for (const fill of ['0x7fc00000', 'nothing']) {
    const { message } = await rejection(openZarr(imageOf({ dtype: '<f4', fill, chunks })));
    expect(message).toContain(
      `array "0".fill_value: must be a number, "NaN", "Infinity" or "-Infinity", got "${fill}"`,
    );
  }
});

describe('an axis without a unit', () => {
  const chunks = { '0.0.0': Uint8Array.of(1, 2, 3, 4, 5, 6, 7, 8) };
  const open = (units: (string | undefined)[]) => openZarr(imageOf({ dtype: '|u1', fill: 0, chunks, units }));

  test('has that of the others, with a warning', async () => {
    const zarr = await open([undefined, 'micrometer', 'micrometer']);
    expect(zarr.unit).toBe('mm');
    expect(zarr.levels[0]?.spacing).toEqual([0.001, 0.002, 0.004]);
    const warning = { code: 'reader', text: /no unit of length for z; that of its other axes was assumed/ };
    expect(zarr.warnings).toMatchObject([warning]);
    expect((await zarr.region(0, WHOLE)).warnings).toMatchObject([warning]);
    expect((await open(['micrometer', 'micrometer', 'micrometer'])).warnings).toEqual([]);
    expect((await open([undefined, undefined, undefined])).warnings).toEqual([]);
  });

  test('is refused if the others differ, or if it has another unit', async () => {
    for (const [units, axis] of [
      [[undefined, 'micrometer', 'millimeter'], 0],
      [['micrometer', 'pixel', undefined], 1],
    ] as const) {
      const { message } = await rejection(open([...units]));
      expect(message).toContain(`axes[${axis}].unit: must be a unit of length`);
    }
  });

  test('is known to the meshes of the image, too', async () => {
    const zarr = await open([undefined, 'micrometer', 'micrometer']);
    const model = new DeformableModel({ volume: zarr, start: 'enclosing', params: { iso: 4.5 } });
    expect(model.mesh.warnings).toMatchObject([{ code: 'reader' }]);
    model.free();
  });
});
