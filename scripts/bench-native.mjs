// Runs the benchmark programs in examples/ and returns their figures in the form of the benches in Node and Chromium.
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { must } from './shell.mjs';

const example = (name, files = [], env = {}) =>
  must('cargo', ['run', '--quiet', '--locked', '--release', '--example', name, '--', ...files], { env });

/** Calls `work` with the path of a temporary folder, removes the folder afterwards, and returns the result. */
export async function inFolder(work) {
  const folder = await mkdtemp(join(tmpdir(), 'vesicle-'));
  try {
    return await work(folder);
  } finally {
    await rm(folder, { recursive: true });
  }
}

/** Returns the native timings of steps of the deformable model, which the example prints as JSON. */
export async function stepsNatively() {
  return { host: 'native', rows: JSON.parse(await example('step_figures')) };
}

/** Returns the native timings of remeshing, of the same meshes as in bench/remesh.mjs. */
export async function remeshNatively() {
  const { meshes } = await import('../bench/remesh.mjs');
  const printed = await inFolder(async (folder) => {
    const files = [];
    for (const [name, mesh] of Object.entries(await meshes())) {
      files.push(join(folder, `${name}.ply`));
      await writeFile(files.at(-1), mesh.toBytes('ply'));
      mesh.free();
    }
    // Only these files, without the example's built-in shapes.
    return example('remesh_figures', files, { ONLY: '.ply' });
  });
  return { host: 'native', rows: readTable(printed).map(remeshRow) };
}

/** Returns the native milliseconds of the tasks of bench/tools.mjs, on its mesh and label map. */
export async function toolsNatively(repeats) {
  const { labelMap, labelNoise, roughMesh, ...sizes } = await import('../bench/tools.mjs');
  const [mesh, map, noise] = [roughMesh(), labelMap(), labelNoise()];
  return inFolder(async (folder) => {
    const files = ['mesh.ply', 'labels.bin', 'noise.bin'].map((name) => join(folder, name));
    await Promise.all([mesh.toBytes('ply'), map.data, noise.data].map((bytes, k) => writeFile(files[k], bytes)));
    mesh.free();
    const { ITERATIONS, KEPT, WITHIN, IMAGE, DISTANCES } = sizes;
    const given = [...files, map.dims[0], noise.dims[0], repeats, ITERATIONS, KEPT, WITHIN, IMAGE, DISTANCES];
    return JSON.parse(await example('tool_figures', given.map(String)));
  });
}

/** Parses a printed table into row objects whose keys are the words of its first line. */
function readTable(printed) {
  const [head, ...lines] = printed.trim().split('\n');
  const names = head.trim().split(/\s+/);
  const row = (line) => {
    const values = line.trim().split(/\s+/);
    return Object.fromEntries(names.map((name, k) => [name, values[k]]));
  };
  return lines.filter((line) => line.includes('.ply ')).map(row);
}

function remeshRow({ mesh, aim, in: before, out, 'us/tri': each, cross, angle, 'haus/a': distance }) {
  const triangles = Number(out);
  return {
    name: mesh.replace('.ply', ''),
    factor: Number(aim),
    milliseconds: (Number(each) * triangles) / 1000,
    before: Number(before),
    triangles,
    minAngleDegrees: Number(angle),
    selfIntersections: Number(cross),
    distance: Number(distance),
  };
}
