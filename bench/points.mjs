// Times the implicit surface of few and of many points of a torus. Runs in Node and in a page.
import init, { ImplicitSurface, version } from '../pkg/index.js';
import { randomNumbers } from './random.mjs';

/** Numbers of points; one exterior point is added for every ten. */
export const FEW = 3000;
export const MANY = 20_000;
/** Extraction cell: a 128th of the box of side 2 that contains the torus. */
const CELL = 2 / 128;
/** The paper's settings, which give other packages the same points and values to solve for. */
const PARAMS = { delta: 5, lambdaSurface: 0.001, lambdaExterior: 2, sides: 'outside', cell: CELL };
const [RING, TUBE] = [0.65, 0.35];

/** Returns uniformly distributed points of a torus as packed xyz. */
function torus(count) {
  const random = randomNumbers(7);
  const points = [];
  while (points.length < 3 * count) {
    const [u, v] = [2 * Math.PI * random(), 2 * Math.PI * random()];
    if (random() > RING + TUBE * Math.cos(v)) continue;
    const across = RING + TUBE * Math.cos(v);
    points.push(across * Math.cos(u), across * Math.sin(u), TUBE * Math.sin(v));
  }
  return Float32Array.from(points);
}

/** Runs a surface to the end; returns the milliseconds of each phase and the last report. */
function phases(surface) {
  const times = {};
  let report;
  do {
    report = surface.step();
    for (const [phase, milliseconds] of Object.entries(report.times)) {
      times[phase] = (times[phase] ?? 0) + milliseconds;
    }
  } while (!report.done);
  return { times, report };
}

/** Returns constraints, and the vertices of the resulting surface, as input for other packages. */
export async function example(count) {
  await init();
  const surface = new ImplicitSurface({ points: torus(count), params: PARAMS });
  phases(surface);
  const { surface: points, exterior } = surface.constraints();
  const { positions: vertices } = surface.mesh.arrays();
  surface.free();
  return { points, exterior, vertices };
}

/** Reconstructs a surface from its points, then again with one point added by hand. */
function wholeRun(count) {
  const surface = new ImplicitSurface({ points: torus(count), params: PARAMS });
  try {
    const { times, report } = phases(surface);
    const { residual, vertices, components, euler } = report;
    const exterior = surface.constraints().exterior.length / 3;
    surface.setEdits({ added: Float32Array.of(0, 0.65, 0.4) });
    const edited = phases(surface).times;
    return { times, edited, exterior, residual, vertices, components, euler };
  } finally {
    surface.free();
  }
}

/**
 * Returns the times of the first run, in which code is still being compiled, and the shortest time of each phase over
 * all runs.
 */
function runs(count, repeats) {
  const all = Array.from({ length: repeats }, () => wholeRun(count));
  const least = (which, phase) => Math.min(...all.map((run) => run[which][phase]));
  const { times, exterior, residual, vertices, components, euler } = all[0];
  return {
    points: count,
    exterior,
    first: { solve: times.solve, extract: times.extract },
    solve: least('times', 'solve'),
    extract: least('times', 'extract'),
    solveAfterEdit: least('edited', 'solve'),
    ...{ residual, vertices, components, euler },
  };
}

/**
 * Returns milliseconds, counts, the memory of the module at the end in bytes, and the ratio of the time per constraint
 * with many points to that with few.
 */
export async function measure(repeats) {
  const { memory } = await init();
  const few = runs(FEW, repeats);
  const many = runs(MANY, repeats);
  const each = ({ solve, points, exterior }) => solve / (points + exterior);
  return {
    version: version(),
    ...{ few, many },
    perConstraint: each(many) / each(few),
    edit: many.solveAfterEdit / many.solve,
    bytes: memory.buffer.byteLength,
  };
}
