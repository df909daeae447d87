// What one would do without us, beside a row of `npm run real`: bench/pipeline.py, where Python has what it needs.
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { inFolder } from './bench-native.mjs';
import { at, run } from './shell.mjs';

const PYTHON = process.env.VESICLE_PYTHON ?? 'python3';

/** Flying edges and isotropic remeshing of a volume to edges of a mean length, as figures. */
export async function pipelineOf(volume, iso, edge) {
  return inFolder(async (folder) => {
    const voxels = join(folder, 'voxels.f32');
    await writeFile(voxels, volume.intensities());
    const job = join(folder, 'job.json');
    await writeFile(job, JSON.stringify({ voxels, dims: volume.dims, spacing: volume.spacing, iso, edge }));
    const { code, output } = await run(PYTHON, [at('bench/pipeline.py'), job], { echo: false });
    const last = output.trim().split('\n').at(-1);
    if (code !== 0) throw new Error(`${PYTHON} cannot run bench/pipeline.py: ${last}`);
    return JSON.parse(last);
  });
}

/** The figures in one line, and how much longer it took than ours. */
export function pipelineLine(theirs, seconds) {
  return [
    `${theirs.seconds.toFixed(1)} s, ${(theirs.seconds / seconds).toFixed(1)} times ours`,
    `${theirs.fewRoundsSeconds.toFixed(1)} s with three rounds`,
    `recall ${(100 * theirs.recall).toFixed(2)} %`,
    `${theirs.vertices} vertices`,
    `${theirs.crossingFaces} faces that intersect`,
    `${theirs.openEdges} open edges, ${theirs.branchingEdges} of more than two faces`,
    `${theirs.smallestAngle.toFixed(2)}° at least`,
  ].join(', ');
}
