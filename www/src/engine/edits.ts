/** Edits as calls of the package's methods: to carry them out, and to repeat them outside the app. */
import type { Mesh } from 'vesicle';
import { literal } from './literal';

import type { Edit } from './protocol';

/** Carries out an edit. */
export function apply(mesh: Mesh, edit: Edit): void {
  const method = mesh[edit.op] as (...values: unknown[]) => void;
  method.apply(mesh, argumentsOf(edit));
}

/**
 * Returns a program for Node that makes the same edits with the package, and gets the same surface, bit for bit, from
 * `file`, the surface before the edits as a PLY file.
 */
export function toCode(log: readonly Edit[], file: string): string {
  return [
    `import { readFile, writeFile } from 'node:fs/promises';`,
    `import init, { Mesh } from 'vesicle';`,
    '',
    'await init();',
    `const mesh = Mesh.parse(await readFile(${JSON.stringify(file)}));`,
    ...log.map((edit) => `mesh.${callOf(edit)};`),
    `await writeFile('edited.ply', mesh.toBytes('ply'));`,
    '',
  ].join('\n');
}

/** Returns one edit as a call, for a list of edits. */
export function callOf(edit: Edit): string {
  return `${edit.op}(${argumentsOf(edit).map(literal).join(', ')})`;
}

type Arguments = { [Op in Edit['op']]: (edit: Extract<Edit, { op: Op }>) => unknown[] };

/** The arguments of each edit, and nothing else: a log may come from a file of anyone. */
const ARGUMENTS: Arguments = {
  remesh: ({ min, max }) => [{ min, max }],
  decimate: ({ targetTriangles }) => [targetTriangles],
  decimateWithin: ({ maxDistance }) => [maxDistance],
  smooth: ({ iterations, keepVolume }) => [{ iterations, keepVolume }],
  keepComponents: ({ indices }) => [indices],
  removeCavities: () => [],
  cut: ({ origin, normal }) => [{ origin, normal }],
};

function argumentsOf(edit: Edit): unknown[] {
  return (ARGUMENTS[edit.op] as (edit: Edit) => unknown[])(edit);
}
