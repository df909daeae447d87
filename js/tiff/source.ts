// Files by name, of which parts are read.
import { invalid } from '../check.js';
import { namedContents } from '../input-file.js';
import { badTiff } from './error.js';

/** Number of bytes that are read together around small values. */
const WINDOW = 16384;

/** Bytes of one of several sources that were read last. */
interface Window {
  source?: Source;
  at: number;
  bytes: Uint8Array;
}

/** The content of a file. */
export class Source {
  readonly name: string;
  readonly size: number;
  readonly #content: Blob | Uint8Array;
  readonly #window: Window;

  constructor(name: string, content: Blob | Uint8Array, window: Window) {
    this.#window = window;
    this.name = name;
    this.size = content instanceof Uint8Array ? content.byteLength : content.size;
    // A view of class Uint8Array: slices of Node's buffers are no copies.
    this.#content =
      content instanceof Uint8Array ? new Uint8Array(content.buffer, content.byteOffset, content.length) : content;
  }

  /** Throws `bad-file` unless the file has the bytes from `at`, included, to `at + length`, excluded. */
  check(at: number, length: number): void {
    if (Number.isSafeInteger(at) && at >= 0 && length >= 0 && at + length <= this.size) return;
    throw badTiff(this.name, `truncated: bytes ${at} to ${at + length} are needed, the file has ${this.size}`);
  }

  /** Returns a copy of some bytes. */
  async read(at: number, length: number): Promise<Uint8Array<ArrayBuffer>> {
    this.check(at, length);
    if (this.#content instanceof Uint8Array) return Uint8Array.from(this.#content.subarray(at, at + length));
    try {
      return new Uint8Array(await this.#content.slice(at, at + length).arrayBuffer());
    } catch (error) {
      throw badTiff(this.name, `cannot be read: ${error instanceof Error ? error.message : error}`);
    }
  }

  /** Returns a few bytes, which must not be changed; those after them are kept for the next call. */
  async peek(at: number, length: number): Promise<Uint8Array> {
    this.check(at, length);
    if (this.#content instanceof Uint8Array) return this.#content.subarray(at, at + length);
    const { source, at: start, bytes } = this.#window;
    if (source === this && at >= start && at + length <= start + bytes.length)
      return bytes.subarray(at - start, at - start + length);
    const found = await this.read(at, Math.min(Math.max(length, WINDOW), this.size - at));
    Object.assign(this.#window, { source: this, at, bytes: found });
    return found.subarray(0, length);
  }
}

/** Returns the sources of one or several files, in the order of the numbers in their names. */
export function sourcesOf(files: unknown): Source[] {
  const list = namedContents('files', files);
  if (list.length === 0) throw invalid('files', 'must be one or several TIFF files');
  const window: Window = { at: 0, bytes: new Uint8Array() };
  const sources = list.map(({ name, content }) => new Source(name || 'file', content, window));
  return sources.sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
}
