import { AnimationMixer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { afterEach, expect, test } from 'vitest';
import {
  Mesh,
  paramSpecs,
  type StepReport,
  SurfaceTracker,
  type TrackingOptions,
  type TrackingParams,
  type Vec3,
  Volume,
} from '../../pkg/index.js';
import { beating, FRAMES, LARGE, MIDDLE, pair, pierced, REACH, SECONDS, SMALL, truth } from './beating.js';
import { failure, HEALTHY, rejection, wrong } from './helpers.js';

const volume = beating();
const short = beating({ frames: 3 });
const trackers: SurfaceTracker[] = [];

function tracker(more: Partial<TrackingOptions> = {}): SurfaceTracker {
  const made = new SurfaceTracker({ volume, ...more });
  trackers.push(made);
  return made;
}

/** Returns a tracker that has run to the end. */
function tracked(more: Partial<TrackingOptions> = {}): SurfaceTracker {
  const made = tracker(more);
  expect(made.step(1000).done).toBe(true);
  return made;
}

afterEach(() => {
  for (const made of trackers.splice(0)) made.free();
});

const bytesOf = (mesh: Mesh) => Buffer.from(mesh.arrays().positions.buffer);
/** Returns the bytes of the surfaces of all completed frames. */
const bytesOfAll = (one: SurfaceTracker) =>
  Buffer.concat(Array.from(one.volumes(), (_, frame) => bytesOf(one.meshAt(frame))));
const apart = (a: Vec3, b: Vec3) => Math.hypot(...a.map((x, k) => x - (b[k] as number)));

test('a tracker is created with pauses, to the same bits, and that is aborted', async () => {
  const made = await SurfaceTracker.create({ volume: short, params: { damping: 0.9 } }, { budgetMs: 1e-6 });
  trackers.push(made);
  const direct = tracker({ volume: short, params: { damping: 0.9 } });
  expect([made.params, made.noise, made.save()]).toEqual([direct.params, direct.noise, direct.save()]);
  made.step(1000);
  direct.step(1000);
  expect(bytesOfAll(made)).toEqual(bytesOfAll(direct));
  const abort = new AbortController();
  const work = SurfaceTracker.create({ volume: short }, { signal: abort.signal, budgetMs: 1e-6 });
  abort.abort('enough');
  await expect(work).rejects.toBe('enough');
  await expect(SurfaceTracker.create({ volume: short, params: { radius: -1 } })).rejects.toThrow('radius');
  expect(await rejection(SurfaceTracker.create(wrong({ volume: 1 })))).toMatchObject({ code: 'invalid-argument' });
});

test('the ball is tracked through its beat: valid surfaces of the right position and size', () => {
  const one = tracked({ params: { cyclic: true } });
  expect([one.frames, one.frame]).toEqual([FRAMES, FRAMES - 1]);
  const volumes = [...one.volumes()];
  expect(volumes).toHaveLength(FRAMES);
  for (const [frame, found] of volumes.entries()) {
    const mesh = one.meshAt(frame);
    expect(mesh.check(), `${frame}`).toEqual(HEALTHY);
    const { components, euler, centroid, volume } = mesh.info();
    expect([components, euler]).toEqual([1, 2]);
    expect(found).toBeCloseTo(volume, 6);
    expect(apart(centroid, MIDDLE)).toBeLessThan(0.2);
    // Round surfaces shrink a little, as with any mean over a neighbourhood.
    expect(found / truth(frame), `${frame}`).toBeGreaterThan(0.84);
    expect(found / truth(frame), `${frame}`).toBeLessThan(1.06);
  }
});

test('the surface of each frame has what is true of it, also if it is true of others', () => {
  const one = tracked({ volume: short, box: { min: REACH.min, max: [MIDDLE[0], REACH.max[1], REACH.max[2]] } });
  const expected = [0, 1, 2].map((frame) => [expect.objectContaining({ code: 'touches-box', where: { frame } })]);
  expect(expected.map((_, frame) => one.meshAt(frame).warnings)).toEqual(
    expected.map((list) => expect.arrayContaining(list)),
  );
  expect(one.step().warnings.filter(({ code }) => code === 'touches-box')).toMatchObject([{ where: { frame: 0 } }]);
});

test('volumes decrease and increase once, and a cycle closes', () => {
  const one = tracker({ params: { cyclic: true } });
  expect(one.cycleClosureError).toBeUndefined();
  one.step(2 * FRAMES);
  expect(one.cycleClosureError).toBeUndefined();
  expect(one.step()).toMatchObject({ done: true, iteration: 2 * FRAMES + 1 });
  expect(one.cycleClosureError).toBeGreaterThan(0);
  expect(one.cycleClosureError).toBeLessThan(0.3);
  const volumes = [...one.volumes()];
  const rises = volumes.map((value, frame) => (volumes[(frame + 1) % FRAMES] as number) > value);
  expect(rises).toEqual(volumes.map((_, frame) => frame >= FRAMES / 2));
});

test('reports show progress: first boundaries, then surfaces, then the closing of the cycle', () => {
  const one = tracker({ volume: short, params: { cyclic: true } });
  const reports: StepReport[] = [];
  const frames: number[] = [];
  while (!reports.at(-1)?.done) {
    reports.push(one.step());
    frames.push(one.frame);
  }
  expect(reports.map(({ iteration }) => iteration)).toEqual([1, 2, 3, 4, 5, 6, 7]);
  expect(frames).toEqual([0, 0, 0, 0, 1, 2, 2]);
  for (const [at, { progress }] of reports.entries()) expect(progress).toBeCloseTo((at + 1) / 7, 12);
  const parts = reports.map(({ times }) => Object.keys(times).join());
  expect(parts).toEqual([...Array(3).fill('boundary'), ...Array(3).fill('surface'), 'closure']);
  for (const { phase, times, tolerance } of reports) {
    expect(phase).toMatch(/finding boundary|tracking surface|closing the cycle/);
    expect(tolerance).toBeGreaterThan(0);
    for (const milliseconds of Object.values(times)) expect(milliseconds).toBeGreaterThanOrEqual(0);
  }
  expect(reports.slice(0, 3).every(({ triangles }) => triangles === 0)).toBe(true);
  const { vertexCount: vertices, triangleCount: triangles } = one.mesh;
  expect(reports[6]).toMatchObject({ vertices, triangles, components: 1, euler: 2, progress: 1 });
  const counts = ['creations', 'deletions', 'inversions', 'axial', 'annular', 'vanished', 'seeds'];
  expect(Object.keys((reports[4] as StepReport).events).sort()).toEqual(counts.sort());
});

test('without a cycle it ends with the last frame', () => {
  const one = tracked({ volume: short });
  expect(one.step(0x7fffffff).progress).toBe(1);
  expect(one.cycleClosureError).toBeUndefined();
  expect(one.volumes()).toHaveLength(3);
});

test('the live mesh is one object that follows the frames', () => {
  const one = tracker({ volume: short });
  const { mesh } = one;
  expect([mesh.triangleCount, one.frame, one.frames]).toEqual([0, 0, 3]);
  one.step(4);
  const { geometryVersion } = mesh;
  const first = bytesOf(mesh);
  expect(first.equals(bytesOf(one.meshAt(0)))).toBe(true);
  one.step();
  expect(one.mesh).toBe(mesh);
  expect(mesh.geometryVersion).toBeGreaterThan(geometryVersion);
  expect(bytesOf(mesh).equals(bytesOf(one.meshAt(1)))).toBe(true);
  expect(bytesOf(one.meshAt(0)).equals(first)).toBe(true);
  const error = failure(() => mesh.refine());
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('clone()')]);
});

test('the surface of a frame is a copy', () => {
  const one = tracker({ volume: short });
  one.step(4);
  const copy = one.meshAt(0);
  copy.refine();
  expect(copy.triangleCount).toBe(3 * one.meshAt(0).triangleCount);
  one.free();
  expect(copy.check()).toEqual(HEALTHY);
});

test('the boundary consists of weighted space-time points', () => {
  const one = tracker({ volume: short });
  expect(one.boundary()).toHaveLength(0);
  one.step(2);
  expect([...one.boundary()]).toEqual([...one.boundary(1)]);
  expect(one.boundary(2)).toHaveLength(0);
  const points = one.boundary(1);
  expect(points).toBeInstanceOf(Float32Array);
  expect(points.length % 5).toBe(0);
  expect(points.length).toBeGreaterThan(5 * 100);
  let [near, all] = [0, 0];
  for (let at = 0; at < points.length; at += 5) {
    const [x, y, z, t, weight] = points.subarray(at, at + 5) as unknown as [number, number, number, number, number];
    expect([1, 1.5]).toContain(t);
    expect(weight).toBeGreaterThan(0);
    expect(weight).toBeLessThanOrEqual(1);
    const away = Math.abs(apart([x, y, z], MIDDLE) - Math.cbrt((truth(t) * 3) / (4 * Math.PI)));
    [near, all] = [near + (away < 2 ? weight : 0), all + weight];
  }
  expect(near / all).toBeGreaterThan(0.9);
});

test('every frame has its statistics, and the volume its noise', () => {
  const one = tracked({ volume: short });
  // The sum of two uniform numbers from -5 to 5.
  expect(one.noise / (10 / Math.sqrt(6))).toBeGreaterThan(0.8);
  expect(one.noise / (10 / Math.sqrt(6))).toBeLessThan(1.4);
  expect(one.statistics).toHaveLength(3);
  for (const [frame, facts] of one.statistics.entries()) {
    const { area, triangles } = one.meshAt(frame).info();
    expect(facts).toMatchObject({ area, triangles, folded: 0, volume: one.volumes()[frame] });
    for (const count of [facts.rejected, facts.heldMoves, facts.withoutBoundary])
      expect(Number.isInteger(count)).toBe(true);
    expect(facts.steps).toBeGreaterThan(0);
    expect(facts.meanFinalCorrection).toBeLessThan(1);
  }
});

test('tracking succeeds with and without prediction', () => {
  const [predicted, not] = [tracked(), tracked({ params: { prediction: false } })];
  expect(bytesOfAll(predicted).equals(bytesOfAll(not))).toBe(false);
  const last = FRAMES - 1;
  expect(not.mesh.check()).toEqual(HEALTHY);
  expect(not.mesh.distanceTo(predicted.mesh).mean).toBeLessThan(0.3);
  expect((not.volumes()[last] as number) / truth(last)).toBeGreaterThan(0.8);
});

test('an animation shows each frame for the duration given by the volume', async () => {
  const one = tracked({ volume: short });
  const glb = one.toGlb();
  const { scene, animations } = await new GLTFLoader().parseAsync(glb.buffer as ArrayBuffer, '');
  expect(scene.children).toHaveLength(3);
  const [clip] = animations;
  if (!clip) throw new Error('no animation');
  expect(clip.duration).toBeCloseTo(3 * SECONDS, 6);
  const mixer = new AnimationMixer(scene);
  mixer.clipAction(clip).play();
  for (const frame of [0, 1, 2]) {
    mixer.setTime((frame + 0.5) * SECONDS);
    expect(scene.children.map(({ scale }) => scale.x)).toEqual([0, 1, 2].map((at) => (at === frame ? 1 : 0)));
  }
  const first = Mesh.parse(glb);
  expect(first.check()).toEqual(HEALTHY);
  expect(first.info().volume).toBeCloseTo(one.volumes()[0] as number, 3);
});

test('an animation of a volume without times, and of the frames done so far', async () => {
  const one = tracker({ volume: beating({ frames: 3 }, { frameSeconds: wrong(undefined) }) });
  one.step(5);
  const { animations } = await new GLTFLoader().parseAsync(one.toGlb().buffer as ArrayBuffer, '');
  expect(animations[0]?.duration).toBeCloseTo(2 * 0.1, 6);
});

/** Returns a sequence with a ball in the given frames, and none in the others. */
function appearing(frames: readonly boolean[], origin: Vec3 = [0, 0, 0]): Volume {
  const side = 20;
  const data = new Uint8Array(frames.length * side ** 3);
  data.forEach((_, i) => {
    const p = [i % side, Math.floor(i / side) % side, Math.floor(i / side ** 2) % side];
    const depth = 6.5 - Math.hypot(...p.map((x) => x - 9.5));
    if (frames[Math.floor(i / side ** 3)]) data[i] = 200 * Math.min(1, Math.max(0, depth));
  });
  return new Volume({ data, dims: [side, side, side, frames.length], origin });
}

test('frames without the object have no surface, and are told', async () => {
  const shown = [false, true, true, false, true];
  const one = tracked({ volume: appearing(shown) });
  for (const [frame, volume] of one.volumes().entries()) {
    const mesh = one.meshAt(frame);
    const size = shown[frame] ? (4 / 3) * Math.PI * 6 ** 3 : 0;
    expect(Math.abs(volume - size)).toBeLessThanOrEqual(0.02 * size);
    expect(mesh.info().volume).toBeCloseTo(volume, 6);
    expect(mesh.triangleCount > 0).toBe(shown[frame]);
    expect(one.statistics[frame]?.triangles).toBe(mesh.triangleCount);
    mesh.free();
  }
  const { warnings } = one.step();
  expect(warnings.map(({ code, where }) => [code, where])).toEqual([
    ['begins-in-frame', { frame: 1 }],
    ['ends-in-frame', { frame: 3 }],
    ['begins-in-frame', { frame: 4 }],
  ]);
  const resumed = tracker({ volume: appearing(shown) });
  resumed.restore(one.save());
  expect([[...resumed.volumes()], resumed.step().warnings]).toEqual([[...one.volumes()], warnings]);
  const { scene, animations } = await new GLTFLoader().parseAsync(one.toGlb().buffer as ArrayBuffer, '');
  const mixer = new AnimationMixer(scene);
  mixer.clipAction(animations[0] as never).play();
  for (const [frame, isShown] of shown.entries()) {
    mixer.setTime((frame + 0.5) * 0.1);
    expect(scene.children.filter(({ scale }) => scale.x > 0)).toHaveLength(isShown ? 1 : 0);
  }
});

test('a surface far from the origin has an origin of its own', () => {
  const near = tracked({ volume: appearing([true, true]) });
  const far = tracked({ volume: appearing([true, true], [2e6, -2e6, 0]) });
  expect(near.origin).toEqual([0, 0, 0]);
  expect(apart(far.origin, [2e6, -2e6, 0])).toBeLessThan(40);
  expect(far.volumes()[1]).toBeCloseTo(near.volumes()[1] as number, 2);
  const [x, y, z] = far.boundary(0);
  expect(Math.hypot(x as number, y as number, z as number)).toBeLessThan(40);
});

test.each([0, 2, 3, 4, 5, 6])('a state after %i steps continues bit for bit', (steps) => {
  const more = { volume: short, params: { cyclic: true } };
  const [saved, resumed] = [tracker(more), tracker(more)];
  if (steps > 0) saved.step(steps);
  const state = saved.save();
  resumed.step(5);
  resumed.restore(state);
  expect(Buffer.from(resumed.save()).equals(Buffer.from(state))).toBe(true);
  expect([resumed.frame, [...resumed.volumes()]]).toEqual([saved.frame, [...saved.volumes()]]);
  const reports = [saved, resumed].map((one) => ({ ...one.step(100), times: {} }));
  expect(reports[1]).toEqual(reports[0]);
  expect(bytesOfAll(resumed).equals(bytesOfAll(saved))).toBe(true);
  expect(resumed.cycleClosureError).toBe(saved.cycleClosureError);
});

test('a state includes its parameters', () => {
  const [saved, resumed] = [
    tracker({ volume: short, params: { damping: 0.7, threshold: 50 } }),
    tracker({ volume: short }),
  ];
  saved.step(4);
  resumed.restore(saved.save());
  expect(resumed.params).toEqual(saved.params);
  expect(resumed.mesh.vertexCount).toBe(saved.mesh.vertexCount);
});

test('an invalid state is refused and changes nothing', () => {
  const [one, untouched] = [tracker({ volume: short }), tracker({ volume: short })];
  for (const each of [one, untouched]) each.step(4);
  const state = one.save();
  const broken = [new Uint8Array(), state.slice(0, 20), state.slice(0, -1), new Uint8Array(state.length).fill(7)];
  const others = [beating({ frames: 3, seed: 8 }), beating({ frames: 4 })].map((other) =>
    tracker({ volume: other }).save(),
  );
  const boxed = tracker({ volume: short, box: { min: REACH.min, max: MIDDLE } }).save();
  const started = tracker({ volume: short, start: Mesh.icosphere({ center: MIDDLE, radius: 8, maxEdge: 2 }) }).save();
  for (const bytes of [...broken, ...others, boxed, started]) {
    expect(failure(() => one.restore(bytes)).code).toBe('bad-file');
  }
  expect(failure(() => one.restore(wrong([]))).code).toBe('invalid-argument');
  for (const each of [one, untouched]) each.step(2);
  expect(bytesOfAll(one).equals(bytesOfAll(untouched))).toBe(true);
});

test('the same steps give the same bits, in slices or at once', async () => {
  const [sliced, atOnce, inParts] = [
    tracker({ volume: short }),
    tracker({ volume: short }),
    tracker({ volume: short }),
  ];
  expect((await sliced.run({ budgetMs: 0.01 })).done).toBe(true);
  atOnce.step(6);
  for (let i = 0; i < 3; i++) inParts.step(2);
  expect(bytesOfAll(sliced).equals(bytesOfAll(atOnce))).toBe(true);
  expect(bytesOfAll(inParts).equals(bytesOfAll(atOnce))).toBe(true);
});

test("the events of several steps are the sum of each step's", () => {
  // Bounds so close that edges are split and collapsed in every frame.
  const params = { edgeMin: 0.7, edgeMax: 1.5 };
  const [together, each] = [tracker({ params }), tracker({ params })];
  const sum = (reports: StepReport[]) => reports.reduce((total, { events }) => total + events.deletions, 0);
  const single = Array.from({ length: 2 * FRAMES }, () => each.step());
  expect(sum(single)).toBeGreaterThan(0);
  expect(together.step(2 * FRAMES).events.deletions).toBe(sum(single));
});

test('onStep is called for every step, and can end the run', async () => {
  const one = tracker({ volume: short });
  const heard: number[] = [];
  const last = await one.run({ maxIterations: 4, onStep: ({ progress }) => heard.push(progress) });
  expect(heard).toHaveLength(4);
  expect(heard).toEqual(heard.toSorted((a, b) => a - b));
  expect(last).toMatchObject({ iteration: 4, done: false });
  const thrown = new Error('mine');
  const failing = one.run({
    onStep: () => {
      throw thrown;
    },
  });
  await expect(failing).rejects.toBe(thrown);
  expect((await one.run()).iteration).toBe(6);
});

test('an aborted run rejects with the reason and can continue later', async () => {
  const one = tracker({ volume: short });
  const abort = new AbortController();
  const reason = new Error('enough');
  const stopped = one.run({
    signal: abort.signal,
    onStep: ({ iteration }) => {
      if (iteration === 4) abort.abort(reason);
    },
  });
  await expect(stopped).rejects.toBe(reason);
  expect([one.frame, one.mesh.check()]).toEqual([0, HEALTHY]);
  await expect(one.run({ signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  await one.run();
  expect(bytesOfAll(one).equals(bytesOfAll(tracked({ volume: short })))).toBe(true);
});

test('an abort from a timer takes effect between frames', async () => {
  const abort = new AbortController();
  setTimeout(() => abort.abort('late'), 1);
  await expect(tracker().run({ signal: abort.signal, budgetMs: 1 })).rejects.toBe('late');
});

test('a second run is refused, but parameters can change during a run', async () => {
  const one = tracker({ volume: short });
  const first = one.run({ maxIterations: 5, budgetMs: 0.01 });
  expect((await rejection(one.run())).code).toBe('invalid-argument');
  expect(failure(() => one.step()).message).toContain('during a run');
  expect(failure(() => one.restore(one.save())).message).toContain('during a run');
  one.setParams({ damping: 0.8 });
  expect((await first).iteration).toBe(5);
  expect(one.step().iteration).toBe(6);
});

test('freeing a tracker ends its run', async () => {
  const one = tracker();
  const running = one.run({ budgetMs: 0.01 });
  one.free();
  expect((await rejection(running)).code).toBe('freed');
});

test('any subset of parameters can be set, all or nothing', () => {
  const one = tracker({ volume: short, params: { damping: 0.8 } });
  const before = one.params;
  expect(before).toMatchObject({ damping: 0.8, cyclic: false, prediction: true });
  one.setParams({ edgeMin: 0.3, edgeMax: 2 });
  expect(one.params).toEqual({ ...before, edgeMin: 0.3, edgeMax: 2 });
  one.setParams({});
  one.setParams(wrong({ damping: undefined }));
  const now = one.params;
  one.params.damping = 0.5;
  const refused: [string, object][] = [
    ['dampening', { window: 1, dampening: 1 }],
    ['damping', { window: 1, damping: 2 }],
    ['damping', { window: 1, damping: '0.8' }],
    ['threshold', { window: 1, threshold: -1 }],
    ['threshold', { window: 1, threshold: Number.NaN }],
    ['timeScale', { window: 1, timeScale: Number.POSITIVE_INFINITY }],
    ['radius', { window: 1, radius: 1000 }],
    ['radius', { window: 1, radius: 0.1 }],
    ['window', { damping: 0.9, window: 2.5 }],
    ['windowFrames', { damping: 0.9, windowFrames: 5 }],
    ['edgeMin', { window: 1, edgeMin: 0.01 }],
    ['edgeMax', { window: 1, edgeMin: 0.9, edgeMax: 1.5 }],
    ['cyclic', { window: 1, cyclic: 1 }],
    ['prediction', { window: 1, prediction: 'yes' }],
  ];
  for (const [name, params] of refused) {
    const error = failure(() => one.setParams(params));
    expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining(name)]);
    expect(one.params).toEqual(now);
  }
  expect(failure(() => one.setParams(wrong([]))).code).toBe('invalid-argument');
});

test('surface parameters apply from the next frame on', () => {
  const [one, other] = [tracker({ volume: short }), tracker({ volume: short })];
  for (const each of [one, other]) each.step(4);
  one.setParams({ damping: 0.6, radius: 3, timeScale: 3, edgeMin: 0.4, edgeMax: 2, prediction: false });
  expect([one.frame, one.volumes().length]).toEqual([0, 1]);
  for (const each of [one, other]) each.step(2);
  expect(bytesOf(one.meshAt(0)).equals(bytesOf(other.meshAt(0)))).toBe(true);
  expect(bytesOf(one.meshAt(2)).equals(bytesOf(other.meshAt(2)))).toBe(false);
  expect(one.mesh.check()).toEqual(HEALTHY);
});

const AGAIN: TrackingParams[] = [{ threshold: 50 }, { window: 1 }, { windowFrames: 1 }, { cyclic: true }];
test.each(AGAIN)('%o restarts tracking', (params) => {
  const one = tracker({ volume: short });
  one.step(5);
  const { topologyVersion, geometryVersion } = one.mesh;
  one.setParams(params);
  expect([one.frame, one.volumes().length, one.statistics.length, one.boundary().length]).toEqual([0, 0, 0, 0]);
  expect(one.mesh.triangleCount).toBe(0);
  expect(one.mesh.topologyVersion).toBeGreaterThan(topologyVersion);
  expect(one.mesh.geometryVersion).toBeGreaterThan(geometryVersion);
  one.step(1000);
  expect(bytesOfAll(one).equals(bytesOfAll(tracked({ volume: short, params })))).toBe(true);
});

test('setting the same values does not restart', () => {
  const one = tracker({ volume: short });
  one.step(4);
  one.setParams(one.params);
  expect(one.volumes()).toHaveLength(1);
});

test('a given start surface is tracked', () => {
  const start = Mesh.icosphere({ center: MIDDLE, radius: 8, maxEdge: 2 });
  const one = tracker({ volume: short, start });
  expect(one.mesh.triangleCount).toBe(start.triangleCount);
  start.free();
  one.step(6);
  const found = tracked({ volume: short });
  expect(one.mesh.check()).toEqual(HEALTHY);
  expect(one.mesh.distanceTo(found.mesh).mean).toBeLessThan(0.3);
  one.setParams({ window: 1 });
  expect(one.mesh.triangleCount).toBeGreaterThan(0);
});

test('the largest surface is tracked, or the one nearest to a point', () => {
  const two = pair();
  const centroid = (component?: TrackingOptions['component']) =>
    tracked({ volume: two, ...(component && { component }) }).mesh.info().centroid;
  for (const component of [undefined, 'largest', LARGE.at] as const) {
    expect(apart(centroid(component), LARGE.at)).toBeLessThan(0.5);
  }
  for (const component of [SMALL.at, [1000, 12, 12] as Vec3]) {
    expect(apart(centroid(component), SMALL.at)).toBeLessThan(0.5);
  }
});

test('a box limits the boundary', () => {
  const two = pair();
  const box = { min: [15.5, 7, 7] as Vec3, max: [23, 17, 17] as Vec3 };
  const one = tracker({ volume: two, box });
  one.step();
  const all = tracker({ volume: two });
  all.step();
  expect(one.boundary().length).toBeLessThan(all.boundary().length);
  const wide = tracked({ box: { min: [-1e6, -1e6, -1e6], max: [1e6, 1e6, 1e6] } });
  expect(bytesOfAll(wide).equals(bytesOfAll(tracked()))).toBe(true);
});

/** Asserts that a volume with these voxel axes is tracked in world space, and that the surface faces outwards. */
function followedAt(affine: number[]): void {
  const one = tracked({ volume: beating({ frames: 2 }, { affine }) });
  const column = (row: number) => [0, 4, 8].reduce((sum, at) => sum + (affine[at + row] as number), 0);
  const middle = [0, 1, 2].map((row) => (affine[12 + row] as number) + 9.5 * column(row)) as Vec3;
  expect(one.mesh.check()).toEqual(HEALTHY);
  expect(apart(one.mesh.info().centroid, middle)).toBeLessThan(0.2);
  expect((one.volumes()[1] as number) / truth(1)).toBeGreaterThan(0.84);
}

test('a rotated volume is tracked in world space', () => {
  followedAt([0, 1.5, 0, 0, -1.2, 0, 0.9, 0, 0.9, 0, 1.2, 0, 5, 6, 7, 1]);
});

test('an enriched or binned volume is tracked', () => {
  for (const other of [volume.binned([1, 1, 2]).enrichSlices(), volume.binned([2, 2, 1]).enrichSlices({ factor: 1 })]) {
    const one = tracked({ volume: other });
    expect(one.mesh.check()).toEqual(HEALTHY);
    expect((one.volumes()[0] as number) / truth(0)).toBeGreaterThan(0.75);
    expect((one.volumes()[0] as number) / truth(0)).toBeLessThan(1.1);
  }
});

test('specs describe every parameter, and their defaults are used', () => {
  const specs = paramSpecs('tracking');
  const defaults: Record<string, unknown> = tracker().params;
  expect(specs.map(({ name }) => name).sort()).toEqual(Object.keys(defaults).sort());
  for (const { name, help, label, type, default: usual, min, max } of specs) {
    expect(help.length, name).toBeGreaterThan(20);
    expect(label.length, name).toBeGreaterThan(0);
    expect(['number', 'integer', 'boolean']).toContain(type);
    expect(typeof defaults[name], name).toBe(type === 'boolean' ? 'boolean' : 'number');
    // The other defaults depend on the volume.
    if (usual !== undefined) expect(defaults[name], name).toEqual(usual);
    const taken = type === 'boolean' ? [true, false] : [defaults[name]];
    for (const value of taken) expect(tracker({ params: { [name]: value } }).params).toMatchObject({ [name]: value });
    if (type !== 'boolean') for (const end of [min, max]) expect(Number.isFinite(end), name).toBe(true);
  }
  expect(specs.filter(({ type }) => type === 'boolean').map(({ name }) => name)).toEqual(['prediction', 'cyclic']);
  expect(specs.filter((spec) => spec.default === undefined).map(({ name }) => name)).toEqual([
    'threshold',
    'radius',
    'timeScale',
  ]);
});

test("default thresholds and lengths depend on the volume's noise and voxels", () => {
  const { threshold, radius, timeScale } = tracker().params;
  expect(threshold).toBeCloseTo(4 * tracker().noise, 6);
  expect(radius).toBeGreaterThan(1.5);
  expect(timeScale).toBeLessThan(radius);
});

const closed = Mesh.icosphere({ center: MIDDLE, radius: 8, maxEdge: 2 }).arrays();
const open = () => Mesh.fromArrays(closed.positions, closed.indices.slice(3));
const insideOut = () => Mesh.fromArrays(closed.positions, closed.indices.toReversed());
/** Returns a mesh of two intersecting balls. */
function crossing(): Mesh {
  const positions = Float32Array.from([...closed.positions, ...closed.positions.map((x) => x + 1)]);
  const count = closed.positions.length / 3;
  return Mesh.fromArrays(positions, Uint32Array.from([...closed.indices, ...closed.indices.map((i) => i + count)]));
}
const flat = () => new Volume({ data: new Uint8Array(2000).fill(9), dims: [10, 10, 10, 2] });
const slanted = () => beating({ frames: 2 }, { affine: [1, 0, 0, 0, 0.2, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] });
const boxed = (min: unknown, max: unknown) => tracker({ box: wrong({ min, max }) });
const { min, max } = REACH;

const REFUSED: [string, string, string, () => unknown][] = [
  ['no options', 'invalid-argument', 'volume', () => new SurfaceTracker(wrong(undefined))],
  ['no volume', 'invalid-argument', 'volume', () => new SurfaceTracker(wrong({}))],
  ['a volume that is none', 'invalid-argument', 'volume', () => tracker({ volume: wrong(closed) })],
  [
    'one frame',
    'invalid-argument',
    'volume: must have at least two frames',
    () => tracker({ volume: beating({ frames: 1 }) }),
  ],
  ['no contrast', 'invalid-argument', 'volume', () => tracker({ volume: flat() })],
  ['slanted axes', 'invalid-argument', 'volume', () => tracker({ volume: slanted() })],
  ['a misspelled option', 'invalid-argument', 'bounds', () => tracker(wrong({ bounds: REACH }))],
  ['a box outside', 'invalid-argument', 'box', () => boxed([1e4, 1e4, 1e4], [2e4, 2e4, 2e4])],
  ['a box the wrong way round', 'invalid-argument', 'box', () => boxed(max, min)],
  ['a flat box', 'invalid-argument', 'box', () => boxed(min, [max[0], min[1], max[2]])],
  ['NaN in a box', 'invalid-argument', 'box.min', () => boxed([Number.NaN, 0, 0], max)],
  ['an endless box', 'invalid-argument', 'box.max', () => boxed(min, [0, 0, Number.POSITIVE_INFINITY])],
  ['half a box', 'invalid-argument', 'box.max', () => tracker({ box: wrong({ min }) })],
  ['a misspelled box', 'invalid-argument', 'low', () => tracker({ box: wrong({ low: min, max }) })],
  ['no box', 'invalid-argument', 'box', () => tracker({ box: wrong(null) })],
  ['another component', 'invalid-argument', 'component', () => tracker({ component: wrong('smallest') })],
  ['a component in the plane', 'invalid-argument', 'component', () => tracker({ component: wrong([1, 2]) })],
  ['a component nowhere', 'invalid-argument', 'component', () => tracker({ component: [1, Number.NaN, 2] })],
  ['a start that is none', 'invalid-argument', 'start', () => tracker({ start: wrong(closed) })],
  ['an open start', 'not-closed', 'closed', () => tracker({ start: open() })],
  ['a start that crosses itself', 'self-intersecting', 'intersects itself', () => tracker({ start: crossing() })],
  ['a start inside out', 'invalid-argument', 'start', () => tracker({ start: insideOut() })],
  ['an empty start', 'invalid-argument', 'start', () => tracker({ start: tracker().mesh })],
  ['parameters in a row', 'invalid-argument', 'params', () => tracker({ params: wrong([1]) })],
  ['a misspelled parameter', 'invalid-argument', 'treshold', () => tracker({ params: wrong({ treshold: 1 }) })],
  ['a parameter in words', 'invalid-argument', 'threshold', () => tracker({ params: wrong({ threshold: 'low' }) })],
  ['NaN for a parameter', 'invalid-argument', 'radius', () => tracker({ params: { radius: Number.NaN } })],
  ['no steps', 'invalid-argument', 'iterations', () => tracker().step(0)],
  ['steps in parts', 'invalid-argument', 'iterations', () => tracker().step(0.5)],
  ['a frame that is not done', 'invalid-argument', 'frame', () => tracker().meshAt(0)],
  ['a frame too far', 'invalid-argument', 'frame', () => tracked({ volume: short }).meshAt(3)],
  ['a frame before all', 'invalid-argument', 'frame', () => tracked({ volume: short }).meshAt(-1)],
  ['no frame', 'invalid-argument', 'frame', () => tracker().meshAt(wrong(undefined))],
  ['a boundary too far', 'invalid-argument', 'frame', () => tracker({ volume: short }).boundary(3)],
  [
    'a single slice',
    'invalid-argument',
    'volume',
    () => tracker({ volume: new Volume({ data: new Uint8Array(1800).map((_, i) => i % 7), dims: [30, 30, 1, 2] }) }),
  ],
  ['an animation of nothing', 'invalid-argument', 'frames', () => tracker().toGlb()],
];

test.each(REFUSED)('%s is refused: %s, saying %s', (_, code, word, work) => {
  const error = failure(work);
  expect(error.code).toBe(code);
  expect(error.message).toContain(word);
});

test('without any boundary the largest step is reported, and a lower threshold works', () => {
  const one = tracker({ volume: short, params: { threshold: 119 } });
  one.step(3);
  const { code, message } = failure(() => one.step());
  expect([code, message]).toEqual(['invalid-argument', expect.stringMatching(/^threshold: .*largest step/)]);
  const largest = Number(/must be below ([\d.]+), the largest step in the box/.exec(message)?.[1]);
  expect(largest).toBeGreaterThan(90);
  expect(largest).toBeLessThan(119);
  expect(failure(() => one.step()).message).toBe(message);
  one.setParams({ threshold: 0.7 * largest });
  expect(one.step(1000).done).toBe(true);
  expect(one.mesh.check()).toEqual(HEALTHY);
});

test('a run without a boundary rejects with the error that a step throws', async () => {
  const error = await rejection(tracker({ volume: short, params: { threshold: 119 } }).run());
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('threshold')]);
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
    const error = await rejection(tracker().run(wrong(options)));
    expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining(name)]);
  }
});

test('a tracker survives its volume, and a freed tracker is refused', () => {
  const own = beating({ frames: 2 });
  const one = tracker({ volume: own });
  own.free();
  one.step(4);
  const { mesh } = one;
  one.free();
  one.free();
  const uses = [
    ...[() => one.step(), () => one.params, () => one.frame, () => one.frames, () => one.noise, () => one.statistics],
    ...[() => one.cycleClosureError, () => one.boundary(), () => one.meshAt(0), () => one.volumes(), () => one.toGlb()],
    ...[() => one.save(), () => one.restore(new Uint8Array(9)), () => one.setParams({}), () => mesh.info()],
  ];
  for (const use of uses) expect(failure(use).code).toBe('freed');
  expect(failure(() => tracker({ volume: own })).code).toBe('freed');
  const start = Mesh.icosphere({ center: MIDDLE, radius: 8, maxEdge: 2 });
  start.free();
  expect(failure(() => tracker({ start })).code).toBe('freed');
  const scoped = tracker();
  scoped[Symbol.dispose]();
  expect(failure(() => scoped.step()).code).toBe('freed');
});

test('a mirrored volume is tracked, and its surface faces outwards', () => {
  followedAt([-1.5, 0, 0, 0, 0, 1.5, 0, 0, 0, 0, 1.5, 0, 5, 6, 7, 1]);
});

test('the largest step is reported for thresholds beyond all intensities as well', () => {
  const one = tracker({ volume: short, params: { threshold: 1000 } });
  one.step(3);
  const { message } = failure(() => one.step());
  expect(Number(/must be below ([\d.]+), the largest step in the box/.exec(message)?.[1])).toBeGreaterThan(90);
});

test.each([null, 0, '', false])('%o as a start is refused by name', (start) => {
  const error = failure(() => tracker({ start: wrong(start) }));
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('start')]);
});

test('a state belongs to a volume, box and start, whatever its parameters', () => {
  const box = { min: MIDDLE.map((x) => x - 6) as Vec3, max: MIDDLE.map((x) => x + 6) as Vec3 };
  for (const params of [{ radius: 3 }, { window: 1 }]) {
    const [saved, resumed] = [tracker({ volume: short, box, params }), tracker({ volume: short, box })];
    saved.step(2);
    resumed.restore(saved.save());
    expect(resumed.params).toEqual(saved.params);
  }
});

test('steps after the end are not counted', () => {
  const one = tracked({ volume: short });
  expect(one.step().iteration).toBe(6);
});

test('one point, a box or nothing is enough to propose options, with which the ball is tracked', async () => {
  const at = MIDDLE.map((x, k) => x + (k === 0 ? 3 : 0)) as Vec3;
  for (const query of [{ point: at }, { point: at, frame: 3 }, { box: REACH }, {}, undefined]) {
    const { options, frame } = await SurfaceTracker.propose(volume, query);
    expect(frame).toBe(0);
    expect(apart(options.component, MIDDLE)).toBeLessThan(6);
    expect(options.params.threshold).toBeGreaterThan(30);
    expect(options.params.threshold).toBeLessThan(100);
    expect(options.cavity).toBe('closed');
    for (const k of [0, 1, 2] as const) {
      expect(options.voxels.min[k]).toBeLessThan(3);
      expect(options.voxels.max[k]).toBeGreaterThan(16);
    }
    const one = tracker(options);
    one.step(FRAMES + 1);
    expect((one.volumes()[0] as number) / truth(0)).toBeGreaterThan(0.9);
    expect((one.volumes()[0] as number) / truth(0)).toBeLessThan(1.06);
  }
});

test('a proposal is refused with a reason, and can be aborted', async () => {
  const refused = async (query: object) => rejection(SurfaceTracker.propose(volume, query));
  expect(await refused({ point: REACH.min })).toMatchObject({ code: 'invalid-argument' });
  expect((await refused({ point: REACH.min })).message).toMatch(/^point: .*bright object/);
  expect((await refused({ point: [1e6, 0, 0] })).message).toMatch(/^point: .*outside/);
  expect((await refused({ point: MIDDLE, frame: FRAMES })).message).toMatch(/^frame/);
  expect((await refused({ point: MIDDLE, box: REACH })).message).toMatch(/^box/);
  expect((await refused({ place: MIDDLE })).message).toContain('place');
  const reason = new Error('enough');
  await expect(SurfaceTracker.propose(volume, {}, { signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  const abort = new AbortController();
  setTimeout(() => abort.abort(reason), 0);
  await expect(SurfaceTracker.propose(volume, {}, { signal: abort.signal, budgetMs: 0.1 })).rejects.toBe(reason);
});

test('muscles in a cavity are inside of it if it is closed, and states say which it was', () => {
  expect(failure(() => tracker(wrong({ cavity: 'shut' }))).message).toMatch(/^cavity/);
  const [closed, open] = (['closed', 'open'] as const).map((cavity) => tracker({ volume: pierced(), cavity }));
  for (const one of [closed, open]) one?.step(3);
  const volumes = [closed, open].map((one) => one?.volumes()[0] as number);
  expect((volumes[0] as number) / (volumes[1] as number)).toBeGreaterThan(1.05);
  expect(failure(() => open?.restore(closed?.save() as Uint8Array)).code).toBe('bad-file');
  const again = tracker({ volume: pierced(), cavity: 'closed' });
  again.restore(closed?.save() as Uint8Array);
  expect(bytesOfAll(again).equals(bytesOfAll(closed as SurfaceTracker))).toBe(true);
});

test('a run yields within steps: an abort leaves the tracker as after the last step', async () => {
  const one = tracker({ volume: short });
  one.step(3);
  let ticks = 0;
  const timer = setInterval(() => {
    ticks += 1;
  }, 0);
  await one.run({ maxIterations: 1, budgetMs: 0.2 });
  clearInterval(timer);
  expect(ticks).toBeGreaterThan(1);
  const before = one.save();
  const abort = new AbortController();
  const run = one.run({ signal: abort.signal, budgetMs: 0.2 });
  setTimeout(() => abort.abort('now'), 0);
  await expect(run).rejects.toBe('now');
  expect(Buffer.from(one.save()).equals(Buffer.from(before))).toBe(true);
  await one.run();
  expect(bytesOfAll(one).equals(bytesOfAll(tracked({ volume: short })))).toBe(true);
  const freed = tracker({ volume: short });
  const ended = freed.run({ budgetMs: 0.2 });
  freed.free();
  expect((await rejection(ended)).code).toBe('freed');
});
