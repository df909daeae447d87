// Reconstructs every cloud of points of a folder at the default settings: `npm run real -- FOLDER --clouds`; without a folder, twenty computed
// shapes. Prints a row for each cloud, and a summary for each noise.
//
// - `NAME.points.EXT` is a cloud, beside `NAME.reference.EXT`, the closed mesh that its surface is compared with, if there is one.
// - Any other closed mesh is sampled: 5,000 points, uniform by area, with Gaussian noise of 0, .01 and .02 along each axis,
//   for a box whose longest side is 2. The mesh is the reference.
// - Any other file of points is a cloud without a reference.
import { readFile } from 'node:fs/promises';
import { basename, dirname, join } from 'node:path';
import { normalNumber, randomNumbers } from '../bench/random.mjs';
import { readEach } from './beside.mjs';
import { SHAPES, surfaceOf } from './made-shapes.mjs';
import { hasPoisson, poissonOf } from './poisson.mjs';
import { say } from './shell.mjs';

const FILES = /\.(ply|obj|stl|glb|xyz|pts|csv)$/i;
const POINTS = /\.points\.[a-z]+$/i;
const REFERENCE = /\.reference\.[a-z]+$/i;

/** Number of points of a mesh that is sampled. */
const COUNT = 5000;
/** Standard deviations of the noise along each axis, in a box of side 2. */
const NOISES = [0, 0.01, 0.02];
/** The paper's settings, with which the time is compared. */
const PAPER = { delta: 5, lambdaSurface: 0.001, lambdaExterior: 2, sides: 'outside' };

const NONE = '–';
const perMille = (value) => (Number.isFinite(value) ? value.toFixed(2) : NONE);
const of = (found, wanted) => (wanted === undefined ? String(found) : `${found}/${wanted}`);

const COLUMNS = [
  ['points', (row) => String(row.points)],
  ['σ', (row) => row.noise?.toFixed(3) ?? NONE],
  ['σ measured', (row) => row.choice?.noise.toFixed(4) ?? NONE],
  ['λ', (row) => row.choice?.lambdaSurface.toPrecision(2) ?? NONE],
  ['δ', (row) => row.choice?.delta.toFixed(2) ?? NONE],
  ['parts', (row) => of(row.components, row.wanted?.components)],
  ['χ', (row) => of(row.euler, row.wanted?.euler)],
  ['mean ‰', (row) => perMille(row.mean)],
  ['max ‰', (row) => perMille(row.max)],
  ['Poisson ‰', (row) => perMille(row.peer?.estimated)],
  ['true n. ‰', (row) => perMille(row.peer?.true)],
  ['outliers', (row) => String(row.outliers)],
  ['self-int.', (row) => String(row.selfIntersections)],
  ['seconds', (row) => row.seconds.toFixed(1)],
  ['× paper', (row) => row.ratio.toFixed(2)],
];

/** Returns whether a surface has what is guaranteed: it is closed and does not intersect itself. */
export const isSound = (row) => row.closed && row.selfIntersections === 0;

/** Returns whether the number of components and the Euler characteristic are those of the reference. */
export const hasTopology = ({ wanted, components, euler }) =>
  components === wanted.components && euler === wanted.euler;

/** Prints a row for every cloud in a folder, or for the computed shapes; returns whether all surfaces are sound. */
export async function reportClouds(library, folder, line) {
  const peer = await hasPoisson();
  if (!peer) say('Poisson', 'not run: Python has no pymeshlab and numpy (VESICLE_PYTHON names another Python)');
  process.stdout.write(
    line(
      '',
      COLUMNS.map(([title]) => title),
    ),
  );
  const rows = [];
  for await (const cloud of folder ? cloudsIn(library, folder) : computed(library)) {
    try {
      if (cloud.failure) throw cloud.failure;
      rows.push(await reported(library, cloud, peer, line));
    } catch (error) {
      process.stdout.write(line(cloud.name, [` ${error.message.slice(0, 120)}`]));
    }
  }
  for (const noise of NOISES) summarise(rows, noise);
  return rows.every(isSound);
}

async function reported(library, cloud, peer, line) {
  const row = reconstructed(library, cloud);
  if (peer && cloud.reference) {
    const { estimated, true: best } = await poissonOf(library, cloud, cloud.reference);
    row.peer = { estimated: row.inPerMille(estimated), true: row.inPerMille(best) };
  }
  const cells = COLUMNS.map(([, text]) => text(row));
  process.stdout.write(line(cloud.name, [...cells, `  ${row.warnings.join(' ')}`]));
  return row;
}

const cloudsIn = (library, folder) =>
  readEach(folder, FILES, REFERENCE, (path, name, all) => cloudsOf(library, path, name, all));

async function* cloudsOf({ Mesh, parsePoints }, path, name, all) {
  const bytes = new Uint8Array(await readFile(path));
  const reference = await referenceOf(Mesh, path, bytes, all);
  if (reference && !POINTS.test(path)) yield* sampledAll(name, reference);
  else yield { name, ...parsePoints(bytes), reference };
  reference?.free();
}

/** Returns the mesh with which the clouds of a file are compared: the one beside it or, if the file is a mesh, itself. */
async function referenceOf(Mesh, path, bytes, all) {
  if (!POINTS.test(path)) return asClosed(Mesh, bytes);
  const stem = join(dirname(path), basename(path).replace(POINTS, '.reference.'));
  const beside = all.find((one) => one.startsWith(stem));
  return beside && Mesh.parse(new Uint8Array(await readFile(beside)));
}

/** Returns the mesh of a file, or nothing if it is a file of points; an open mesh is an error. */
function asClosed(Mesh, bytes) {
  let mesh;
  try {
    mesh = Mesh.parse(bytes);
  } catch {
    return undefined;
  }
  if (mesh.triangleCount === 0) return undefined;
  if (!mesh.check().closed) throw new Error('the mesh is open, so there is no reference');
  return mesh;
}

function* computed(library) {
  for (const [name, make] of Object.entries(SHAPES)) {
    const mesh = surfaceOf(library, make());
    yield* sampledAll(name, mesh);
    mesh.free();
  }
}

function* sampledAll(name, reference) {
  for (const [seed, noise] of NOISES.entries()) {
    yield { name: `${name}, σ ${noise}`, noise, reference, ...sampled(reference, { noise, seed: seed + 1 }) };
  }
}

/** Returns the longest side of the bounds of packed points. */
function longestSide(points) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  points.forEach((x, i) => {
    low[i % 3] = Math.min(low[i % 3], x);
    high[i % 3] = Math.max(high[i % 3], x);
  });
  return Math.max(...high.map((x, k) => x - low[k]));
}

/**
 * Returns points of a mesh, uniform by area, with Gaussian noise of a standard deviation along each axis, and their normals
 * before noise. The noise is for a box of side 2.
 */
export function sampled(mesh, { count = COUNT, noise = 0, seed = 1 }) {
  const { positions, indices } = mesh.arrays();
  const random = randomNumbers(seed);
  const sigma = (noise * longestSide(positions)) / 2;
  const triangles = trianglesOf(positions, indices);
  const [points, normals] = [new Float32Array(3 * count), new Float32Array(3 * count)];
  for (let i = 0; i < count; i++) {
    const { corners, normal } = triangles.at(random());
    const root = Math.sqrt(random());
    const weights = [1 - root, root];
    weights[2] = weights[1] * random();
    weights[1] -= weights[2];
    for (let k = 0; k < 3; k++) {
      points[3 * i + k] =
        corners.reduce((sum, corner, c) => sum + weights[c] * corner[k], 0) + sigma * normalNumber(random);
      normals[3 * i + k] = normal[k];
    }
  }
  return { points, normals };
}

/** Returns a function `at` from a number in (0, 1) to a triangle, each as likely as its share of the area. */
function trianglesOf(positions, indices) {
  const corner = (v) => [...positions.subarray(3 * v, 3 * v + 3)];
  const upTo = new Float64Array(indices.length / 3);
  let area = 0;
  const read = (t) => {
    const corners = [0, 1, 2].map((c) => corner(indices[3 * t + c]));
    const [a, b, c] = corners;
    const [u, v] = [b, c].map((p) => p.map((x, k) => x - a[k]));
    const across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const twice = Math.hypot(...across);
    return { corners, twice, normal: across.map((x) => x / twice) };
  };
  for (let t = 0; t < upTo.length; t++) {
    area += read(t).twice;
    upTo[t] = area;
  }
  return { at: (share) => read(firstAbove(upTo, share * area)) };
}

/** Returns the index of the first of ascending numbers that is above a value. */
function firstAbove(numbers, value) {
  let [low, high] = [0, numbers.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (numbers[middle] > value) high = middle;
    else low = middle + 1;
  }
  return low;
}

/** Reconstructs a cloud at the defaults, without its normals, and compares the surface with its reference. */
export function reconstructed(library, cloud) {
  const { points, noise, reference } = cloud;
  const { surface, seconds } = timedRun(library, points, {});
  const paper = timedRun(library, points, PAPER);
  paper.surface.free();
  const { mesh, choice, outliers } = surface;
  const { components, euler } = mesh.info();
  const { closed, selfIntersections } = mesh.check();
  const wanted = reference?.info();
  const side = longestSide(reference ? reference.arrays().positions : points);
  const inPerMille = (length) => (1000 * length) / side;
  const distance = reference && components > 0 ? mesh.distanceTo(reference) : { mean: NaN, hausdorff: NaN };
  const row = {
    ...{ points: points.length / 3, noise, choice, outliers, components, euler, closed, selfIntersections, wanted },
    ...{ mean: inPerMille(distance.mean), max: inPerMille(distance.hausdorff), seconds },
    ...{ ratio: seconds / paper.seconds, inPerMille, warnings: [...new Set(mesh.warnings.map(({ code }) => code))] },
  };
  surface.free();
  return row;
}

function timedRun({ ImplicitSurface }, points, params) {
  const began = performance.now();
  const surface = new ImplicitSurface({ points, params });
  while (!surface.step().done);
  return { surface, seconds: (performance.now() - began) / 1000 };
}

const geometricMean = (list) => Math.exp(list.reduce((sum, x) => sum + Math.log(x), 0) / list.length);

/** Prints how the clouds of one noise fare beside their peer, and how many have the topology of their reference. */
function summarise(rows, noise) {
  const these = rows.filter((row) => row.noise === noise);
  if (these.length === 0) return;
  const count = (test) => `${these.filter(test).length} of ${these.length}`;
  const parts = [
    `components and χ right ${count(hasTopology)}, wrong without a warning ${count((row) => !hasTopology(row) && row.warnings.length === 0)}`,
    `time ${geometricMean(these.map((row) => row.ratio)).toFixed(2)} × the paper's settings`,
  ];
  if (these.every((row) => row.peer)) {
    const over = (kind) => geometricMean(these.map((row) => row.mean / row.peer[kind])).toFixed(2);
    parts.push(
      `${over('estimated')} × Poisson with estimated normals, no worse ${count((row) => row.mean <= row.peer.estimated)}`,
      `${over('true')} × with true ones, at most 1.3 times ${count((row) => row.mean <= 1.3 * row.peer.true)}`,
    );
  }
  say(`σ ${noise}`, parts.join('; '));
}
