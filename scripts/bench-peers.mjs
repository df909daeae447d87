// Compares other software with this library on the benches' data, in the same run. bench/peers.py times the packages
// that are installed; its docstring says how far figures can be compared. VESICLE_PYTHON names a Python other than
// python3.
import { readFile, writeFile } from 'node:fs/promises';
import { cpus, loadavg } from 'node:os';
import { join } from 'node:path';
import { inFolder, remeshNatively } from './bench-native.mjs';
import { at, run } from './shell.mjs';

/** Factor on the number of runs of short tasks, for both sides. */
const CHEAP = 10;

export const PYTHON = process.env.VESICLE_PYTHON ?? 'python3';

/** Load average of the machine before the benches start, and its number of cores. */
export const MACHINE = { load: loadavg()[0], cores: cpus().length };

/**
 * Returns a row for each task and package, with the figures of both sides or the reason why the package was skipped.
 */
export async function comparePeers(scan, repeats) {
  const all = tasks(await measureOurs(scan, repeats));
  return inFolder(async (folder) => {
    const found = await measureTheirs(await writeJob(folder, scan, repeats));
    const rows = all.flatMap((task) => task.packages.map((name) => compare(task, name, found)));
    return { bestOf: repeats, ...MACHINE, rows: await Promise.all(rows) };
  });
}

async function measureOurs(scan, repeats) {
  const bytes = new Uint8Array(await readFile(at(scan)));
  const { measure, measureCubes } = await import('../bench/head.mjs');
  const cubes = await measureCubes(bytes, CHEAP * repeats);
  const head = { ...(await measure(bytes, repeats)), cubes };
  const points = await (await import('../bench/points.mjs')).measure(repeats);
  return { head, points, remesh: await remeshNatively() };
}

export const PER_RUN = { unit: 'ms', figure: ({ milliseconds }) => milliseconds };
const PER_TRIANGLE = {
  unit: 'µs per triangle',
  figure: ({ milliseconds, triangles }) => (1000 * milliseconds) / triangles,
};

const remeshTask = (name, factor) => `remesh ${name} ${factor}`;

/** Returns the tasks: their names, the packages to compare with, and this library's results. */
function tasks({ head: { cubes, model }, points: { few, many }, remesh }) {
  const host = `Node ${process.versions.node}`;
  const solve = ({ solve, residual }) => ({ milliseconds: solve, residual });
  const size = ({ points, exterior }) => (points + exterior).toLocaleString('en');
  const surface = { milliseconds: many.solve + many.extract, vertices: many.vertices };
  const inNode = [
    { task: 'cubes', name: 'Head CT, marching cubes', packages: ['vtk', 'scikit-image'], ours: cubes },
    { task: 'model', name: 'Head CT, a surface fitted until it rests', packages: ['SimpleITK'], ours: model },
    { task: 'solve few', name: `${size(few)} constraints solved`, packages: ['scipy'], ours: solve(few) },
    { task: 'solve many', name: `${size(many)} constraints solved`, packages: ['scipy'], ours: solve(many) },
    { task: 'surface many', name: `${size(many)} constraints to a surface`, packages: ['scipy'], ours: surface },
  ];
  const natively = remesh.rows.map((row) => ({
    task: remeshTask(row.name, row.factor),
    name: `Remeshing, ${row.name}, edges × ${row.factor}`,
    packages: ['pymeshlab', 'cgal'],
    ours: row,
    host: remesh.host,
    ...PER_TRIANGLE,
  }));
  return [...inNode.map((task) => ({ host, ...PER_RUN, ...task })), ...natively];
}

/** Writes the input files of the other packages and returns the path of the job file that lists them. */
async function writeJob(folder, scan, repeats) {
  const { ISO } = await import('../bench/head.mjs');
  const { FEW, MANY } = await import('../bench/points.mjs');
  const job = {
    ...{ scan: at(scan), iso: ISO, repeats, cheapRepeats: CHEAP * repeats },
    few: await writePoints(folder, FEW),
    many: await writePoints(folder, MANY),
    meshes: await writeMeshes(folder),
  };
  const file = join(folder, 'job.json');
  await writeFile(file, JSON.stringify(job));
  return file;
}

async function writePoints(folder, count) {
  const { example } = await import('../bench/points.mjs');
  const files = {};
  for (const [name, array] of Object.entries(await example(count))) {
    files[name] = join(folder, `${name}-${count}.f32`);
    await writeFile(files[name], array);
  }
  return files;
}

async function writeMeshes(folder) {
  const { FACTORS, meshes } = await import('../bench/remesh.mjs');
  const written = [];
  for (const [name, mesh] of Object.entries(await meshes())) {
    const file = join(folder, `${name}.off`);
    await writeFile(file, offOf(mesh.arrays()));
    const edge = mesh.info().edge.mean;
    for (const factor of FACTORS) written.push({ task: remeshTask(name, factor), file, factor, edge: factor * edge });
    mesh.free();
  }
  return written;
}

/** Formats an array as lines of three numbers each, after the prefix `first`. */
function lines(array, first = '') {
  const line = (_, k) => `${first}${array[3 * k]} ${array[3 * k + 1]} ${array[3 * k + 2]}`;
  return Array.from({ length: array.length / 3 }, line);
}

/** Returns a mesh as OFF text, the one format that both remeshers read. */
function offOf({ positions, indices }) {
  const counts = `${positions.length / 3} ${indices.length / 3} 0`;
  return `${['OFF', counts, ...lines(positions), ...lines(indices, '3 ')].join('\n')}\n`;
}

/** Runs bench/peers.py and returns its results, or why there are none. */
export async function measureTheirs(job) {
  const { code, output } = await run(PYTHON, [at('bench/peers.py'), job], { echo: false });
  if (code !== 0) return { absent: `${PYTHON} cannot run bench/peers.py: ${output.trim().split('\n').at(-1)}` };
  return { results: JSON.parse(output.trim().split('\n').at(-1)) };
}

/**
 * Returns the row of a task and a package. A result without a task explains all tasks of its package that have no
 * result.
 */
export async function compare(given, wanted, { results = [], absent }) {
  const { task, name, unit, figure, host, ours, volume } = given;
  const from = results.filter(({ package: name }) => name === wanted);
  const found = from.find((one) => one.task === task) ?? from.find((one) => !one.task);
  const mine = { host, figure: figure(ours), ...counts(ours) };
  const row = { task, name, unit, package: wanted, version: found?.version, ours: mine };
  if (found?.milliseconds === undefined) return { ...row, skipped: found?.absent ?? absent ?? 'nothing came of it' };
  const theirs = { what: found.what, figure: figure(found), ...counts(found), ...(await looked(found, volume)) };
  return { ...row, theirs, ratio: mine.figure / theirs.figure };
}

const COUNTED = [
  ...['vertices', 'triangles', 'iterations', 'converged', 'volume', 'volumeError', 'minAngleDegrees'],
  'selfIntersections',
];

/** Returns the counts and measures among the fields of a result. */
export const counts = (of) => Object.fromEntries(COUNTED.filter((name) => name in of).map((name) => [name, of[name]]));

/**
 * Returns the quality of another package's mesh, measured by this library: its smallest angle, self-intersections, and
 * the error of its volume if `volume` is known; or the self-intersections of its `parts` and how many are no closed surface.
 */
async function looked({ files, parts }, volume) {
  if (parts) {
    const found = await Promise.all(parts.map((one) => looked({ files: one })));
    const selfIntersections = found.reduce((sum, one) => sum + (one.selfIntersections ?? 0), 0);
    return { selfIntersections, parts: parts.length, notClosed: found.filter(({ refused }) => refused).length };
  }
  if (!files) return {};
  const { Mesh } = await import('../pkg/index.js');
  const [positions, indices] = await Promise.all([readFile(files.positions), readFile(files.indices)]);
  try {
    const mesh = Mesh.fromArrays(new Float32Array(bufferOf(positions)), new Uint32Array(bufferOf(indices)));
    const { minAngleDegrees, volume: found } = mesh.info();
    const { selfIntersections } = mesh.check();
    mesh.free();
    return { minAngleDegrees, selfIntersections, ...(volume && { volumeError: found / volume - 1 }) };
  } catch (error) {
    return { refused: error.message };
  }
}

/** Copies the bytes of a Node buffer, which may be part of a larger one, into an `ArrayBuffer` of their own. */
const bufferOf = ({ buffer, byteOffset, byteLength }) => buffer.slice(byteOffset, byteOffset + byteLength);

/** Returns the printed lines: one for each row, with a heading for each task. */
export function peerRows({ rows, bestOf }) {
  const lines = [['', '', `best of ${bestOf}; the ratio is ours to theirs`]];
  let task;
  for (const row of rows) {
    if (row.task !== task) lines.push(...heading(row));
    task = row.task;
    if (row.package) lines.push(row.skipped ? skippedLine(row) : peerLine(row));
  }
  return lines;
}

const heading = (row) => [
  [row.name, '', ''],
  [`  ours, ${row.ours.host}`, shown(row, row.ours), `        ${sizes(row.ours)}`],
  ...(row.native ? [['  ours, native', shown(row, row.native), '']] : []),
];

const skippedLine = (row) => [`  ${row.package}`, '–', `        skipped: ${row.skipped}`];

function peerLine(row) {
  const { ratio, theirs, version } = row;
  const remark = [theirs.what, sizes(theirs)].filter(Boolean).join(', ');
  return [`  ${row.package} ${short(version)}`, shown(row, theirs), `${ratio.toPrecision(2).padEnd(6)}  ${remark}`];
}

/** Removes the post-release number from a version. */
const short = (version) => version.replace(/\.post\d+$/, '');

export const percent = (share) => `${(100 * share).toPrecision(2)} %`;

/** Formats the figure of a row's side. */
export function shown({ unit }, { figure }) {
  if (unit !== 'ms') return `${figure.toFixed(1)} µs`;
  return figure < 1000 ? `${figure.toFixed(0)} ms` : `${(figure / 1000).toFixed(2)} s`;
}

function sizes(of) {
  const { vertices, triangles, volume, volumeError, minAngleDegrees, selfIntersections, notClosed, parts, refused } =
    of;
  const words = [];
  if (vertices) words.push(`${vertices} vertices`);
  if (triangles) words.push(`${triangles} triangles`);
  if (volume) words.push(`${(volume / 1000).toFixed(0)} cm³`);
  if (volumeError !== undefined) words.push(`volume off by ${percent(volumeError)}`);
  if (minAngleDegrees !== undefined) words.push(`${minAngleDegrees.toFixed(1)}° at least`);
  if (selfIntersections !== undefined) words.push(`${selfIntersections} self-intersections`);
  if (notClosed) words.push(`${notClosed} of ${parts} surfaces not closed or manifold`);
  if (refused) words.push(`no closed surface: ${refused}`);
  return words.join(', ');
}
