// Times the tracker on a beating ventricle of the paper's size, from thick slices to a surface in every frame. Runs in
// Node and in a page.
import init, { Mesh, SurfaceTracker, version } from '../pkg/index.js';
import { BOX, cine, FRAMES, volumes } from './cine.mjs';

/** Edge threshold, between the step from blood to muscle and that from muscle to lung. */
const THRESHOLD = 70;
/** Iso value between blood and muscle, for marching cubes. */
const ISO = 145;

/** Returns the result of `work` and the milliseconds it took. */
function timed(work) {
  const started = performance.now();
  const value = work();
  return { value, milliseconds: performance.now() - started };
}

/** Returns the fastest of several runs; the others were disturbed. */
function best(repeats, work) {
  const runs = Array.from({ length: repeats }, work);
  return runs.reduce((least, run) => (run.milliseconds < least.milliseconds ? run : least));
}

const middle = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];
const sum = (values) => values.reduce((total, value) => total + value, 0);

/** Returns the ejection fraction: the difference of the largest and the smallest volume, relative to the largest. */
const ejected = (list) => 1 - Math.min(...list) / Math.max(...list);

/** Extracts the surfaces of all frames by marching cubes, the reference for the timings. */
function marchingCubes(volume) {
  const frames = Array.from({ length: FRAMES }, (_, frame) => frame);
  return timed(() => {
    for (const frame of frames) Mesh.marchingCubes(volume, ISO, { frame }).free();
  });
}

/** Runs a tracker to the end; returns the milliseconds of each part of its steps, as lists by name. */
function steps(tracker) {
  const parts = {};
  for (let report; !report?.done; ) {
    report = tracker.step();
    for (const [part, took] of Object.entries(report.times)) parts[part] = [...(parts[part] ?? []), took];
  }
  return parts;
}

/** Returns the measures and checks of the resulting surfaces. */
function summary(tracker) {
  const meshes = Array.from({ length: FRAMES }, (_, frame) => tracker.meshAt(frame));
  const checks = meshes.map((mesh) => mesh.check());
  for (const mesh of meshes) mesh.free();
  return {
    triangles: Math.max(...tracker.statistics.map((facts) => facts.triangles)),
    folded: Math.max(...tracker.statistics.map((facts) => facts.folded / facts.triangles)),
    closing: tracker.cycleClosureError,
    ejection: ejected(tracker.volumes()),
    closed: checks.every((check) => check.closed && check.oriented),
    selfIntersections: sum(checks.map((check) => check.selfIntersections)),
  };
}

/** Runs the tracker once, from thick slices to the closed cycle. */
function wholeRun(volume) {
  const started = performance.now();
  const enriched = timed(() => volume.enrichSlices());
  const params = { threshold: THRESHOLD, cyclic: true };
  const made = timed(() => new SurfaceTracker({ volume: enriched.value, box: BOX, params }));
  const tracker = made.value;
  const { boundary, surface, closure } = steps(tracker);
  const milliseconds = performance.now() - started;
  const [first, ...others] = surface;
  const result = {
    milliseconds,
    enrich: enriched.milliseconds,
    begin: made.milliseconds,
    votes: sum(boundary),
    first,
    frame: middle(others),
    worst: Math.max(...others),
    tracked: sum(surface),
    closingTime: sum(closure),
    ...summary(tracker),
  };
  tracker.free();
  enriched.value.free();
  return result;
}

/**
 * Returns milliseconds by part, the results beside the truth, the memory of the module at the end in bytes, and the
 * ratio of the whole run's time to that of marching cubes on all frames of the same volume in the same run.
 */
export async function measure(repeats) {
  const { memory } = await init();
  const volume = cine();
  const cubes = best(repeats, () => marchingCubes(volume)).milliseconds;
  const run = best(repeats, () => wholeRun(volume));
  const { dims, frames } = volume;
  volume.free();
  return {
    version: version(),
    ...{ dims, frames, cubes, run },
    trueEjection: ejected(volumes()),
    ratio: run.milliseconds / cubes,
    bytes: memory.buffer.byteLength,
  };
}
