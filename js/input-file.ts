// Files that readers are given: from a page, or from a program's memory or disk.
import { checkProperties, denseCopy, invalid, typedArray } from './check.js';
import type { NamedFile } from './data.js';

/**
 * A file: that of a page, or a name with the content. Readers take from a `Blob` only what they need; in Node,
 * `{ name, bytes: await openAsBlob(path) }` of `node:fs` reads from disk.
 */
export type InputFile = Blob | { readonly name: string; readonly bytes: Uint8Array | Blob };

/** One or several files, as in an array or in the list of an input. */
export type InputFiles = InputFile | Iterable<InputFile> | ArrayLike<InputFile>;

/** A file's name, empty if it has none, and content. */
export interface NamedContent {
  name: string;
  content: Uint8Array | Blob;
}

/** Returns names and contents of one or several files; throws `invalid-argument` naming the one that is wrong. */
export function namedContents(parameter: string, files: unknown): NamedContent[] {
  if (files instanceof Blob || 'bytes' in Object(files)) return [namedContent(parameter, files)];
  const { length, [Symbol.iterator]: iterator } = Object(files);
  if (typeof files === 'string' || (typeof length !== 'number' && typeof iterator !== 'function'))
    throw invalid(parameter, 'must be a File, a Blob, { name, bytes }, or a list of these');
  return Array.from(files as ArrayLike<unknown>, (file, k) => namedContent(`${parameter}[${k}]`, file));
}

function namedContent(parameter: string, file: unknown): NamedContent {
  const { name = '', bytes } = Object(file) as { name?: unknown; bytes?: unknown };
  const content = file instanceof Blob ? file : bytes;
  if (typeof name === 'string' && (content instanceof Blob || content instanceof Uint8Array)) return { name, content };
  throw invalid(parameter, 'must be a File, a Blob, or { name, bytes } with a Uint8Array or a Blob');
}

/** Returns files in memory after a check of each; throws `invalid-argument` naming the one that is wrong. */
export function checkedNamedFiles(parameter: string, files: readonly NamedFile[]): NamedFile[] {
  return denseCopy(parameter, files).map((file, k) => {
    const { name, bytes } = checkProperties(`${parameter}[${k}]`, file ?? null, ['name', 'bytes']);
    if (typeof name !== 'string') throw invalid(`${parameter}[${k}].name`, 'must be a string');
    return { name, bytes: typedArray(`${parameter}[${k}].bytes`, bytes, Uint8Array) };
  });
}
