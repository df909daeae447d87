import { expect, test } from 'vitest';
import * as vesicle from '../../pkg/index.js';
import {
  type Camera,
  DeformableModel,
  type ImplicitChoice,
  ImplicitSurface,
  paramSpecs,
  parsePoints,
} from '../../pkg/index.js';
import { BUMPS_BITS, bumpsBits } from './bumps.js';
import { failure, HEALTHY, rejection, wrong } from './helpers.js';

type Options = ConstructorParameters<typeof ImplicitSurface>[0];

/** Returns points of the unit sphere on a spiral, packed xyz. */
function ball(count: number): Float32Array {
  const golden = Math.PI * (3 - Math.sqrt(5));
  return Float32Array.from({ length: 3 * count }, (_, at) => {
    const i = Math.floor(at / 3);
    const z = 1 - (2 * i + 1) / count;
    const across = Math.sqrt(1 - z * z);
    return [across * Math.cos(golden * i), across * Math.sin(golden * i), z][at % 3] as number;
  });
}

const points = ball(300);
const surface = (options: Partial<Options> = {}) => new ImplicitSurface({ points, ...options });
const finished = (options: Partial<Options> = {}) => {
  const whole = surface(options);
  while (!whole.step(100).done);
  return whole;
};
const bytesOf = ({ mesh }: ImplicitSurface) => Buffer.from(mesh.arrays().positions);

/** Returns a camera on the z axis, directed at the ball, with an image of one colour. */
const above = (color = [255, 0, 0, 255]): Camera => ({
  projection: [100, 0, -50, 250, 0, -100, -50, 250, 0, 0, -1, 5],
  width: 101,
  height: 101,
  image: Uint8ClampedArray.from({ length: 4 * 101 * 101 }, (_, i) => color[i % 4] as number),
});

test('a ball is reconstructed', async () => {
  const found = surface();
  const phases = new Set<string>();
  const report = await found.run({ onStep: ({ phase }) => phases.add(phase) });
  expect(report).toMatchObject({ done: true, progress: 1, components: 1, euler: 2 });
  expect(report.residual).toBeLessThanOrEqual(report.tolerance);
  expect([...phases]).toEqual(['subsample', 'constraints', 'solve', 'extract', 'colour']);
  expect(found.mesh.check()).toEqual(HEALTHY);
  const { volume } = found.mesh.info();
  expect(volume / ((4 / 3) * Math.PI)).toBeGreaterThan(0.97);
  expect(volume / ((4 / 3) * Math.PI)).toBeLessThan(1.01);
  const { mean, rms, max } = found.fitness();
  expect(mean).toBeLessThan(0.01);
  expect(rms).toBeGreaterThanOrEqual(mean);
  expect(max).toBeGreaterThanOrEqual(rms);
  expect([found.duplicates, found.outliers, found.spuriousComponents, found.warning]).toEqual([0, 0, 0, undefined]);
  expect(found.spacing).toBeGreaterThan(0);
  expect(found.cell).toBeGreaterThan(0);
});

test('values and gradients of the function', () => {
  const found = finished();
  const [inside, outside] = found.evaluate(Float32Array.of(0, 0, 0, 1.3, 0, 0));
  expect(inside).toBeGreaterThan(0);
  expect(outside).toBeLessThan(0);
  const slope = found.gradient(Float32Array.of(1, 0, 0));
  expect(slope).toHaveLength(3);
  expect(slope[0]).toBeLessThan(0);
  const { surface: near, exterior } = found.constraints();
  expect(near).toHaveLength(points.length);
  expect(exterior.length).toBeGreaterThan(3 * 16);
});

test('the live mesh is one object, empty before the first surface', () => {
  const found = surface();
  const { mesh } = found;
  expect(mesh.vertexCount).toBe(0);
  const before = mesh.geometryVersion;
  while (!found.step().done);
  expect(found.mesh).toBe(mesh);
  expect(mesh.vertexCount).toBeGreaterThan(100);
  expect(mesh.geometryVersion).toBeGreaterThan(before);
});

test('run, step and single steps end in the same bits', async () => {
  const [run, atOnce, each] = [surface(), surface(), surface()];
  const last = await run.run({ budgetMs: 0.01 });
  expect(atOnce.step(100_000).iteration).toBe(last.iteration);
  while (!each.step().done);
  expect(bytesOf(run).equals(bytesOf(atOnce))).toBe(true);
  expect(bytesOf(run).equals(bytesOf(each))).toBe(true);
});

test('a restored run continues bit for bit in every phase', () => {
  const whole = finished();
  const running = surface();
  for (const steps of [1, 1, 1, 2, 2, 5]) {
    running.step(steps);
    const resumed = surface();
    resumed.restore(running.save());
    expect(resumed.step(100_000).iteration).toBe(whole.step().iteration);
    expect(bytesOf(resumed).equals(bytesOf(whole))).toBe(true);
  }
});

test('edits change the surface, and are restored with a saved state', () => {
  const found = finished();
  const { volume } = found.mesh.info();
  const edits = {
    added: Float32Array.of(0, 0, 1.15, 0, 0.1, 1.14),
    removed: Uint32Array.of(0, 1, 2),
    exterior: Float32Array.of(0, 0, -1.1),
  };
  const before = found.constraints().surface.length / 3;
  found.setEdits(edits);
  expect(found.edits).toEqual(edits);
  expect(found.mesh.info().volume).toBe(volume);
  expect(found.step(100_000)).toMatchObject({ done: true, components: 1, euler: 2 });
  expect(found.mesh.check().selfIntersections).toBe(0);
  expect(found.evaluate(Float32Array.of(0, 0, 1.08))[0]).toBeGreaterThan(0);
  expect(found.constraints().surface.length / 3).toBe(before - 1);
  const other = surface();
  other.restore(found.save());
  expect(other.edits).toEqual(edits);
  for (const one of [found, other]) {
    one.setEdits({});
    one.step(100_000);
  }
  expect(bytesOf(other).equals(bytesOf(found))).toBe(true);
  expect(found.mesh.info().volume).toBeCloseTo(volume, 3);
  for (const [name, bad] of [
    ['added', { added: Float32Array.of(0, 0, 9) }],
    ['added', { added: Float32Array.of(0, Number.NaN, 0) }],
    ['added', { added: Float32Array.of(0, 1) }],
    ['exterior', { exterior: wrong([0, 0, 1]) }],
    ['removed', { removed: Uint32Array.of(1_000_000) }],
    ['removed', { removed: wrong([1]) }],
    ['remove', { remove: Uint32Array.of(1) } as object],
  ] as const) {
    const { code, message } = failure(() => found.setEdits(bad));
    expect(code).toBe('invalid-argument');
    expect(message).toContain(name);
  }
});

test('invalid states are refused', () => {
  const found = finished();
  const state = found.save();
  for (const bytes of [
    new Uint8Array(),
    state.slice(0, 20),
    state.slice(0, -1),
    new Uint8Array(state.length).fill(7),
  ]) {
    expect(failure(() => found.restore(bytes)).code).toBe('bad-file');
  }
  expect(failure(() => surface({ points: ball(299) }).restore(state)).code).toBe('bad-file');
  expect(failure(() => found.restore(wrong([]))).code).toBe('invalid-argument');
  expect(found.step().done).toBe(true);
});

test('sampled as a volume it can be fitted by the deformable model', async () => {
  const volume = finished().toVolume([32, 32, 32]);
  expect(volume.dims).toEqual([32, 32, 32]);
  const model = new DeformableModel({ volume, params: { iso: 0 } });
  const report = await model.run({ maxIterations: 400 });
  expect(report).toMatchObject({ components: 1, euler: 2 });
  expect(model.mesh.info().volume / ((4 / 3) * Math.PI)).toBeGreaterThan(0.9);
});

test('a surface of more vertices than allowed is refused, and a larger cell is taken then', () => {
  const refused = failure(() => finished({ params: { cell: 0.004, sides: 'outside' } }));
  expect([refused.code, refused.message]).toEqual([
    'too-large',
    expect.stringMatching(/more than 350000 vertices: use a larger cell/),
  ]);
  const few = surface({ maxVertices: 500 });
  expect(failure(() => few.step(1000)).message).toContain('more than 500 vertices');
  few.setParams({ cell: 0.3 });
  while (!few.step(100).done);
  expect(few.mesh.vertexCount).toBeLessThan(500);
});

test('it is coloured in slices to the same bits, if it does not change meanwhile, and not if that is aborted', async () => {
  const [whole, sliced, aborted, changed] = [finished(), finished(), finished(), finished()];
  const cameras = Array.from({ length: 40 }, (_, k) => above([6 * k, 0, 0, 255]));
  whole.colorize(cameras);
  await sliced.inSlices({ budgetMs: 0.01 }).colorize(cameras);
  expect(whole.mesh.arrays().colors).toBeDefined();
  expect(sliced.mesh.arrays().colors).toEqual(whole.mesh.arrays().colors);
  const stop = new AbortController();
  const work = aborted.inSlices({ signal: stop.signal, budgetMs: 0.01 }).colorize(cameras);
  stop.abort('enough');
  await expect(work).rejects.toBe('enough');
  expect(aborted.mesh.arrays().colors).toBeUndefined();
  const late = changed.inSlices({ budgetMs: 0.01 }).colorize(cameras);
  changed.colorize(cameras.slice(0, 1));
  expect((await rejection(late)).message).toContain('the surface has changed meanwhile');
});

test('it is sampled in slices to the same bits, although it changes meanwhile, and not if that is aborted', async () => {
  const found = finished();
  const whole = found.toVolume([40, 41, 42]);
  const sampling = found.inSlices({ budgetMs: 0.01 }).toVolume([40, 41, 42]);
  found.setParams({ delta: 9 });
  const sliced = await sampling;
  expect(sliced.intensities()).toEqual(whole.intensities());
  expect(sliced.affine).toEqual(whole.affine);
  const stop = new AbortController();
  const other = finished();
  const aborted = other.inSlices({ signal: stop.signal, budgetMs: 0.01 }).toVolume([100, 100, 100]);
  setTimeout(() => stop.abort('enough'));
  await expect(aborted).rejects.toBe('enough');
  expect((await rejection(other.inSlices().toVolume([1, 9, 9]))).message).toContain('dims');
  expect((await rejection(surface().inSlices().toVolume([9, 9, 9]))).message).toContain('solved');
});

test('colours from images and from points', () => {
  const found = finished();
  expect(found.mesh.arrays().colors).toBeUndefined();
  found.colorize([above()]);
  const { colors, positions } = found.mesh.arrays();
  expect(colors).toHaveLength(positions.length);
  expect([...(colors as Float32Array).slice(0, 3)].map((c) => Math.round(c))).toEqual([1, 0, 0]);
  const own = finished({ colors: new Float32Array(points.length).fill(0.25) });
  for (const c of own.mesh.arrays().colors as Float32Array) expect(c).toBeCloseTo(0.25, 5);
  const { image: _, ...blind } = above();
  for (const cameras of [[], [blind]]) {
    const error = failure(() => found.colorize(cameras));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain('cameras');
  }
});

test('any subset of parameters can be set, all or nothing', () => {
  const found = finished();
  const before = found.params;
  found.setParams({ delta: 30 });
  expect(found.params).toEqual({ ...before, delta: 30 });
  expect(found.warning).toContain('25');
  const refused: [string, object][] = [
    ['delta', { tau: 0.02, delta: 0 }],
    ['tau', { delta: 4, tau: Number.NaN }],
    ['lambdaSurface', { delta: 4, lambdaSurface: -1 }],
    ['kernel', { delta: 4, kernel: 'cubic' }],
    ['level', { delta: 4, level: 1 }],
    ['lamda', { delta: 4, lamda: 1 }],
  ];
  for (const [name, params] of refused) {
    const error = failure(() => found.setParams(params));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain(name);
    expect(found.params.delta).toBe(30);
  }
  expect(failure(() => found.setParams(wrong([]))).code).toBe('invalid-argument');
});

test('specs describe every parameter, with its default', () => {
  const specs = paramSpecs('implicit');
  const defaults: Record<string, unknown> = surface().params;
  expect(specs.map(({ name }) => name).sort()).toEqual(Object.keys(defaults).sort());
  for (const spec of specs) {
    expect(spec.help.length, spec.name).toBeGreaterThan(10);
    expect(defaults[spec.name], spec.name).toEqual(spec.default);
  }
});

const flat = points.map((value, i) => (i % 3 === 2 ? 0 : value));
const holed = points.with(7, Number.NaN);
const REFUSED: [string, string, () => unknown][] = [
  ['no options', 'points', () => new ImplicitSurface(wrong(undefined))],
  ['no points', 'points', () => surface({ points: new Float32Array() })],
  ['three points', 'points', () => surface({ points: points.slice(0, 9) })],
  ['a part of a point', 'points', () => surface({ points: points.slice(0, 100) })],
  ['a list', 'points', () => surface({ points: wrong([0, 0, 0]) })],
  ['all in one plane', 'points', () => surface({ points: flat })],
  ['a point nowhere', 'points', () => surface({ points: holed })],
  ['too few normals', 'normals', () => surface({ normals: points.slice(3) })],
  ['a normal nowhere', 'normals', () => surface({ normals: holed })],
  ['confidence 0', 'confidence', () => surface({ confidence: new Float32Array(300) })],
  ['too much confidence', 'confidence', () => surface({ confidence: new Float32Array(300).fill(2) })],
  ['too few colours', 'colors', () => surface({ colors: points.slice(3) })],
  ['an exterior point nowhere', 'exterior', () => surface({ exterior: Float32Array.of(2, 2, Number.NaN) })],
  ['no room', 'maxPoints', () => surface({ maxPoints: 3 })],
  ['too much room', 'maxPoints', () => surface({ maxPoints: 100_001 })],
  ['no part', 'keepComponents', () => surface({ keepComponents: 0 })],
  ['half a part', 'keepComponents', () => surface({ keepComponents: 0.5 })],
  ['a misspelled option', 'maxpoints', () => surface(wrong({ maxpoints: 9 }))],
  ['a parameter out of range', 'delta', () => surface({ params: { delta: -1 } })],
  [
    'a camera without centre',
    'cameras',
    () => surface({ cameras: [{ ...above(), projection: new Float64Array(12) }] }),
  ],
  ['too few numbers', 'projection', () => surface({ cameras: [{ ...above(), projection: [1, 2] }] })],
  ['a picture of another size', 'cameras', () => surface({ cameras: [{ ...above(), width: 100 }] })],
  ['half a step', 'iterations', () => surface().step(0.5)],
  ['f before it is solved', 'evaluate', () => surface().evaluate(points)],
  ['a slope before it is solved', 'gradient', () => surface().gradient(points)],
  ['a volume before it is solved', 'toVolume', () => surface().toVolume([9, 9, 9])],
  ['fitness before there is a surface', 'surface', () => surface().fitness()],
  ['colours before there is a surface', 'colorize', () => surface().colorize([above()])],
  ['a flat volume', 'dims', () => finished().toVolume([1, 9, 9])],
];

test.each(REFUSED)('%s is refused, naming %s', (_, word, work) => {
  const error = failure(work);
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(word);
});

test('a system without solution is reported, and other parameters continue', () => {
  const twins = Float32Array.from([...points, ...points.map((value) => value + 1e-7)]);
  const params = { kernel: 'gaussian', sigma: 1, lambdaSurface: 0, lambdaExterior: 0, tolerance: 1e-12 } as const;
  const found = surface({ points: twins, params });
  const error = failure(() => found.step(100_000));
  expect(error.code).toBe('singular-system');
  expect(error.message).toContain('lambdaSurface');
  found.setParams({ kernel: 'multi-order', lambdaSurface: 0.001, lambdaExterior: 2, tolerance: 1e-5 });
  expect(found.step(100_000).done).toBe(true);
});

const PAPER = { delta: 5, lambdaSurface: 0.001, lambdaExterior: 2, sides: 'outside' } as const;

test('by default, parameters are chosen from the points, and said', async () => {
  const chosen = surface();
  expect(chosen.choice).toBeUndefined();
  const automatic = { delta: 'auto', lambdaSurface: 'auto', lambdaExterior: 'auto', sides: 'auto' };
  expect(chosen.params).toMatchObject(automatic);
  const { done } = await chosen.run();
  expect(done).toBe(true);
  const { noise, density, lambdaSurface, delta } = chosen.choice ?? {};
  expect(noise).toBeLessThan(0.01);
  expect([density, lambdaSurface, delta].every((value) => (value ?? 0) > 0)).toBe(true);
  const { surface: on, exterior, interior } = chosen.constraints();
  expect(interior.length).toBeGreaterThan(60);
  expect(chosen.evaluate(interior).every((value) => value > 0)).toBe(true);
  expect(chosen.evaluate(exterior).every((value) => value < 0)).toBe(true);
  expect(on.length).toBe(points.length);
  expect(chosen.mesh.check()).toMatchObject(HEALTHY);
  expect(() => chosen.setParams({ delta: wrong('some') })).toThrow('delta');
  const { noise: _, density: __, ...values } = chosen.choice as ImplicitChoice;
  expect(bytesOf(finished({ params: values })).equals(bytesOf(chosen))).toBe(true);
  chosen.setParams(PAPER);
  while (!chosen.step(100).done);
  expect(chosen.constraints().interior).toHaveLength(0);
  expect(bytesOf(finished({ params: PAPER })).equals(bytesOf(chosen))).toBe(true);
  chosen.free();
});

test.each([20, 50, 100])('%i points on a sphere are enough for a ball', (count) => {
  const { mesh } = finished({ points: ball(count) });
  const { components, euler, volume } = mesh.info();
  expect([components, euler]).toEqual([1, 2]);
  expect(Math.abs(volume / ((4 / 3) * Math.PI) - 1)).toBeLessThan(0.1);
});

test('an outlier that is discarded changes nothing, and one that is kept gives a warning', () => {
  const alone = finished({ keepComponents: 1 });
  for (const far of [50, 1000, 1e6]) {
    const all = Float32Array.from([...points, far, 0, 0, 0, far, 0]);
    const without = finished({ points: all, keepComponents: 1 });
    expect(without.outliers).toBe(2);
    expect(bytesOf(without).equals(bytesOf(alone))).toBe(true);
    expect(without.fitness()).toEqual(alone.fitness());
    expect(without.step().warnings).toEqual([]);
    const kept = finished({ points: all });
    expect(kept.outliers).toBe(0);
    expect(kept.step().warnings.map(({ code }) => code)).toContain('outliers');
  }
});

test('an aborted run rejects with the reason and can continue later', async () => {
  const found = surface();
  const [abort, reason] = [new AbortController(), new Error('enough')];
  const stopped = found.run({
    signal: abort.signal,
    onStep: ({ iteration }) => {
      if (iteration === 4) abort.abort(reason);
    },
  });
  await expect(stopped).rejects.toBe(reason);
  expect(found.step().iteration).toBe(5);
  await expect(found.run({ signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  expect((await found.run()).done).toBe(true);
});

test('a second run is refused, and freeing a surface ends its run', async () => {
  const found = surface();
  const running = found.run({ budgetMs: 0.01 });
  expect((await rejection(found.run())).code).toBe('invalid-argument');
  expect(failure(() => found.step()).message).toContain('during a run');
  expect(failure(() => found.restore(found.save())).message).toContain('during a run');
  found.free();
  expect((await rejection(running)).code).toBe('freed');
});

test('a freed surface is refused', () => {
  const found = finished();
  const { mesh } = found;
  found.free();
  const uses = [
    () => found.step(),
    () => found.params,
    () => found.setParams({}),
    () => found.evaluate(points),
    () => found.gradient(points),
    () => found.constraints(),
    () => found.fitness(),
    () => found.preview(),
    () => found.toVolume([9, 9, 9]),
    () => found.colorize([above()]),
    () => found.save(),
    () => found.cell,
    () => mesh.info(),
  ];
  for (const use of uses) expect(failure(use).code).toBe('freed');
});

test('parsing files of points', () => {
  const bytes = (text: string) => new TextEncoder().encode(text);
  const { points: found, normals, colors } = parsePoints(bytes('0 0 1\n1 0 0\n0 1 0\n0 0 0\n'));
  expect([...found]).toEqual([0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 0]);
  expect([normals, colors]).toEqual([undefined, undefined]);
  const lines = ['ply', 'format ascii 1.0', 'element vertex 1', ...['x', 'y', 'z'].map((k) => `property float ${k}`)];
  const ply = bytes([...lines, 'end_header', '1 2 3', ''].join('\n'));
  expect([...parsePoints(ply).points]).toEqual([1, 2, 3]);
  for (const bad of [bytes(''), bytes('solid'), ply.slice(0, -7), Uint8Array.of(0, 1, 2, 255)]) {
    expect(failure(() => parsePoints(bad)).code).toBe('bad-file');
  }
  expect(failure(() => parsePoints(wrong('0 0 1'))).code).toBe('invalid-argument');
});

test('the same bits as natively', () => {
  expect(bumpsBits(vesicle)).toBe(BUMPS_BITS);
});
