// Times steps of the deformable model while every vertex moves, at several mesh sizes. Runs in Node and in a page.
// examples/step_figures.rs does the same natively.
import init, { DeformableModel, Volume, version } from '../pkg/index.js';

/**
 * Voxels along each side of the volume, and, in voxels, the radius of the ball at its centre and of the sphere that
 * shrinks onto it.
 */
const SIDE = 256;
const BALL = 96;
const SPHERE = 112;
/**
 * Mean edge lengths in voxels. The spheres have 7,000, 66,000 and 1.7 million vertices: edges shrink in steps of about
 * three.
 */
const EDGES = [4.6, 1.6, 0.46];
/** Number of steps that are not timed, while the sphere accelerates, and of steps that are. */
const BEFORE = 4;
const COUNTED = 6;
/** Number of runs for each size: steps of the small ones are short, and other processes may disturb them. */
const RUNS = [6, 3, 1];
const PARAMS = { iso: 128, isoForce: -1, rigidity: 0.2 };

function ball() {
  const data = new Uint8Array(SIDE ** 3);
  const middle = (SIDE - 1) / 2;
  for (let i = 0; i < data.length; i += 1) {
    const [x, y, z] = [i % SIDE, Math.floor(i / SIDE) % SIDE, Math.floor(i / SIDE / SIDE)];
    const far = Math.hypot(x - middle, y - middle, z - middle);
    data[i] = Math.min(Math.max(128 - 32 * (far - BALL), 0), 255);
  }
  return new Volume({ data, dims: [SIDE, SIDE, SIDE] });
}

/**
 * Returns the shortest times of all timed steps of one run: nanoseconds per vertex, and milliseconds of the topology
 * part.
 */
function row(volume, edge) {
  const middle = (SIDE - 1) / 2;
  const start = { seeds: Float32Array.of(middle, middle, middle), radius: SPHERE };
  const model = new DeformableModel({ volume, start, edge, params: PARAMS });
  try {
    let [step, topology, vertices] = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, 0];
    for (let k = 0; k < BEFORE + COUNTED; k += 1) {
      const began = performance.now();
      const report = model.step();
      const spent = performance.now() - began;
      if (k < BEFORE) continue;
      vertices = report.vertices;
      step = Math.min(step, (1e6 * spent) / vertices);
      topology = Math.min(topology, report.times.topology);
    }
    return { edge, vertices, step, topology };
  } finally {
    model.free();
  }
}

/** Returns a row for each size. */
export async function measure() {
  await init();
  const volume = ball();
  // Warm-up: code is compiled in the background while it runs, so the first second is not timed.
  row(volume, EDGES[1]);
  return { version: version(), rows: EDGES.map((edge, k) => best(volume, edge, RUNS[k])) };
}

function best(volume, edge, runs) {
  const rows = Array.from({ length: runs }, () => row(volume, edge));
  const least = (key) => Math.min(...rows.map((one) => one[key]));
  return { ...rows[0], step: least('step'), topology: least('topology') };
}
