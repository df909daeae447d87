// Tracks the object of every sequence of a folder at the settings that are proposed for it: `npm run real -- FOLDER --sequences`; without a folder,
// three computed sequences. Slices far apart have others inserted between them, as in the Track lab. Prints a row for each.
//
// - `NAME.EXT` is a volume file of several frames. `NAME.truth.EXT`, if there is one, is another, on any grid, whose surface at 0.5 is the
//   true one, such as a label map.
// - `NAME.truth.json`, if there is one: `point`, a point of the object in world space, and `frame`, where it is there, default 0; without it, what
//   moves most is tracked. `volumes`: the true volume of each frame, world units cubed. `label`: that of the object in `NAME.truth.EXT`.
import { readFile } from 'node:fs/promises';
import { filesBeside, readEach } from './beside.mjs';
import { imageOf, SEQUENCES, trueSurface } from './made-sequences.mjs';

const VOLUMES = /\.(nii|nii\.gz|nrrd|nhdr|mha|mhd)$/;
const TRUTH = /\.truth\.[a-z.]+$/;
const WITH_FILES = /\.(nhdr|mhd)$/;

const NONE = '–';
const percent = (value) => (Number.isFinite(value) ? `${(100 * value).toFixed(1)}` : NONE);
const length = (value) => (Number.isFinite(value) ? value.toFixed(2) : NONE);

const COLUMNS = [
  ['frames', (row) => String(row.frames)],
  ['voxels', (row) => row.dims.join('×')],
  ['spacing', (row) => row.spacing.map((x) => Number(x.toFixed(2))).join('×')],
  ['box', (row) => row.box.join('×')],
  ['threshold', (row) => row.threshold.toPrecision(3)],
  ['parts', (row) => String(row.components)],
  ['genus', (row) => String(row.genus)],
  ['smallest', (row) => row.smallest.toPrecision(4)],
  ['largest', (row) => row.largest.toPrecision(4)],
  ['EF %', (row) => percent(row.ejection)],
  ['true EF %', (row) => percent(row.trueEjection)],
  ['of largest %', (row) => percent(row.ofLargest)],
  ['of own %', (row) => percent(row.ofOwn)],
  ['error', (row) => length(row.error)],
  ['voxels off', (row) => length(row.error / Math.min(...row.spacing))],
  ['self-int.', (row) => String(row.selfIntersections)],
  ['s proposing', (row) => row.proposing.toFixed(1)],
  ['s tracking', (row) => row.tracking.toFixed(1)],
];

/** Width of a column, in characters. */
const WIDTH = 14;
const cells = (texts) => texts.map((text) => text.padStart(WIDTH));

/** Returns whether every frame's surface has what is guaranteed: it is closed and does not intersect itself. */
export const isSound = (row) => row.closed && row.selfIntersections === 0;

/** Prints a row for every sequence in a folder, or for the computed ones; returns whether all surfaces are sound. */
export async function reportSequences(library, folder, line) {
  process.stdout.write(line('', cells(COLUMNS.map(([title]) => title))));
  let areSound = true;
  for await (const one of folder ? sequencesIn(library, folder) : computed(library)) {
    try {
      if (one.failure) throw one.failure;
      const row = await tracked(library, one);
      const warnings = `  ${row.warnings.join(' ')}`;
      process.stdout.write(line(one.name, [...cells(COLUMNS.map(([, text]) => text(row))), warnings]));
      areSound &&= isSound(row);
    } catch (error) {
      process.stdout.write(line(one.name, [` ${error.message.slice(0, 160)}`]));
    }
  }
  return areSound;
}

const sequencesIn = (library, folder) =>
  readEach(folder, VOLUMES, TRUTH, (path, name, all) => sequencesOf(library, path, name, all));

async function* sequencesOf(library, path, name, all) {
  const volume = await volumeOf(library, path);
  if (volume.frames > 1) yield { name, volume, ...(await truthBeside(library, path, all)) };
  else volume.free();
}

async function volumeOf({ Volume }, path) {
  const files = WITH_FILES.test(path) ? await filesBeside(path) : undefined;
  return Volume.parse(new Uint8Array(await readFile(path)), files && { files });
}

/** Returns the truth of a sequence, as far as there are files beside it. */
async function truthBeside(library, path, all) {
  const stem = path.replace(VOLUMES, '.truth.');
  const known = JSON.parse(await readFile(`${stem}json`, 'utf8').catch(missing));
  const beside = all.find((one) => one.startsWith(stem));
  if (!beside) return known;
  const truth = await volumeOf(library, beside);
  const mask = known.label === undefined ? truth : truth.label(known.label);
  return { ...known, surface: (frame) => library.Mesh.marchingCubes(mask, 0.5, { frame }) };
}

function missing(error) {
  if (error.code !== 'ENOENT') throw error;
  return '{}';
}

function* computed(library) {
  for (const [name, made] of Object.entries(SEQUENCES)) yield sequenceOf(library, name, made);
}

/** Returns a computed sequence with its truth. */
export function sequenceOf(library, name, made) {
  const surface = (frame) => trueSurface(library, made, frame);
  const volumes = Array.from({ length: made.frames }, (_, frame) => {
    const mesh = surface(frame);
    const { volume } = mesh.info();
    mesh.free();
    return volume;
  });
  return { name, volume: imageOf(library, made), point: made.point, volumes, surface };
}

/** Proposes settings from one point, tracks with them, and compares the surfaces with the truth, as far as it is known. */
export async function tracked({ SurfaceTracker }, { volume: given, point, frame, volumes: truth, surface }) {
  const volume = given.enrichSlices();
  const { value: proposal, seconds: proposing } = await timed(() =>
    SurfaceTracker.propose(volume, point ? { point, frame } : {}),
  );
  const { value: tracker, seconds: tracking } = await timed(() => {
    const one = new SurfaceTracker({ volume, ...proposal.options });
    while (!one.step().done);
    return one;
  });
  const frames = framesOf(tracker, surface);
  const { voxels, params } = proposal.options;
  const { spacing, frames: count } = given;
  const row = {
    ...{ frames: count, dims: given.dims.slice(0, 3), spacing, proposing, tracking, threshold: params.threshold },
    box: voxels.max.map((x, k) => x - voxels.min[k] + 1),
    ...worst(frames),
    ...measures([...tracker.volumes()], truth),
    warnings: [...new Set(frames.flatMap(({ codes }) => codes))],
  };
  tracker.free();
  volume.free();
  given.free();
  return row;
}

async function timed(work) {
  const began = performance.now();
  const value = await work();
  return { value, seconds: (performance.now() - began) / 1000 };
}

/** Returns the checks of every frame's surface, and its distance from the true one. */
function framesOf(tracker, surface) {
  return Array.from({ length: tracker.frames }, (_, frame) => {
    const mesh = tracker.meshAt(frame);
    const codes = mesh.warnings.map(({ code }) => code);
    const { closed, selfIntersections } = mesh.check();
    const { components, genus, triangles } = mesh.info();
    const error = surface && triangles > 0 ? distance(mesh, surface(frame)) : Number.NaN;
    mesh.free();
    return { codes, closed, selfIntersections, components, genus, error };
  });
}

function distance(mesh, truth) {
  const { mean } = mesh.distanceTo(truth);
  truth.free();
  return mean;
}

function worst(frames) {
  const most = (name) => Math.max(...frames.map((frame) => frame[name]));
  return {
    closed: frames.every(({ closed }) => closed),
    selfIntersections: most('selfIntersections'),
    components: most('components'),
    genus: most('genus'),
    error: most('error'),
  };
}

/** Returns the volumes' range and ejection fraction, and the largest differences from the true volumes. */
function measures(volumes, truth) {
  const [smallest, largest] = [Math.min(...volumes), Math.max(...volumes)];
  const found = { smallest, largest, ejection: 1 - smallest / largest };
  if (!truth) return found;
  const trueLargest = Math.max(...truth);
  const differences = volumes.map((volume, frame) => Math.abs(volume - truth[frame]));
  return {
    ...found,
    trueEjection: 1 - Math.min(...truth) / trueLargest,
    ofLargest: Math.max(...differences) / trueLargest,
    ofOwn: Math.max(...differences.map((difference, frame) => difference / truth[frame])),
  };
}
