// The measured work: the head CT by marching cubes and by the deformable model. Runs in Node and in a page.
import init, { DeformableModel, Mesh, Volume, version } from '../pkg/index.js';

/** Bone, in the scan's intensities. */
export const ISO = 95;
const LEVELS = 2;
const PARAMS = { iso: ISO, isoForce: -1, rigidity: 0.2 };
/** A model that has not come to rest by then is reported as such. */
const MOST_ITERATIONS = 3000;

/** The value of `work` and the milliseconds it took. */
function timed(work) {
  const started = performance.now();
  const value = work();
  return { value, milliseconds: performance.now() - started };
}

/** Of several runs the one that took least: the others were disturbed. */
function best(repeats, work) {
  const runs = Array.from({ length: repeats }, work);
  return runs.reduce((least, run) => (run.milliseconds < least.milliseconds ? run : least));
}

function marchingCubes(volume) {
  const { value: mesh, milliseconds } = timed(() => Mesh.marchingCubes(volume, ISO));
  const { vertexCount: vertices, triangleCount: triangles } = mesh;
  mesh.free();
  return { milliseconds, vertices, triangles };
}

/** One whole run of the model, from making it to rest. */
function wholeRun(volume) {
  const parts = {};
  const started = performance.now();
  const model = new DeformableModel({ volume, levels: LEVELS, params: PARAMS });
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

/** Marching cubes alone, as often as it takes to find a moment when nothing else disturbs so short a time. */
export async function measureCubes(bytes, repeats) {
  await init();
  const volume = Volume.parse(bytes);
  return best(repeats, () => marchingCubes(volume));
}

/**
 * Measures everything on the bytes of the scan: milliseconds, counts, and the ratio of the model's time to that of
 * marching cubes on the same volume in the same run.
 */
export async function measure(bytes, repeats) {
  await init();
  const { value: volume, milliseconds: parse } = timed(() => Volume.parse(bytes));
  const cubes = best(repeats, () => marchingCubes(volume));
  const model = best(repeats, () => wholeRun(volume));
  const ratio = model.milliseconds / cubes.milliseconds;
  return { version: version(), dims: volume.dims, levels: LEVELS, params: PARAMS, parse, cubes, model, ratio };
}
