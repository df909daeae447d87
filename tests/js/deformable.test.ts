import { afterEach, expect, test } from 'vitest';
import * as vesicle from '../../pkg/index.js';
import {
  DeformableModel,
  type DeformableParams,
  Mesh,
  paramSpecs,
  type StepReport,
  type Vec3,
  VesicleError,
  Volume,
} from '../../pkg/index.js';
import { ball, ballWithHollowAndPlate, failure, HEALTHY, noise, PAPER, rejection, wrong } from './helpers.js';
import { SPONGE_BITS, spongeBits } from './sponge.js';

type Options = ConstructorParameters<typeof DeformableModel>[0];

const volume = ball(32, 9);
const PARAMS: DeformableParams = { iso: 100, isoForce: -1, rigidity: 0.2, ...PAPER };
const models: DeformableModel[] = [];

/** Returns a model that starts from outside and takes many small steps by default. */
function model(more: Partial<Options> = {}): DeformableModel {
  const made = new DeformableModel({ volume, start: 'enclosing', params: PARAMS, ...more });
  models.push(made);
  return made;
}

afterEach(() => {
  for (const made of models.splice(0)) made.free();
});

const bytesOf = (mesh: Mesh) => Buffer.from(mesh.arrays().positions.buffer);

test('it converges to the ball', async () => {
  const fitted = model();
  const report = await fitted.run();
  expect(report).toMatchObject({ done: true, components: 1, euler: 2, triangles: fitted.mesh.triangleCount });
  expect(report.residual).toBeLessThanOrEqual(report.tolerance);
  expect(fitted.mesh.check()).toMatchObject({
    closed: true,
    oriented: true,
    nonManifoldEdges: 0,
    selfIntersections: 0,
  });
  const info = fitted.mesh.info();
  expect(info.volume / ((4 / 3) * Math.PI * 9 ** 3)).toBeGreaterThan(0.93);
  expect(info.volume / ((4 / 3) * Math.PI * 9 ** 3)).toBeLessThan(1.07);
  for (const coordinate of info.centroid) expect(Math.abs(coordinate)).toBeLessThan(0.2);
});

test('coarse to fine it ends on the full volume, with the requested edge length', async () => {
  const fitted = model({ levels: 2 });
  expect(fitted.level).toBe(2);
  const coarse = fitted.delta;
  const report = await fitted.run();
  expect(report.done).toBe(true);
  expect(fitted.level).toBe(0);
  expect(fitted.delta).toBeLessThan(coarse);
});

test('the largest number of levels is told by dimensions and spacing', () => {
  const cases: { dims: Vec3; spacing: Vec3; most: number }[] = [
    { dims: [4, 3, 2], spacing: [1, 1, 1], most: 0 },
    { dims: [8, 8, 1], spacing: [1, 1, 1], most: 0 },
    { dims: [12, 14, 18], spacing: [1, 1, 1], most: 2 },
    // The long voxels are divided until the others are as long.
    { dims: [40, 40, 4], spacing: [1, 1, 10], most: 4 },
  ];
  for (const { dims, spacing, most } of cases) {
    const data = new Uint8Array(dims.reduce((product, side) => product * side));
    data[data.length >> 1] = 1;
    const volume = new Volume({ data, dims, spacing });
    expect(DeformableModel.maxLevels(volume)).toBe(most);
    const made = (levels: number) => new DeformableModel({ volume, levels, params: { iso: 0.5 } });
    expect(made(most).level).toBe(most);
    expect(() => made(most + 1)).toThrow('levels');
  }
  expect(() => DeformableModel.maxLevels(wrong({}))).toThrow(VesicleError);
});

test('speeds are given for each vertex, inwards while an enclosing surface shrinks', () => {
  const fitted = model();
  expect([...fitted.speeds()].every((speed) => speed === 0)).toBe(true);
  fitted.step(5);
  const speeds = fitted.speeds();
  expect(speeds).toHaveLength(fitted.mesh.vertexCount);
  expect([...speeds].every((speed) => speed < 0)).toBe(true);
  // No vertex moves further than its bound.
  const most = fitted.params.maxMove * fitted.delta * (1 + 1e-5);
  expect(Math.min(...speeds)).toBeGreaterThanOrEqual(-most);
  fitted.free();
  expect(failure(() => fitted.speeds()).code).toBe('freed');
});

test('the time of a step is reported for each of its parts', () => {
  expect(Object.keys(model().step().times).sort()).toEqual(['embedding', 'forces', 'motion', 'normals', 'topology']);
});

test('every kind of start', async () => {
  const starts: [Options['start'], number][] = [
    ['contour', 1],
    ['enclosing', 1],
    [{ bubbles: 3 }, 1],
    [{ seeds: Float32Array.of(1, 0, 0), radius: 4 }, 1],
    [{ marchingCubes: 100 }, 1],
    [Mesh.icosphere({ center: [0, 0, 0], radius: 6, maxEdge: 2 }), 1],
  ];
  for (const [start, components] of starts) {
    const report = await model({ start: start as NonNullable<Options['start']> }).run({ maxIterations: 400 });
    expect(report.components, JSON.stringify(start)).toBe(components);
    expect(report.euler).toBe(2);
  }
});

test('the live mesh is one object that follows the model', () => {
  const fitted = model();
  const { mesh } = fitted;
  const before = mesh.geometryVersion;
  fitted.step(5);
  expect(fitted.mesh).toBe(mesh);
  expect(mesh.geometryVersion).toBeGreaterThan(before);
  const copy = mesh.clone();
  copy.refine();
  expect(copy.triangleCount).toBe(3 * mesh.triangleCount);
  for (const edit of [() => mesh.refine(), () => mesh.decimate(8)]) {
    const error = failure(edit);
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain('clone()');
  }
  for (const measured of [mesh.curvature('mean'), mesh.geodesic(0), mesh.distanceTo(copy).perVertex]) {
    expect(measured).toHaveLength(mesh.vertexCount);
  }
  mesh.free();
  expect(fitted.step().iteration).toBe(6);
});

test('a step report has all fields', () => {
  const report = model().step(3);
  expect(report.iteration).toBe(3);
  expect(report.done).toBe(false);
  expect(report.phase).toMatch(/level/);
  const counts = ['creations', 'deletions', 'inversions', 'axial', 'annular', 'vanished', 'seeds'];
  expect(Object.keys(report.events).sort()).toEqual([...counts].sort());
  expect(Object.keys(report.times).length).toBeGreaterThan(0);
  for (const milliseconds of Object.values(report.times)) expect(milliseconds).toBeGreaterThanOrEqual(0);
});

test("the events of several steps are the sum of each step's", () => {
  const [together, each] = [model(), model()];
  const events = (reports: StepReport[]) => reports.reduce((sum, report) => sum + report.events.deletions, 0);
  const single = Array.from({ length: 20 }, () => each.step());
  expect(together.step(20).events.deletions).toBe(events(single));
});

test('the same steps give the same bits, in slices or at once', async () => {
  const [sliced, atOnce] = [model(), model()];
  await sliced.run({ maxIterations: 20, budgetMs: 0.01 });
  atOnce.step(20);
  expect(bytesOf(sliced.mesh).equals(bytesOf(atOnce.mesh))).toBe(true);
});

test('restore(save()) then step() equals step()', () => {
  const [saved, resumed] = [model(), model()];
  saved.step(12);
  const state = saved.save();
  resumed.restore(state);
  expect(resumed.step(10)).toMatchObject({ iteration: saved.step(10).iteration });
  expect(bytesOf(resumed.mesh).equals(bytesOf(saved.mesh))).toBe(true);
  saved.restore(state);
  expect(saved.step(10).iteration).toBe(22);
  expect(bytesOf(resumed.mesh).equals(bytesOf(saved.mesh))).toBe(true);
});

test('a damaged state is refused and changes nothing', () => {
  const [fitted, untouched] = [model(), model()];
  fitted.step(3);
  untouched.step(3);
  const state = fitted.save();
  const broken = [new Uint8Array(), state.slice(0, 20), state.slice(0, -1), new Uint8Array(state.length).fill(7)];
  for (const bytes of broken) expect(failure(() => fitted.restore(bytes)).code).toBe('bad-file');
  expect(failure(() => fitted.restore(wrong([]))).code).toBe('invalid-argument');
  fitted.step(3);
  untouched.step(3);
  expect(bytesOf(fitted.mesh).equals(bytesOf(untouched.mesh))).toBe(true);
});

test('an aborted run rejects with the reason and can continue later', async () => {
  const fitted = model();
  const abort = new AbortController();
  const reason = new Error('enough');
  const stopped = fitted.run({
    signal: abort.signal,
    onStep: ({ iteration }) => {
      if (iteration === 4) abort.abort(reason);
    },
  });
  await expect(stopped).rejects.toBe(reason);
  expect(fitted.step().iteration).toBe(5);
  await expect(fitted.run({ signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  expect((await fitted.run({ maxIterations: 2 })).iteration).toBe(7);
});

test('an abort from a timer takes effect during a run', async () => {
  const abort = new AbortController();
  setTimeout(() => abort.abort('late'), 1);
  await expect(model().run({ signal: abort.signal, budgetMs: 1 })).rejects.toBe('late');
});

test('onStep is called for every iteration and can end the run', async () => {
  const fitted = model();
  const heard: number[] = [];
  const last = await fitted.run({ maxIterations: 6, onStep: ({ iteration }) => heard.push(iteration) });
  expect(heard).toEqual([1, 2, 3, 4, 5, 6]);
  expect(last.iteration).toBe(6);
  const thrown = new Error('mine');
  const failing = fitted.run({
    onStep: () => {
      throw thrown;
    },
  });
  await expect(failing).rejects.toBe(thrown);
  expect(fitted.step().iteration).toBe(8);
});

test('a second run is refused, but parameters can change during a run', async () => {
  const fitted = model();
  const first = fitted.run({ maxIterations: 10, budgetMs: 0.01 });
  expect((await rejection(fitted.run())).code).toBe('invalid-argument');
  expect(failure(() => fitted.step()).message).toContain('during a run');
  expect(failure(() => fitted.restore(fitted.save())).message).toContain('during a run');
  fitted.setParams({ rigidity: 0.1 });
  expect((await first).iteration).toBe(10);
  expect(fitted.step().iteration).toBe(11);
});

test('freeing a model ends its run', async () => {
  const fitted = model();
  const running = fitted.run({ budgetMs: 0.01 });
  fitted.free();
  expect((await rejection(running)).code).toBe('freed');
});

test('any subset of parameters can be set, all or nothing', () => {
  const fitted = model();
  const before = fitted.params;
  expect(before).toMatchObject(PARAMS);
  fitted.setParams({ damping: 0.4, restLength: 'mean' });
  expect(fitted.params).toEqual({ ...before, damping: 0.4, restLength: 'mean' });
  fitted.setParams({ restLength: 0.5 });
  fitted.setParams(wrong({ restLength: undefined }));
  expect(fitted.params.restLength).toBe(0.5);
  const now = fitted.params;
  const refused: [string, object][] = [
    ['dampening', { rigidity: 0.1, dampening: 1 }],
    ['damping', { rigidity: 0.1, damping: Number.NaN }],
    ['damping', { rigidity: 0.1, damping: '0.3' }],
    ['mass', { rigidity: 0.1, mass: -1 }],
    ['topology', { rigidity: 0.1, topology: 'none' }],
    ['integrator', { rigidity: 0.1, integrator: 'explicit' }],
    ['adaptivity', { rigidity: 0.1, adaptivity: 1.5 }],
    ['seeding', { rigidity: 0.1, seeding: true }],
    ['smallestPart', { rigidity: 0.1, smallestPart: -1 }],
  ];
  for (const [name, params] of refused) {
    const error = failure(() => fitted.setParams(params));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain(name);
    expect(fitted.params).toEqual(now);
  }
});

test('numbers of very many digits have an exponent in messages', () => {
  const message = (rigidity: number) => failure(() => model().setParams({ rigidity })).message;
  expect(message(1e308)).toBe('rigidity: must be a number from 0 to 3, got 1e+308');
  expect(message(-1.5e30)).toMatch(/got -1.5e\+30$/);
  expect(message(-1e-300)).toMatch(/got -1e-300$/);
  expect(message(123_456.75)).toMatch(/got 123456.75$/);
});

test('specs describe every parameter, with its default', () => {
  const specs = paramSpecs('deformable');
  const defaults: Record<string, unknown> = new DeformableModel({ volume }).params;
  expect(specs.map(({ name }) => name).sort()).toEqual(Object.keys(defaults).sort());
  for (const spec of specs) {
    expect(spec.help.length, spec.name).toBeGreaterThan(10);
    expect(spec.label.length, spec.name).toBeGreaterThan(0);
    if (spec.type === 'choice') expect(spec.choices).toContain(spec.default);
    // The default iso value is the centre of the volume's range.
    if (spec.name !== 'iso') expect(defaults[spec.name], spec.name).toEqual(spec.default);
    else expect(defaults.iso).toBe(100);
  }
  expect(failure(() => paramSpecs(wrong('magic'))).code).toBe('invalid-argument');
});

test('an attractor pulls the surface', () => {
  const [pulled, free] = [model({ start: { marchingCubes: 100 } }), model({ start: { marchingCubes: 100 } })];
  pulled.setAttractors([{ point: [13, 0, 0], strength: 0.5, radius: 8 }]);
  pulled.step(30);
  free.step(30);
  expect(pulled.mesh.info().bounds.max[0]).toBeGreaterThan(free.mesh.info().bounds.max[0] + 0.5);
});

/** Default parameters of the method, with adaptive sampling. */
const ADAPTING: DeformableParams = { iso: 100 };

test('from the contour, the default, a ball with a cavity and a thin plate is found completely', async () => {
  const fitted = new DeformableModel({ volume: ballWithHollowAndPlate(), params: ADAPTING });
  models.push(fitted);
  expect(await fitted.run()).toMatchObject({ done: true, components: 3, euler: 6 });
  expect(fitted.mesh.check().selfIntersections).toBe(0);
  const { recall, precision } = await fitted.coverage();
  expect(recall).toBeGreaterThan(0.99);
  expect(precision).toBeGreaterThan(0.99);
});

test('a cavity that an enclosing surface cannot reach is reported, and seeding adds it', async () => {
  const apart = ballWithHollowAndPlate();
  const fitted = model({ volume: apart, params: { ...ADAPTING, seeding: 'off' } });
  expect((await fitted.run()).events.seeds).toBe(0);
  const shares: number[] = [];
  const { recall, precision, uncovered } = await fitted.coverage({ onProgress: (share) => shares.push(share) });
  expect(precision).toBeGreaterThan(0.99);
  const cavity = 4 * Math.PI * 6 ** 2;
  expect(recall).toBeLessThan(0.93);
  expect(uncovered[0]?.kind).toBe('cavity');
  expect(Math.abs((uncovered[0]?.area ?? 0) / cavity - 1)).toBeLessThan(0.1);
  const { position = [0, 0, 0] } = uncovered[0] ?? {};
  expect(Math.abs(Math.hypot(position[0] - 22, position[1] - 24, position[2] - 24) - 6)).toBeLessThan(1);
  expect(shares.at(-1)).toBe(1);
  expect(shares.every((share, i) => share > (shares[i - 1] ?? 0))).toBe(true);

  const seeded = fitted.seed();
  expect(seeded.events.seeds).toBe(1);
  expect(seeded.done).toBe(false);
  await fitted.run();
  expect((await fitted.coverage()).recall).toBeGreaterThan(0.99);
  expect(fitted.seed().events.seeds).toBe(0);
});

test('the seeds of a run are counted', async () => {
  const fitted = model({ volume: ballWithHollowAndPlate(), params: { ...ADAPTING, seeding: 'on' } });
  let seeds = 0;
  const onStep = ({ events }: StepReport) => {
    seeds += events.seeds;
  };
  await fitted.run({ onStep });
  expect(seeds).toBe(1);
});

test('matter that a surface leaves out is reported as such, and small parts are not', async () => {
  const start = Mesh.icosphere({ center: [22, 24, 24], radius: 14, maxEdge: 2 });
  const given = { volume: ballWithHollowAndPlate(), start };
  const kinds = async (params: DeformableParams) => {
    const { uncovered } = await model({ ...given, params: { ...ADAPTING, ...params } }).coverage();
    return uncovered.map(({ kind }) => kind);
  };
  expect(await kinds({})).toEqual(['matter', 'cavity']);
  // The cavity has 904 voxels, the plate 1250.
  expect(await kinds({ smallestPart: 1100 })).toEqual(['matter']);
  expect(await kinds({ smallestPart: 1500 })).toEqual([]);
});

test('coverage is measured during a run, for the surface at its beginning', async () => {
  const fitted = model();
  const before = await fitted.coverage();
  const running = fitted.run({ maxIterations: 30, budgetMs: 0.01 });
  expect(failure(() => fitted.seed()).message).toContain('during a run');
  const [meanwhile] = await Promise.all([fitted.coverage(), running]);
  expect(meanwhile.recall).toBeLessThanOrEqual(1);
  expect(await model().coverage()).toEqual(before);
});

test('an aborted measurement rejects with the reason, and one of a freed model with freed', async () => {
  const fitted = model();
  const reason = new Error('enough');
  await expect(fitted.coverage({ signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  const abort = new AbortController();
  const stopped = fitted.coverage({ signal: abort.signal, onProgress: () => abort.abort(reason) });
  await expect(stopped).rejects.toBe(reason);
  const thrown = new Error('mine');
  const failing = fitted.coverage({
    onProgress: () => {
      throw thrown;
    },
  });
  await expect(failing).rejects.toBe(thrown);
  const going = fitted.coverage({ onProgress: () => fitted.free() });
  expect((await rejection(going)).code).toBe('freed');
  expect((await rejection(fitted.coverage())).code).toBe('freed');
  expect(failure(() => fitted.seed()).code).toBe('freed');
});

test('invalid options of a measurement are refused', async () => {
  const refused: [string, unknown][] = [
    ['signal', { signal: {} }],
    ['onProgress', { onProgress: 1 }],
    ['budgetMs', { budgetMs: 12 }],
    ['options', 7],
  ];
  for (const [name, options] of refused) {
    const error = await rejection(model().coverage(wrong(options)));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain(name);
  }
});

const closed = Mesh.icosphere({ center: [0, 0, 0], radius: 6, maxEdge: 2 });
const REFUSED: [string, string, string, () => unknown][] = [
  ['no options', 'invalid-argument', 'volume', () => new DeformableModel(wrong(undefined))],
  ['no volume', 'invalid-argument', 'volume', () => new DeformableModel(wrong({}))],
  ['a misspelled option', 'invalid-argument', 'level', () => model(wrong({ level: 1 }))],
  ['a frame too far', 'invalid-argument', 'frame', () => model({ frame: 1 })],
  ['half a level', 'invalid-argument', 'levels', () => model({ levels: 0.5 })],
  ['too many levels', 'invalid-argument', 'levels', () => model({ levels: 40 })],
  ['a negative edge', 'invalid-argument', 'edge', () => model({ edge: -1 })],
  ['another start', 'invalid-argument', 'start', () => model({ start: wrong('inside') })],
  ['no bubbles', 'invalid-argument', 'bubbles', () => model({ start: { bubbles: 0 } })],
  [
    'seeds without radius',
    'invalid-argument',
    'radius',
    () => model({ start: wrong({ seeds: Float32Array.of(0, 0, 0) }) }),
  ],
  ['a misspelled parameter', 'invalid-argument', 'stifness', () => model({ params: wrong({ stifness: 1 }) })],
  ['a parameter out of range', 'invalid-argument', 'damping', () => model({ params: { damping: -1 } })],
  ['steps in parts', 'invalid-argument', 'iterations', () => model().step(0.5)],
  [
    'an attractor without reach',
    'invalid-argument',
    'radius',
    () => model().setAttractors([{ point: [0, 0, 0], strength: 1, radius: 0 }]),
  ],
  [
    'an attractor nowhere',
    'invalid-argument',
    'point',
    () => model().setAttractors(wrong([{ strength: 1, radius: 1 }])),
  ],
  [
    'an open start mesh',
    'not-closed',
    'closed',
    () => {
      const { positions, indices } = closed.arrays();
      return model({ start: Mesh.fromArrays(positions, indices.slice(3)) });
    },
  ],
  [
    'a start mesh that crosses itself',
    'self-intersecting',
    'intersects itself',
    () => {
      const { positions, indices } = closed.arrays();
      const twice = Float32Array.from([...positions, ...positions.map((value) => value + 1)]);
      const first = positions.length / 3;
      return model({ start: Mesh.fromArrays(twice, Uint32Array.from([...indices, ...indices.map((i) => i + first)])) });
    },
  ],
];

test.each(REFUSED)('%s is refused: %s, saying %s', (_, code, word, work) => {
  const error = failure(work);
  expect(error.code).toBe(code);
  expect(error.message).toContain(word);
});

test('invalid run options are refused', async () => {
  const refused: [string, object][] = [
    ['maxIterations', { maxIterations: 0 }],
    ['budgetMs', { budgetMs: -1 }],
    ['signal', { signal: {} }],
    ['onStep', { onStep: 1 }],
    ['onstep', { onstep: () => {} }],
  ];
  for (const [name, options] of refused) {
    const error = await rejection(model().run(wrong(options)));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain(name);
  }
});

test('a model survives its volume, and a freed model is refused', () => {
  const own = ball(16, 4);
  const fitted = model({ volume: own });
  own.free();
  fitted.step(3);
  const { mesh } = fitted;
  fitted.free();
  for (const use of [() => fitted.step(), () => fitted.params, () => mesh.info(), () => fitted.save()]) {
    expect(failure(use).code).toBe('freed');
  }
  expect(failure(() => model({ volume: own })).code).toBe('freed');
});

test('getters of parameters may use the model', () => {
  const fitted = model();
  fitted.setParams({
    get iso() {
      return (fitted.params.iso ?? 0) + 1;
    },
  });
  expect(fitted.params.iso).toBe(101);
});

test('names of inherited properties are no parameters, and arrays are refused', () => {
  const fitted = model();
  expect(failure(() => fitted.setParams({ toString: 1 } as unknown as DeformableParams)).message).toContain('toString');
  expect(failure(() => fitted.setParams([] as unknown as DeformableParams)).code).toBe('invalid-argument');
  expect(failure(() => model({ start: { bubbles: 1, seeds: 1 } as never })).message).toContain('seeds');
});

test('a restored mesh has new version numbers', () => {
  const fitted = model();
  const state = fitted.save();
  fitted.step(5);
  const { topologyVersion, geometryVersion } = fitted.mesh;
  fitted.restore(state);
  expect(fitted.mesh.topologyVersion).toBeGreaterThan(topologyVersion);
  expect(fitted.mesh.geometryVersion).toBeGreaterThan(geometryVersion);
});

test('two hundred steps give the same bits as the native core', async () => {
  expect(await spongeBits(vesicle)).toBe(SPONGE_BITS);
});

test('after a change of voxels, the surface follows with `refresh`, there and nowhere else', async () => {
  using brushed = ball(32, 9);
  const fitted = model({ volume: brushed, start: 'contour', params: ADAPTING });
  await fitted.run();
  const before = fitted.mesh.info().volume;
  const lowest = (from: Mesh) =>
    from.arrays().positions.reduce((least, x, i) => (i % 3 === 0 && x < least ? x : least), 0);
  const far = lowest(fitted.mesh);
  const region = { min: [22, 12, 12], dims: [6, 7, 7] } as const;
  const box = { min: [...region.min], dims: [...region.dims] } as { min: vesicle.Vec3; dims: vesicle.Vec3 };
  const saved = fitted.save();
  fitted.refresh(box);
  expect(fitted.save()).toEqual(saved);
  brushed.write({ ...box, data: new Uint8Array(6 * 7 * 7).fill(200) });
  fitted.refresh(box);
  const report = await fitted.run();
  expect(report).toMatchObject({ done: true, components: 1, euler: 2 });
  expect(fitted.mesh.info().volume).toBeGreaterThan(before + 50);
  expect(lowest(fitted.mesh)).toBe(far);
  expect(fitted.mesh.check()).toMatchObject({ closed: true, selfIntersections: 0 });
  const { recall, precision } = await fitted.coverage();
  expect(Math.min(recall, precision)).toBeGreaterThan(0.99);
  expect(failure(() => fitted.restore(saved)).code).toBe('bad-file');

  const island = { min: [1, 1, 1], dims: [5, 5, 5] } as typeof box;
  brushed.write({ ...island, data: new Uint8Array(125).fill(200) });
  fitted.refresh(island);
  expect(await fitted.run()).toMatchObject({ components: 2, euler: 4 });
  brushed.write({ ...island, data: new Uint8Array(125) });
  fitted.refresh(island);
  expect(await fitted.run()).toMatchObject({ components: 1, euler: 2 });
});

test.each([
  ['region', undefined],
  ['region', { min: [0, 0, 0] }],
  ['region.min', { min: [0.5, 0, 0], dims: [1, 1, 1] }],
  ['region.dims', { min: [0, 0, 0], dims: [1, 1, -1] }],
  ['region', { min: [0, 0, 0], dims: [1, 0, 1] }],
  ['region', { min: [31, 0, 0], dims: [2, 1, 1] }],
  ['frame', { min: [0, 0, 0], dims: [1, 1, 1], frame: 0 }],
])('refresh refuses a wrong %s', (name, region) => {
  const fitted = model();
  const before = fitted.save();
  const error = failure(() => fitted.refresh(wrong(region)));
  expect(error.code).toBe('invalid-argument');
  expect(error.message.split(':')[0]).toContain(name);
  expect(fitted.save()).toEqual(before);
});

test('refresh needs the volume', () => {
  const gone = ball(32, 9);
  const fitted = model({ volume: gone });
  gone.free();
  expect(failure(() => fitted.refresh({ min: [0, 0, 0], dims: [1, 1, 1] })).code).toBe('freed');
});

test('a model can be created in slices, with the same bits, and not if that is aborted', async () => {
  const volume = noise(24, 8);
  const whole = new DeformableModel({ volume, levels: 1 });
  const sliced = await DeformableModel.create({ volume, levels: 1 }, { budgetMs: 0.1 });
  expect(sliced).toBeInstanceOf(DeformableModel);
  expect(sliced.save()).toEqual(whole.save());
  const stop = new AbortController();
  // Runs only if the creation lets it.
  setTimeout(() => stop.abort(new Error('enough')));
  const options = { signal: stop.signal, budgetMs: 0.1 };
  await expect(DeformableModel.create({ volume }, options)).rejects.toThrow('enough');
  await expect(DeformableModel.create({ volume }, options)).rejects.toThrow('enough');
  const error = await rejection(DeformableModel.create({ volume, edge: -1 }));
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('edge')]);
});

test('a run yields within steps: an abort leaves the model as after the last step', async () => {
  const make = () => new DeformableModel({ volume: noise(14, 8), params: { smallestPart: 0, seeding: 'on' } });
  const [whole, sliced] = [make(), make()];
  const expectSame = () => expect(Buffer.from(sliced.save()).equals(Buffer.from(whole.save()))).toBe(true);
  let withinSteps = 0;
  for (let round = 1; round <= 6; round++) {
    const stop = new AbortController();
    const ended: number[] = [];
    const onStep = ({ iteration }: StepReport) => ended.push(iteration);
    const run = sliced.run({ signal: stop.signal, budgetMs: 1e-6, onStep });
    // After another number of slices each time.
    for (let slice = 0; slice < 4 * round; slice++) await new Promise((resolve) => setImmediate(resolve));
    stop.abort('enough');
    await expect(run).rejects.toBe('enough');
    if (ended.length === 0) withinSteps += 1;
    else whole.step(ended.length);
    expectSame();
    expect(sliced.mesh.check()).toEqual(HEALTHY);
    const { times: _, ...report } = await sliced.run({ maxIterations: 1, budgetMs: 1e-6 });
    const { times: __, ...expected } = whole.step();
    expect(report).toEqual(expected);
    expectSame();
  }
  expect(withinSteps).toBeGreaterThan(2);
});

test('a step that ends because of a call is reported before the call, and when the run is aborted', async () => {
  // Runs pause for two turns of the event loop.
  const slice = async () => {
    for (let turn = 0; turn < 2; turn++) await new Promise((resolve) => setImmediate(resolve));
  };
  const make = () => new DeformableModel({ volume: noise(14, 8), params: { smallestPart: 0 } });
  const [sliced, again] = [make(), make()];
  const log: ('step' | number)[] = [];
  const stop = new AbortController();
  const run = sliced.run({ signal: stop.signal, budgetMs: 1e-6, onStep: () => log.push('step') });
  for (let k = 1; k <= 8; k++) {
    await slice();
    // Ends a step, too, as reading the surface does.
    if (k % 2 === 0) sliced.mesh.info();
    sliced.setParams({ rigidity: k / 10 });
    log.push(k / 10);
  }
  await slice();
  sliced.mesh.info();
  const before = log.length;
  stop.abort('enough');
  await expect(run).rejects.toBe('enough');
  expect(log.slice(before)).toEqual(['step']);
  for (const entry of log) {
    if (entry === 'step') again.step();
    else again.setParams({ rigidity: entry });
  }
  expect(log.filter((entry) => entry === 'step').length).toBeGreaterThan(4);
  expect(Buffer.from(sliced.save()).equals(Buffer.from(again.save()))).toBe(true);
});

test('what is asked of a model in the middle of a step ends the step first', async () => {
  const make = () => new DeformableModel({ volume: noise(14, 8), params: { smallestPart: 0 } });
  const [whole, sliced] = [make(), make()];
  const reports: number[] = [];
  const run = sliced.run({ maxIterations: 3, budgetMs: 1e-6, onStep: ({ iteration }) => reports.push(iteration) });
  await new Promise((resolve) => setImmediate(resolve));
  whole.step();
  expect(sliced.mesh.arrays()).toEqual(whole.mesh.arrays());
  for (const one of [whole, sliced]) one.setParams({ rigidity: 0.3 });
  await run;
  whole.step(2);
  expect(reports).toEqual([1, 2, 3]);
  expect(Buffer.from(sliced.save()).equals(Buffer.from(whole.save()))).toBe(true);
  const freed = sliced.run({ budgetMs: 1e-6 });
  await new Promise((resolve) => setImmediate(resolve));
  sliced.free();
  expect((await rejection(freed)).code).toBe('freed');
});
