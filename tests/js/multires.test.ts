import { afterEach, expect, test } from 'vitest';
import * as vesicle from '../../pkg/index.js';
import { type ControlEllipsoid, Mesh, MultiresolutionModel, paramSpecs, type StepReport } from '../../pkg/index.js';
import { failure, HEALTHY, rejection, wrong } from './helpers.js';
import { LAMP_BITS, lampBits } from './lamp.js';

type Options = ConstructorParameters<typeof MultiresolutionModel>[0];

const EDGES = { edgeMin: 0.12, edgeMax: 0.26 };
const models: MultiresolutionModel[] = [];

function ball(x: number, radius: number): ControlEllipsoid {
  return {
    center: [x, 0, 0],
    axes: [
      [radius, 0, 0],
      [0, radius, 0],
      [0, 0, radius],
    ],
  };
}

function model(more: Partial<Options> = {}): MultiresolutionModel {
  const made = new MultiresolutionModel({ ellipsoids: [ball(-0.5, 1), ball(0.5, 0.8)], params: EDGES, ...more });
  models.push(made);
  return made;
}

/** Returns a ball with waves on it. */
function wavy(edge = 0.15): Mesh {
  const { positions, indices } = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: edge }).arrays();
  for (let at = 0; at < positions.length; at += 3) {
    const height = 1.05 + 0.04 * Math.sin(6 * (positions[at] as number)) * Math.cos(5 * (positions[at + 2] as number));
    for (let k = 0; k < 3; k++) positions[at + k] = (positions[at + k] as number) * height;
  }
  return Mesh.fromArrays(positions, indices);
}

afterEach(() => {
  for (const made of models.splice(0)) made.free();
});

test('a bare surface converges over its ellipsoids', async () => {
  const skin = model();
  const report = await skin.run();
  expect(report).toMatchObject({ done: true, components: 1, euler: 2, triangles: skin.mesh.triangleCount });
  expect(report.residual).toBeLessThanOrEqual(report.tolerance);
  for (const mesh of [skin.mesh, skin.baseMesh]) expect(mesh.check()).toEqual(HEALTHY);
  expect(skin.linkMesh.triangleCount).toBe(skin.baseMesh.triangleCount);
  expect(skin.bandCount).toBe(1);
});

test('pulled apart it splits, and each frame is valid', () => {
  const skin = model({ params: { ...EDGES, topology: 'split' } });
  let annular = 0;
  let report: StepReport | undefined;
  for (let frame = 0; frame < 16; frame++) {
    skin.setEllipsoids([ball(-0.5, 1), ball(0.5 + 0.14 * frame, 0.8)]);
    report = skin.step();
    annular += report.events.annular;
    expect(skin.mesh.check()).toEqual(HEALTHY);
  }
  expect(report).toMatchObject({ components: 2, euler: 4 });
  expect(annular).toBeGreaterThan(0);
});

test('detail is kept, and its distortion is reported', () => {
  const detail = wavy();
  const base = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 });
  const deformed = model({
    detail,
    base,
    ellipsoids: [ball(0, 0.99), ball(0.3, 0.6)],
    params: { ...EDGES, supersample: 1 },
  });
  expect(deformed.mesh.distanceTo(detail).mean).toBeLessThan(0.02);
  for (let frame = 1; frame <= 6; frame++) {
    deformed.setEllipsoids([ball(0, 0.99), ball(0.3 + 0.1 * frame, 0.6)]);
    deformed.step();
  }
  expect(deformed.mesh.check()).toEqual(HEALTHY);
  expect(deformed.mesh.triangleCount).toBeGreaterThan(deformed.baseMesh.triangleCount);
  const { area, angle } = deformed.distortion();
  expect(area).toHaveLength(deformed.baseMesh.vertexCount);
  expect(angle.every((ratio) => ratio >= 0.999)).toBe(true);
  expect(deformed.bandCount).toBe(2);
  expect([deformed.folded, deformed.unmatchedVertices]).toEqual([0, 0]);
});

test('texture coordinates move with the surface', () => {
  const globe = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.15 }).arrays();
  const uvs = new Float32Array((globe.positions.length / 3) * 2);
  for (let v = 0; v < uvs.length / 2; v++) {
    const [x = 0, y = 0, z = 0] = globe.positions.subarray(3 * v, 3 * v + 3);
    uvs.set([0.5 + Math.atan2(y, x) / (2 * Math.PI), 0.5 + Math.asin(Math.max(-1, Math.min(1, z))) / Math.PI], 2 * v);
  }
  const base = Mesh.fromArrays(globe.positions, globe.indices, { uvs });
  const textured = model({ base, ellipsoids: [ball(0, 0.99), ball(0.3, 0.6)] });
  textured.setEllipsoids([ball(0, 0.99), ball(0.7, 0.6)]);
  textured.step();
  const found = textured.mesh.arrays();
  expect(found.uvs).toHaveLength((found.positions.length / 3) * 2);
  // Latitudes are those of the corresponding points on the globe.
  const link = textured.linkMesh.arrays().positions;
  for (let v = 0; v < link.length / 3; v++) {
    const latitude = 0.5 + Math.asin(Math.max(-1, Math.min(1, link[3 * v + 2] as number))) / Math.PI;
    expect(Math.abs((found.uvs?.[2 * v + 1] as number) - latitude)).toBeLessThan(0.05);
  }
});

test('a surface that holds itself rests as given, and follows the ellipsoids proposed for it', async () => {
  const detail = wavy();
  const given = [...detail.arrays().positions];
  const options = { detail, support: 'surface' as const };
  // The default for a detail alone.
  const made = new MultiresolutionModel({ detail });
  models.push(made);
  expect((await made.run()).done).toBe(true);
  expect([...made.mesh.arrays().positions]).toEqual(given);
  const rest = made.ellipsoids;
  expect(rest.length).toBeGreaterThan(0);
  const [first] = rest as [ControlEllipsoid];
  const center: [number, number, number] = [first.center[0], first.center[1], first.center[2] + 0.2];
  made.setEllipsoids([{ ...first, center }, ...rest.slice(1)]);
  expect(await made.run()).toMatchObject({ done: true, components: 1, euler: 2 });
  expect(made.mesh.check()).toEqual(HEALTHY);
  expect([...made.mesh.arrays().positions]).not.toEqual(given);
  const other = model({ ...options, ellipsoids: rest });
  other.restore(made.save());
  expect(other.save()).toEqual(made.save());
  made.setEllipsoids(rest);
  await made.run();
  expect([...made.mesh.arrays().positions]).toEqual(given);
  const refused = failure(() => model({ support: 'none' as never }));
  expect(refused).toMatchObject({ code: 'invalid-argument' });
  expect(refused.message).toMatch(/^support/);
  expect(failure(() => model({ support: 'surface' })).message).toMatch(/^support.*detail/);
  detail.free();
});

test('a state is restored bit for bit', () => {
  const skin = model();
  skin.setEllipsoids([ball(-0.5, 1), ball(1.4, 0.8)]);
  skin.step();
  const state = skin.save();
  const targets = skin.targets;
  skin.step(3);
  const expected = Buffer.from(skin.mesh.arrays().positions.buffer);
  skin.setEllipsoids([ball(0, 1)]);
  skin.step();
  skin.restore(state);
  expect(skin.targets).toEqual(targets);
  skin.step(3);
  expect(Buffer.from(skin.mesh.arrays().positions.buffer).equals(expected)).toBe(true);
  expect(failure(() => skin.restore(state.slice(0, 100))).code).toBe('bad-file');
});

test('levels and single restructuring passes can be inspected', () => {
  const levels = model({ params: { edgeMin: 0.06, edgeMax: 0.13 } }).levelMeshes();
  expect(levels.length).toBeGreaterThan(1);
  const mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 });
  const before = mesh.triangleCount;
  expect(mesh.restructure({ min: 0.2, max: 0.5 }, ['collapse'])).toBeGreaterThan(0);
  expect(mesh.triangleCount).toBeLessThan(before);
  expect(mesh.restructure({ min: 0.02, max: 0.1 })).toBeGreaterThan(0);
  expect(mesh.triangleCount).toBeGreaterThan(before);
});

test('an aborted run can continue', async () => {
  const skin = model();
  skin.setEllipsoids([ball(-0.5, 1), ball(6, 0.8)]);
  const abort = new AbortController();
  const stopped = skin.run({ signal: abort.signal, onStep: () => abort.abort(new Error('enough')) });
  await expect(stopped).rejects.toThrow('enough');
  expect(skin.mesh.check()).toEqual(HEALTHY);
  expect((await skin.run()).done).toBe(true);
});

test('a run yields within frames of a surface that holds itself: an abort leaves the model as after the last frame', async () => {
  const make = () => {
    const made = model({ detail: wavy(0.08), ellipsoids: [ball(0.4, 0.3), ball(-0.4, 0.3)], params: {} });
    made.setEllipsoids([ball(1.5, 0.3), ball(-0.4, 0.3)]);
    return made;
  };
  const [whole, sliced] = [make(), make()];
  const expectSame = () => expect(Buffer.from(sliced.save()).equals(Buffer.from(whole.save()))).toBe(true);
  let withinFrames = 0;
  for (let round = 1; round <= 5; round++) {
    const stop = new AbortController();
    let ended = 0;
    const count = () => {
      ended += 1;
    };
    const run = sliced.run({ signal: stop.signal, budgetMs: 1e-6, onStep: count });
    for (let slice = 0; slice < 2 * round; slice++) await new Promise((resolve) => setImmediate(resolve));
    stop.abort('enough');
    await expect(run).rejects.toBe('enough');
    if (ended === 0) withinFrames += 1;
    else whole.step(ended);
    expectSame();
    expect(sliced.mesh.arrays()).toEqual(whole.mesh.arrays());
    const { times: _, ...report } = await sliced.run({ maxIterations: 1, budgetMs: 1e-6 });
    const { times: __, ...expected } = whole.step();
    expect(report).toEqual(expected);
    expectSame();
  }
  expect(withinFrames).toBeGreaterThan(1);
  // A question in the middle of a frame ends it first.
  const frames: number[] = [];
  const run = sliced.run({ maxIterations: 2, budgetMs: 1e-6, onStep: ({ iteration }) => frames.push(iteration) });
  await new Promise((resolve) => setImmediate(resolve));
  whole.step();
  expect(sliced.baseMesh.arrays()).toEqual(whole.baseMesh.arrays());
  for (const one of [whole, sliced]) one.setEllipsoids([ball(1, 0.3), ball(-0.4, 0.3)]);
  await run;
  whole.step();
  expect(frames.length).toBe(2);
  expectSame();
  const freed = sliced.run({ budgetMs: 1e-6 });
  await new Promise((resolve) => setImmediate(resolve));
  models.splice(models.indexOf(sliced), 1);
  sliced.free();
  expect((await rejection(freed)).code).toBe('freed');
});

test('invalid arguments are refused by name', async () => {
  const code = (work: () => unknown) => failure(work).code;
  const message = (work: () => unknown) => failure(work).message;
  expect(message(() => model({ ellipsoids: [] }))).toContain('ellipsoids');
  expect(message(() => model({ ellipsoids: wrong([{ center: [0, 0, 0] }]) }))).toContain('ellipsoids[0].axes');
  expect(message(() => model({ ellipsoids: [ball(Number.NaN, 1)] }))).toContain('ellipsoids[0].center');
  expect(message(() => model({ ellipsoids: [ball(0, 0)] }))).toContain('semi-axes must be');
  expect(message(() => model({ params: { edgeMin: 1, edgeMax: 2 } }))).toContain('edgeMax');
  expect(message(() => model({ params: { levels: 2.5 } }))).toContain('levels');
  expect(message(() => model({ params: wrong({ colour: 1 }) }))).toContain('colour');
  const paper = { detail: wavy(), support: 'membrane' } as const;
  expect(message(() => model({ ...paper, ellipsoids: [ball(9, 1)] }))).toContain('must touch');
  expect(code(() => model({ params: { edgeMin: 1e-5, edgeMax: 3e-5 } }))).toBe('too-large');
  const open = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 }).arrays();
  const hole = Mesh.fromArrays(open.positions, open.indices.slice(3));
  expect(code(() => model({ detail: hole }))).toBe('not-closed');
  expect(code(() => model({ base: hole }))).toBe('not-closed');
  for (let k = 0; k < 3; k++) open.positions[k] = -3 * (open.positions[k] as number);
  expect(code(() => model({ base: Mesh.fromArrays(open.positions, open.indices) }))).toBe('self-intersecting');
  for (const none of [null, 0, '', false]) {
    for (const name of ['detail', 'base']) {
      const error = failure(() => model({ [name]: wrong(none) }));
      expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining(name)]);
    }
  }
  const skin = model();
  expect(code(() => skin.setEllipsoids([]))).toBe('invalid-argument');
  expect(code(() => skin.setParams({ edgeMin: 0.2, edgeMax: 0.3 }))).toBe('invalid-argument');
  skin.setEllipsoids([ball(-0.5, 1), ball(6, 0.8)]);
  const running = skin.run({ budgetMs: 1 });
  expect(code(() => skin.step())).toBe('invalid-argument');
  await running;
  expect((await rejection(skin.run(wrong({ budget: 1 })))).code).toBe('invalid-argument');
  skin.free();
  expect(code(() => skin.step())).toBe('freed');
  expect(code(() => skin.mesh.info())).toBe('freed');
  models.pop();
});

test('parameters describe themselves', () => {
  const specs = paramSpecs('multires');
  expect(specs.map(({ name }) => name).sort()).toEqual(Object.keys(model().params).sort());
  for (const { help } of specs) expect(help.length).toBeGreaterThan(20);
});

test('the same bits as on every other platform', () => {
  expect(lampBits(vesicle)).toBe(LAMP_BITS);
});

test('a model can be created in slices, with the same bits, and not if that is aborted', async () => {
  const given: Options[] = [
    { detail: wavy() },
    { detail: wavy(), support: 'membrane', ellipsoids: [ball(0, 0.9)], params: EDGES },
    {
      detail: wavy(),
      base: Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 }),
      ellipsoids: [ball(0, 0.9)],
      params: EDGES,
    },
    { ellipsoids: [ball(-0.5, 1), ball(0.5, 0.8)], params: EDGES },
  ];
  for (const options of given) {
    const whole = model({ ellipsoids: [], params: {}, ...options });
    let turns = 0;
    const count = () => {
      turns += 1;
      immediate = setImmediate(count);
    };
    let immediate = setImmediate(count);
    const sliced = await MultiresolutionModel.create({ ellipsoids: [], ...options }, { budgetMs: 1e-6 });
    clearImmediate(immediate);
    models.push(sliced);
    expect(sliced).toBeInstanceOf(MultiresolutionModel);
    expect(sliced.mesh.arrays()).toEqual(whole.mesh.arrays());
    expect(Buffer.from(sliced.save()).equals(Buffer.from(whole.save()))).toBe(true);
    expect(turns).toBeGreaterThan(2);
    const stop = new AbortController();
    const aborted = MultiresolutionModel.create(options, { signal: stop.signal, budgetMs: 1e-6 });
    setImmediate(() => stop.abort(new Error('enough')));
    await expect(aborted).rejects.toThrow('enough');
    await expect(MultiresolutionModel.create(options, { signal: stop.signal })).rejects.toThrow('enough');
  }
  const error = await rejection(MultiresolutionModel.create({ ellipsoids: [], params: EDGES }));
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('ellipsoid')]);
});

test('the meshes of a model that is created in slices may be freed meanwhile', async () => {
  const detail = wavy();
  const created = MultiresolutionModel.create({ detail }, { budgetMs: 1e-6 });
  detail.free();
  const made = await created;
  models.push(made);
  expect(made.mesh.arrays().positions).toEqual(wavy().arrays().positions);
});
