// Files beside one that may refer to them: the voxels of a header, the buffers of a document.
import { readdir, readFile, stat } from 'node:fs/promises';
import { basename, dirname, join, relative } from 'node:path';

/** Most bytes of all files beside one. */
const MOST_BYTES = 2 ** 28;

/** Returns the files in the folder of a file, without it, as `{ name, bytes }`, as far as they are not too many. */
export async function filesBeside(path) {
  const files = [];
  let size = 0;
  for (const entry of await readdir(dirname(path), { withFileTypes: true })) {
    if (!entry.isFile() || entry.name === basename(path)) continue;
    const other = join(dirname(path), entry.name);
    size += (await stat(other)).size;
    if (size > MOST_BYTES) break;
    files.push({ name: entry.name, bytes: new Uint8Array(await readFile(other)) });
  }
  return files;
}

/** Returns the paths of the files in a folder and its subfolders whose names match, in order. */
export async function filesBelow(folder, names) {
  const entries = await readdir(folder, { recursive: true, withFileTypes: true });
  const files = entries.filter((entry) => entry.isFile() && names.test(entry.name));
  return files.map((entry) => join(entry.parentPath, entry.name)).sort();
}

/**
 * Iterates over what `read` yields for each file of a folder whose name matches `names`, without those that match `belonging`, which
 * are read with another. A file that throws yields its name and the error, as `failure`.
 */
export async function* readEach(folder, names, belonging, read) {
  const all = await filesBelow(folder, names);
  for (const path of all.filter((one) => !belonging.test(one))) {
    const name = relative(folder, path) || basename(path);
    try {
      yield* read(path, name, all);
    } catch (failure) {
      yield { name, failure };
    }
  }
}
