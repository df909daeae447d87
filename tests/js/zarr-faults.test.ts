// `vesicle/zarr` with stores that fail, lie, stall and are aborted.
import { afterEach, describe, expect, test } from 'vitest';
import { openZarr, type ZarrVolume } from '../../pkg/zarr/index.js';
import { failure, rejection } from './helpers.js';
import { changed, DIMS, filesOf, type ImageServer, serveImage, storeOf, type TestStore, zipOf } from './zarr-stores.js';

type Triple = [number, number, number];

const WHOLE = { min: [0, 0, 0] as Triple, max: [...DIMS] as Triple };

/** One chunk of level 0, and its file in the images on `zyx` that ome-zarr wrote. */
const CHUNK = { min: [0, 0, 0] as Triple, max: [11, 9, 6] as Triple };
const CHUNK_FILE = '/s0/c/0/0/0';

const httpError = (status: number) => Object.assign(new Error(`status ${status}`), { status });

/** Rejects never, resolves never. */
const stall = () => new Promise<never>(() => {});

async function voxels(zarr: ZarrVolume, box = WHOLE, options?: { signal?: AbortSignal }): Promise<number[]> {
  return [...(await zarr.voxels(0, box, options)).data];
}

/** The voxels of level 0, read without faults. */
async function truth(image: string): Promise<number[]> {
  return voxels(await openZarr(zipOf(image)));
}

/** Returns the reason that a promise rejects with. */
const reasonOf = (promise: Promise<unknown>): Promise<unknown> =>
  promise.then(
    () => 'resolved',
    (reason) => reason,
  );

/** Returns whole numbers below `limit`, the same for each seed. */
function random(seed: number): (limit: number) => number {
  let state = seed;
  return (limit) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * limit);
  };
}

describe('requests that fail', () => {
  test('are repeated if the server fails, the connection is lost, or nothing comes', async () => {
    const faults = [
      () => Promise.reject(httpError(503)),
      () => Promise.reject(new Error('Unexpected response status 500 Internal Server Error')),
      () => Promise.reject(new TypeError('fetch failed')),
      () => Promise.reject(httpError(429)),
      stall,
    ];
    for (const fault of faults) {
      const store = await storeOf('v3-zstd-zyx');
      store.fault = async (_, bytes, request) => (request === 1 ? fault() : bytes);
      const zarr = await openZarr(store, { retries: 1, timeoutMs: 100 });
      expect(await voxels(zarr, CHUNK)).toHaveLength(11 * 9 * 6);
      expect([...store.requests.values()]).toEqual([...store.requests.keys()].map(() => 2));
      expect(store.open).toBe(0);
    }
  });

  test('are given up after the last repetition, and may be made again', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const zarr = await openZarr(store, { retries: 2 });
    store.fault = () => Promise.reject(httpError(500));
    const error = await rejection(zarr.region(0, CHUNK));
    expect(error.code).toBe('unavailable');
    expect(error.message).toBe(`${CHUNK_FILE}: status 500; 3 attempts`);
    expect(store.requests.get(CHUNK_FILE)).toBe(3);
    store.fault = async (_, bytes) => bytes;
    expect(await voxels(zarr)).toEqual(await truth('v3-zstd-zyx'));
  });

  test('are not repeated if they were refused', async () => {
    for (const status of [400, 401, 403, 410]) {
      const store = await storeOf('v3-zstd-zyx');
      const zarr = await openZarr(store);
      store.fault = () => Promise.reject(httpError(status));
      const error = await rejection(zarr.region(0, CHUNK));
      expect(error.code).toBe('unavailable');
      expect(error.message).toBe(`${CHUNK_FILE}: status ${status}`);
      expect(store.requests.get(CHUNK_FILE)).toBe(1);
    }
  });

  test('end all others of the same call', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const zarr = await openZarr(store);
    store.fault = (key) => (key === '/s0/c/0/1/1' ? Promise.reject(httpError(403)) : stall());
    expect((await rejection(zarr.region(0, WHOLE))).message).toContain('status 403');
    await expect.poll(() => store.open).toBe(0);
  });

  test('leave what was read in the cache', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const zarr = await openZarr(store, { concurrency: 1 });
    store.fault = (key, bytes) => (key === '/s0/c/1/0/0' ? Promise.reject(httpError(403)) : Promise.resolve(bytes));
    await rejection(zarr.region(0, WHOLE));
    expect(zarr.loaded()[0]?.chunks).toBe(9);
    store.fault = async (_, bytes) => bytes;
    await zarr.region(0, WHOLE);
    expect(store.requests.get(CHUNK_FILE)).toBe(1);
    expect(store.requests.get('/s0/c/1/0/0')).toBe(2);
  });
});

test('a chunk that is missing has the fill value', async () => {
  const store = await changed('v3-zstd-zyx', '/s0/zarr.json', (json) => {
    json.fill_value = 77;
  });
  const expected = await truth('v3-zstd-zyx');
  store.fault = async (key, bytes) => (key === '/s0/c/1/1/1' ? undefined : bytes);
  const values = await voxels(await openZarr(store));
  const [nx, ny] = DIMS;
  for (const [at, value] of values.entries()) {
    const [x, y, z] = [at % nx, Math.floor(at / nx) % ny, Math.floor(at / nx / ny)];
    const isMissing = Math.floor(x / 11) === 1 && Math.floor(y / 9) === 1 && Math.floor(z / 6) === 1;
    if (value !== (isMissing ? 77 : expected[at])) throw new Error(`voxel ${x}, ${y}, ${z}: ${value}`);
  }
});

describe('damaged chunks', () => {
  const IMAGES = {
    'v2-blosc-tczyx': '/s0/0/0/0/0/0',
    'v2-gzip-fortran': '/scale0/image/0.0.0',
    'v3-zstd-zyx': '/s0/c/0/0/0',
    'v3-raw-float': '/scale0/image/c/0/0/0',
    'v3-sharded-gzip': '/scale0/image/c/0/0/0',
    'v3-sharded-zstd-yxzc': '/scale0/image/c/0/0/0/0',
  };

  test.each(Object.entries(IMAGES))('%s: a truncated one is found, whatever its length', async (image, file) => {
    const store = await storeOf(image);
    const whole = (await storeOf(image)).get(file as `/${string}`);
    const { length } = (await whole) as Uint8Array;
    for (const left of [0, 1, 7, Math.floor(length / 2), length - 1]) {
      // All reads of parts of a truncated shard are cut, too.
      store.fault = async (key, bytes) => (key === file ? bytes?.slice(0, Math.min(left, bytes.length - 1)) : bytes);
      const error = await rejection((await openZarr(store)).region(0, CHUNK));
      expect([left, error.code, error.message]).toEqual([left, 'bad-file', expect.stringMatching(/trunc|voxels/)]);
    }
  });

  test('noise in place of a chunk is found, or has as many voxels', async () => {
    const next = random(1);
    for (const [image, file] of Object.entries(IMAGES)) {
      const store = await storeOf(image);
      store.fault = async (key, bytes) => (key === file ? bytes?.map(() => next(256)) : bytes);
      const found = await reasonOf((await openZarr(store)).region(0, CHUNK));
      if (image === 'v3-raw-float') expect(found).toBe('resolved');
      else expect(found).toMatchObject({ code: 'bad-file', message: expect.stringContaining('OME-Zarr') });
    }
  });

  test('a codec that is unknown or another one is named', async () => {
    const unknown = await changed('v3-zstd-zyx', '/s0/zarr.json', ({ codecs }) => {
      codecs.at(-1).name = 'jpeg-xl';
    });
    expect((await rejection((await openZarr(unknown)).region(0, CHUNK))).message).toMatch(
      /^OME-Zarr: array "s0", chunk 0,0,0: unsupported codec "jpeg-xl"; supported: blosc, lz4, zstd, gzip/,
    );
    const another = await changed('v3-zstd-zyx', '/s0/zarr.json', ({ codecs }) => {
      codecs.at(-1).name = 'gzip';
    });
    expect((await rejection((await openZarr(another)).region(0, CHUNK))).message).toMatch(
      /^OME-Zarr: array "s0", chunk 0,0,0: truncated, damaged, or not encoded with "gzip"/,
    );
  });
});

describe('metadata that lies', () => {
  /** Name, property that is changed (its path in the JSON), its value (none to delete it), and what is said. */
  type Lie = [string, string, unknown, RegExp];

  async function told(file: `/${string}`, [, path, value]: Lie, base = ''): Promise<void> {
    const names = `${base}${path}`.split('.');
    const last = names.pop() as string;
    const store = await changed('v3-zstd-zyx', file, (json) => {
      const parent = names.reduce((object, name) => object[name], json);
      if (value === undefined) delete parent[last];
      else parent[last] = value;
    });
    await openZarr(store);
  }

  const FILES: Lie[] = [
    ['an array', 'node_type', 'array', /group "\/"/],
    ['no image', 'attributes.ome', undefined, /multiscales: missing; must be the group of an image/],
    ['no attributes', 'attributes', undefined, /multiscales: missing/],
    ['a list that is empty', 'attributes.ome.multiscales', [], /multiscales: must be a list/],
    ['version', 'attributes.ome.version', '0.6', /version "0.6"; supported are 0.4 and 0.5/],
    ['a series', 'attributes.ome', { 'bioformats2raw.layout': 3 }, /path of one, such as "0"/],
  ];

  const scale = (index: number) => `datasets.${index}.coordinateTransformations.0.scale`;
  const IMAGES: Lie[] = [
    ['no axes', 'axes', undefined, /axes: must be a list/],
    ['axes as text', 'axes', ['z', 'y', 'x'], /axes: must be a list/],
    ['axis twice', 'axes.0.name', 'x', /axes: repeated, got x, y, x/],
    [
      'many axes',
      'axes',
      Array.from({ length: 140_000 }, () => ({ name: 'x', type: 'space' })),
      /axes: repeated, got [x, ]{199}…$/,
    ],
    ['no x', 'axes.2', { name: 't', type: 'time' }, /must include x and y/],
    ['unknown axis', 'axes.0.name', 'depth', /axes\[0\]: must be x, y or z .*got "depth"/],
    ['type', 'axes.0.type', 'time', /axes\[0\]: .*got "z" of type "time"/],
    ['one unit unknown', 'axes.0.unit', 'voxel', /axes\[0\].unit: must be a unit of length/],
    ['unit', 'axes.1.unit', 'pixel', /axes\[1\].unit: .*got "pixel"/],
    ['too many axes', 'axes.3', { name: 'c', type: 'channel' }, /scale: must be 4 finite numbers/],
    [
      'negative scale',
      scale(0),
      [0.2, -0.1, 0.1],
      /datasets\[0\].*scale: all numbers must be > 0, got \[0.2,-0.1,0.1\]/,
    ],
    ['zero scale', scale(0), [0.2, 0, 0.1], /must be > 0/],
    ['scale of NaN', scale(0), [0.2, null, 0.1], /must be 3 finite numbers/],
    ['short scale', scale(0), [0.2, 0.1], /must be 3 finite numbers, one for each axis, got \[0.2,0.1\]/],
    ['scale as text', scale(0), '0.2', /must be 3 finite numbers, one for each axis, got "0.2"/],
    ['scale of level 1', scale(1), [0.47, 0.6, 0.3], /array "s1": must show the same part of the world.* along y/],
    ['coarse to fine', scale(0), [0.94, 0.6, 0.6], /array "s1": must not be finer along x/],
    ['no scale', 'datasets.1.coordinateTransformations', undefined, /datasets\[1\].*missing/],
    ['rotation', 'datasets.0.coordinateTransformations.0.type', 'rotation', /must be "scale", .*got "rotation"/],
    ['no datasets', 'datasets', [], /datasets: must be a list/],
    [
      'many datasets',
      'datasets',
      Array.from({ length: 99 }, () => ({})),
      /datasets: must be at most 32 levels, got 99/,
    ],
    ['inherited name of an axis', 'axes.0.name', 'constructor', /axes\[0\]: must be x, y or z .*got "constructor"/],
    ['inherited name of a unit', 'axes.1.unit', 'toString', /axes\[1\].unit: .*got "toString"/],
    ['no path', 'datasets.0.path', undefined, /datasets\[0\].path: must be a string/],
    ['wrong path', 'datasets.2.path', 's7', /array "s7": Not found/],
    ['path of a group', 'datasets.2.path', '.', /array "\."/],
    ['shift', 'coordinateTransformations', [{ type: 'translation', translation: [1] }], /\[0\].translation: must be 3/],
    ['no list', 'coordinateTransformations', { type: 'identity' }, /coordinateTransformations: must be a list/],
    ['no step', 'coordinateTransformations', [null], /coordinateTransformations\[0\].type/],
  ];

  const chunkShape = 'chunk_grid.configuration.chunk_shape';
  const ARRAYS: Lie[] = [
    ['shape', 'shape', [14, 44, 26], /array "s1": must show the same part of the world/],
    ['too few axes', 'shape', [14, 22], /array "s0".shape: must be 3 whole numbers above 0/],
    ['negative shape', 'shape', [14, -22, 26], /array "s0".shape/],
    ['fraction', 'shape', [14, 22.5, 26], /array "s0".shape/],
    ['shape as text', 'shape', '14,22,26', /array "s0"/],
    ['chunk of nothing', chunkShape, [6, 0, 11], /array "s0".chunk_shape/],
    ['chunk axes', chunkShape, [6, 9], /array "s0"/],
    ['no chunks', 'chunk_grid', undefined, /array "s0": cannot be read/],
    ['no codecs', 'codecs', undefined, /array "s0": cannot be read/],
    ['text', 'data_type', 'string', /array "s0".data_type: must be one of uint8, .*got "string"/],
    ['half precision', 'data_type', 'float16', /array "s0": .*float16/],
    ['unknown type', 'data_type', 'quaternion', /array "s0": .*quaternion/],
    ['another type', 'data_type', 'uint16', /array "s1": must have the voxel type of level 0, u16/],
    ['no array', 'node_type', 'group', /array "s0"/],
  ];

  const expectBad = async (work: Promise<unknown>, message: RegExp) => {
    const error = await rejection(work);
    expect(error.code).toBe('bad-file');
    expect(error.message).toMatch(message);
  };

  test.each(FILES)('of the group: %s', (...lie) => expectBad(told('/zarr.json', lie), lie[3]));
  const IMAGE = 'attributes.ome.multiscales.0.';
  test.each(IMAGES)('of the image: %s', (...lie) => expectBad(told('/zarr.json', lie, IMAGE), lie[3]));
  test.each(ARRAYS)('of an array: %s', (...lie) => expectBad(told('/s0/zarr.json', lie), lie[3]));

  test('no JSON, or none with properties', async () => {
    await expectBad(openZarr(await changed('v3-zstd-zyx', '/zarr.json', () => '{')), /group "\/".*JSON/);
    await expectBad(openZarr(await changed('v3-zstd-zyx', '/zarr.json', () => 'null')), /group "\/": cannot be read/);
    await expectBad(openZarr(await changed('v3-zstd-zyx', '/s1/zarr.json', () => '7')), /array "s1"/);
  });

  test('chunks larger than they are said to be, or smaller', async () => {
    for (const chunk of [
      [6, 9, 12],
      [6, 9, 10],
      [5, 9, 11],
    ]) {
      const store = await changed('v3-zstd-zyx', '/s0/zarr.json', (json) => {
        json.chunk_grid.configuration.chunk_shape = chunk;
      });
      const error = await rejection((await openZarr(store)).region(0, CHUNK));
      expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining('got 594')]);
    }
  });

  test('chunks that do not fit into memory', async () => {
    const store = await changed('v3-zstd-zyx', '/s0/zarr.json', (json) => {
      json.chunk_grid.configuration.chunk_shape = [14, 1e5, 1e5];
    });
    expect((await rejection(openZarr(store))).code).toBe('too-large');
  });

  test('shards whose index is longer than the file, or does not fit', async () => {
    for (const inner of [
      [1, 1, 1],
      [5, 7, 3],
      [24, 18, 22],
    ]) {
      const store = await changed('v3-sharded-gzip', '/scale0/image/zarr.json', ({ codecs }) => {
        codecs[0].configuration.chunk_shape = inner;
      });
      const error = await rejection(openZarr(store).then((zarr) => zarr.region(0, CHUNK)));
      expect(error.code).toBe('bad-file');
      // Half a shard: positions beyond the index.
      if (inner[0] === 5) expect(error.message).toContain('the index of the shard is damaged');
    }
  });
});

test('an image of 10⁹ chunks takes no memory for each', async () => {
  const store = await changed('v3-zstd-zyx', '/s0/zarr.json', (json) => {
    json.shape = [100_000, 100_000, 100_000];
    json.chunk_grid.configuration.chunk_shape = [100, 100, 100];
    json.fill_value = 5;
  });
  const one = await changed('v3-zstd-zyx', '/zarr.json', ({ attributes }) => {
    attributes.ome.multiscales[0].datasets.length = 1;
  });
  const get = store.get.bind(store);
  store.get = (key, options) => (key === '/zarr.json' ? one.get(key, options) : get(key, options));
  const before = process.memoryUsage().heapUsed;
  const zarr = await openZarr(store);
  expect(zarr.loaded()).toEqual([{ chunks: 0, bytes: 0, of: { chunks: 1e9, bytes: 1e15 } }]);
  const region = await zarr.region(0, { min: [99_950, 50_050, 0], max: [100_000, 50_150, 20] });
  expect(region.range).toEqual([5, 5]);
  expect(zarr.loaded()[0]?.chunks).toBe(2);
  expect(process.memoryUsage().heapUsed - before).toBeLessThan(50e6);
  for (const size of [1700, 100_000]) {
    const error = await rejection(zarr.region(0, { min: [0, 0, 0], max: [size, size, size] }));
    expect([error.code, error.message]).toEqual(['too-large', expect.stringContaining(`${size} × ${size} × ${size}`)]);
  }
});

describe('chunks', () => {
  test('are requested once at a time, and not again while they are in the cache', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const zarr = await openZarr(store);
    const box = { min: [5, 5, 5] as Triple, max: [20, 20, 14] as Triple };
    const [one, other] = await Promise.all([voxels(zarr), zarr.voxels(0, box), voxels(zarr)]);
    expect(one).toEqual(await truth('v3-zstd-zyx'));
    expect(other?.dims).toEqual([15, 15, 9]);
    await zarr.region(0, WHOLE);
    const chunks = [...store.requests].filter(([key]) => key.startsWith('/s0/c/'));
    expect(chunks).toHaveLength(27);
    for (const [, requests] of chunks) expect(requests).toBe(1);
    expect(zarr.loaded()[0]).toEqual({ chunks: 27, bytes: 26 * 22 * 14, of: { chunks: 27, bytes: 26 * 22 * 14 } });
  });

  test('used longest ago leave the cache first', async () => {
    const store = await storeOf('v3-zstd-zyx');
    // Room for two whole chunks.
    const zarr = await openZarr(store, { cache: 2 * 11 * 9 * 6 });
    const at = (x: number) => ({ min: [x, 0, 0] as Triple, max: [x + 1, 1, 1] as Triple });
    // The chunk at 22 is smaller, but there is no room for it beside two others.
    for (const x of [0, 11, 0, 22, 0, 22, 11]) await zarr.region(0, at(x));
    const counts = [0, 1, 2].map((x) => store.requests.get(`/s0/c/0/0/${x}`));
    expect(counts).toEqual([1, 2, 1]);
    const none = await storeOf('v3-zstd-zyx');
    const uncached = await openZarr(none, { cache: 0 });
    for (let i = 0; i < 3; i++) await uncached.region(0, CHUNK);
    expect(none.requests.get(CHUNK_FILE)).toBe(3);
    expect(uncached.loaded()[0]?.chunks).toBe(1);
  });

  test.each([1, 3, 8])('at most %i requests at the same time, and that many', async (concurrency) => {
    for (const image of ['v3-zstd-zyx', 'v3-sharded-gzip']) {
      const store = await storeOf(image);
      store.fault = (_, bytes) => new Promise((resolve) => setTimeout(() => resolve(bytes), 1));
      const zarr = await openZarr(store, { concurrency });
      await Promise.all([zarr.region(0, WHOLE), zarr.region(1, { min: [0, 0, 0], max: [13, 11, 7] })]);
      expect(store.most).toBe(concurrency);
    }
  });

  test('may arrive in any order', async () => {
    for (const image of ['v2-blosc-tczyx', 'v3-zstd-zyx', 'v3-sharded-gzip']) {
      const expected = await truth(image);
      for (let seed = 0; seed < 20; seed++) {
        const next = random(seed);
        const store = await storeOf(image);
        const waiting: (() => void)[] = [];
        store.fault = async (_, bytes) => {
          await new Promise<void>((resolve) => waiting.push(resolve));
          return bytes;
        };
        const timer = setInterval(() => waiting.splice(next(waiting.length), 1)[0]?.(), 0);
        const zarr = await openZarr(store, { concurrency: 1 + next(20) });
        expect(await voxels(zarr)).toEqual(expected);
        clearInterval(timer);
      }
    }
  });
});

describe('an abort', () => {
  test('is listened for once, however many requests there are: Node warns of eleven listeners', async () => {
    const warnings: string[] = [];
    const note = ({ name }: Error) => warnings.push(name);
    process.on('warning', note);
    const store = await storeOf('v3-zstd-zyx');
    // All chunks at a time, and 30 of them wait.
    store.fault = async (_, bytes) => new Promise((resolve) => setTimeout(() => resolve(bytes), 1));
    await voxels(await openZarr(store, { concurrency: 12 }));
    await new Promise((resolve) => setTimeout(resolve));
    process.off('warning', note);
    expect(store.most).toBeGreaterThan(10);
    expect(warnings).toEqual([]);
  });

  /** Aborts when the request of a number begins; opens an image, and reads all of it. */
  async function abortedAt(image: string, number: number): Promise<[unknown, unknown, TestStore]> {
    const store = await storeOf(image);
    const stop = new AbortController();
    const reason = new Error('enough');
    let requests = 0;
    store.fault = async (_, bytes) => {
      requests += 1;
      if (requests === number) stop.abort(reason);
      if (requests === number) await stall();
      await new Promise((resolve) => setTimeout(resolve));
      return bytes;
    };
    const { signal } = stop;
    const work = openZarr(store, { signal }).then((zarr) => voxels(zarr, WHOLE, { signal }));
    return [await reasonOf(work), reason, store];
  }

  test.each(['v2-gzip-fortran', 'v3-zstd-zyx', 'v3-sharded-gzip'])(
    '%s: leaves no request, at any moment',
    async (image) => {
      let number = 1;
      for (; ; number++) {
        const [outcome, reason, store] = await abortedAt(image, number);
        if (outcome === 'resolved') break;
        expect(outcome).toBe(reason);
        expect(store.open).toBe(0);
      }
      expect(number).toBeGreaterThan(20);
    },
  );

  test('is not lost while zarrita is imported, before the first request', async () => {
    const store = await storeOf('v3-zstd-zyx');
    store.fault = stall;
    const stop = new AbortController();
    const opening = reasonOf(openZarr(store, { signal: stop.signal, retries: 0, timeoutMs: 2000 }));
    stop.abort('enough');
    expect(await opening).toBe('enough');
    expect(store.open).toBe(0);
  });

  test('ends pauses between repetitions, and waiting for a slot', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const zarr = await openZarr(store, { concurrency: 2 });
    store.fault = () => Promise.reject(httpError(500));
    const started = performance.now();
    const signal = AbortSignal.timeout(100);
    expect(await reasonOf(zarr.region(0, WHOLE, { signal }))).toBe(signal.reason);
    expect(performance.now() - started).toBeLessThan(5000);
    store.fault = async (_, bytes) => bytes;
    expect(await voxels(zarr)).toEqual(await truth('v3-zstd-zyx'));
  });

  test('in the moment in which a slot becomes free does not lose it', async () => {
    for (let delay = 0; delay < 40; delay++) {
      const store = await storeOf('v3-zstd-zyx');
      const zarr = await openZarr(store, { concurrency: 1 });
      const stop = new AbortController();
      const abort = async () => {
        for (let i = 0; i < delay; i++) await undefined;
        stop.abort('enough');
      };
      store.fault = async (_, bytes) => {
        await new Promise((resolve) => setTimeout(resolve));
        // The second region waits for the slot of this request.
        abort();
        return bytes;
      };
      const first = voxels(zarr, CHUNK);
      const second = reasonOf(voxels(zarr, { min: [11, 0, 0], max: [22, 9, 6] }, { signal: stop.signal }));
      await Promise.all([first, second]);
      store.fault = async (_, bytes) => bytes;
      expect(await voxels(zarr, { min: [0, 9, 0], max: [1, 10, 1] })).toHaveLength(1);
    }
  });

  test('does not end the requests that another caller waits for', async () => {
    for (const image of ['v3-zstd-zyx', 'v3-sharded-gzip']) {
      const store = await storeOf(image);
      const zarr = await openZarr(store);
      const stop = new AbortController();
      store.fault = async (_, bytes) => {
        await new Promise((resolve) => setTimeout(resolve, 5));
        return bytes;
      };
      const aborted = reasonOf(voxels(zarr, WHOLE, { signal: stop.signal }));
      const other = voxels(zarr, { min: [5, 5, 5], max: [20, 20, 12] });
      await new Promise((resolve) => setTimeout(resolve, 2));
      stop.abort('enough');
      expect(await aborted).toBe('enough');
      expect(await other).toHaveLength(15 * 15 * 7);
      for (const [key, requests] of store.requests) {
        // The index of a shard and each chunk in it are one request each.
        if (!key.endsWith('json')) expect(requests).toBeLessThanOrEqual(image === 'v3-zstd-zyx' ? 1 : 9);
      }
    }
  });

  test('of whoever asked first for the index of a shard does not harm those who wait for it', async () => {
    const store = await storeOf('v3-sharded-gzip');
    const zarr = await openZarr(store);
    const stop = new AbortController();
    const [give, given] = [[] as (() => void)[], async () => {}];
    store.fault = async (_, bytes) => {
      await new Promise<void>((resolve) => give.push(resolve));
      return bytes;
    };
    const first = reasonOf(voxels(zarr, CHUNK, { signal: stop.signal }));
    await given();
    const second = voxels(zarr, { min: [11, 0, 0], max: [22, 9, 6] });
    await new Promise((resolve) => setTimeout(resolve, 1));
    expect(store.open).toBe(1);
    stop.abort('enough');
    expect(await first).toBe('enough');
    const timer = setInterval(() => give.shift()?.());
    expect(await second).toHaveLength(11 * 9 * 6);
    clearInterval(timer);
  });

  test('before the call rejects at once', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const signal = AbortSignal.abort('no');
    expect(await reasonOf(openZarr(store, { signal }))).toBe('no');
    const zarr = await openZarr(store);
    const { size } = store.requests;
    expect(await reasonOf(zarr.region(0, WHOLE, { signal }))).toBe('no');
    expect(store.requests.size).toBe(size);
  });

  test('by free() ends all', async () => {
    const store = await storeOf('v3-zstd-zyx');
    const zarr = await openZarr(store);
    store.fault = stall;
    const regions = [zarr.region(0, WHOLE), zarr.voxels(1, CHUNK)].map(rejection);
    await new Promise((resolve) => setTimeout(resolve, 1));
    expect(store.open).toBeGreaterThan(0);
    zarr.free();
    for (const error of await Promise.all(regions)) expect(error.code).toBe('freed');
    expect(store.open).toBe(0);
    expect((await rejection(zarr.region(0, WHOLE))).code).toBe('freed');
    expect(failure(() => zarr.loaded()).code).toBe('freed');
    expect(failure(() => zarr.range).code).toBe('freed');
    zarr.free();
  });
});

describe('a server', () => {
  let server: ImageServer | undefined;
  afterEach(async () => {
    await server?.close();
    server = undefined;
  });

  test.each(['v2-blosc-tczyx', 'v3-zstd-zyx', 'v3-sharded-gzip'])('gives the voxels of %s', async (image) => {
    server = await serveImage(image);
    const zarr = await openZarr(`${server.url}`, { concurrency: 4 });
    expect(await voxels(zarr)).toEqual(await truth(image));
    expect(server.most()).toBeLessThanOrEqual(4);
    // Each chunk is one request, and the index of each shard two.
    expect(server.log.filter((line) => /s(cale)?0\/(image\/)?(c|0)\//.test(line))).toHaveLength(
      image === 'v3-sharded-gzip' ? 27 + 8 * 2 : 27,
    );
    expect(new Set(server.log).size).toBe(server.log.length);
  });

  test('that fails, drops connections or sends parts only is asked again', async () => {
    server = await serveImage('v3-sharded-gzip');
    const seen = new Map<string, number>();
    server.answer = ({ method, url, headers }, response) => {
      const key = `${method} ${url} ${headers.range}`;
      const count = seen.size;
      if (seen.has(key)) return false;
      seen.set(key, 1);
      if (count % 3 === 0) response.writeHead(503).end('busy');
      if (count % 3 === 1) response.destroy();
      if (count % 3 === 2) {
        response.writeHead(206, { 'Content-Length': 1000 }).write('only this');
        setTimeout(() => response.destroy(), 5);
      }
      return true;
    };
    // The index of a shard takes two requests, each of which fails once.
    const zarr = await openZarr(server.url, { retries: 2 });
    expect(await voxels(zarr)).toEqual(await truth('v3-sharded-gzip'));
  });

  test('that says nothing, or stops in the middle, fails after the time limit', async () => {
    server = await serveImage('v3-zstd-zyx');
    const zarr = await openZarr(new URL(`${server.url}/`), { retries: 1, timeoutMs: 100 });
    server.answer = () => true;
    const error = await rejection(zarr.region(0, CHUNK));
    expect([error.code, error.message]).toEqual(['unavailable', `${CHUNK_FILE}: no data for 0.1 s; 2 attempts`]);
    server.answer = (_, response) => response.writeHead(200, { 'Content-Length': 1000 }).write('begin');
    expect((await rejection(zarr.region(0, CHUNK))).message).toContain('no data for 0.1 s');
    await expect.poll(server.open).toBe(0);
    server.answer = () => false;
    expect(await voxels(zarr)).toEqual(await truth('v3-zstd-zyx'));
  });

  test('that is slow but sends something is waited for', async () => {
    server = await serveImage('v3-raw-float');
    // Takes longer in all, and is never silent for a tenth of it, also on a busy machine.
    const zarr = await openZarr(server.url, { retries: 0, timeoutMs: 2000 });
    const store = await storeOf('v3-raw-float');
    const bytes = (await store.get('/scale0/image/c/0/0/0')) as Uint8Array;
    server.answer = (_, response) => {
      response.writeHead(200, { 'Content-Length': bytes.length });
      let sent = 0;
      const timer = setInterval(() => {
        response.write(bytes.slice(sent, sent + 99));
        sent += 99;
        if (sent >= bytes.length) response.end(() => clearInterval(timer));
      }, 100);
      return true;
    };
    expect(await voxels(zarr, CHUNK)).toHaveLength(11 * 9 * 6);
  });

  test('whose chunk is missing gives the fill value', async () => {
    server = await serveImage('v3-zstd-zyx');
    server.answer = ({ url }, response) => !!url?.endsWith('/s0/c/0/0/0') && !!response.writeHead(404).end('none');
    expect(await voxels(await openZarr(server.url), CHUNK)).toEqual(new Array(11 * 9 * 6).fill(0));
  });

  test('that refuses is named with its status, and not asked again', async () => {
    server = await serveImage('v3-zstd-zyx');
    const zarr = await openZarr(server.url);
    const before = server.log.length;
    server.answer = (_, response) => !!response.writeHead(403).end('no');
    const error = await rejection(zarr.region(0, CHUNK));
    expect(error.message).toBe(`${CHUNK_FILE}: ${server.url}${CHUNK_FILE}: 403 Forbidden`);
    expect(server.log.length).toBe(before + 1);
    expect((await rejection(openZarr(server.url))).message).toContain('403 Forbidden');
  });

  test('that refuses keys which are missing is read if there is Zarr 2', async () => {
    server = await serveImage('v2-blosc-tczyx');
    server.answer = ({ url }, response) => {
      if (!url?.endsWith('zarr.json')) return false;
      response.writeHead(403).end();
      return true;
    };
    expect(await voxels(await openZarr(server.url))).toEqual(await truth('v2-blosc-tczyx'));
  });

  test('without byte ranges, or lengths of files, is named', async () => {
    server = await serveImage('v3-sharded-gzip');
    const faults: [ImageServer['answer'], string][] = [
      [({ headers }, response) => !!headers.range && !!response.writeHead(200).end('all'), 'ignores byte ranges'],
      [({ method }, response) => method === 'HEAD' && !!response.writeHead(200).end(), 'does not tell the length'],
      [({ method }, response) => method === 'HEAD' && !!response.writeHead(405).end(), '405 Method Not Allowed'],
    ];
    const zarr = await openZarr(server.url);
    for (const [fault, message] of faults) {
      server.answer = fault;
      const error = await rejection(zarr.region(0, CHUNK));
      expect([error.code, error.message]).toEqual(['unavailable', expect.stringContaining(message)]);
    }
    server.answer = () => false;
    expect(await voxels(zarr)).toEqual(await truth('v3-sharded-gzip'));
  });

  test('that is not there is named', async () => {
    server = await serveImage('v3-zstd-zyx');
    const { url } = server;
    await server.close();
    server = undefined;
    const error = await rejection(openZarr(url, { retries: 1 }));
    expect([error.code, error.message]).toEqual(['unavailable', expect.stringMatching(/^\/zarr.json: .*2 attempts$/)]);
  });

  test('has no request left when all is aborted', async () => {
    server = await serveImage('v3-zstd-zyx');
    const zarr = await openZarr(server.url);
    const before = server.log.length;
    server.answer = (_, response) => response.writeHead(200, { 'Content-Length': 1000 }).write('begin');
    const stop = new AbortController();
    const region = reasonOf(zarr.region(0, WHOLE, { signal: stop.signal }));
    await expect.poll(server.open).toBe(8);
    stop.abort('enough');
    expect(await region).toBe('enough');
    await expect.poll(server.open).toBe(0);
    expect(server.log.length).toBe(before + 8);
  });
});

describe('an image does not lead elsewhere:', () => {
  test.each(['./http://127.0.0.1:9/x', '%2F%2F127.0.0.1:9/x', '../other'])('path %s', async (path) => {
    const server = await serveImage('v3-zstd-zyx');
    const json = JSON.parse(new TextDecoder().decode((await filesOf('v3-zstd-zyx')).get('/zarr.json')));
    json.attributes.ome.multiscales[0].datasets[1].path = path;
    server.answer = ({ url }, response) => {
      if (url !== '/image/zarr.json') return false;
      response.end(JSON.stringify(json));
      return true;
    };
    const error = await rejection(openZarr(server.url));
    expect(error.message).toMatch(/outside of the image at|Not found/);
    expect(server.log.filter((line) => !line.includes('/image/'))).toEqual([]);
    await server.close();
  });

  test('a redirect', async () => {
    const [server, other] = [await serveImage('v3-zstd-zyx'), await serveImage('v3-zstd-zyx')];
    server.answer = ({ url }, response) => {
      response.writeHead(302, { Location: other.url + url?.slice('/image'.length) }).end();
      return true;
    };
    const error = await rejection(openZarr(server.url));
    expect([error.code, error.message]).toEqual(['unavailable', expect.stringContaining('redirected to')]);
    expect(other.log).toEqual([]);
    await server.close();
    await other.close();
  });
});
