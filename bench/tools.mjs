// Times the surfaces of a label map and tools for meshes, for docs/performance.md. Runs in Node.
import init, { LabelSurfaces, Mesh, Volume, version } from '../pkg/index.js';
import { normalNumber, randomNumbers } from './random.mjs';

/** Voxels along each side of the label map, its number of labels, and the radius of the ball that they fill. */
const [SIDE, LABELS, BALL] = [192, 30, 90];
/** Voxels along each side of the label map of noise. */
const NOISE = 64;
/** Voxels along each side of the image whose noisy surface the tools work on, and of the distances. */
export const [IMAGE, DISTANCES] = [128, 256];

export const ITERATIONS = 20;
/** Share of the triangles that decimation keeps. */
export const KEPT = 0.1;
/** Largest distance of decimation within one, in voxels. */
export const WITHIN = 0.2;

/** A ball that is divided into the cells around random points, each a label. */
export function labelMap(side = SIDE, labels = LABELS, ball = BALL) {
  const random = randomNumbers(4);
  const coordinate = () => side / 2 + ball * (1.6 * random() - 0.8);
  const centres = Array.from({ length: labels }, () => [coordinate(), coordinate(), coordinate()]);
  const data = new Uint8Array(side ** 3);
  const middle = (side - 1) / 2;
  for (let z = 0, at = 0; z < side; z++)
    for (let y = 0; y < side; y++)
      for (let x = 0; x < side; x++, at++) {
        if (Math.hypot(x - middle, y - middle, z - middle) > ball) continue;
        let [least, nearest] = [Infinity, 0];
        centres.forEach(([a, b, c], label) => {
          const square = (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2;
          if (square < least) [least, nearest] = [square, label];
        });
        data[at] = nearest + 1;
      }
  return { data, dims: [side, side, side] };
}

/** A label map in which each voxel has one of 254 labels, or none, at random. */
export function labelNoise() {
  const random = randomNumbers(2);
  const data = Uint8Array.from({ length: NOISE ** 3 }, () => Math.floor(255 * random()));
  return { data, dims: [NOISE, NOISE, NOISE] };
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

/** Returns the size and quality of the surfaces of a label map; the error of volume is the largest of a label. */
function lookAtLabels(surfaces, { data }) {
  const voxels = new Map();
  for (const label of data) voxels.set(label, (voxels.get(label) ?? 0) + 1);
  let [triangles, selfIntersections, volumeError] = [0, 0, 0];
  for (const label of surfaces.labels) {
    const mesh = surfaces.mesh(label);
    triangles += mesh.triangleCount;
    selfIntersections += mesh.check().selfIntersections;
    const error = mesh.info().volume / voxels.get(label) - 1;
    if (Math.abs(error) > Math.abs(volumeError)) volumeError = error;
    mesh.free();
  }
  return { triangles, selfIntersections, volumeError };
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
    volume: before,
    tasks: {
      noise: timed(
        repeats,
        () => new Volume(labelNoise()),
        surfacesOf,
        () => ({}),
      ),
      labels: timed(
        repeats,
        () => new Volume(map),
        surfacesOf,
        (surfaces) => lookAtLabels(surfaces, map),
      ),
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
