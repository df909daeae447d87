// Runs the alternative to the implicit surface for a row of `npm run real -- FOLDER --clouds`: bench/poisson.py, if Python has its packages.
import { readFile, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { inFolder } from './bench-native.mjs';
import { PYTHON } from './bench-peers.mjs';
import { at, must, run } from './shell.mjs';

/** Returns whether Python has the packages. */
export async function hasPoisson() {
  return (await run(PYTHON, ['-c', 'import numpy, pymeshlab'], { echo: false })).code === 0;
}

/**
 * Returns the mean two-sided distances from a reference of screened Poisson's surfaces of a cloud: with estimated normals and, if
 * the cloud has them, with the true ones at the best depth.
 */
export async function poissonOf({ Mesh }, { points, normals }, reference) {
  return inFolder(async (folder) => {
    const names = { points: join(folder, 'points'), normals: normals && join(folder, 'normals') };
    await writeFile(names.points, points);
    if (normals) await writeFile(names.normals, normals);
    const job = join(folder, 'job.json');
    await writeFile(job, JSON.stringify({ folder, ...names }));
    const output = await must(PYTHON, [at('bench/poisson.py'), job]);
    const found = JSON.parse(output.trim().split('\n').at(-1));
    const best = async (surfaces = []) =>
      Math.min(...(await Promise.all(surfaces.map(({ file }) => meanDistance(Mesh, file, reference)))));
    return { estimated: await best(found.estimated), true: await best(found.true) };
  });
}

async function meanDistance(Mesh, file, reference) {
  const [positions, triangles] = await Promise.all(
    ['positions', 'triangles'].map(async (part) => Uint8Array.from(await readFile(`${file}.${part}`)).buffer),
  );
  const mesh = Mesh.fromArrays(new Float32Array(positions), new Uint32Array(triangles));
  const { mean } = mesh.distanceTo(reference);
  mesh.free();
  return mean;
}
