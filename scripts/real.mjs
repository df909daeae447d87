// Runs the deformable model at its default settings on every volume of a folder: `npm run real -- FOLDER [--levels N]
// [--pipeline]`; by default on the example volumes. Prints a row for each volume and iso value and, with --pipeline,
// the figures of flying edges and isotropic remeshing below it. Ends with 1 if a surface intersects itself, or if
// recall or precision is below 99 %. With `--meshes`, `--clouds` or `--sequences` it runs one of the other three methods.
import { readFile } from 'node:fs/promises';
import { basename, relative } from 'node:path';
import { parseArgs } from 'node:util';
import { filesBelow, filesBeside } from './beside.mjs';
import { build } from './build.mjs';
import { pipelineLine, pipelineOf } from './pipeline.mjs';
import { reportClouds } from './real-clouds.mjs';
import { reportMeshes } from './real-meshes.mjs';
import { reportSequences } from './real-sequences.mjs';
import { at, say, script, startedAs } from './shell.mjs';

const VOLUMES = /\.(nii|nii\.gz|nrrd|nhdr|mha|mhd)$/;
const BINS = 256;

/** Standard deviation, in bins, of the Gaussian that smooths the histogram before valleys are searched. */
const SMOOTHING = 4;

/** Fewest voxels along an axis; smaller volumes are test files, not objects. */
const SMALLEST = 8;

/** Width of the first column, in characters. */
const LONGEST_NAME = 54;

function smoothed(histogram) {
  const reach = 3 * SMOOTHING;
  return Array.from(histogram, (_, bin) => {
    let sum = 0;
    let weights = 0;
    for (let d = -reach; d <= reach; d++) {
      const weight = Math.exp(-0.5 * (d / SMOOTHING) ** 2);
      // Logarithms, since the background is a thousand times as frequent as the objects.
      if (bin + d >= 0 && bin + d < histogram.length) sum += weight * Math.log1p(histogram[bin + d]);
      weights += weight;
    }
    return sum / weights;
  });
}

/**
 * Returns the intensities of at most `count` deepest valleys of the histogram, filled up with fixed fractions of the
 * range.
 */
export function valleys(histogram, [low, high], count) {
  const heights = smoothed(histogram);
  const found = [];
  for (let bin = 1; bin < heights.length - 1; bin++) {
    if (heights[bin] > heights[bin - 1] || heights[bin] >= heights[bin + 1]) continue;
    const [left, right] = [heights.slice(0, bin), heights.slice(bin + 1)].map((side) => Math.max(...side));
    found.push({ bin, depth: Math.min(left, right) - heights[bin] });
  }
  found.sort((a, b) => b.depth - a.depth);
  const bins = found.slice(0, count).map(({ bin }) => bin);
  for (const share of [0.35, 0.6]) {
    if (bins.length < count) bins.push(Math.round(share * heights.length));
  }
  return bins.sort((a, b) => a - b).map((bin) => low + ((high - low) * (bin + 0.5)) / heights.length);
}

/** Returns whether the whole contour was found, and nothing else. */
export const isComplete = ({ recall, precision }) => recall >= 0.99 && precision >= 0.99;

/**
 * Returns the largest number of √3 levels above a volume whose coarsest level has four voxels along its shortest side.
 */
function mostLevels(dims) {
  return Math.max(0, Math.floor(Math.log(Math.min(...dims) / 4) / Math.log(Math.sqrt(3))));
}

/**
 * Runs the model once at the defaults and marching cubes for comparison. Self-intersections are summed over all steps;
 * counting them is not timed.
 */
export async function measured({ DeformableModel, Mesh }, volume, iso, levels) {
  const cubes = Math.min(...[1, 2, 3].map(() => timed(() => Mesh.marchingCubes(volume, iso).free())));
  const reference = Mesh.marchingCubes(volume, iso);
  const vertices = reference.vertexCount;
  reference.free();
  let model;
  let milliseconds = timed(() => {
    model = new DeformableModel({ volume, levels, params: { iso } });
  });
  let report;
  let seeds = 0;
  let intersections = model.mesh.check().selfIntersections;
  do {
    milliseconds += timed(() => {
      report = model.step();
    });
    seeds += report.events.seeds;
    intersections += model.mesh.check().selfIntersections;
  } while (!report.done);
  const { recall, precision } = await model.coverage();
  const info = model.mesh.info();
  model.free();
  return {
    recall,
    precision,
    vertices: info.vertices,
    edge: info.edge.mean,
    smallestAngle: info.minAngleDegrees,
    share: info.vertices / vertices,
    components: info.components,
    euler: info.euler,
    intersections,
    iterations: report.iteration,
    seeds,
    seconds: milliseconds / 1000,
    ratio: milliseconds / cubes,
  };
}

function timed(work) {
  const started = performance.now();
  work();
  return performance.now() - started;
}

const COLUMNS = [
  ['recall', (row) => `${(100 * row.recall).toFixed(2)} %`],
  ['precision', (row) => `${(100 * row.precision).toFixed(2)} %`],
  ['vertices', (row) => String(row.vertices)],
  ['of m.c.', (row) => row.share.toFixed(2)],
  ['parts', (row) => String(row.components)],
  ['χ', (row) => String(row.euler)],
  ['self-int.', (row) => String(row.intersections)],
  ['seeds', (row) => String(row.seeds)],
  ['iterations', (row) => String(row.iterations)],
  ['angle', (row) => `${row.smallestAngle.toFixed(1)}°`],
  ['seconds', (row) => row.seconds.toFixed(1)],
  ['× m.c.', (row) => row.ratio.toFixed(0)],
];

const line = (name, cells) => `${name.padEnd(LONGEST_NAME)}${cells.map((cell) => cell.padStart(11)).join('')}\n`;

/** Prints and returns the rows of one file; a file that cannot be read gets one line and no rows. */
async function report(library, path, name, { levels, pipeline }) {
  const bytes = await readFile(path);
  let volume;
  try {
    const files = /\.(nhdr|mhd)$/.test(path) ? await filesBeside(path) : undefined;
    volume = library.Volume.parse(new Uint8Array(bytes), files && { files });
  } catch (error) {
    process.stdout.write(`${name.padEnd(LONGEST_NAME)} not read: ${error.message.slice(0, 80)}\n`);
    return [];
  }
  const { dims, range } = volume;
  const rows = [];
  const used = Math.min(levels, mostLevels(dims));
  const isos = dims.every((n) => n >= SMALLEST) ? valleys(volume.histogram({ bins: BINS }), range, 2) : [];
  for (const iso of isos) {
    const row = await measured(library, volume, iso, used);
    process.stdout.write(
      line(
        `${name} at ${Number(iso.toPrecision(4))}${used < levels ? `, levels ${used}` : ''}`,
        COLUMNS.map(([, text]) => text(row)),
      ),
    );
    if (pipeline && row.vertices > 0) {
      const theirs = await pipelineOf(volume, iso, row.edge);
      process.stdout.write(`  flying edges, isotropic remeshing: ${pipelineLine(theirs, row.seconds)}\n`);
    }
    rows.push(row);
  }
  volume.free();
  return rows;
}

/** Returns the report of the method that the options name, if it is not that of volumes. */
function otherReport({ meshes, clouds, sequences }) {
  if (meshes) return reportMeshes;
  if (clouds) return reportClouds;
  return sequences ? reportSequences : undefined;
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    await build();
    const library = await import(at('pkg', 'index.js'));
    await library.default();
    const { values, positionals } = parseArgs({
      allowPositionals: true,
      options: {
        levels: { type: 'string', default: '0' },
        pipeline: { type: 'boolean', default: false },
        meshes: { type: 'boolean', default: false },
        clouds: { type: 'boolean', default: false },
        sequences: { type: 'boolean', default: false },
      },
    });
    const [given] = positionals;
    const folder = given ?? at('www/public/data');
    const other = otherReport(values);
    if (other) {
      if (!(await other(library, values.meshes ? folder : given, line))) process.exitCode = 1;
      return;
    }
    process.stdout.write(
      line(
        '',
        COLUMNS.map(([title]) => title),
      ),
    );
    const rows = [];
    for (const path of await filesBelow(folder, VOLUMES)) {
      const name = relative(folder, path) || basename(path);
      rows.push(...(await report(library, path, name, { ...values, levels: Number(values.levels) })));
    }
    const complete = rows.filter(isComplete);
    say('rows', `${rows.length}, ${complete.length} with recall and precision of 99 % and more`);
    if (complete.length < rows.length || rows.some((row) => row.intersections > 0)) process.exitCode = 1;
  });
}
