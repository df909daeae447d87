// The deformable model on OME-Zarr images of which it reads only what is around its surface.
import { expect, test } from 'vitest';
import * as zarrita from 'zarrita';
import { type DataReport, DeformableModel, NeedsDataError, type StepReport, Volume } from '../../pkg/index.js';
import { SPARSE_SOURCE, type SparseSource, sparseSource } from '../../pkg/sparse.js';
import { openZarr, type ZarrOptions, type ZarrVolume } from '../../pkg/zarr/index.js';
import { failure, HEALTHY, rejection, wrong } from './helpers.js';
import { storeOf, TestStore } from './zarr-stores.js';

const SIZE = 96;
const RADIUS = 30;
const CAVITY = 12;
const CENTRE = 46.3;

/** Intensity at a position in voxels of level 0: a ball (200) with a cavity. */
function intensity(x: number, y: number, z: number, soft: number): number {
  const r = Math.hypot(x - CENTRE, y - CENTRE, z - CENTRE);
  const inside = Math.min(RADIUS - r, r - CAVITY) / soft + 0.5;
  return Math.round(200 * Math.min(1, Math.max(0, inside)));
}

const attributes = (levels: number) => ({
  ome: {
    version: '0.5',
    multiscales: [
      {
        axes: ['z', 'y', 'x'].map((name) => ({ name, type: 'space', unit: 'micrometer' })),
        datasets: Array.from({ length: levels }, (_, level) => ({
          path: `s${level}`,
          coordinateTransformations: [
            { type: 'scale', scale: new Array(3).fill(2 ** level) },
            { type: 'translation', translation: new Array(3).fill((2 ** level - 1) / 2) },
          ],
        })),
      },
    ],
  },
});

/** Returns the files of an image with three levels, in chunks of a size. */
async function imageOf(chunk: number): Promise<Map<string, Uint8Array>> {
  const files = new Map<string, Uint8Array>();
  const root = zarrita.root(files as never);
  await zarrita.create(root as never, { attributes: attributes(3) });
  for (let level = 0; level < 3; level++) {
    const size = SIZE / 2 ** level;
    const data = new Uint8Array(size ** 3);
    const at = (i: number) => (i + 0.5) * 2 ** level - 0.5;
    for (let i = 0; i < data.length; i++) {
      const [x, y, z] = [i % size, Math.floor(i / size) % size, Math.floor(i / size / size)];
      data[i] = intensity(at(x), at(y), at(z), 2 ** level);
    }
    const array = await zarrita.create(root.resolve(`s${level}`) as never, {
      ...{ shape: [size, size, size], chunkShape: [chunk, chunk, chunk], dtype: 'uint8', codecs: [] },
    });
    await zarrita.set(array, null, { data, shape: [size, size, size], stride: [size * size, size, 1] } as never);
  }
  return files;
}

const IMAGES = new Map(
  await Promise.all([13, 16, 32, 96].map(async (chunk) => [chunk, await imageOf(chunk)] as const)),
);

const storeOfChunks = (chunk: number): TestStore => new TestStore(IMAGES.get(chunk) as Map<string, Uint8Array>);

const open = (chunk: number, options?: ZarrOptions) => openZarr(storeOfChunks(chunk), options);

const PARAMS = { iso: 100, isoForce: -1 };

function bits({ mesh }: DeformableModel): string {
  const { positions, indices } = mesh.arrays();
  const bytes = (array: Float32Array | Uint32Array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength);
  return `${bytes(positions).toString('base64')} ${bytes(indices).toString('base64')}`;
}

/** Runs a model on an image to its end, and returns its surface. */
async function surface(image: ZarrVolume): Promise<string> {
  const model = new DeformableModel({ volume: image, params: PARAMS });
  expect((await model.run()).done).toBe(true);
  const result = bits(model);
  model.free();
  return result;
}

/** The surface of a run for which all voxels were in memory from the start. */
async function reference(): Promise<string> {
  const image = await open(96);
  const source = sparseSource(image) as SparseSource;
  const voxels = await Promise.all(
    image.levels.map(async ({ dims }, level) => (await image.voxels(level, { min: [0, 0, 0], max: [...dims] })).data),
  );
  const create = () => {
    const volume = source.create();
    for (const [level, { dims }] of image.levels.entries()) {
      volume.use((raw) => raw.insert(level, new Uint32Array(3), Uint32Array.from(dims), voxels[level]));
    }
    return volume;
  };
  const whole = {
    ...image,
    [SPARSE_SOURCE]: () => ({ ...source, create, read: () => Promise.reject('nothing is read') }),
  };
  return surface(wrong(whole));
}

const REFERENCE = await reference();

test('the surface is that of the object, with its cavity', async () => {
  const image = await open(16);
  const model = new DeformableModel({ volume: image, params: PARAMS });
  const levels = new Set<number>();
  const report = await model.run({ onStep: () => levels.add(model.level) });
  expect([report.components, report.euler]).toEqual([2, 4]);
  expect(model.mesh.check()).toMatchObject(HEALTHY);
  const exact = ((4 / 3) * Math.PI * (RADIUS ** 3 - CAVITY ** 3)) / 1e9;
  expect(model.mesh.info().volume / exact).toBeCloseTo(1, 1.5);
  expect([...levels]).toEqual([2, 1, 0]);
  // Positions are in millimetres.
  const { positions } = model.mesh.arrays();
  const r = Array.from({ length: positions.length / 3 }, (_, i) =>
    Math.hypot(...[0, 1, 2].map((axis) => (positions[3 * i + axis] as number) * 1e3 - CENTRE)),
  );
  expect(Math.max(...r)).toBeLessThan(RADIUS + 0.6);
  expect(Math.min(...r)).toBeGreaterThan(CAVITY - 0.6);
});

test('a model can be created in slices, with the same bits, and not if that is aborted', async () => {
  const image = await open(16);
  const whole = new DeformableModel({ volume: image, params: PARAMS });
  const sliced = await DeformableModel.create({ volume: image, params: PARAMS }, { budgetMs: 0.1 });
  expect(bits(sliced)).toBe(bits(whole));
  expect((await sliced.run()).done).toBe(true);
  expect(bits(sliced) === REFERENCE).toBe(true);
  for (const model of [whole, sliced]) model.free();
  const stop = new AbortController();
  // Runs only if the creation lets it.
  setTimeout(() => stop.abort(new Error('enough')));
  const options = { signal: stop.signal, budgetMs: 0.1 };
  await expect(DeformableModel.create({ volume: image }, options)).rejects.toThrow('enough');
  const error = await rejection(DeformableModel.create({ volume: image, levels: 1 }));
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('levels')]);
  image.free();
});

test('the bits do not depend on chunks, their order, the cache or interruptions', async () => {
  for (const chunk of IMAGES.keys()) expect((await surface(await open(chunk))) === REFERENCE, `${chunk}`).toBe(true);
  for (let seed = 1; seed <= 20; seed++) {
    let state = seed;
    const next = () => {
      state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
      return state / 2 ** 32;
    };
    const store = storeOfChunks(seed % 2 ? 16 : 13);
    const image = await openZarr(store, { concurrency: 1 + (seed % 9), cache: seed % 3 ? 2e5 : 0 });
    store.fault = async (_, bytes) => {
      if (next() < 0.5) await new Promise((resolve) => setTimeout(resolve, 2 * next()));
      return bytes;
    };
    expect((await surface(image)) === REFERENCE, `seed ${seed}`).toBe(true);
  }
});

test('a step that needs data says so, changes nothing, and can be made once they are read', async () => {
  const store = storeOfChunks(16);
  const image = await openZarr(store);
  const model = new DeformableModel({ volume: image, params: PARAMS });
  let [asked, steps] = [0, 0];
  for (let report: StepReport | undefined; !report?.done; ) {
    const before = [bits(model), model.mesh.geometryVersion, model.mesh.topologyVersion, model.level];
    try {
      report = model.step();
      steps += 1;
    } catch (error) {
      expect(error).toBeInstanceOf(NeedsDataError);
      expect((error as NeedsDataError).code).toBe('needs-data');
      expect([bits(model), model.mesh.geometryVersion, model.mesh.topologyVersion, model.level]).toEqual(before);
      const { size } = store.requests;
      await (error as NeedsDataError).load();
      expect(store.requests.size).toBeGreaterThanOrEqual(size);
      asked += 1;
    }
  }
  expect(bits(model) === REFERENCE).toBe(true);
  expect(asked).toBeGreaterThanOrEqual(2);
  // A step asks for more than it reads, so that asking is rare.
  expect(asked).toBeLessThan(steps);
});

test('a run tells what it reads, and reads only what is near the surface', async () => {
  const image = await open(13);
  const reports: DataReport[] = [];
  const model = new DeformableModel({ volume: image, params: PARAMS });
  await model.run({ onData: (report) => void reports.push(report) });
  const loaded = image.loaded();
  const last = reports.at(-1) as DataReport;
  expect(last.waiting).toBe(0);
  expect(last.bytes).toBe(loaded.reduce((sum, { bytes }) => sum + bytes, 0));
  expect(last.chunks).toBe(loaded.reduce((sum, { chunks }) => sum + chunks, 0));
  for (const [i, { bytes }] of reports.entries()) expect(bytes).toBeGreaterThanOrEqual(reports[i - 1]?.bytes ?? 0);
  const [finest, , coarsest] = loaded;
  expect(coarsest?.chunks).toBe(coarsest?.of.chunks);
  expect(finest?.chunks).toBeGreaterThan(0);
  expect((finest?.chunks as number) / (finest?.of.chunks as number)).toBeLessThan(0.8);
});

test('a run that is aborted or loses its connection keeps the surface, and another one continues', async () => {
  const store = storeOfChunks(16);
  const image = await openZarr(store, { retries: 0 });
  const model = new DeformableModel({ volume: image, params: PARAMS });
  const stop = new AbortController();
  store.fault = (key, bytes) => {
    if (key.startsWith('/s1/')) stop.abort('enough');
    return key.startsWith('/s1/') ? new Promise(() => {}) : Promise.resolve(bytes);
  };
  expect(await model.run({ signal: stop.signal }).catch((reason: unknown) => reason)).toBe('enough');
  expect(store.open).toBe(0);
  const coarse = bits(model);
  store.fault = async (key, bytes) => {
    if (key.startsWith('/s0/')) throw new TypeError('connection lost');
    return bytes;
  };
  const lost = await rejection(model.run());
  expect([lost.code, lost.message]).toEqual(['unavailable', expect.stringMatching(/^\/s0\/c\/.*: connection lost$/)]);
  expect(store.open).toBe(0);
  expect(model.level).toBeLessThan(2);
  expect(bits(model) === coarse).toBe(false);
  expect(model.mesh.check()).toMatchObject(HEALTHY);
  store.fault = async (_, bytes) => bytes;
  expect((await model.run()).done).toBe(true);
  expect(bits(model) === REFERENCE).toBe(true);
});

test('a saved run continues in a model of the same image, which reads what it needs', async () => {
  const model = new DeformableModel({ volume: await open(16), params: PARAMS });
  const saved: Uint8Array[] = [];
  await model.run({ onStep: () => void saved.push(model.save()) });
  const middle = saved[Math.floor(saved.length / 2)] as Uint8Array;
  const image = await open(13);
  const restored = new DeformableModel({ volume: image });
  restored.restore(middle);
  expect(restored.save()).toEqual(middle);
  expect((await restored.run()).done).toBe(true);
  expect(bits(restored) === REFERENCE).toBe(true);
  // Undo: back to the same state.
  restored.restore(middle);
  expect((await restored.run()).done).toBe(true);
  expect(bits(restored) === REFERENCE).toBe(true);
  const other = new DeformableModel({ volume: image, finest: 1 });
  expect(failure(() => other.restore(middle)).code).toBe('bad-file');
});

test('a run ends at the level that is asked for', async () => {
  const image = await open(16);
  const model = new DeformableModel({ volume: image, finest: 1, params: PARAMS });
  expect((await model.run()).done).toBe(true);
  expect(image.loaded().map(({ chunks }) => chunks > 0)).toEqual([false, true, true]);
});

test('inside a box finer levels are followed, outside not', async () => {
  const image = await open(16);
  const end = CENTRE - 20;
  const box = { min: [-1, -1, -1] as [number, number, number], max: [end / 1e3, 1, 1] as [number, number, number] };
  const model = new DeformableModel({ volume: image, box, params: PARAMS });
  expect((await model.run()).done).toBe(true);
  const whole = await open(16);
  await surface(whole);
  const [part, all] = [image, whole].map((one) => one.loaded()[0]?.chunks as number) as [number, number];
  expect(part / all).toBeGreaterThan(0.1);
  expect(part / all).toBeLessThan(0.6);
  // Edges are four times as long on level 2. Caps of the ball of the same height have the same area.
  const x = model.mesh.arrays().positions.filter((_, i) => i % 3 === 0);
  const inside = x.filter((x) => x * 1e3 < end - 3).length;
  const outside = x.filter((x) => x * 1e3 > 2 * CENTRE - end + 3).length;
  expect(inside / outside).toBeGreaterThan(4);
  expect(model.mesh.check()).toMatchObject(HEALTHY);
});

test('options are checked', async () => {
  const image = await open(16);
  const volume = new Volume({ data: new Uint8Array(4096).fill(1, 0, 2000), dims: [16, 16, 16] });
  const box = { min: [0, 0, 0], max: [1, 1, 1] };
  const given: [object, RegExp][] = [
    [{ volume: image, frame: 0 }, /frame: not for volumes larger than memory/],
    [{ volume: image, levels: 1 }, /levels: not for volumes/],
    [{ volume, finest: 0 }, /finest: only for volumes larger than memory/],
    [{ volume, box }, /box: only for volumes/],
    [{ volume: image, finest: 3 }, /finest/],
    [{ volume: image, finest: -1 }, /finest: must be an integer/],
    [{ volume: image, box: { min: [0, 0], max: [1, 1, 1] } }, /box.min: must be 3 numbers/],
    [{ volume: image, box: { ...box, size: 1 } }, /size: unknown property of box/],
    [{ volume: image, box: { ...box, outside: 0.5 } }, /box.outside: must be an integer/],
    [{ volume: image, box: { min: [1, 0, 0], max: [0, 1, 1] } }, /box|within/],
    [{ volume: image, params: { iso: NaN } }, /iso/],
    [{ volume: { levels: [] } }, /volume: must be a Volume/],
  ];
  for (const [options, message] of given) {
    const error = failure(() => new DeformableModel(wrong(options)));
    expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringMatching(message)]);
  }
  const model = new DeformableModel({ volume: image });
  expect((await rejection(model.run(wrong({ onData: 1 })))).message).toContain('onData: must be a function');
  expect((await rejection(model.run(wrong({ onDate: () => {} })))).message).toContain('onDate: unknown property');
  expect(failure(() => model.refresh({ min: [0, 0, 0], dims: [1, 1, 1] })).code).toBe('invalid-argument');
  image.free();
  expect(failure(() => new DeformableModel({ volume: image })).code).toBe('freed');
  expect((await rejection(model.run())).code).toBe('freed');
  model.free();
  expect((await rejection(model.run())).code).toBe('freed');
});

test('a model that is freed while it waits rejects, and so does one whose image is freed', async () => {
  for (const what of ['model', 'image'] as const) {
    const store = storeOfChunks(16);
    const image = await openZarr(store);
    const model = new DeformableModel({ volume: image, params: PARAMS });
    store.fault = async (_, bytes) => {
      await new Promise((resolve) => setTimeout(resolve, 5));
      return bytes;
    };
    const run = rejection(model.run());
    await expect.poll(() => store.open).toBeGreaterThan(0);
    if (what === 'model') model.free();
    else image.free();
    const error = await run;
    expect([error.code, error.message]).toEqual([
      'freed',
      expect.stringContaining(what === 'model' ? 'DeformableModel' : 'ZarrVolume'),
    ]);
    await expect.poll(() => store.open).toBe(0);
  }
});

test('images of ome-zarr and zarr-python, with and without shards, give the same surface', async () => {
  const surfaces = new Set<string>();
  for (const name of ['v2-blosc-tczyx', 'v3-zstd-zyx'])
    surfaces.add(await surface(await openZarr(await storeOf(name))));
  expect(surfaces.size).toBe(1);
  const sharded = new DeformableModel({ volume: await openZarr(await storeOf('v3-sharded-gzip')), params: PARAMS });
  expect((await sharded.run()).done).toBe(true);
});
