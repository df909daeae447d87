import { endingTogether } from '../abort.js';
import { checkProperties, invalid, numbers, shallowCopy } from '../check.js';
import type { Vec3, VolumeInit, VoxelArray } from '../data.js';
import { VesicleError } from '../error.js';
import { type Pause, withPause } from '../pause.js';
import { Handle } from '../runtime.js';
import { noted, unpackingProblem } from '../small-files.js';
import { SPARSE_SOURCE, type SparseSource } from '../sparse.js';
import { checkSignal } from '../stepper.js';
import { RawSparseVolume } from '../vesicle.js';
import { Volume } from '../volume.js';
import type { Warning } from '../warning.js';
import { type Brick, BrickCache } from './cache.js';
import { type Level, levelAt, volumeOf } from './levels.js';
import type { ZarrBox, ZarrLevel, ZarrLoaded } from './types.js';

/** Largest number of bytes of a region: what fits into the memory of a WebAssembly module. */
const LARGEST_REGION = 2 ** 32;

/** Largest number of bytes of a coarsest level that is read when the image is opened. */
const LARGEST_COARSEST = 256e6;

/** Largest number of its chunks, each of which is a request. */
const MOST_CHUNKS = 2 ** 14;

/** Largest number of bytes that its chunks have with all that is around its voxels, such as other channels. */
const MOST_DECODED = 2 ** 31;

/**
 * Constituents of a {@link ZarrVolume}.
 *
 * @internal
 */
export interface ZarrParts {
  levels: Level[];
  unit: 'mm' | undefined;
  warnings: Warning[];
  /** Number of bytes of chunks to keep. */
  cache: number;
  concurrency: number;
}

/**
 * An OME-Zarr image, one channel and one time of it, of which only the chunks are read that are asked for.
 *
 * @throws All methods: `VesicleError` `freed` after {@link ZarrVolume.free}.
 */
export class ZarrVolume {
  /** The levels of the image, finest first. */
  readonly levels: readonly ZarrLevel[];
  /** Unit of world coordinates: millimetres, into which lengths were converted; undefined if the image states none. */
  readonly unit: 'mm' | undefined;
  /** Warnings about assumptions where metadata are missing; volumes made from the image have the same. */
  readonly warnings: readonly Warning[];
  readonly #levels: Level[];
  readonly #cache: BrickCache;
  readonly #concurrency: number;
  // Positions of the chunks of each level that have been read.
  readonly #seen: Set<string>[];
  readonly #bytes: number[];
  #coarsest: VoxelArray | undefined;
  #unread = '';
  #range: [number, number] | undefined;
  #stored = () => 0;
  #freed = false;

  /** @internal */
  constructor({ levels, unit, warnings, cache, concurrency }: ZarrParts) {
    this.levels = Object.freeze(levels.map(({ info }) => info));
    this.unit = unit;
    this.warnings = Object.freeze(warnings.map((warning) => Object.freeze(warning)));
    this.#levels = levels;
    this.#cache = new BrickCache(cache);
    this.#concurrency = concurrency;
    this.#seen = levels.map(() => new Set());
    this.#bytes = levels.map(() => 0);
  }

  /** Returns how much of each level has been read, finest first. */
  loaded(): ZarrLoaded[] {
    this.#check();
    return this.#levels.map(({ chunkCount, bytes }, index) => ({
      chunks: this.#seen[index]?.size ?? 0,
      bytes: this.#bytes[index] ?? 0,
      of: { chunks: chunkCount, bytes },
    }));
  }

  /**
   * Reads a box of a level as a volume of its own, at its place in the world. Chunks that are not stored have the fill
   * value of the array.
   *
   * @param level - Index of the level; 0 is the finest.
   * @param box - Voxel indices of that level.
   * @param options - `signal`: aborts the requests.
   * @throws `VesicleError` `invalid-argument`: no such level, a box that is empty or extends beyond the level, or
   *   has no finite voxel; `unavailable`: a chunk that could not be fetched; `bad-file`: one that is damaged;
   *   `too-large`. `signal.reason` when aborted. No request is left open, and what was read stays in the cache.
   */
  async region(level: number, box: ZarrBox, options?: { signal?: AbortSignal }): Promise<Volume> {
    return new Volume(await this.voxels(level, box, options));
  }

  /**
   * Reads a box of a level like {@link ZarrVolume.region}, as options of a `Volume`, for workers and for entry points
   * with one method, whose volumes are another type.
   *
   * @throws As {@link ZarrVolume.region}.
   */
  async voxels(level: number, box: ZarrBox, options?: { signal?: AbortSignal }): Promise<VolumeInit> {
    this.#check();
    const from = levelAt(this.#levels, level);
    const { signal } = checkProperties('options', options, ['signal']);
    checkSignal(signal);
    const { min, dims } = checkedBox(box, from.info.dims);
    const target = { min, dims, data: allocate(from, dims) };
    await this.#fill(target, level, from, signal);
    const affine = from.info.affine.slice();
    for (const axis of [0, 1, 2] as const) affine[12 + axis] = world(from.info, min, axis);
    const warnings = this.warnings.length > 0 && { warnings: this.warnings };
    return {
      data: noted(target.data, this.#stored()),
      dims,
      affine,
      ...(this.unit && { unit: this.unit }),
      ...warnings,
    };
  }

  /**
   * Smallest and largest finite intensity of the coarsest level; undefined if it has no finite voxel, or was not read
   * when the image was opened: it is larger than 256 MB, or than 32 MiB if its chunks are stored in up to 128 KiB, is in
   * more than 16,384 chunks, or those are larger than 2 GB.
   */
  get range(): [number, number] | undefined {
    this.#check();
    return this.#range && [...this.#range];
  }

  /** Why the coarsest level was not read when the image was opened; empty if it was. */
  get unread(): string {
    return this.#unread;
  }

  /**
   * Reads the coarsest level, unless it is very large; `stored` returns how many bytes of chunks have been read.
   *
   * @internal
   */
  async readCoarsest(signal: AbortSignal | undefined, stored: () => number): Promise<void> {
    this.#stored = stored;
    const index = this.#levels.length - 1;
    const level = levelAt(this.#levels, index);
    this.#unread = whyUnread(level);
    if (this.#unread) return;
    const { data } = await this.voxels(index, { min: [0, 0, 0], max: level.info.dims }, signal && { signal });
    this.#unread = whyUnused(level, stored());
    if (this.#unread) return this.#cache.clear(undefined);
    this.#coarsest = data;
    this.#range = await rangeOf(data, signal);
  }

  /** @internal */
  [SPARSE_SOURCE](): SparseSource {
    this.#check();
    const [finest] = this.#levels as [Level];
    const [coarsest, range] = [this.#coarsest, this.#range];
    if (!coarsest) throw new VesicleError('too-large', `volume: ${this.#unread}`);
    if (!range) throw invalid('volume', 'the coarsest level must have a finite voxel');
    return {
      ...{ levels: this.#levels.map(({ info }) => info), type: finest.info.voxelType, fill: finest.fill },
      unit: this.unit,
      warnings: this.warnings,
      ...{ range, coarsest, concurrency: this.#concurrency, create: () => sparseVolume(this[SPARSE_SOURCE]()) },
      read: async ({ level, min, dims }, signal) => {
        const max = min.map((first, axis) => first + (dims[axis] as number)) as Vec3;
        return (await this.voxels(level, { min, max }, signal && { signal })).data;
      },
      stored: this.#stored,
      loaded: () => ({
        chunks: this.#seen.reduce((sum, { size }) => sum + size, 0),
        bytes: this.#bytes.reduce((sum, size) => sum + size, 0),
      }),
    };
  }

  async #fill(
    target: Brick & { data: VoxelArray },
    index: number,
    level: Level,
    signal: AbortSignal | undefined,
  ): Promise<void> {
    const chunks = chunksOf(target, level.info.chunks);
    await endingTogether(signal, (signal) => {
      const take = async (pause: Pause) => {
        // All take from the same iterator.
        for (const chunk of chunks) {
          copyOverlap(await this.#brick(index, level, chunk, signal), target.data, target);
          // Those that are not stored need no request that would let other things happen.
          await pause.turn();
        }
      };
      return Promise.all(Array.from({ length: this.#concurrency }, () => withPause(signal, take)));
    });
  }

  #brick(index: number, level: Level, chunk: Vec3, signal: AbortSignal): Promise<Brick> {
    const position = chunk.join();
    const fetch = async (signal: AbortSignal) => {
      const brick = await level.fetch(chunk, signal);
      this.#count(index, position, brick);
      return brick;
    };
    return this.#cache.get(`${index}:${position}`, fetch, signal);
  }

  #count(index: number, position: string, { dims }: Brick): void {
    const seen = this.#seen[index] as Set<string>;
    if (seen.has(position)) return;
    seen.add(position);
    this.#bytes[index] = (this.#bytes[index] as number) + volumeOf(dims) * levelAt(this.#levels, index).voxelBytes;
  }

  #check(): void {
    if (this.#freed) throw freed();
  }

  /** Aborts all requests, which then reject with `freed`, and forgets all chunks; the image cannot be used afterwards. */
  free(): void {
    this.#freed = true;
    this.#coarsest = undefined;
    this.#cache.clear(freed());
  }

  /** The same as {@link ZarrVolume.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

/** Creates the object of the core that holds the voxels of one model, with the coarsest level. */
function sparseVolume({ levels, type, range, fill, coarsest }: SparseSource): Handle<RawSparseVolume> {
  const described = levels.map(({ dims, affine }) => ({ dims, matrix: affine }));
  const volume = new Handle('volume', () => new RawSparseVolume({ levels: described, type, range, fill }));
  const { dims } = levels.at(-1) as (typeof levels)[0];
  const insert = (raw: RawSparseVolume) =>
    raw.insert(levels.length - 1, new Uint32Array(3), Uint32Array.from(dims), coarsest);
  try {
    volume.use(insert);
  } catch (error) {
    volume.free();
    throw error;
  }
  return volume;
}

function freed(): VesicleError {
  return new VesicleError('freed', 'this ZarrVolume was freed and can no longer be used');
}

/** Returns the first index and the numbers of voxels of a box inside a level. */
function checkedBox(box: ZarrBox, size: Vec3): { min: Vec3; dims: Vec3 } {
  const { min, max } = checkProperties('box', shallowCopy('box', box), ['min', 'max']);
  const [from, to] = [numbers('box.min', min, 3), numbers('box.max', max, 3)];
  const fits = size.every((most, axis) => {
    const [low, high] = [from[axis] as number, to[axis] as number];
    return Number.isInteger(low) && Number.isInteger(high) && 0 <= low && low < high && high <= most;
  });
  if (!fits) throw invalid('box', `must be within 0,0,0 to ${size} and not empty, got ${from} to ${to}`);
  return { min: [...from] as Vec3, dims: [...to].map((end, axis) => end - (from[axis] as number)) as Vec3 };
}

function allocate({ VoxelArrays, voxelBytes, fill }: Level, dims: Vec3): VoxelArray {
  const bytes = volumeOf(dims) * voxelBytes;
  const tooLarge = () =>
    new VesicleError('too-large', `a region of ${dims.join(' × ')} voxels needs ${Math.ceil(bytes / 1e6)} MB`);
  if (bytes > LARGEST_REGION) throw tooLarge();
  try {
    const voxels = new VoxelArrays(volumeOf(dims));
    // Of chunks that are not stored.
    return fill === 0 ? voxels : voxels.fill(fill);
  } catch {
    throw tooLarge();
  }
}

function world({ affine, spacing }: ZarrLevel, index: Vec3, axis: 0 | 1 | 2): number {
  return (affine[12 + axis] as number) + index[axis] * spacing[axis];
}

/** Positions of the chunks that a box touches, in order. */
function* chunksOf({ min, dims }: Brick, chunks: Vec3): Generator<Vec3> {
  const first = (axis: 0 | 1 | 2) => Math.floor(min[axis] / chunks[axis]);
  const last = (axis: 0 | 1 | 2) => Math.floor((min[axis] + dims[axis] - 1) / chunks[axis]);
  for (let z = first(2); z <= last(2); z++) {
    for (let y = first(1); y <= last(1); y++) for (let x = first(0); x <= last(0); x++) yield [x, y, z];
  }
}

/** Copies the voxels that a brick shares with a box. */
function copyOverlap(from: Brick, data: VoxelArray, to: Omit<Brick, 'data'>): void {
  if (!from.data) return;
  const start = (axis: 0 | 1 | 2) => Math.max(from.min[axis], to.min[axis]);
  const end = (axis: 0 | 1 | 2) => Math.min(from.min[axis] + from.dims[axis], to.min[axis] + to.dims[axis]);
  const offset = ({ min, dims }: Omit<Brick, 'data'>, x: number, y: number, z: number) =>
    x - min[0] + dims[0] * (y - min[1] + dims[1] * (z - min[2]));
  const [x, width] = [start(0), end(0) - start(0)];
  for (let z = start(2); z < end(2); z++) {
    for (let y = start(1); y < end(1); y++) {
      const at = offset(from, x, y, z);
      data.set(from.data.subarray(at, at + width), offset(to, x, y, z));
    }
  }
}

/** Returns why a level is not read when the image is opened; an empty text if it is. */
function whyUnread({ bytes, chunkCount, decodedBytes }: Level): string {
  if (bytes > LARGEST_COARSEST) return 'the coarsest level must not be larger than 256 MB';
  if (chunkCount > MOST_CHUNKS) return `the coarsest level must have at most ${MOST_CHUNKS} chunks, got ${chunkCount}`;
  if (decodedBytes <= MOST_DECODED) return '';
  return `the chunks of the coarsest level must not be larger than 2 GB, got ${Math.ceil(decodedBytes / 1e6)} MB`;
}

/** Returns why a level that was read is not used: a model of few bytes could take gigabytes. An empty text if it is. */
function whyUnused({ bytes }: Level, stored: number): string {
  const problem = unpackingProblem(bytes, stored, 'store a coarser level, too');
  return problem ? `the coarsest level ${problem}` : '';
}

/** Number of voxels that are looked through without a pause. */
const SLICE = 2 ** 20;

function rangeOf(data: VoxelArray, signal: AbortSignal | undefined): Promise<[number, number] | undefined> {
  return withPause(signal, async (pause) => {
    let [low, high] = [Infinity, -Infinity];
    for (let start = 0; start < data.length; start += SLICE) {
      for (let i = start; i < Math.min(data.length, start + SLICE); i++) {
        const value = data[i] as number;
        if (value < low && value !== -Infinity) low = value;
        if (value > high && value !== Infinity) high = value;
      }
      await pause.turn();
    }
    return low <= high ? [low, high] : undefined;
  });
}
