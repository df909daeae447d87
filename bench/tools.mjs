// Times the surfaces of a label map and tools for meshes, for docs/performance.md. Runs in Node.
import init, { LabelSurfaces, Mesh, Volume, version } from '../pkg/index.js';
import { normalNumber, randomNumbers } from './random.mjs';

/** Voxels along each side of the label map, its number of labels, and the radius of the ball that they fill. */
const [SIDE, LABELS, BALL] = [192, 30, 90];
/** Voxels along each side of the image whose noisy surface the tools work on, and of the distances. */
const [IMAGE, DISTANCES] = [128, 256];

export const ITERATIONS = 20;
/** Share of the triangles that decimation keeps. */
export const KEPT = 0.1;
/** Largest distance of decimation within one, in voxels. */
export const WITHIN = 0.2;

/** A ball that is divided into the cells around random points, each a label. */
export function labelMap() {
  const random = randomNumbers(4);
  const coordinate = () => SIDE / 2 + BALL * (1.6 * random() - 0.8);
  const centres = Array.from({ length: LABELS }, () => [coordinate(), coordinate(), coordinate()]);
  const data = new Uint8Array(SIDE ** 3);
  const middle = (SIDE - 1) / 2;
  for (let z = 0, at = 0; z < SIDE; z++)
    for (let y = 0; y < SIDE; y++)
      for (let x = 0; x < SIDE; x++, at++) {
        if (Math.hypot(x - middle, y - middle, z - middle) > BALL) continue;
        let [least, nearest] = [Infinity, 0];
        centres.forEach(([a, b, c], label) => {
          const square = (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2;
          if (square < least) [least, nearest] = [square, label];
        });
        data[at] = nearest + 1;
      }
  return { data, dims: [SIDE, SIDE, SIDE] };
}

/** Marching cubes of waves in a ball, with noise that leaves the surface rough. */
export function roughMesh() {
  const random = randomNumbers(9);
  const data = new Float32Array(IMAGE ** 3);
  const middle = (IMAGE - 1) / 2;
  for (let z = 0, at = 0; z < IMAGE; z++)
    for (let y = 0; y < IMAGE; y++)
      for (let x = 0; x < IMAGE; x++, at++) {
        const [a, b, c] = [x, y, z].map((k) => ((k - middle) / IMAGE) * 5 * Math.PI);
        const wave = Math.sin(a) * Math.cos(b) + Math.sin(b) * Math.cos(c) + Math.sin(c) * Math.cos(a);
        const ball = 0.45 * IMAGE - Math.hypot(x - middle, y - middle, z - middle);
        data[at] = Math.min(wave + 0.4, 0.2 * ball) + 0.04 * normalNumber(random);
      }
  return Mesh.marchingCubes(new Volume({ data, dims: [IMAGE, IMAGE, IMAGE] }), 0);
}

/** Returns the shortest time of several runs of `work`, on what `begin` returns each time, and what `look` sees of the last. */
function timed(repeats, begin, work, look) {
  let milliseconds = Infinity;
  let seen;
  for (let run = 0; run < repeats; run++) {
    const given = begin();
    const started = performance.now();
    const result = work(given) ?? given;
    milliseconds = Math.min(milliseconds, performance.now() - started);
    if (run === repeats - 1) seen = look(result);
    result.free();
    if (result !== given) given.free();
  }
  return { milliseconds, ...seen };
}

function surfacesOf(volume) {
  const surfaces = new LabelSurfaces({ volume });
  while (!surfaces.step().done);
  return surfaces;
}

function lookAtLabels(surfaces) {
  let [triangles, selfIntersections] = [0, 0];
  for (const label of surfaces.labels) {
    const mesh = surfaces.mesh(label);
    triangles += mesh.triangleCount;
    selfIntersections += mesh.check().selfIntersections;
    mesh.free();
  }
  return { triangles, selfIntersections };
}

/** Returns milliseconds and results of each task. */
export async function measure(repeats) {
  await init();
  const [map, mesh] = [labelMap(), roughMesh()];
  const { volume: before } = mesh.info();
  const look = (one) => {
    const { triangles, volume } = one.info();
    const { selfIntersections } = one.check();
    return { triangles, selfIntersections, volumeError: volume / before - 1 };
  };
  const tool = (work) => timed(repeats, () => mesh.clone(), work, look);
  const grid = new Volume({
    data: new Uint8Array(DISTANCES ** 3),
    dims: [DISTANCES, DISTANCES, DISTANCES],
    spacing: [IMAGE / DISTANCES, IMAGE / DISTANCES, IMAGE / DISTANCES],
  });
  return {
    version: version(),
    triangles: mesh.triangleCount,
    tasks: {
      labels: timed(repeats, () => new Volume(map), surfacesOf, lookAtLabels),
      smooth: tool((one) => one.smooth({ iterations: ITERATIONS })),
      distance: timed(
        repeats,
        () => mesh.clone(),
        (one) => one.toVolume(grid, { kind: 'distance' }),
        () => ({}),
      ),
      decimate: tool((one) => one.decimate(Math.round(KEPT * one.triangleCount))),
      'decimate within': tool((one) => one.decimateWithin(WITHIN)),
    },
  };
}
