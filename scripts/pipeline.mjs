// Runs the alternative to this library for a row of `npm run real`: bench/pipeline.py, if Python has its packages.
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { inFolder } from './bench-native.mjs';
import { PYTHON } from './bench-peers.mjs';
import { at, must } from './shell.mjs';

/** Returns the figures of flying edges and isotropic remeshing on a volume, with a target edge length. */
export async function pipelineOf(volume, iso, edge) {
  return inFolder(async (folder) => {
    const voxels = join(folder, 'voxels.f32');
    await writeFile(voxels, volume.intensities());
    const job = join(folder, 'job.json');
    await writeFile(job, JSON.stringify({ voxels, dims: volume.dims, spacing: volume.spacing, iso, edge }));
    const output = await must(PYTHON, [at('bench/pipeline.py'), job]);
    // Packages may print lines before it.
    return JSON.parse(output.trim().split('\n').at(-1));
  });
}

/** Formats the figures as one line, with the ratio of their time to `seconds`, the time of the deformable model. */
export function pipelineLine(theirs, seconds) {
  return [
    `${theirs.seconds.toFixed(1)} s, ${(theirs.seconds / seconds).toFixed(1)} times ours`,
    `${theirs.fewRoundsSeconds.toFixed(1)} s with three rounds`,
    `recall ${(100 * theirs.recall).toFixed(2)} %`,
    `${theirs.vertices} vertices`,
    `${theirs.intersectingFaces} self-intersecting faces`,
    `${theirs.openEdges} boundary edges, ${theirs.branchingEdges} non-manifold edges`,
    `smallest angle ${theirs.smallestAngle.toFixed(2)}°`,
  ].join(', ');
}
