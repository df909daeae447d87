// Decompression of strips and tiles into a known number of bytes.
import { type Page, TAG } from './directory.js';
import { badTiff, importGeotiff } from './error.js';
import type { Compression } from './format.js';
import { jpegSize, TOO_MANY_SCANS, zstandardFrame } from './frames.js';
import { lzw } from './lzw.js';

type Bytes = Uint8Array<ArrayBuffer>;

/** Most bytes in a block of Zstandard: the decoder does not notice when its memory is full. */
const LARGEST_ZSTANDARD = 2 ** 28;

/** Size of what a block holds. */
export interface BlockSize {
  width: number;
  height: number;
  /** Number of samples of a pixel. */
  samples: number;
  /** Number of bytes once decompressed. */
  bytes: number;
}

/** Decompresses blocks of one page. */
export class Decompressor {
  readonly #page: Page;
  readonly #compression: Compression;
  readonly #ratio: number;

  constructor(page: Page, compression: Compression, ratio: number) {
    this.#page = page;
    this.#compression = compression;
    this.#ratio = ratio;
  }

  /**
   * Returns the bytes of a block; surplus ones are left out. Throws `bad-file` if there are fewer than `size.bytes`.
   */
  async decompress(stored: Bytes, size: BlockSize): Promise<Bytes> {
    if (this.#compression === 'none') return stored;
    // Before memory is allocated for it.
    if (size.bytes > this.#ratio * (stored.length + 16)) throw this.#damaged();
    const found = await this.#decoded(stored, size).catch((error: unknown) => {
      throw error instanceof Error && error.name === 'VesicleError' ? error : this.#damaged(error);
    });
    if (found.length < size.bytes) throw this.#damaged();
    return found.subarray(0, size.bytes);
  }

  async #decoded(stored: Bytes, size: BlockSize): Promise<Bytes> {
    switch (this.#compression) {
      case 'deflate':
        return inflate(stored, size.bytes);
      case 'LZW':
        return lzw(stored, size.bytes);
      case 'PackBits':
        return packBits(stored, size.bytes);
      case 'JPEG':
        return this.#jpeg(stored, size);
      default:
        return this.#zstandard(stored, size);
    }
  }

  async #jpeg(stored: Bytes, { width, height, samples }: BlockSize): Promise<Bytes> {
    const found = jpegSize(stored);
    if (found?.hasManyScans) throw badTiff(this.#page.label, TOO_MANY_SCANS);
    const isRight = found?.width === width && found.samples === samples && found.bits === 8 && found.height >= height;
    if (!isRight || width * found.height * samples > this.#ratio * stored.length) throw this.#damaged();
    const tables = await this.#page.bytes(TAG.jpegTables);
    return this.#byGeotiff(7, stored, tables.length > 0 ? { JPEGTables: Uint8Array.from(tables) } : {});
  }

  async #zstandard(stored: Bytes, { bytes }: BlockSize): Promise<Bytes> {
    if (bytes > LARGEST_ZSTANDARD)
      throw badTiff(this.#page.label, `${bytes} bytes in one block of Zstandard are too many`);
    const frame = zstandardFrame(stored, bytes);
    if (!frame) throw this.#damaged();
    return this.#byGeotiff(50000, frame, {});
  }

  async #byGeotiff(number: number, stored: Bytes, more: object): Promise<Bytes> {
    const { getDecoder } = await importGeotiff(this.#compression);
    // Predictors of geotiff 3.0 are wrong for big-endian files.
    const none = { tileWidth: 0, tileHeight: 0, predictor: 1, bitsPerSample: 8, planarConfiguration: 1 };
    const decoder = await getDecoder(number, { ...none, ...more });
    return new Uint8Array((await decoder.decode(stored.slice().buffer)) as ArrayBuffer);
  }

  #damaged(error?: unknown): Error {
    const reason = error instanceof Error && error.message ? ` (${error.message})` : '';
    return badTiff(this.#page.label, `truncated or damaged, or not compressed by ${this.#compression}${reason}`);
  }
}

/** Number of bytes at the end that are given one by one: a stream with surplus bytes loses what it has not yielded. */
const TAIL = 16;

/** Decodes at most `size` bytes of a zlib stream. */
async function inflate(stored: Bytes, size: number): Promise<Bytes> {
  const whole = await inflateParts([stored], size);
  if (whole.length === size) return whole;
  const end = Math.max(0, stored.length - TAIL);
  return inflateParts(
    [stored.subarray(0, end), ...Array.from(stored.subarray(end), (byte) => Uint8Array.of(byte))],
    size,
  );
}

async function inflateParts(parts: Bytes[], size: number): Promise<Bytes> {
  const stream = new DecompressionStream('deflate');
  const [writer, reader] = [stream.writable.getWriter(), stream.readable.getReader()];
  const given = parts.map((part) => writer.write(part));
  // Errors show in the number of bytes.
  const settled = Promise.allSettled([...given, writer.close()]);
  const out = new Uint8Array(size);
  let length = 0;
  try {
    while (length < size) {
      const { value, done } = await reader.read();
      if (done) break;
      out.set(value.subarray(0, size - length), length);
      length += Math.min(value.length, size - length);
    }
  } catch {
    // As for those that end too early.
  }
  await reader.cancel().catch(() => {});
  await settled;
  return out.subarray(0, length);
}

/** Decodes at most `size` bytes of runs and literals. */
function packBits(stored: Bytes, size: number): Bytes {
  const out = new Uint8Array(size);
  let length = 0;
  for (let at = 0; at < stored.length && length < size; ) {
    const head = stored[at] ?? 0;
    at += 1;
    if (head < 128) {
      const literal = stored.subarray(at, Math.min(at + head + 1, at + size - length));
      out.set(literal, length);
      length += literal.length;
      at += head + 1;
    } else if (head > 128) {
      const end = Math.min(length + 257 - head, size);
      if (at < stored.length) out.fill(stored[at] ?? 0, length, end);
      else return out.subarray(0, length);
      length = end;
      at += 1;
    }
  }
  return out.subarray(0, length);
}
