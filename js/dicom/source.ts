// Files by name, of which parts are read.
import { type InputFiles, namedContents } from '../input-file.js';

/** The content of a file. */
export class Source {
  readonly name: string;
  readonly size: number;
  readonly #content: Uint8Array | Blob;

  constructor(name: string, content: Uint8Array | Blob) {
    this.name = name;
    this.size = content instanceof Uint8Array ? content.length : content.size;
    // A view of class Uint8Array: slices of Node's buffers are no copies.
    this.#content =
      content instanceof Uint8Array ? new Uint8Array(content.buffer, content.byteOffset, content.length) : content;
  }

  /** Returns the bytes from `start` to `end`, excluded, or as many of them as the file has. */
  async read(start = 0, end = this.size): Promise<Uint8Array> {
    if (this.#content instanceof Uint8Array) return this.#content.subarray(start, end);
    return new Uint8Array(await this.#content.slice(start, end).arrayBuffer());
  }
}

/** Returns the sources of one or several files. */
export function sourcesOf(files: InputFiles): Source[] {
  return namedContents('files', files).map(({ name, content }, k) => new Source(name || `file ${k + 1}`, content));
}
