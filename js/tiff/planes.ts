// Reads the images of pages.
import type { VoxelArray } from '../data.js';
import type { Pause } from '../pause.js';
import { type Block, blocksOf, contiguous, rowBytes, samplesIn } from './blocks.js';
import { Decompressor } from './decompress.js';
import type { Page } from './directory.js';
import { tooLarge } from './error.js';
import { arrayOf, type Format } from './format.js';
import { numbersOf, reverseBits } from './samples.js';

/** The part of a page that is a slice: a sample, or the luminance of red, green and blue. */
export type Part = number | 'luminance';

/** One slice: an image of a page. */
export interface Plane {
  page: Page;
  part: Part;
  /** Number of images between that of the page and this one, which has no directory of its own. */
  after: number;
}

/** Weights of red, green and blue in the luminance, those of ITU-R BT.709, as for other volumes. */
export const WEIGHTS = [0.2126, 0.7152, 0.0722] as const;

/** Number of blocks that are decompressed at the same time, and of their bytes, unless one has more. */
const [TOGETHER, BYTES_TOGETHER] = [8, 2 ** 25];

/** Most bytes of the numbers of a block that is compressed. */
const LARGEST_BLOCK = 2 ** 29;

/** An array that samples of a page are copied into, row by row. */
interface Target {
  sample: number;
  data: VoxelArray;
}

/** Observer of the reading of pages. */
export interface Listener {
  pause: Pause;
  /** Called with the fraction of the page that has been read. */
  progress(share: number): void;
  /** Called with the number of bytes of strips or tiles of a page, before they are read. */
  stored(bytes: number, page: Page): void;
  /** Called if a strip or tile is not stored. */
  missing(page: Page): void;
}

/** Reads one slice into an array. */
export async function readPlane(plane: Plane, format: Format, data: VoxelArray, listener: Listener): Promise<void> {
  const reader = new PageReader(plane, format, listener);
  if (plane.part !== 'luminance') return reader.read([{ sample: plane.part, data }]);
  const colours = WEIGHTS.map((_, sample) => ({ sample, data: data.slice() }));
  await reader.read(colours);
  mix(
    colours.map((colour) => colour.data),
    data,
  );
}

/** Writes the luminance, rounded if it is an integer. */
function mix([red, green, blue]: VoxelArray[], data: VoxelArray): void {
  const isFloat = data instanceof Float32Array || data instanceof Float64Array;
  for (let k = 0; k < data.length; k++) {
    const light = WEIGHTS[0] * (red?.[k] ?? 0) + WEIGHTS[1] * (green?.[k] ?? 0) + WEIGHTS[2] * (blue?.[k] ?? 0);
    data[k] = isFloat ? light : Math.round(light);
  }
}

/** Reads samples of one page. */
class PageReader {
  readonly #plane: Plane;
  readonly #format: Format;
  readonly #listener: Listener;
  readonly #decompressor: Decompressor;

  constructor(plane: Plane, format: Format, listener: Listener) {
    this.#plane = plane;
    this.#format = format;
    this.#listener = listener;
    this.#decompressor = new Decompressor(plane.page, format.compression, format.ratio);
  }

  /** Fills arrays with the samples that they are for. */
  async read(targets: Target[]): Promise<void> {
    // Blocks have all samples, or each sample has its own.
    const passes = this.#format.isPlanar ? targets.map((target) => [target]) : [targets];
    for (const [k, pass] of passes.entries()) await this.#pass(pass, (share) => (k + share) / passes.length);
  }

  async #pass(targets: Target[], share: (done: number) => number): Promise<void> {
    const { page, after } = this.#plane;
    const blocks = await blocksOf(page, this.#format, targets[0]?.sample ?? 0, after);
    const stored = blocks.filter(({ bytes }) => bytes > 0);
    if (stored.length < blocks.length) this.#listener.missing(page);
    this.#listener.stored(
      stored.reduce((sum, { bytes }) => sum + bytes, 0),
      page,
    );
    const groups = contiguous(stored);
    for (const [k, group] of groups.entries()) {
      await this.#group(group, targets);
      this.#listener.progress(share((k + 1) / groups.length));
    }
  }

  /** Reads blocks that are contiguous in the file. */
  async #group(group: Block[], targets: Target[]): Promise<void> {
    const [start, end] = [group[0]?.at ?? 0, group.at(-1)];
    if (!end) return;
    const bytes = await this.#plane.page.source.read(start, end.at + end.bytes - start);
    const together = this.#together();
    for (let first = 0; first < group.length; first += together) {
      const some = group.slice(first, first + together);
      const parts = some.map((block) => bytes.subarray(block.at - start, block.at - start + block.bytes));
      const found = await Promise.all(some.map((block, k) => this.#bytes(block, parts[k] ?? bytes)));
      for (const [k, block] of some.entries())
        this.#place(block, await this.#numbers(block, found[k] ?? new Uint8Array()), targets);
      await this.#listener.pause.turn();
    }
  }

  /** Returns how many blocks are decompressed at the same time; throws `too-large` for one that is too large by itself. */
  #together(): number {
    const { block, type, compression } = this.#format;
    const numbers = block.width * block.height * samplesIn(this.#format);
    const bytes = numbers * new (arrayOf(type))(0).BYTES_PER_ELEMENT;
    if (bytes > LARGEST_BLOCK && compression !== 'none')
      throw tooLarge(this.#plane.page.label, `a compressed strip or tile has ${bytes} bytes; at most ${LARGEST_BLOCK}`);
    // Decoders of JPEG take long, and let nothing happen meanwhile.
    return compression === 'JPEG' ? 1 : Math.min(TOGETHER, Math.max(1, Math.floor(BYTES_TOGETHER / bytes)));
  }

  /** Returns the bytes of a block once they are decompressed. */
  #bytes({ width, height }: Block, stored: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
    const format = this.#format;
    if (format.isReversed) reverseBits(stored);
    const size = { width, height, samples: samplesIn(format), bytes: height * rowBytes(format, width) };
    return this.#decompressor.decompress(stored, size);
  }

  #numbers({ width }: Block, bytes: Uint8Array<ArrayBuffer>): Promise<VoxelArray> {
    const { type, predictor } = this.#format;
    const { isLittle, label } = this.#plane.page;
    const samples = samplesIn(this.#format);
    const storage = { type, isLittle, predictor, label, row: width * samples, samples };
    return numbersOf(bytes, storage, this.#listener.pause);
  }

  /** Copies what of a block is inside the image. */
  #place(block: Block, values: VoxelArray, targets: Target[]): void {
    const { width, height } = this.#format;
    const stride = samplesIn(this.#format);
    const [columns, rows] = [Math.min(block.width, width - block.x), Math.min(block.height, height - block.y)];
    for (const { sample, data } of targets) {
      const first = this.#format.isPlanar ? 0 : sample;
      for (let y = 0; y < rows; y++) {
        const [from, to] = [y * block.width * stride, (block.y + y) * width + block.x];
        if (stride === 1) data.set(values.subarray(from, from + columns), to);
        else for (let x = 0; x < columns; x++) data[to + x] = values[from + x * stride + first] ?? 0;
      }
    }
  }
}
