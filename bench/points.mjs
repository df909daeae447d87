// The measured work: points of a torus to a surface, few and many. Runs in Node and in a page.
import init, { ImplicitSurface, version } from '../pkg/index.js';

/** Points, beside which one for ten is placed outside. */
export const FEW = 3000;
export const MANY = 20_000;
/** The torus in a box of side 2, in cells of a 128th of it. */
const CELL = 2 / 128;
const [RING, TUBE] = [0.65, 0.35];

/** Numbers in [0, 1), the same ones each time. */
function randomNumbers() {
  let state = 7;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** As many to an area everywhere, packed. */
function torus(count) {
  const random = randomNumbers();
  const points = [];
  while (points.length < 3 * count) {
    const [u, v] = [2 * Math.PI * random(), 2 * Math.PI * random()];
    if (random() > RING + TUBE * Math.cos(v)) continue;
    const across = RING + TUBE * Math.cos(v);
    points.push(across * Math.cos(u), across * Math.sin(u), TUBE * Math.sin(v));
  }
  return Float32Array.from(points);
}

/** Milliseconds of each phase to the end, and the last report. */
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

/** The constraints of a surface, and the vertices that come of them: for others to do the same with. */
export async function example(count) {
  await init();
  const surface = new ImplicitSurface({ points: torus(count), params: { cell: CELL } });
  phases(surface);
  const { surface: points, exterior } = surface.constraints();
  const { positions: vertices } = surface.mesh.arrays();
  surface.free();
  return { points, exterior, vertices };
}

/** One surface from its points on, and then with one point more by hand. */
function wholeRun(count) {
  const surface = new ImplicitSurface({ points: torus(count), params: { cell: CELL } });
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

/** Several runs: the first one, when code is still being compiled, and the least time of each phase over all of them. */
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
 * Milliseconds, counts, the memory that the module has taken by the end, in bytes, and as a ratio the time for each
 * constraint with many points to that with few.
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
