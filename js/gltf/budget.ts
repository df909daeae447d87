// How much the parts of a document may decode to.
import { isSmall } from '../small-files.js';
import { tooLarge } from './error.js';
import { entry, type Json, object, objects } from './json.js';

/** Number of bytes that a document may decode to, as of scenes that the reader of meshes accepts. */
const LIMIT = 1 << 27;

/** Number of decoded bytes for each byte of the file that may always be made: few meshes are compressed so well. */
const GROWTH = 64;

/** Number of bytes that small files may decode to: as much as the best compressed, and as plain ones. */
const LIMIT_OF_SMALL = 1 << 23;

/** Returns the largest number of bytes that files of a given size may decode to. */
const limitOf = (fileBytes: number): number =>
  isSmall(fileBytes) ? LIMIT_OF_SMALL : Math.max(LIMIT, fileBytes * GROWTH);

/** Returns a function that counts bytes before they are made; it throws `too-large` where all are far more than the file. */
export function budgetOf(fileBytes: number): (bytes: number, field: string) => void {
  const limit = limitOf(fileBytes);
  let used = 0;
  return (bytes, field) => {
    used += bytes;
    if (used > limit) throw tooLarge(field, used, limit);
  };
}

export type Budget = ReturnType<typeof budgetOf>;

/** Throws `too-large` for a decoded document whose nodes repeat its meshes to far more than the file. */
export function checkRepeated(root: Json, fileBytes: number): void {
  const countOf = (accessor: unknown) => Number(entry(root, 'accessors', Number(accessor)).count) || 0;
  const made = objects(root.meshes).map(({ primitives }) =>
    objects(primitives).reduce((sum, { attributes, indices }) => {
      const { POSITION } = object(attributes);
      const vertices = POSITION === undefined ? 0 : countOf(POSITION);
      return sum + 12 * vertices + 4 * (indices === undefined ? vertices : countOf(indices));
    }, 0),
  );
  const bytes = objects(root.nodes).reduce((sum, { mesh, extensions }) => {
    const [first] = Object.values(object(object(object(extensions).EXT_mesh_gpu_instancing).attributes));
    return sum + (made[Number(mesh)] ?? 0) * (first === undefined ? 1 : countOf(first));
  }, 0);
  const limit = limitOf(fileBytes);
  if (bytes > limit) throw tooLarge('nodes', bytes, limit);
}
