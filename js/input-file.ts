// Files that readers are given: from a page, or from a program's memory or disk.
import { invalid } from './check.js';

/**
 * A file: that of a page, or a name with the content. Readers take from a `Blob` only what they need; in Node,
 * `{ name, bytes: await openAsBlob(path) }` of `node:fs` reads from disk.
 */
export type InputFile = File | { readonly name: string; readonly bytes: Uint8Array | Blob };

/** A file that is read in parts. */
export class FileReaderAt {
  readonly name: string;
  readonly size: number;
  readonly #content: Uint8Array | Blob;

  constructor(name: string, content: Uint8Array | Blob) {
    this.name = name;
    this.size = content instanceof Uint8Array ? content.length : content.size;
    this.#content = content;
  }

  /** Returns the bytes from `start` to `end`, excluded, or as many of them as the file has. */
  async read(start = 0, end = this.size): Promise<Uint8Array> {
    if (this.#content instanceof Uint8Array) return this.#content.subarray(start, end);
    return new Uint8Array(await this.#content.slice(start, end).arrayBuffer());
  }
}

/** Returns the readers of files, after a check of each. */
export function checkedFiles(parameter: string, given: Iterable<InputFile>): FileReaderAt[] {
  if (typeof (given as unknown as { [Symbol.iterator]?: unknown } | null)?.[Symbol.iterator] !== 'function')
    throw invalid(parameter, 'must be an array of files');
  return Array.from(given, (file, k) => checkedFile(`${parameter}[${k}]`, file));
}

function checkedFile(parameter: string, file: InputFile): FileReaderAt {
  if (typeof Blob !== 'undefined' && file instanceof Blob && typeof (file as File).name === 'string')
    return new FileReaderAt((file as File).name, file);
  const { name, bytes } = Object(file) as { name?: unknown; bytes?: unknown };
  if (typeof name !== 'string') throw invalid(`${parameter}.name`, 'must be a string');
  if (!(bytes instanceof Uint8Array || (typeof Blob !== 'undefined' && bytes instanceof Blob)))
    throw invalid(`${parameter}.bytes`, 'must be a Uint8Array or a Blob');
  return new FileReaderAt(name, bytes);
}
