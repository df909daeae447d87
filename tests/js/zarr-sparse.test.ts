// Voxels of an OME-Zarr image as a model gets them: box by box, in any order.
import { describe, expect, test } from 'vitest';
import type { DataReport } from '../../pkg/index.js';
import { type SparseBox, type SparseSource, sparseSource, supply } from '../../pkg/sparse.js';
import { openZarr, type ZarrVolume } from '../../pkg/zarr/index.js';
import { failure } from './helpers.js';
import { changed, DIMS, IMAGES, sourceVoxels, storeOf, zipOf } from './zarr-stores.js';

type Triple = [number, number, number];

const SOURCE = sourceVoxels();

const sourceOf = (image: ZarrVolume): SparseSource => sparseSource(image) as SparseSource;

/** Returns all bricks of level 0, clipped to it. */
function bricks(size: number): SparseBox[] {
  const boxes: SparseBox[] = [];
  for (let z = 0; z < DIMS[2]; z += size) {
    for (let y = 0; y < DIMS[1]; y += size) {
      for (let x = 0; x < DIMS[0]; x += size) {
        const min: Triple = [x, y, z];
        const dims = min.map((first, axis) => Math.min(size, (DIMS[axis] as number) - first)) as Triple;
        boxes.push({ level: 0, min, dims });
      }
    }
  }
  return boxes;
}

/** A stand-in for a sparse volume of the core: keeps voxels in one array, each written once. */
class Core {
  readonly voxels = new Float32Array(SOURCE.length).fill(NaN);
  readonly order: string[] = [];

  insert({ min, dims }: SparseBox, data: ArrayLike<number>): void {
    this.order.push(min.join());
    const [nx, ny] = DIMS;
    for (let i = 0; i < data.length; i++) {
      const x = min[0] + (i % dims[0]);
      const y = min[1] + (Math.floor(i / dims[0]) % dims[1]);
      const z = min[2] + Math.floor(i / dims[0] / dims[1]);
      this.voxels[x + nx * (y + ny * z)] = data[i] as number;
    }
  }
}

describe.each(IMAGES)('%s', (name) => {
  test('bricks of any size have the voxels of the source', async () => {
    const image = await openZarr(zipOf(name));
    const { data } = await image.voxels(0, { min: [0, 0, 0], max: [...DIMS] });
    for (const size of [5, 8, 16, 64]) {
      const core = new Core();
      const reports: DataReport[] = [];
      const boxes = bricks(size);
      const onData = (report: DataReport) => void reports.push(report);
      await supply(sourceOf(image), boxes, (box, voxels) => core.insert(box, voxels), { onData });
      expect([...core.voxels]).toEqual([...data]);
      expect(reports.map(({ waiting }) => waiting)).toEqual([...boxes.keys()].reverse());
      expect(new Set(core.order).size).toBe(boxes.length);
    }
  });

  test('what a model starts from is there at once', async () => {
    const image = await openZarr(zipOf(name));
    const source = sourceOf(image);
    const coarsest = source.levels.length - 1;
    const dims = source.levels[coarsest]?.dims as Triple;
    const { data } = await image.voxels(coarsest, { min: [0, 0, 0], max: dims });
    expect(source.coarsest).toEqual(data);
    expect(source.range).toEqual(image.range);
    expect(source.type).toBe(image.levels[0]?.voxelType);
    expect(source.levels.map(({ affine }) => affine)).toEqual(image.levels.map(({ affine }) => affine));
  });
});

test('bricks that arrive in any order are the same', async () => {
  for (let seed = 1; seed <= 20; seed++) {
    let state = seed;
    const next = () => {
      state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
      return state / 2 ** 32;
    };
    const store = await storeOf('v3-sharded-gzip');
    const image = await openZarr(store, { cache: 20_000, concurrency: 1 + (seed % 9) });
    store.fault = async (_, bytes) => {
      await new Promise((resolve) => setTimeout(resolve, 3 * next()));
      return bytes;
    };
    const core = new Core();
    await supply(sourceOf(image), bricks(8), (box, voxels) => core.insert(box, voxels));
    expect([...core.voxels]).toEqual([...SOURCE]);
  }
});

test('errors and aborts end all reads, and a later call goes on', async () => {
  const store = await storeOf('v3-zstd-zyx');
  const image = await openZarr(store, { retries: 0 });
  const core = new Core();
  const insert = (box: SparseBox, voxels: ArrayLike<number>) => core.insert(box, voxels);
  const reasonOf = (promise: Promise<unknown>) => promise.catch((reason: unknown) => reason);

  store.fault = async (key, bytes) => {
    if (key === '/s0/c/1/1/1') throw new Error('lost');
    return bytes;
  };
  expect(await reasonOf(supply(sourceOf(image), bricks(8), insert))).toMatchObject({ code: 'unavailable' });
  expect(store.open).toBe(0);

  const stop = new AbortController();
  store.fault = () => new Promise(() => {});
  const aborted = reasonOf(supply(sourceOf(image), bricks(8), insert, { signal: stop.signal }));
  await expect.poll(() => store.open).toBeGreaterThan(0);
  const inserted = core.order.length;
  stop.abort('enough');
  expect(await aborted).toBe('enough');
  expect(store.open).toBe(0);
  expect(core.order.length).toBeLessThan(inserted + 12);
  expect(await reasonOf(supply(sourceOf(image), bricks(8), insert, { signal: AbortSignal.abort('no') }))).toBe('no');

  store.fault = async (_, bytes) => bytes;
  const wrong = () => {
    throw new RangeError('refused');
  };
  expect(await reasonOf(supply(sourceOf(image), bricks(8), wrong))).toBeInstanceOf(RangeError);
  await supply(sourceOf(image), bricks(8), insert);
  expect([...core.voxels]).toEqual([...SOURCE]);
});

test('an image that no model can start from is refused', async () => {
  const large = await changed('v3-zstd-zyx', '/s0/zarr.json', (json) => {
    json.shape = [1000, 1000, 1000];
  });
  const one = await changed('v3-zstd-zyx', '/zarr.json', ({ attributes }) => {
    attributes.ome.multiscales[0].datasets.length = 1;
  });
  const get = large.get.bind(large);
  large.get = (key, options) => (key === '/zarr.json' ? one.get(key, options) : get(key, options));
  const unread = await openZarr(large);
  expect([unread.range, unread.loaded()[0]?.chunks]).toEqual([undefined, 0]);
  expect(failure(() => sourceOf(unread)).code).toBe('too-large');
  const empty = await changed('v3-raw-float', '/scale1/image/zarr.json', (json) => {
    json.fill_value = 'NaN';
  });
  empty.fault = async (key, bytes) => (key.includes('/c/') ? undefined : bytes);
  const image = await openZarr(empty);
  expect(failure(() => sourceOf(image)).message).toBe('volume: the coarsest level must have a finite voxel');
  image.free();
  expect(failure(() => sourceOf(image)).code).toBe('freed');
});
