// Compares the surfaces of a label map and tools for meshes with those of other packages, in the same run, and writes the
// figures of docs/performance.md.
import { readFile, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { inFolder, toolsNatively } from './bench-native.mjs';
import { compare, counts, MACHINE, measureTheirs, PER_RUN, peerRows, percent, shown } from './bench-peers.mjs';
import { at } from './shell.mjs';

const PAGE = 'docs/performance.md';
/** The heading of the page below which the figures stand. */
const HEADING = '## Figures\n';

/** Returns a row for each task and package, or one without a package, with the figures of all sides; and those of a page. */
export async function compareTools(repeats) {
  const page = await (await import('../bench/labels-page.mjs')).measure();
  const { measure, ...sizes } = await import('../bench/tools.mjs');
  const [ours, native] = [await measure(repeats), await toolsNatively(repeats)];
  const host = `Node ${process.versions.node}`;
  return inFolder(async (folder) => {
    const found = await measureTheirs(await writeJob(folder, repeats));
    const rows = named(ours, sizes).flatMap((one) => {
      const task = { host, ...PER_RUN, volume: ours.volume, ...one, ours: ours.tasks[one.task] };
      const sides = one.packages ? one.packages.map((name) => compare(task, name, found)) : [alone(task)];
      return sides.map(async (row) => ({ ...(await row), native: { figure: native[one.task] } }));
    });
    return { bestOf: repeats, ...MACHINE, rows: await Promise.all(rows), page };
  });
}

function named({ triangles }, { ITERATIONS, WITHIN, DISTANCES }) {
  const size = `${triangles.toLocaleString('en')} triangles`;
  return [
    { task: 'labels', name: 'Surfaces of a label map, 192³ voxels, 30 labels that touch', packages: ['vtk'] },
    { task: 'noise', name: 'Surfaces of noise of 254 labels, 64³ voxels' },
    { task: 'smooth', name: `Smoothing, ${ITERATIONS} iterations, ${size}`, packages: ['pymeshlab'] },
    { task: 'decimate', name: `Decimation to a tenth, ${size}`, packages: ['pymeshlab', 'vtk'] },
    { task: 'decimate within', name: `Decimation within ${WITHIN} voxels, ${size}` },
    { task: 'distance', name: `Signed distances, ${DISTANCES}³ voxels, ${size}` },
  ];
}

const alone = ({ task, name, unit, figure, host, ours }) => ({
  ...{ task, name, unit },
  ours: { host, figure: figure(ours), ...counts(ours) },
});

/** Writes the input files of the other packages and returns the path of the job file that lists them. */
async function writeJob(folder, repeats) {
  const { labelMap, roughMesh, ITERATIONS, KEPT } = await import('../bench/tools.mjs');
  const [mesh, map] = [roughMesh(), labelMap()];
  const paths = ['positions', 'indices', 'labels'].map((name) => join(folder, `${name}.bin`));
  const { positions, indices } = mesh.arrays();
  await Promise.all([positions, indices, map.data].map((array, k) => writeFile(paths[k], array)));
  mesh.free();
  const job = {
    ...{ packages: ['vtk', 'pymeshlab'], repeats, iterations: ITERATIONS, kept: KEPT },
    mesh: { positions: paths[0], indices: paths[1] },
    labels: { file: paths[2], side: map.dims[0] },
  };
  const file = join(folder, 'job.json');
  await writeFile(file, JSON.stringify(job));
  return file;
}

/** Replaces the figures of docs/performance.md by those of a result, and returns it. */
export async function writePerformance(result) {
  const page = await readFile(at(PAGE), 'utf8');
  const begins = page.indexOf(HEADING) + HEADING.length;
  const ends = page.indexOf('\n## ', begins);
  await writeFile(at(PAGE), `${page.slice(0, begins)}\n${figures(result)}\n${page.slice(ends)}`);
  return result;
}

/** Returns the printed lines. */
export function toolRows(result) {
  const { size, labels, rows } = result.page;
  const row = ({ name, skipped, first, last, longest, over, bytes }) => [
    `  ${name}`,
    skipped ? '–' : shown(PER_RUN, { figure: last }),
    skipped ?? `first after ${shown(PER_RUN, { figure: first })}; ${tasks({ longest, over })}; ${megabytes(bytes)}`,
  ];
  const heading = [`In a page, ${labels} labels, ${size}³`, '', ''];
  return [...peerRows(result), heading, ...rows.map(row)];
}

const tasks = ({ longest, over }) => (over ? `${over}, ${longest.toFixed(0)} ms at most` : 'none');

const megabytes = (bytes) => (bytes ? `${(bytes / 2 ** 20).toFixed(0)} MB` : '–');

const WORK = [
  'work',
  'Vesicle, in Node',
  'natively',
  'beside',
  '',
  'in Node to it',
  'natively to it',
  'self-intersections',
  'volume',
];
const IN_PAGE = ['by', 'first surface', 'all surfaces', 'tasks of the page over 50 ms', 'most memory of the page'];

function figures({ bestOf, cores, rows, page }) {
  const when = new Date().toISOString().slice(0, 10);
  return [
    `One thread of ${cores} cores, the best of ${bestOf} runs, ${when}. Quality: Vesicle's; the other's.`,
    table(WORK, rows.map(cells)),
    `In a page in Chromium, ${page.labels} labels that touch in ${page.size}³ voxels, once each:`,
    table(IN_PAGE, page.rows.map(pageCells)),
  ].join('\n\n');
}

function table(head, rows) {
  return [head, head.map(() => '---'), ...rows].map((line) => `| ${line.join(' | ')} |`).join('\n');
}

function pageCells({ name, skipped, first, last, longest, over, bytes }) {
  if (skipped) return [name, skipped, '', '', ''];
  const times = [first, last].map((figure) => shown(PER_RUN, { figure }));
  return [name, ...times, tasks({ longest, over }), megabytes(bytes)];
}

function cells(row) {
  const { name, ours, native, package: other, version, theirs, skipped } = row;
  const mine = [name, shown(row, ours), shown(row, native)];
  const quality = (of) => [of.selfIntersections, of.volumeError === undefined ? undefined : percent(of.volumeError)];
  if (!theirs)
    return [...mine, skipped ? `${other}: ${skipped}` : '–', '', '', '', ...quality(ours).map((one) => one ?? '–')];
  const broken = theirs.refused
    ? 'not closed'
    : theirs.notClosed
      ? `${theirs.notClosed} of ${theirs.parts} not manifold`
      : '';
  const [crossings, volume] = quality(theirs);
  const both = [
    [ours.selfIntersections, broken || crossings],
    [quality(ours)[1], volume],
  ];
  return [
    ...mine,
    `${theirs.what}, ${other} ${version}`,
    shown(row, theirs),
    ...[ours, native].map(({ figure }) => (figure / theirs.figure).toPrecision(2)),
    ...both.map((pair) => pair.map((one) => one ?? '–').join('; ')),
  ];
}
