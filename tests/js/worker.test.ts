// The package in a worker, in Node: the same results as without, and features of its own.
import { execFileSync } from 'node:child_process';
import { getEventListeners } from 'node:events';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { Worker as NodeWorker } from 'node:worker_threads';
import { afterAll, beforeEach, expect, test } from 'vitest';
import * as vesicle from '../../pkg/index.js';
import init, * as worker from '../../pkg/worker.js';
import { rejection, wrong } from './helpers.js';
import { SPONGE_BITS, spongeBits } from './sponge.js';

const root = fileURLToPath(new URL('../../', import.meta.url));
const pkg = new URL('../../pkg/', import.meta.url);
const data = ballOf(24, 7);
const DIMS: vesicle.Vec3 = [24, 24, 24];
const PARAMS: vesicle.DeformableParams = { iso: 100, isoForce: -1, rigidity: 0.2 };

/** The worker's API. Code written for it also runs without a worker, since awaiting a plain value does no harm. */
type Library = typeof worker;

function ballOf(size: number, radius: number): Uint8Array {
  const middle = (size - 1) / 2;
  return Uint8Array.from({ length: size ** 3 }, (_, i) => {
    const place = [i % size, Math.floor(i / size) % size, Math.floor(i / size ** 2)];
    return 200 * Math.min(1, Math.max(0, radius + 0.5 - Math.hypot(...place.map((x) => x - middle))));
  });
}

/** Returns a model that runs for tens of thousands of steps, for tests that end a run. */
function restless(): worker.DeformableModel {
  const volume = new worker.Volume({ data, dims: DIMS });
  const start = { seeds: Float32Array.of(12, 12, 12), radius: 2 };
  const params = { ...PARAMS, integrator: 'euler', energyTolerance: 1e-12, maxMove: 0.01, timeStep: 0.01 } as const;
  return new worker.DeformableModel({ volume, start, params });
}

beforeEach(() => init());
afterAll(() => worker.terminate());

/** Scenarios that use all features of each class, from construction to results. */
const SCENES: Record<string, (library: Library) => Promise<unknown>> = {
  functions: async ({ version, paramSpecs, parsePoints, animationGlb, Mesh }) => [
    await version(),
    await paramSpecs('tracking'),
    await parsePoints(new TextEncoder().encode('0 0 0 1 0 0\n1 0 0 0 1 0\n')),
    await animationGlb([await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })], { frameSeconds: 1 }),
  ],
  volume: async ({ Volume }) => {
    const made = new Volume({ data, dims: DIMS, spacing: [1, 1, 2], slope: 2, space: 'LPS' });
    const volume = await Volume.parse(await made.toNifti());
    const several = await Volume.fromFrames([made, made], { frameSeconds: 0.5 });
    const { dims, frames, frameSeconds, spacing, affine, space, unit, range } = several;
    return [
      await Promise.all([dims, frames, frameSeconds, spacing, affine, space, unit, range]),
      await Promise.all([several.histogram({ bins: 4, frame: 1 }), several.sample([1, 2, 3]), several.slice(2, 12)]),
      await several.intensities(1),
      await made.toNifti(),
      await Promise.all((await volume.pyramid(3)).map((level) => level.intensities())),
      await (await volume.binned([2, 2, 1])).intensities(),
      await (await volume.enrichSlices({ factor: 2 })).intensities(),
    ];
  },
  labels: async ({ Volume }) => {
    const map = new Volume({ data: data.map((value) => Math.round(value / 100)), dims: DIMS, slope: 2 });
    const other = new Volume({ data: data.map((value) => Math.round(value / 150)), dims: DIMS, slope: 2 });
    const region = { min: [1, 2, 3], dims: [2, 1, 1], data: Uint8Array.of(1, 3) } as const;
    await map.write({ ...region, min: [...region.min], dims: [...region.dims] });
    const part = await map.crop({ min: [2, 4, 6], max: [20, 20, 20] });
    return [
      await Promise.all([map.labels(), map.range, map.dice(other), map.dice(other, { label: 2 })]),
      await (await map.label([2, 4])).intensities(),
      await (await map.threshold(1, 3)).intensities(),
      await (await map.resample({ like: part, interpolation: 'nearest' })).intensities(),
      await (await part.resample({ dims: [5, 6, 7] })).intensities(),
      await (await map.frame(0)).toBytes('nrrd', { gzip: true }),
    ];
  },
  mesh: async ({ Mesh, Volume }) => {
    const ball = await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.4 });
    const { positions, indices } = await ball.arrays();
    const uvs = Float32Array.from({ length: (2 * positions.length) / 3 }, (_, i) => (i % 7) / 7);
    const textured = await Mesh.fromArrays(positions, indices, { uvs });
    const parsed = await Mesh.parse(await textured.toBytes('ply'));
    const found = await Mesh.marchingCubes(new Volume({ data, dims: DIMS }), 100);
    await found.remesh({ min: 0.5, max: 1.5 });
    await found.inSlices().decimate(300);
    const copy = await found.clone();
    await copy.refine();
    const moved = await copy.restructure({ min: 0.6, max: 2 }, ['flip']);
    const smoothed = await found.clone();
    await smoothed.smooth({ iterations: 2 });
    await smoothed.transform([-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 24, 0, 0, 1]);
    const half = await found.clone();
    await half.cut({ origin: [12, 12, 12], normal: [1, 2, 3] });
    await half.removeCavities();
    await half.keepComponents([0]);
    const grid = new Volume({ data, dims: DIMS });
    const distances = await smoothed.toVolume(grid, { kind: 'distance' });
    return [
      await parsed.arrays(),
      await (await textured.splitAtSeams()).arrays(),
      await half.arrays(),
      await Promise.all((await found.components()).map((part) => part.info())),
      [moved, await copy.check(), await copy.curvature('mean'), await copy.geodesic(0)],
      await Promise.all([found.vertexCount, found.triangleCount, found.topologyVersion, found.geometryVersion]),
      await Promise.all([ball.texture, ball.pick([3, 0.1, 0], [-1, 0, 0]), ball.pick([3, 0, 0], [1, 0, 0])]),
      await Promise.all([ball.inSlices().distanceTo(parsed), ball.crossSection([0, 0, 0.1], [0, 0, 1])]),
      await Promise.all([smoothed.arrays(), distances.intensities(), smoothed.contains(positions)]),
    ];
  },
  deformable: async ({ DeformableModel, Mesh, Volume }) => {
    const start = await Mesh.icosphere({ center: [12, 12, 12], radius: 3, maxEdge: 2 });
    const volume = new Volume({ data, dims: DIMS });
    const model = new DeformableModel({ volume, start, levels: 1, params: PARAMS });
    const heard: number[] = [];
    const report = await model.run({
      maxIterations: 12,
      budgetMs: 1,
      onStep: ({ iteration }) => heard.push(iteration),
    });
    await model.setAttractors([{ point: [20, 12, 12], strength: 1, radius: 6 }]);
    await model.setParams({ rigidity: 0.3 });
    const state = await model.save();
    const { iteration } = await model.step(4);
    await model.restore(state);
    await model.step(4);
    const shares: number[] = [];
    const coverage = await model.coverage({ onProgress: (share) => shares.push(share) });
    await volume.write({ min: [4, 5, 6], dims: [2, 1, 2], data: data.slice(0, 4).fill(255) });
    await model.refresh({ min: [4, 5, 6], dims: [2, 1, 2] });
    await model.step(2);
    return [
      [heard, iteration, report.events, report.phase, state],
      [coverage, shares, (await model.seed()).events],
      await Promise.all([model.level, model.delta, model.params, model.speeds(), model.mesh.arrays()]),
    ];
  },
  implicit: async ({ DeformableModel, ImplicitSurface }) => {
    // On a spiral on a sphere.
    const points = Float32Array.from({ length: 360 }, (_, at) => {
      const z = 1 - (2 * Math.floor(at / 3) + 1) / 120;
      const turned = 2.4 * Math.floor(at / 3) + (at % 3 === 1 ? Math.PI / 2 : 0);
      return at % 3 === 2 ? z : Math.sqrt(1 - z * z) * Math.cos(turned);
    });
    const surface = new ImplicitSurface({ points, params: { cell: 0.2 } });
    const { residual } = await surface.run();
    await surface.setEdits({ added: Float32Array.of(0, 0, 1.2) });
    await surface.run();
    const volume = await surface.inSlices().toVolume([12, 12, 12]);
    expect(await volume.intensities()).toEqual(await (await surface.toVolume([12, 12, 12])).intensities());
    const next = new DeformableModel({ volume, params: { iso: 0, isoForce: -1 } });
    await next.step(3);
    return [
      [
        residual,
        await surface.mesh.arrays(),
        await surface.edits,
        await surface.constraints(),
        await surface.fitness(),
      ],
      await Promise.all([
        surface.cell,
        surface.spacing,
        surface.duplicates,
        surface.outliers,
        surface.spuriousComponents,
        surface.warning,
      ]),
      await Promise.all([surface.evaluate(points), surface.gradient(points), surface.params]),
      [await (await surface.preview()).vertexCount, await next.mesh.arrays()],
    ];
  },
  tracker: async ({ SurfaceTracker, Volume }) => {
    const frames = [7, 6.5, 6].map((radius) => new Volume({ data: ballOf(24, radius), dims: DIMS }));
    const sequence = await (await Volume.fromFrames(frames)).inSlices().enrichSlices({ factor: 1 });
    const tracker = await SurfaceTracker.create({ volume: sequence, params: { window: 1 } });
    const proposal = await SurfaceTracker.propose(await Volume.fromFrames(frames), {});
    const { phase } = await tracker.run();
    return [
      await Promise.all([
        phase,
        tracker.frame,
        tracker.frames,
        tracker.noise,
        tracker.cycleClosureError,
        tracker.statistics,
        proposal,
      ]),
      await Promise.all([tracker.boundary(1), tracker.volumes(), tracker.toGlb(), tracker.params]),
      await (await tracker.meshAt(1)).arrays(),
    ];
  },
  labelSurfaces: async ({ LabelSurfaces, Volume }) => {
    const volume = new Volume({ data: Uint8Array.of(1, 1, 2, 0, 2, 2, 0, 0), dims: [2, 2, 2] });
    const surfaces = new LabelSurfaces({ volume, smoothing: 10 });
    const { components } = await surfaces.run();
    await volume.write({ min: [1, 1, 1], dims: [1, 1, 1], data: Uint8Array.of(3) });
    await surfaces.refresh({ min: [1, 1, 1], dims: [1, 1, 1] });
    const { done } = await surfaces.step(9);
    return [components, done, await surfaces.labels, await (await surfaces.mesh(3)).arrays()];
  },
  multires: async ({ MultiresolutionModel }) => {
    const ball = (x: number): vesicle.ControlEllipsoid => ({
      center: [x, 0, 0],
      axes: [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
      ],
    });
    const model = new MultiresolutionModel({ ellipsoids: [ball(0)], params: { edgeMin: 0.2, edgeMax: 0.45 } });
    await model.step(2);
    await model.setEllipsoids([ball(0.5)]);
    await model.step(2);
    return [
      await Promise.all([model.mesh, model.baseMesh, model.linkMesh].map((mesh) => mesh.arrays())),
      await Promise.all((await model.levelMeshes()).map((level) => level.vertexCount)),
      await Promise.all([
        model.ellipsoids,
        model.targets,
        model.bandCount,
        model.folded,
        model.unmatchedVertices,
        model.heldVertices,
      ]),
      await model.distortion(),
    ];
  },
};

test.each(Object.entries(SCENES))('%s: the same as without a worker', async (_, scene) => {
  await vesicle.default();
  const here = await scene(vesicle as unknown as Library);
  expect(await scene(worker)).toEqual(here);
});

test('two hundred steps give the same bits as the native core', { tags: ['long'] }, async () => {
  expect(await spongeBits(worker)).toBe(SPONGE_BITS);
});

test('all names of the package are exported, and objects have no other members', async () => {
  const names = Object.keys(vesicle).filter((name) => name !== 'initSync');
  expect(Object.keys(worker).sort()).toEqual([...names, 'terminate', 'transfer'].sort());
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  expect(mesh).toBeInstanceOf(worker.Mesh);
  expect(mesh.constructor.name).toBe('Mesh');
  expect(wrong(mesh).then).toBeUndefined();
  expect(wrong(mesh).anything).toBeUndefined();
});

test('errors arrive as VesicleErrors with code and message', async () => {
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  const refused = await rejection(mesh.decimate(-1));
  expect([refused.code, refused.message.slice(0, 15), refused.name]).toEqual([
    'invalid-argument',
    'targetTriangles',
    'VesicleError',
  ]);
  expect((await rejection(worker.Mesh.parse(new Uint8Array(9)))).code).toBe('bad-file');
  expect((await rejection(worker.paramSpecs(wrong('magic')))).message).toContain('magic');
});

test('an object whose construction fails rejects all calls, and create itself rejects', async () => {
  const volume = new worker.Volume({ data, dims: [1, 1, 1] });
  expect((await rejection(volume.range)).message).toContain('dims');
  const model = new worker.DeformableModel({ volume, params: PARAMS });
  for (const asked of [model.step(), model.mesh.arrays()]) expect((await rejection(asked)).message).toContain('dims');
  expect((await rejection(worker.Volume.create({ data, dims: [1, 1, 1] }))).message).toContain('dims');
  const made = await worker.Volume.create({ data, dims: DIMS });
  expect(await made.dims).toEqual(DIMS);
  expect((await rejection(wrong(new (wrong(worker.Mesh))()).info())).message).toContain('icosphere');
  const remote = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  await vesicle.default();
  const own = vesicle.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  expect(() => own.distanceTo(wrong(remote))).toThrow(/^other: is a Mesh in a worker; .* pass on its arrays/);
});

test('arguments that cannot be sent are refused by name', async () => {
  const volume = new worker.Volume({ data, dims: DIMS });
  const loop: Record<string, unknown> = {};
  loop.again = loop;
  const cases: [unknown, string][] = [
    [new vesicle.VesicleError('aborted', ''), 'volume: a VesicleError cannot be sent'],
    [() => 1, 'volume: a function cannot be sent'],
    [loop, 'objects are nested too deeply'],
  ];
  for (const [value, message] of cases) {
    const model = new worker.DeformableModel({ volume: wrong(value) });
    expect((await rejection(model.step())).message).toContain(message);
  }
  const misspelled = new worker.DeformableModel({ volume, ...wrong({ level: 2 }) });
  expect((await rejection(misspelled.step())).message).toContain('level');
});

test('an aborted measurement of coverage rejects with the reason, and measuring works during a run', async () => {
  const model = restless();
  const reason = { because: 'of this' };
  const abort = new AbortController();
  const stopped = model.coverage({ signal: abort.signal, onProgress: () => abort.abort(reason) });
  await expect(stopped).rejects.toBe(reason);
  await expect(model.coverage({ signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  expect((await rejection(model.coverage(wrong({ onProgress: 1 })))).message).toContain('onProgress');
  const thrown = new Error('mine');
  const failing = model.coverage({
    onProgress: () => {
      throw thrown;
    },
  });
  await expect(failing).rejects.toBe(thrown);
  const running = new AbortController();
  const run = model.run({ signal: running.signal, budgetMs: 1 });
  expect((await rejection(model.seed())).message).toContain('during a run');
  const { recall, precision } = await model.coverage();
  expect([recall, precision].every((share) => share >= 0 && share <= 1 + 1e-9)).toBe(true);
  running.abort('done');
  await expect(run).rejects.toBe('done');
  model.free();
  expect((await rejection(model.coverage())).code).toBe('freed');
});

test('an aborted run rejects with the reason, and the model can continue', async () => {
  const model = restless();
  const abort = new AbortController();
  const reason = new Error('enough');
  const heard: number[] = [];
  const run = model.run({
    signal: abort.signal,
    onStep: ({ iteration }) => {
      heard.push(iteration);
      if (iteration === 3) abort.abort(reason);
    },
  });
  await expect(run).rejects.toBe(reason);
  expect(heard).toEqual([1, 2, 3]);
  const { iteration, done } = await model.step();
  expect([iteration > 3, done]).toEqual([true, false]);
  await expect(model.run({ signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
});

test('an error thrown by onStep ends the run', async () => {
  const model = restless();
  const thrown = new Error('mine');
  const run = model.run({
    onStep: () => {
      throw thrown;
    },
  });
  await expect(run).rejects.toBe(thrown);
  expect((await model.step()).done).toBe(false);
});

test('during a run parameters can change, and other calls are refused', async () => {
  const model = restless();
  const abort = new AbortController();
  const run = model.run({ signal: abort.signal, budgetMs: 1 });
  await model.setParams({ rigidity: 0.4 });
  expect((await model.params).rigidity).toBe(0.4);
  expect((await rejection(model.run())).message).toContain('during a run');
  expect((await rejection(model.step())).message).toContain('during a run');
  expect((await rejection(model.run({ signal: wrong('now') }))).message).toContain('AbortSignal');
  abort.abort('done');
  await expect(run).rejects.toBe('done');
});

test('operations of meshes in slices are aborted, and refuse other changes meanwhile', async () => {
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.03 });
  const before = await mesh.arrays();
  const abort = new AbortController();
  const slices = mesh.inSlices({ signal: abort.signal, budgetMs: 1e-6 });
  const work = slices.decimate(1000);
  expect((await rejection(mesh.refine())).message).toContain('refine: not allowed while this mesh is changed');
  expect((await rejection(slices.remesh({ min: 1, max: 1 }))).message).toContain('edge.max');
  expect(() => mesh.inSlices(wrong({ budgetMs: 0 }))).toThrow('budgetMs');
  abort.abort('enough');
  await expect(work).rejects.toBe('enough');
  await expect(slices.decimate(1000)).rejects.toBe('enough');
  expect(await mesh.arrays()).toEqual(before);
  await mesh.inSlices().decimate(1000);
  expect(await mesh.triangleCount).toBeLessThanOrEqual(1000);
});

test('a multiresolution model is created in slices, and the creation is aborted', async () => {
  const detail = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.05 });
  const stop = new AbortController();
  const work = worker.MultiresolutionModel.create({ detail }, { signal: stop.signal, budgetMs: 1e-6 });
  stop.abort('enough');
  await expect(work).rejects.toBe('enough');
  const model = await worker.MultiresolutionModel.create({ detail });
  expect(await model.mesh.vertexCount).toBe(await detail.vertexCount);
});

test('arrays are copied, or transferred on request', async () => {
  const [kept, given, inside] = [data.slice(), data.slice(), data.slice()];
  const all = new Uint8Array(2 * data.length);
  all.set(data, data.length);
  const volumes = [
    new worker.Volume({ data: kept, dims: DIMS }),
    new worker.Volume({ data: all.subarray(data.length), dims: DIMS }),
    new worker.Volume({ data: worker.transfer(given), dims: DIMS }),
    new worker.Volume(worker.transfer({ data: inside, dims: DIMS })),
  ];
  for (const volume of volumes) expect(await volume.intensities()).toEqual(Float32Array.from(data));
  expect([kept, all, given, inside].map(({ length }) => length)).toEqual([data.length, 2 * data.length, 0, 0]);
  const again = new worker.Volume({ data: given, dims: DIMS });
  expect((await rejection(again.dims)).message).toContain('already transferred');
  const shared = new Uint8Array(new SharedArrayBuffer(data.length));
  expect((await rejection(worker.Volume.create({ data: worker.transfer(shared), dims: DIMS }))).message).toContain(
    'shared',
  );
});

test('only the part of a buffer that an array covers is sent', async () => {
  const sent: Uint8Array[] = [];
  const own = hostOf();
  const post = own.postMessage.bind(own);
  own.postMessage = (message, transfer) => {
    if (message.body?.name === 'parse') sent.push(message.body.args[0]);
    post(message, transfer);
  };
  worker.terminate();
  await init({ worker: own });
  const large = new Uint8Array(1 << 20);
  await rejection(worker.Volume.parse(large.subarray(5, 9)));
  await rejection(worker.Volume.parse(Buffer.from('abc')));
  // Transferred, and therefore empty: they were copies, not the caller's arrays.
  expect(sent.map(({ length }) => length)).toEqual([0, 0]);
  expect(large.length).toBe(1 << 20);
  worker.terminate();
});

test('results are transferred', async () => {
  // Answers with the number of transferred buffers instead of the result.
  const own = hostOf(`
    const { parentPort } = await import('node:worker_threads');
    const post = parentPort.postMessage.bind(parentPort);
    parentPort.postMessage = (message, buffers) => post({ ...message, value: buffers.length });`);
  await answerTo(own, 'init');
  const mesh = { vesicle: -1, class: 'Mesh' };
  await answerTo(own, 'call', { on: 'Mesh', name: 'icosphere', args: [[0, 0, 0], 1, 1] });
  expect((await answerTo(own, 'call', { on: mesh, name: 'arrays' })).value).toBe(3);
  expect((await answerTo(own, 'call', { on: mesh, name: 'toBytes', args: ['stl'] })).value).toBe(1);
  await own.terminate();
});

test('copyTo reuses the same memory if it is large enough', async () => {
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 });
  const { positions, normals, indices } = await mesh.arrays();
  const out = { positions: new Float32Array(9999), normals: new Float32Array(), indices: new Uint32Array(9999) };
  const before = out.positions;
  const counts = mesh.copyTo(out);
  expect([out.positions.length, before.length]).toEqual([0, 0]);
  expect(await counts).toEqual({ vertices: positions.length / 3, triangles: indices.length / 3 });
  expect([out.positions.length, out.normals.length, out.indices.length]).toEqual([9999, normals.length, 9999]);
  expect(out.positions.subarray(0, positions.length)).toEqual(positions);
  expect(out.indices.subarray(0, indices.length)).toEqual(indices);
  // While the buffers are in the worker, new ones replace them.
  expect(await Promise.all([mesh.copyTo(out), mesh.copyTo(out)])).toEqual([await counts, await counts]);
  expect(out.positions.subarray(0, positions.length)).toEqual(positions);
  mesh.free();
  const { indices: kept } = out;
  expect((await rejection(mesh.copyTo(out))).code).toBe('freed');
  expect((await rejection(mesh.copyTo(wrong({ ...out, colours: kept })))).message).toContain('colours');
  expect(out.indices).toBe(kept);
  expect(kept.length).toBeGreaterThan(0);
});

test('the live mesh is one object that follows the model', async () => {
  const model = restless();
  const { mesh } = model;
  const before = await mesh.geometryVersion;
  await model.step(3);
  expect(model.mesh).toBe(mesh);
  expect(await mesh.geometryVersion).toBeGreaterThan(before);
  mesh.free();
  expect((await mesh.info()).components).toBe(1);
  expect((await mesh.distanceTo(await mesh.clone())).hausdorff).toBe(0);
  model.free();
  expect((await rejection(mesh.info())).code).toBe('freed');
});

test('freed objects are refused, as targets and as arguments', async () => {
  const volume = await worker.Volume.create({ data, dims: DIMS });
  const model = new worker.DeformableModel({ volume, params: PARAMS });
  volume.free();
  volume[Symbol.dispose]();
  expect((await rejection(volume.range)).message).toContain('this Volume was freed');
  expect((await rejection(worker.Mesh.marchingCubes(volume, 1))).code).toBe('freed');
  expect((await model.step()).iteration).toBe(1);
  const lasting = restless();
  const run = lasting.run();
  lasting.free();
  expect((await rejection(run)).code).toBe('freed');
});

/** Starts the worker's host script by hand; `before` runs in it first. */
function hostOf(before = ''): NodeWorker {
  const script = `${before}; import(${JSON.stringify(new URL('worker-host.js', pkg).href)});`;
  return new NodeWorker(`(async () => { ${script} })()`, { eval: true });
}

/** Sends a raw request, which the library itself would not send, and returns the answer. */
async function answerTo(
  own: NodeWorker,
  kind: 'init' | 'make' | 'call',
  body?: object,
): Promise<{ failure?: { message: string }; value?: unknown }> {
  const answer = new Promise<object>((resolve) => own.once('message', resolve));
  own.postMessage({ id: 1, kind, body: body && { args: [], ...body } });
  return answer;
}

test('names that are not in the tables are refused', async () => {
  const own = hostOf();
  await answerTo(own, 'init');
  const mesh = { vesicle: 7, class: 'Volume' };
  await answerTo(own, 'make', { as: mesh, args: [{ data, dims: DIMS }] });
  const calls = [
    { on: mesh, name: 'constructor' },
    { on: mesh, name: '__proto__' },
    { on: mesh, name: 'toString' },
    { on: mesh, name: 'free' },
    { on: { ...mesh, part: 'constructor' }, name: 'info' },
    { on: { ...mesh, part: 'dims' }, name: 'info' },
    { on: 'Volume', name: 'constructor' },
    { on: 'Volume', name: 'prototype' },
    { on: 'constructor', name: 'assign' },
    { on: 'VesicleError', name: 'captureStackTrace' },
    { name: 'default' },
    { name: 'hasOwnProperty' },
  ];
  for (const call of calls) {
    const { failure } = await answerTo(own, 'call', call);
    expect(failure?.message, JSON.stringify(call)).toMatch(/no such member|not an object/);
  }
  const { failure } = await answerTo(own, 'make', { as: { vesicle: 8, class: 'constructor' } });
  expect(failure?.message).toContain('no such member');
  const polluting = JSON.parse('[{ "__proto__": { "levels": 3 } }]');
  expect((await answerTo(own, 'call', { on: 'Volume', name: 'parse', args: polluting })).failure).toBeDefined();
  expect((await answerTo(own, 'call', { on: mesh, name: 'dims' })).value).toEqual(DIMS);
  await own.terminate();
});

/** Makes `info` of meshes fail like a trap in the module, and `check` throw where nothing catches it. */
const FAULTY = `
  const { RawMesh } = await import(${JSON.stringify(new URL('vesicle.js', pkg).href)});
  RawMesh.prototype.info = () => { throw new WebAssembly.RuntimeError('unreachable'); };
  RawMesh.prototype.check = () => { setImmediate(() => { throw new Error('no more'); }); return {}; };`;

async function crashOf(promise: Promise<unknown>): Promise<string> {
  const error = await promise.catch((reason) => reason);
  expect(error).toBeInstanceOf(worker.VesicleCrash);
  return (error as Error).message;
}

test('a crash of the module rejects all calls, until init starts a new worker', async () => {
  worker.terminate();
  await init({ worker: hostOf(FAULTY) });
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  const run = restless().run();
  const [crash, waiting] = await Promise.all([crashOf(mesh.info()), crashOf(run)]);
  expect(crash).toMatch(/^unreachable\. This is a fault in vesicle/);
  expect(waiting).toBe(crash);
  expect(await crashOf(mesh.arrays())).toBe(crash);
  expect(await crashOf(worker.version())).toBe(crash);
  await init();
  expect((await rejection(mesh.info())).message).toContain('was lost');
  mesh.free();
  expect((await (await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })).info()).genus).toBe(0);
});

test('a worker that exits by itself rejects all pending calls', async () => {
  worker.terminate();
  await init({ worker: hostOf(FAULTY) });
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  // Whether the answer still arrives depends on the system.
  const check = mesh.check().catch(() => undefined);
  expect(await crashOf(restless().run())).toContain('no more');
  await check;
  const own = hostOf();
  await init({ worker: own });
  const waiting = crashOf(restless().run());
  await own.terminate();
  expect(await waiting).toContain('exited with code');
  await init();
  expect(await worker.version()).toBeTruthy();
});

test('terminate rejects pending calls, and init starts again', async () => {
  const model = restless();
  const run = rejection(model.run());
  worker.terminate();
  expect((await run).code).toBe('aborted');
  expect((await rejection(model.step())).code).toBe('aborted');
  const called = [rejection(init()), worker.terminate()];
  expect((await (called[0] as Promise<vesicle.VesicleError>)).code).toBe('aborted');
  const first = init();
  expect(init()).toBe(first);
  await first;
  expect((await rejection(model.step())).message).toContain('was lost');
  expect(await worker.version()).toBeTruthy();
});

test('a failed start gives the reason, and the next one works', async () => {
  worker.terminate();
  await expect(init({ module: new Uint8Array(8) })).rejects.toMatchObject({ name: 'CompileError' });
  await expect(init({ module: new Response('', { status: 404 }) })).rejects.toThrow('404');
  const missing = new NodeWorker(new URL('nowhere.js', pkg));
  await expect(init({ worker: missing })).rejects.toThrow(/could not be started: .*nowhere\.js/);
  await expect(init(wrong({ wasm: 1 }))).rejects.toThrow('wasm');
  await init({ module_or_path: new URL('vesicle_bg.wasm', pkg) });
  expect(await worker.version()).toBeTruthy();
});

/** Runs a module script in a new Node process from the project's folder and returns what it prints. */
function node(script: string, ...flags: string[]): string {
  const args = [...flags, '--input-type=module', '--eval', script];
  return execFileSync(process.execPath, args, { cwd: root, encoding: 'utf8', timeout: 120_000 }).trim();
}

test('calls before init say what to do, and an idle worker keeps no process alive', () => {
  const script = `
    import init, { Mesh, Volume, version } from './pkg/worker.js';
    for (const early of [version(), Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 }), new Volume({}).dims, new Volume({}).dims])
      await early.catch(({ code, message }) => console.log(code, message.includes('await init()')));
    await init();
    const mesh = await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
    console.log((await mesh.info()).genus);`;
  expect(node(script).split('\n')).toEqual([...Array(4).fill('invalid-argument true'), '0']);
});

test('the example of the documentation runs', () => {
  const [, example = ''] = /```js\n([\s\S]*?)```/.exec(readFileSync(`${root}/js/worker.ts`, 'utf8')) ?? [];
  const script = `
    import { readFileSync } from 'node:fs';
    const file = new Blob([readFileSync('www/public/data/visible-human-head.nii.gz')]);
    ${example.replaceAll(/^ \* ?/gm, '').replace("from 'vesicle/worker'", "from './pkg/worker.js'")}
    console.log(report.done, positions.length / 3 === report.vertices, indices.length / 3 === report.triangles);`;
  expect(node(script).split('\n').at(-1)).toBe('true true true');
});

test('unreachable objects are freed in the worker, those in use are not', () => {
  const script = `
    import { Worker } from 'node:worker_threads';
    import init, { DeformableModel, Mesh, Volume } from './pkg/worker.js';
    const worker = new Worker(new URL('./pkg/worker-host.js', 'file://' + process.cwd() + '/'), { execArgv: [] });
    const freed = new Set();
    const post = worker.postMessage.bind(worker);
    worker.postMessage = (message, transfer) => {
      if (message.message?.free) freed.add(message.message.free);
      post(message, transfer);
    };
    await init({ worker });
    const data = Uint8Array.from({ length: 4096 }, (_, i) => (i % 16 > 4 && i % 16 < 12 ? 100 : 0));
    const held = await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
    const { mesh } = new DeformableModel({ volume: new Volume({ data, dims: [16, 16, 16] }), params: { iso: 50 } });
    const steps = (model) => model.run({ maxIterations: 50 });
    const run = steps(new DeformableModel({ volume: new Volume({ data, dims: [16, 16, 16] }), params: { iso: 50 } }));
    await (async () => { for (let i = 0; i < 20; i++) await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 }); })();
    // The two volumes and twenty meshes; the engine decides when.
    while (freed.size < 22) { gc(); await new Promise((resolve) => setTimeout(resolve)); }
    const { iteration } = await run;
    console.log(iteration > 0, (await mesh.info()).components > 0, (await held.info()).genus);
    // The model that ran as well.
    while (freed.size < 23) { gc(); await new Promise((resolve) => setTimeout(resolve)); }
    console.log(freed.size, (await mesh.info()).components > 0);`;
  expect(node(script, '--expose-gc').split('\n')).toEqual(['true true 0', '23 true']);
});

test('many calls with one signal have one listener, and all are aborted', async () => {
  const stop = new AbortController();
  const mesh = await worker.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 4 });
  const slices = mesh.inSlices({ signal: stop.signal, budgetMs: 1e-6 });
  const calls = Array.from({ length: 12 }, () => slices.distanceTo(mesh).catch((reason: unknown) => reason));
  expect(getEventListeners(stop.signal, 'abort')).toHaveLength(1);
  stop.abort('enough');
  expect(await Promise.all(calls)).toEqual(calls.map(() => 'enough'));
});
