// Models of images in small files, which may come from anyone and stand for a lattice of any size.
import { gzipSync } from 'node:zlib';
import { expect, test } from 'vitest';
import startReaders, { parseVolume } from '../../pkg/import/index.js';
import { DeformableModel, LabelSurfaces, Mesh, SurfaceTracker, Volume } from '../../pkg/index.js';
import { readTiff } from '../../pkg/tiff/index.js';
import { openZarr } from '../../pkg/zarr/index.js';
import { ball, failure, HEALTHY, rejection, wrong } from './helpers.js';
import { deflatedStack } from './made-tiff.js';
import { TestStore } from './zarr-stores.js';

const SIZE = 104;

/** Rods of one voxel, whose contour has two triangles for each voxel of the image. */
const rods = Uint8Array.from({ length: SIZE ** 3 }, (_, i) => {
  const [x, y] = [i % SIZE, Math.floor(i / SIZE) % SIZE];
  return x % 2 === 0 && y % 2 === 0 ? 200 : 0;
});

function nrrd(encoding: 'gzip' | 'raw'): Uint8Array {
  const header = `NRRD0004\ntype: uint8\ndimension: 3\nsizes: ${SIZE} ${SIZE} ${SIZE}\nencoding: ${encoding}\n\n`;
  return new Uint8Array(Buffer.concat([Buffer.from(header), encoding === 'gzip' ? gzipSync(rods) : rods]));
}

const tiff = () =>
  deflatedStack(
    Array.from({ length: SIZE }, (_, z) => rods.subarray(z * SIZE ** 2, (z + 1) * SIZE ** 2)),
    SIZE,
  );

async function zarr() {
  const json = (value: unknown) => new TextEncoder().encode(JSON.stringify(value));
  const axes = ['z', 'y', 'x'].map((name) => ({ name, type: 'space' }));
  const coordinateTransformations = [{ type: 'scale', scale: [1, 1, 1] }];
  const multiscales = [{ axes, datasets: [{ path: '0', coordinateTransformations }] }];
  const shape = [SIZE, SIZE, SIZE];
  const array = {
    ...{ zarr_format: 3, node_type: 'array', shape, data_type: 'uint8', fill_value: 0, attributes: {} },
    chunk_grid: { name: 'regular', configuration: { chunk_shape: shape } },
    chunk_key_encoding: { name: 'default', configuration: { separator: '/' } },
    codecs: [
      { name: 'bytes', configuration: { endian: 'little' } },
      { name: 'gzip', configuration: { level: 9 } },
    ],
  };
  const files: [string, Uint8Array][] = [
    ['/zarr.json', json({ zarr_format: 3, node_type: 'group', attributes: { ome: { version: '0.5', multiscales } } })],
    ['/0/zarr.json', json(array)],
    ['/0/c/0/0/0', new Uint8Array(gzipSync(rods))],
  ];
  return openZarr(new TestStore(new Map(files)));
}

const SMALL = {
  'Volume.parse': async () => Volume.parse(nrrd('gzip')),
  parseVolume: async () => {
    await startReaders();
    return new Volume(parseVolume(nrrd('gzip')));
  },
  'a header and its data': async () => {
    const header = new TextDecoder().decode(nrrd('raw').subarray(0, 80)).split('\n\n')[0]?.replace('raw', 'gzip');
    const bytes = new TextEncoder().encode(`${header}\ndata file: LIST\nrods.gz\n`);
    return Volume.parse(bytes, { files: [{ name: 'rods.gz', bytes: new Uint8Array(gzipSync(rods)) }] });
  },
  'frames of small files': async () => Volume.fromFrames([Volume.parse(nrrd('gzip')), Volume.parse(nrrd('gzip'))]),
  readTiff: async () => new Volume(await readTiff([{ name: 'rods.tif', bytes: tiff() }])),
  openZarr: zarr,
  'a region of openZarr': async () => (await zarr()).region(0, { min: [0, 0, 0], max: [SIZE, SIZE, SIZE] }),
  'a level of a pyramid': async () => Volume.parse(nrrd('gzip')).pyramid(1)[0] as Volume,
};

const options = { params: { iso: 100, smallestPart: 1 } };

test.each(Object.entries(SMALL))(
  'a lattice in a small file is refused unless more vertices are allowed: %s',
  async (_, open) => {
    const volume = await open();
    const byDefault = await rejection(DeformableModel.create({ ...options, volume }));
    expect(byDefault).toMatchObject({
      code: 'too-large',
      message: expect.stringContaining('more than 300000 vertices'),
    });
    const allowed = await rejection(DeformableModel.create({ ...options, volume, maxVertices: 100_000 }));
    expect(allowed).toMatchObject({
      code: 'too-large',
      message: expect.stringContaining('more than 800000 triangles'),
    });
  },
);

test('an iso-surface of a lattice in a small file is refused unless more triangles are allowed', () => {
  const volume = Volume.parse(nrrd('gzip'));
  expect(failure(() => Mesh.marchingCubes(volume, 100))).toMatchObject({ code: 'too-large' });
  expect(Mesh.marchingCubes(volume, 100, { maxTriangles: 3e6 }).triangleCount).toBeGreaterThan(1_200_000);
});

test('a label map of noise in a small file is refused unless more vertices are allowed', async () => {
  const random = (i: number) => Math.floor(8 * ((Math.sin(i + 1) * 43758.5453) % 1) ** 2);
  const labels = Uint8Array.from({ length: SIZE ** 3 }, (_, i) => random(i % SIZE ** 2));
  const header = `NRRD0004\ntype: uint8\ndimension: 3\nsizes: ${SIZE} ${SIZE} ${SIZE}\nencoding: gzip\n\n`;
  const volume = Volume.parse(new Uint8Array(Buffer.concat([Buffer.from(header), gzipSync(labels)])));
  const byDefault = await rejection(LabelSurfaces.create({ volume }));
  expect(byDefault.message).toContain('more than 1000000 cells');
  const allowed = await rejection(LabelSurfaces.create({ volume, maxVertices: 1_050_000 }));
  expect(allowed.message).toContain('more than 1050000 cells');
});

test('a larger file, or voxels of the caller, may have as many vertices as fit into memory', async () => {
  for (const volume of [Volume.parse(nrrd('raw')), new Volume({ data: rods, dims: [SIZE, SIZE, SIZE] })]) {
    const signal = AbortSignal.timeout(1500);
    const error = await DeformableModel.create({ ...options, volume }, { signal }).catch((reason) => reason);
    expect(error).toBe(signal.reason);
  }
});

test('a run ends with an error where the surface would have more vertices than allowed, and nothing is lost', async () => {
  // Coarse levels blur the two balls, which the finest has, into one.
  const volume = ball(64, 22);
  const most = 2000;
  const model = new DeformableModel({ volume, levels: 2, maxVertices: most, params: { iso: 0.5, seeding: 'off' } });
  expect(model.mesh.info().vertices).toBeLessThan(most);
  const error = await rejection(model.run());
  expect(error).toMatchObject({ code: 'too-large' });
  expect(model.mesh.check()).toMatchObject(HEALTHY);
  expect(model.mesh.info().vertices).toBeLessThanOrEqual(most);
});

/** A sequence of two frames of stripes or of a ball, in a small file. */
function sequence(size: number, isBright: (at: [number, number, number], frame: number) => boolean): Volume {
  const voxels = Uint8Array.from({ length: 2 * size ** 3 }, (_, i) => {
    const at = [i % size, Math.floor(i / size) % size, Math.floor(i / size ** 2) % size] as [number, number, number];
    return isBright(at, Math.floor(i / size ** 3)) ? 200 : 10;
  });
  const header = `NRRD0004\ntype: uint8\ndimension: 4\nsizes: ${size} ${size} ${size} 2\nencoding: gzip\n\n`;
  return Volume.parse(new Uint8Array(Buffer.concat([Buffer.from(header), gzipSync(voxels)])));
}

const striped = (size: number) => sequence(size, ([x], frame) => ((x + frame) & 4) > 0);
const beating = (size: number) =>
  sequence(size, (at, frame) => Math.hypot(...at.map((x) => x - size / 2)) < size / 4 + frame);

test('tracking in a box of too many voxels is refused before it begins, unless more are allowed', async () => {
  const volume = striped(216);
  const tracker = new SurfaceTracker({ volume });
  expect(await rejection(tracker.run())).toMatchObject({
    code: 'too-large',
    message: expect.stringContaining('220 × 220 × 220 voxels'),
  });
  expect(tracker.boundary(0)).toHaveLength(0);
  const part = new SurfaceTracker({ volume, voxels: { min: [0, 0, 0], max: [31, 31, 31] } });
  expect(part.step().phase).toContain('boundary');
});

test('a lattice is refused as soon as its boundary is found, unless more vertices are allowed', async () => {
  const volume = striped(32);
  const few = new SurfaceTracker({ volume, maxVertices: 500 });
  expect(await rejection(few.run())).toMatchObject({
    code: 'too-large',
    message: expect.stringContaining('use a smaller box'),
  });
  expect(few.boundary(0)).toHaveLength(0);
  const blocks = sequence(32, (at, frame) => at.reduce((sum, x) => sum + (x >> 1), frame) % 2 > 0);
  const points = new SurfaceTracker({ volume: blocks, maxVoxels: 36 ** 3 });
  expect(await rejection(points.run())).toMatchObject({ code: 'too-large' });
  expect((await new SurfaceTracker({ volume }).run()).done).toBe(true);
});

test('a ball of a small file is tracked, with the bits that it has in other images', async () => {
  const volume = beating(40);
  const small = new SurfaceTracker({ volume });
  await small.run();
  const other = new SurfaceTracker({ volume, maxVertices: 4_000_000, maxVoxels: 1e8 });
  await other.run();
  expect(small.volumes()[1]).toBeGreaterThan(4000);
  expect(Buffer.from(small.save()).equals(Buffer.from(other.save()))).toBe(true);
});

test('a tracked surface with more vertices than allowed ends the run, and nothing is lost', async () => {
  const volume = beating(40);
  const full = new SurfaceTracker({ volume });
  await full.run();
  const most = full.mesh.info().vertices - 1;
  const tracker = new SurfaceTracker({ volume, maxVertices: most });
  expect(await rejection(tracker.run())).toMatchObject({
    code: 'too-large',
    message: expect.stringContaining(`more than ${most} vertices`),
  });
  expect(tracker.statistics.length).toBeLessThan(2);
});

test('a small file with a slope is not written as many times its voxels', () => {
  const plain = new Volume({ data: new Uint8Array(8), dims: [2, 2, 2], slope: 2.5 }).toNifti();
  const side = 408;
  const header = plain.slice(0, 352);
  for (const axis of [1, 2, 3]) new DataView(header.buffer).setInt16(40 + 2 * axis, side, true);
  const file = gzipSync(Buffer.concat([header, new Uint8Array(side ** 3)]), { level: 9 });
  expect(file.length).toBeLessThan(2 ** 17);
  const volume = Volume.parse(new Uint8Array(file));
  for (const format of ['mha', 'nrrd'] as const)
    expect(failure(() => volume.toBytes(format))).toMatchObject({ code: 'too-large', message: /271669248 bytes/ });
  expect(volume.toBytes('nifti').length).toBe(352 + side ** 3);
  const part = volume.crop({ min: [0, 0, 0], max: [200, 200, 200] });
  expect(part.toBytes('nrrd').length).toBeGreaterThan(32e6);
  for (const format of ['mha', 'nrrd'] as const)
    expect(failure(() => part.toBytes(format, { gzip: true }))).toMatchObject({ code: 'too-large' });
  for (const one of [part, volume]) one.free();
  const small = Volume.parse(plain);
  expect(small.toBytes('mha').length).toBeGreaterThan(32);
  small.free();
});

test('a pyramid of an image of a small file has fifty million voxels at most, in all levels but the first', () => {
  const [small, large] = [nrrd('gzip'), nrrd('raw')].map((bytes) => Volume.parse(bytes)) as [Volume, Volume];
  const factor = 1.0001;
  const levels = Math.ceil(60_000_000 / SIZE ** 3);
  expect(failure(() => small.pyramid(levels, { factor }))).toMatchObject({
    code: 'too-large',
    message: expect.stringMatching(/^factor: \d+ voxels in all levels but the first are more than 50000000/),
  });
  expect(small.pyramid(2).length).toBe(2);
  expect(large.pyramid(levels, { factor }).length).toBe(levels);
});

test('an image of a small file is resampled to fifty million voxels at most, any other to as many as there is memory for', () => {
  const [small, large] = [nrrd('gzip'), nrrd('raw')].map((bytes) => Volume.parse(bytes)) as [Volume, Volume];
  for (const grid of [{ dims: [369, 369, 369] }, { spacing: [0.28, 0.28, 0.28] }, { like: large }] as const) {
    const resample = (volume: Volume) => volume.resample({ ...wrong(grid), interpolation: 'nearest' });
    if ('like' in grid) expect(resample(small).dims).toEqual([SIZE, SIZE, SIZE]);
    else
      expect(failure(() => resample(small))).toMatchObject({
        code: 'too-large',
        message: expect.stringMatching(/needs 5\d{7} bytes/),
      });
  }
  expect(small.resample({ dims: [300, 300, 300], interpolation: 'nearest' }).dims).toEqual([300, 300, 300]);
  expect(large.resample({ dims: [369, 369, 369], interpolation: 'nearest' }).dims).toEqual([369, 369, 369]);
});
