// Sources and arguments of `vesicle/zarr`.
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import FileSystemStore from '@zarrita/storage/fs';
import { afterAll, describe, expect, test } from 'vitest';
import { Volume } from '../../pkg/index.js';
import { openZarr, type ZarrSource, ZarrVolume } from '../../pkg/zarr/index.js';
import { rejection, wrong } from './helpers.js';
import { changed, DIMS, filesOf, IMAGES, sourceVoxels, storeOf, TestStore, zipOf } from './zarr-stores.js';

type Triple = [number, number, number];

const WHOLE = { min: [0, 0, 0] as Triple, max: [...DIMS] as Triple };

const SOURCE = [...sourceVoxels()];

const missing = (name: string) => Object.assign(new Error(name), { name });

/** A folder as `showDirectoryPicker` returns it. */
function handleOf(files: Map<string, Uint8Array>, folder = ''): FileSystemDirectoryHandle {
  const under = (path: string) => [...files.keys()].some((key) => key.startsWith(`${path}/`));
  const handle = {
    kind: 'directory',
    async getDirectoryHandle(name: string) {
      const path = `${folder}/${name}`;
      if (files.has(path)) throw missing('TypeMismatchError');
      if (!under(path)) throw missing('NotFoundError');
      return handleOf(files, path);
    },
    async getFileHandle(name: string) {
      const path = `${folder}/${name}`;
      if (under(path)) throw missing('TypeMismatchError');
      const bytes = files.get(path);
      if (!bytes) throw missing('NotFoundError');
      return { getFile: async () => new Blob([bytes as BlobPart]) };
    },
  };
  return handle as unknown as FileSystemDirectoryHandle;
}

/** A folder as `webkitGetAsEntry` of something dropped returns it. */
function entryOf(files: Map<string, Uint8Array>): FileSystemDirectoryEntry {
  const getFile = (path: string, _: object, resolve: (file: unknown) => void, reject: (error: Error) => void) => {
    const bytes = files.get(`/${path}`);
    if (bytes) resolve({ file: (give: (blob: Blob) => void) => give(new Blob([bytes as BlobPart])) });
    else reject(missing('NotFoundError'));
  };
  return { isDirectory: true, getFile } as unknown as FileSystemDirectoryEntry;
}

/** The files of an input with `webkitdirectory`. */
function inputOf(files: Map<string, Uint8Array>): File[] {
  return [...files].map(([key, bytes]) => {
    const file = new File([bytes as BlobPart], key.split('/').at(-1) as string);
    return Object.assign(file, { webkitRelativePath: `picked.zarr${key}` });
  });
}

const folders: string[] = [];

/** Writes files to a folder and returns its path. */
function written(files: Map<string, Uint8Array>): string {
  const folder = mkdtempSync(join(tmpdir(), 'vesicle-zarr-'));
  folders.push(folder);
  for (const [key, bytes] of files) {
    mkdirSync(dirname(join(folder, key)), { recursive: true });
    writeFileSync(join(folder, key), bytes);
  }
  return folder;
}

afterAll(() => {
  for (const folder of folders) rmSync(folder, { recursive: true });
});

describe('an image is read from', () => {
  const SOURCES: [string, (files: Map<string, Uint8Array>) => ZarrSource][] = [
    ['a folder picked', (files) => handleOf(files)],
    ['a folder dropped', (files) => entryOf(files)],
    ['the files of a folder', (files) => inputOf(files)],
    ['a store in memory', (files) => files as ZarrSource],
    ['files on a disk', (files) => new FileSystemStore(written(files))],
  ];

  test.each(SOURCES)('%s', async (name, sourceOf) => {
    for (const image of ['v2-blosc-tczyx', 'v3-zstd-zyx', 'v3-sharded-gzip']) {
      const source = sourceOf(await filesOf(image));
      if (name === 'a store in memory' && image === 'v3-sharded-gzip') {
        const error = await rejection(openZarr(source));
        expect(error.message).toContain('sharding requires a store with getRange');
        continue;
      }
      const zarr = await openZarr(source);
      expect([...(await zarr.voxels(0, WHOLE)).data]).toEqual(SOURCE);
      expect(zarr.loaded()[0]?.chunks).toBe(27);
    }
  });

  test('a folder within a folder, by its path', async () => {
    const files = await filesOf('v3-zstd-zyx');
    const nested = new Map([...files].map(([key, bytes]) => [`/a b/image.zarr${key}`, bytes]));
    for (const path of ['a b', 'a b/image.zarr/zarr.json', 'nowhere']) {
      const error = await rejection(openZarr(handleOf(nested), { path }));
      expect(error.message).toContain(`group "/${path}": no Zarr group is there`);
    }
    for (const path of ['a b/image.zarr', '/a b/image.zarr/', 'a b/image.zarr//']) {
      const zarr = await openZarr(handleOf(nested), { path });
      expect([...(await zarr.voxels(0, WHOLE)).data]).toEqual(SOURCE);
    }
    const error = await rejection(openZarr(handleOf(nested)));
    expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining('no Zarr group is there')]);
    const other = await rejection(openZarr(handleOf(nested), { path: 'a b/image.zarr/s0' }));
    expect(other.message).toContain('this is an array; must be the group of an image');
  });

  test('a file that is not a ZIP, or truncated', async () => {
    for (const zip of [new Blob([]), new Blob(['hello']), zipOf('v3-zstd-zyx').slice(0, 9000)]) {
      const error = await rejection(openZarr(zip));
      expect([error.code, error.message]).toEqual(['bad-file', expect.stringMatching(/^OME-Zarr: ZIP: /)]);
    }
  });

  test('nothing else', async () => {
    const sources = [undefined, null, 7, {}, [], 'no address', [new File([], 'a')], [1], () => 1];
    for (const source of sources) {
      const error = await rejection(openZarr(wrong(source)));
      expect([source, error.code]).toEqual([
        source,
        Array.isArray(source) && !source.length ? 'bad-file' : 'invalid-argument',
      ]);
    }
  });
});

test('options and arguments are checked', async () => {
  const store = await storeOf('v3-zstd-zyx');
  const options = [
    ...[{ paths: '' }, { path: 1 }, { channel: 0.5 }, { time: -1 }, { cache: -1 }, { cache: NaN }, { signal: {} }],
    ...[{ concurrency: 0 }, { concurrency: 1e4 }, { retries: -1 }, { timeoutMs: 0 }, 'x', null],
  ];
  for (const option of options) {
    expect([option, (await rejection(openZarr(store, wrong(option)))).code]).toEqual([option, 'invalid-argument']);
  }
  expect(store.requests.size).toBe(0);
  const zarr = await openZarr(store);
  for (const level of [-1, 3, 0.5, '0', undefined]) {
    expect((await rejection(zarr.region(wrong(level), WHOLE))).message).toContain(
      'level: must be an integer from 0 to 2',
    );
  }
  const boxes = [
    { min: [0, 0, 0], max: [27, 22, 14] },
    { min: [-1, 0, 0], max: [26, 22, 14] },
    { min: [5, 5, 5], max: [5, 6, 6] },
    { min: [5, 5, 5], max: [4, 6, 6] },
    { min: [0.5, 0, 0], max: [2, 2, 2] },
    { min: [0, 0], max: [2, 2, 2] },
    { min: [0, 0, 0] },
    { min: [0, 0, 0], max: [1, 1, 1], size: 1 },
    undefined,
  ];
  const before = store.requests.size;
  for (const box of boxes) {
    expect([box, (await rejection(zarr.region(0, wrong(box)))).code]).toEqual([box, 'invalid-argument']);
  }
  expect((await rejection(zarr.region(0, WHOLE, wrong({ signal: 1 })))).code).toBe('invalid-argument');
  expect(store.requests.size).toBe(before);
});

test('the range of intensities is that of the coarsest level, which is read at first', async () => {
  for (const image of IMAGES) {
    const store = await storeOf(image);
    const zarr = await openZarr(store);
    const coarsest = zarr.levels.length - 1;
    const loaded = zarr.loaded();
    expect(loaded[coarsest]?.chunks).toBe(loaded[coarsest]?.of.chunks);
    expect(loaded[0]?.chunks).toBe(0);
    const { size } = store.requests;
    const { data } = await zarr.voxels(coarsest, { min: [0, 0, 0], max: zarr.levels[coarsest]?.dims as Triple });
    expect(zarr.range).toEqual([Math.min(...data), Math.max(...data)]);
    expect(store.requests.size).toBe(size);
  }
});

test('values that are not finite are no part of the range', async () => {
  const store = await changed('v3-raw-float', '/scale1/image/zarr.json', (json) => {
    json.fill_value = 'NaN';
  });
  const [low, high] = (await openZarr(store)).range as [number, number];
  store.fault = async (key, bytes) => (key === '/scale1/image/c/0/0/0' ? undefined : bytes);
  const [less, more] = (await openZarr(store)).range as [number, number];
  expect(less).toBeGreaterThanOrEqual(low);
  expect(more).toBeLessThanOrEqual(high);
  store.fault = async (key, bytes) => (key.startsWith('/scale1/image/c') ? undefined : bytes);
  expect((await openZarr(store)).range).toBeUndefined();
});

describe('axes and units', () => {
  const multiscale = 'attributes.ome.multiscales.0'.split('.');
  // biome-ignore lint/suspicious/noExplicitAny: any JSON
  const image = (change: (multiscale: any) => void) =>
    changed('v3-zstd-zyx', '/zarr.json', (json) => change(multiscale.reduce((object, name) => object[name], json)));

  test('lengths in any unit become millimetres; without units they stay', async () => {
    const UNITS: [string | undefined, number][] = [
      ['nanometer', 1e-6],
      ['micrometer', 1e-3],
      ['µm', 1e-3],
      ['millimeter', 1],
      ['meter', 1e3],
      ['inch', 25.4],
      ['pixel', 1],
      [undefined, 1],
    ];
    for (const [unit, factor] of UNITS) {
      const store = await image(({ axes }) => {
        for (const axis of axes) axis.unit = unit;
      });
      const zarr = await openZarr(store);
      expect([unit, zarr.unit]).toEqual([unit, unit === 'pixel' || unit === undefined ? undefined : 'mm']);
      expect((zarr.levels[0]?.spacing[2] as number) / factor).toBeCloseTo(0.235, 12);
    }
  });

  test('each axis may have a unit of its own', async () => {
    const store = await image(({ axes }) => {
      axes[0].unit = 'nanometer';
    });
    const { spacing } = (await openZarr(store)).levels[0] as ZarrVolume['levels'][0];
    for (const [axis, size] of [0.15e-3, 0.15e-3, 0.235e-6].entries()) expect(spacing[axis]).toBeCloseTo(size, 14);
  });

  test('scales and translations apply one after the other, those of the whole image last', async () => {
    const store = await image((one) => {
      one.datasets.length = 1;
      one.datasets[0].coordinateTransformations = [
        { type: 'scale', scale: [1, 2, 3] },
        { type: 'translation', translation: [10, 20, 30] },
      ];
      one.coordinateTransformations = [
        { type: 'identity' },
        { type: 'scale', scale: [2, 2, 10] },
        { type: 'translation', translation: [1, 2, 3] },
      ];
      for (const axis of one.axes) axis.unit = 'millimeter';
    });
    const { affine } = (await openZarr(store)).levels[0] as ZarrVolume['levels'][0];
    expect([...affine]).toEqual([30, 0, 0, 0, 0, 4, 0, 0, 0, 0, 2, 0, 303, 42, 21, 1]);
    const region = await (await openZarr(store)).region(0, { min: [1, 2, 3], max: [4, 5, 6] });
    expect([...region.affine].slice(12)).toEqual([333, 50, 27, 1]);
  });

  test('an image without z is one slice', async () => {
    // The z axis of the images is their time here.
    const change = (levels: number) =>
      image(({ axes, datasets }) => {
        axes[0] = { name: 'frame', type: 'time' };
        datasets.length = levels;
      });
    const uneven = await rejection(openZarr(await change(2)));
    expect(uneven.message).toBe('OME-Zarr: array "s1".shape: must have the t 14 of level 0, got t 7');
    const store = await change(1);
    const zarr = await openZarr(store, { time: 5 });
    expect(zarr.levels[0]).toMatchObject({ dims: [26, 22, 1], chunks: [11, 9, 1] });
    const slice = await zarr.region(0, { min: [0, 0, 0], max: [26, 22, 1] });
    expect([...slice.intensities()]).toEqual(SOURCE.slice(26 * 22 * 5, 26 * 22 * 6));
    expect(slice.spacing[2]).toBe(slice.spacing[0]);
  });
});

test('regions are volumes of the library, and voxels are options of one', async () => {
  const zarr = await openZarr(zipOf('v3-zstd-zyx'));
  expect(zarr).toBeInstanceOf(ZarrVolume);
  const box = { min: [2, 3, 4] as Triple, max: [20, 19, 13] as Triple };
  const region = await zarr.region(0, box);
  expect(region).toBeInstanceOf(Volume);
  const again = new Volume(await zarr.voxels(0, box));
  expect(again.intensities()).toEqual(region.intensities());
  expect(again.affine).toEqual(region.affine);
});

test('a region does not share its voxels with the cache', async () => {
  const store = new TestStore(await filesOf('v3-zstd-zyx'));
  const zarr = await openZarr(store);
  const first = await zarr.voxels(0, WHOLE);
  (first.data as Uint8Array).fill(0);
  expect([...(await zarr.voxels(0, WHOLE)).data]).toEqual(SOURCE);
});
