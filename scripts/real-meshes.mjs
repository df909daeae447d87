// Deforms every closed mesh of a folder at the default settings: `npm run real -- FOLDER --meshes`. Each ellipsoid that is
// proposed is moved by a fifth of the diagonal of the mesh, away from its middle, and back. Prints a row for each mesh.
import { readdir, readFile } from 'node:fs/promises';
import { basename, dirname, join, relative } from 'node:path';
import { filesBelow } from './beside.mjs';
import { at } from './shell.mjs';

const MESHES = /\.(obj|ply|stl|glb|gltf)$/i;

/** Distance by which an ellipsoid is moved, as a share of the diagonal. */
const FAR = 0.2;
/** A distance that is hardly any. */
const NEAR = 1e-6;
/** Most frames of a motion. */
const FRAMES = 300;

const COLUMNS = [
  ['triangles', (row) => String(row.triangles)],
  ['parts', (row) => String(row.components)],
  ['χ', (row) => String(row.euler)],
  ['s to build', (row) => row.seconds.toFixed(2)],
  ['at rest', (row) => (row.isSame ? 'same bits' : 'CHANGED')],
  ['mean ‰', (row) => row.mean.toFixed(4)],
  ['max ‰', (row) => row.max.toFixed(4)],
  ['ellipsoids', (row) => String(row.moves.length)],
  ['arrived', (row) => String(row.moves.filter(({ share }) => share > 0.99).length)],
  ['self-int.', (row) => String(sum(row.moves.map(({ crossings }) => crossings)))],
  ['far half ‰', (row) => Math.max(...row.moves.map(({ far }) => far)).toFixed(3)],
  ['ms a frame', (row) => median(row.moves.map(({ frame }) => frame)).toFixed(0)],
  ['longest', (row) => Math.max(...row.moves.map(({ longest }) => longest)).toFixed(0)],
];

const sum = (list) => list.reduce((all, one) => all + one, 0);
const median = (list) => [...list].sort((a, b) => a - b)[list.length >> 1] ?? Number.NaN;
const distance = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));

/** Prints a row for every mesh in a folder; returns whether all closed ones stay as given, and none intersects itself. */
export async function reportMeshes(library, folder, line) {
  const { default: startReaders, parseMesh } = await import(at('pkg', 'import', 'index.js'));
  const { decompressGltf } = await import(at('pkg', 'gltf', 'index.js'));
  await startReaders();
  process.stdout.write(
    line(
      '',
      COLUMNS.map(([title]) => title),
    ),
  );
  let isSound = true;
  for (const path of await filesBelow(folder, MESHES)) {
    const name = relative(folder, path) || basename(path);
    try {
      const files = await filesIn(dirname(path));
      const bytes = await decompressGltf(new Uint8Array(await readFile(path)), { files });
      const { positions, indices, ...extra } = parseMesh(bytes, { files });
      const row = await deformed(library, library.Mesh.fromArrays(positions, indices, extra));
      process.stdout.write(
        line(
          name,
          COLUMNS.map(([, text]) => text(row)),
        ),
      );
      const crossings = row.isCrossing ? 0 : sum(row.moves.map(({ crossings }) => crossings));
      isSound &&= row.isSame && crossings === 0;
    } catch (error) {
      process.stdout.write(line(name, [` ${error.message.slice(0, 120)}`]));
    }
  }
  return isSound;
}

async function filesIn(folder) {
  const entries = (await readdir(folder, { withFileTypes: true })).filter((one) => one.isFile());
  return Promise.all(
    entries.map(async ({ name }) => ({ name, bytes: new Uint8Array(await readFile(join(folder, name))) })),
  );
}

async function deformed({ MultiresolutionModel }, given) {
  const before = given.arrays().positions.slice();
  const { bounds, components, euler, centroid } = given.info();
  const diagonal = distance(bounds.min, bounds.max);
  const began = performance.now();
  const model = new MultiresolutionModel({ detail: given });
  model.step(FRAMES);
  const seconds = (performance.now() - began) / 1000;
  const isSame = isEqual(model.mesh.arrays().positions, before);
  const rest = model.ellipsoids;
  const moved = (index, by) =>
    rest.map((one, k) => (k === index ? { ...one, center: away(one.center, centroid, by * diagonal) } : one));
  settle(model, moved(0, NEAR));
  const { mean, hausdorff } = model.mesh.distanceTo(given);
  const moves = [];
  for (const index of rest.keys()) {
    settle(model, rest);
    const times = settle(model, moved(index, FAR));
    const share = distance(model.ellipsoids[index].center, rest[index].center) / (FAR * diagonal);
    const crossings = model.mesh.check().selfIntersections;
    const far = farHalf(before, model.mesh.arrays().positions, rest[index].center) / diagonal;
    moves.push({ share, crossings, far: 1000 * far, frame: median(times), longest: Math.max(...times) });
  }
  settle(model, rest);
  const returned = isEqual(model.mesh.arrays().positions, before);
  const isCrossing = given.check().selfIntersections > 0;
  const triangles = given.triangleCount;
  model.free();
  given.free();
  const [perMille, most] = [mean, hausdorff].map((length) => (1000 * length) / diagonal);
  const row = { triangles, components, euler, seconds, isSame: isSame && returned, isCrossing, moves };
  return { ...row, mean: perMille, max: most };
}

/** Moves the ellipsoids to a pose; returns the milliseconds that each frame took. */
function settle(model, pose) {
  model.setEllipsoids(pose);
  const times = [];
  for (let i = 0; i < FRAMES; i++) {
    const began = performance.now();
    const { done } = model.step();
    times.push(performance.now() - began);
    if (done) break;
  }
  return times;
}

/** Returns a point moved away from another, or up if it is there. */
function away(point, from, by) {
  const length = distance(point, from);
  const unit = length > 1e-3 * by ? point.map((x, k) => (x - from[k]) / length) : [0, 0, 1];
  return point.map((x, k) => x + by * unit[k]);
}

/** Returns the largest displacement of the half of the given vertices that are furthest from a point. */
function farHalf(before, after, from) {
  const at = (list, v) => [...list.subarray(3 * v, 3 * v + 3)];
  const order = Array.from({ length: before.length / 3 }, (_, v) => [distance(at(before, v), from), v]);
  order.sort(([a], [b]) => b - a);
  return Math.max(...order.slice(0, order.length >> 1).map(([, v]) => distance(at(before, v), at(after, v))));
}

const isEqual = (a, b) => a.length === b.length && a.every((x, i) => x === b[i]);
