// Times the deformable model and marching cubes on two heads, a CT and a phantom. Runs in Node and in a page.
import init, { DeformableModel, Mesh, Volume, version } from '../pkg/index.js';
import { headPhantom, ISO as PHANTOM_ISO } from './phantom.mjs';

/** Iso value of bone, in the scan's intensities. */
export const ISO = 95;
const LEVELS = 2;
const PARAMS = { iso: ISO, isoForce: -1, rigidity: 0.2 };
const PHANTOM_PARAMS = { iso: PHANTOM_ISO, isoForce: -1, rigidity: 0.4 };
/** A model that has not converged after this many iterations is reported as such. */
const MOST_ITERATIONS = 3000;

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

function marchingCubes(volume, iso) {
  const { value: mesh, milliseconds } = timed(() => Mesh.marchingCubes(volume, iso));
  const { vertexCount: vertices, triangleCount: triangles } = mesh;
  mesh.free();
  return { milliseconds, vertices, triangles };
}

/** Runs the model once, from its construction until it converges. */
function wholeRun(volume, params) {
  const parts = {};
  const started = performance.now();
  const model = new DeformableModel({ volume, levels: LEVELS, params });
  parts.start = performance.now() - started;
  let report;
  do {
    report = model.step();
    for (const [part, milliseconds] of Object.entries(report.times)) parts[part] = (parts[part] ?? 0) + milliseconds;
  } while (!report.done && report.iteration < MOST_ITERATIONS);
  const milliseconds = performance.now() - started;
  const result = { milliseconds, parts, ...summary(model, report) };
  model.free();
  return result;
}

function summary(model, { iteration, done, vertices, triangles, components, euler }) {
  const { closed, oriented, selfIntersections } = model.mesh.check();
  const { area, volume } = model.mesh.info();
  const counts = { iterations: iteration, converged: done, vertices, triangles, components, euler };
  return { ...counts, area, volume, closed, oriented, selfIntersections };
}

/** Times marching cubes alone, repeated often enough to find a run that nothing disturbed. */
export async function measureCubes(bytes, repeats) {
  await init();
  const volume = Volume.parse(bytes);
  return best(repeats, () => marchingCubes(volume, ISO));
}

/**
 * Returns milliseconds, counts, and the ratio of the model's time to that of marching cubes on the same volume in the
 * same run.
 */
function compare(volume, params, repeats) {
  const cubes = best(repeats, () => marchingCubes(volume, params.iso));
  const model = best(repeats, () => wholeRun(volume, params));
  const ratio = model.milliseconds / cubes.milliseconds;
  return { version: version(), dims: volume.dims, levels: LEVELS, params, cubes, model, ratio };
}

/** Runs the bench on the bytes of the scan. */
export async function measure(bytes, repeats) {
  await init();
  const { value: volume, milliseconds: parse } = timed(() => Volume.parse(bytes));
  return { parse, ...compare(volume, PARAMS, repeats) };
}

/** Runs the bench on a phantom of the same size as the paper's CT. */
export async function measurePhantom(repeats) {
  await init();
  return compare(headPhantom(), PHANTOM_PARAMS, repeats);
}
