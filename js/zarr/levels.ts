// The levels of an image: arrays of Zarr that were checked against the metadata and against each other.
import type { Array as ZarrArray } from 'zarrita';
import { integer, invalid } from '../check.js';
import type { Vec3, VoxelArray } from '../data.js';
import { type Pause, withPause } from '../pause.js';
import { Abandoned, type Brick } from './cache.js';
import { withSlack } from './codecs.js';
import { badZarr, shown, tooLarge, translated, type Zarrita } from './error.js';
import type { AxisName, LevelTransform, Multiscale } from './multiscales.js';
import { type FileOptions, NotStored, Slots } from './requests.js';
import type { ZarrLevel, ZarrVoxelType } from './types.js';

/** The channel and the time that are read. */
export interface Selection {
  channel: number;
  time: number;
}

type VoxelArrays = new (values: number | number[]) => VoxelArray;

const TYPES: Record<string, [ZarrVoxelType, VoxelArrays]> = {
  ...{ uint8: ['u8', Uint8Array], int8: ['i8', Int8Array] },
  ...{ uint16: ['u16', Uint16Array], int16: ['i16', Int16Array] },
  ...{ uint32: ['u32', Uint32Array], int32: ['i32', Int32Array] },
  ...{ float32: ['f32', Float32Array], float64: ['f32', Float32Array] },
  // Label maps, whose values mostly fit into 32 bits; others are refused where they are read.
  ...{ uint64: ['u32', Uint32Array], int64: ['i32', Int32Array] },
};

/** Largest number of voxels along an axis. */
const MOST_VOXELS = 0xffffffff;

/** Largest number of bytes of a chunk, decoded, with all channels and times. */
const LARGEST_CHUNK = 2 ** 28;

/** Largest number of bytes of all chunks that are decoded at a time, unless one has more: decoding takes several times as many. */
const DECODED_AT_A_TIME = 2 ** 27;

/**
 * How far apart the fields of view of two levels may be, in voxels of the coarser one: those that fit only in part may
 * be dropped or padded, and half of one lies between the conventions of where the first voxel is.
 */
const TOLERANCE = 2;

/** An array of voxels, with its place in world space. */
export class Level {
  readonly info: ZarrLevel;
  /** Value of voxels in chunks that are not stored. */
  readonly fill: number;
  /** Constructor of arrays of this level's voxels. */
  readonly VoxelArrays: VoxelArrays;
  readonly #zarrita: Zarrita;
  readonly #array: ZarrArray<'uint8'>;
  readonly #part: string;
  /** Axis of the array for each of x, y and z; -1 for none. */
  readonly #spatial: Vec3;
  /** Index along each axis of the array; along spatial ones, 0. */
  readonly #selected: number[];
  /** Bytes of a chunk with all channels and times, as zarrita decodes it. */
  readonly #chunkBytes: number;
  readonly #decoders: Slots;

  /** Validates an array; `bad-file` if it does not fit the metadata, `invalid-argument` for no such channel or time. */
  constructor(
    zarrita: Zarrita,
    array: ZarrArray<'uint8'>,
    { axes }: Multiscale,
    transform: LevelTransform,
    selection: Selection,
  ) {
    [this.#zarrita, this.#array, this.#part] = [zarrita, array, `array "${transform.path}"`];
    const type = TYPES[array.dtype as string];
    if (!type) {
      const known = Object.keys(TYPES).join(', ');
      throw badZarr(`${this.#part}.data_type`, `must be one of ${known}, got ${shown(array.dtype)}`);
    }
    this.#chunkBytes = chunkBytes(array, this.#part);
    this.#decoders = new Slots(Math.max(1, Math.floor(DECODED_AT_A_TIME / this.#chunkBytes)));
    this.#spatial = spatialAxes(axes);
    this.#selected = axes.map((axis, index) => selected(axis, array.shape[index] as number, selection));
    this.VoxelArrays = type[1];
    this.fill = this.#fillOf(array.fillValue ?? 0);
    this.info = Object.freeze({
      dims: this.#along(array.shape, 1),
      ...placement(transform, this.#spatial),
      chunks: this.#along(array.chunks, 1),
      voxelType: type[0],
    });
  }

  #fillOf(value: unknown): number {
    const fill = Number(value);
    const part = `${this.#part}.fill_value`;
    // zarrita passes on bytes of floats, which are written in hexadecimal digits, as if they were a number.
    if (typeof value === 'string' && (/^0x/i.test(value) || (Number.isNaN(fill) && value !== 'NaN'))) {
      throw badZarr(part, `must be a number, "NaN", "Infinity" or "-Infinity", got ${shown(value)}`);
    }
    if (typeof value !== 'bigint' || new this.VoxelArrays([fill])[0] === fill) return fill;
    throw badZarr(part, `${TOO_LONG}, got ${value}`);
  }

  #along(values: number[], missing: number): Vec3 {
    return this.#spatial.map((axis) => (axis < 0 ? missing : (values[axis] as number))) as Vec3;
  }

  /** Number of chunks with voxels of the selected channel and time; it may be inexact above 2^53. */
  get chunkCount(): number {
    const { dims, chunks } = this.info;
    return dims.reduce((count, size, axis) => count * Math.ceil(size / (chunks[axis] as number)), 1);
  }

  /** Number of bytes of the value of a voxel. */
  get voxelBytes(): number {
    return new this.VoxelArrays(0).BYTES_PER_ELEMENT;
  }

  /** Size of the voxels of the selected channel and time, bytes. */
  get bytes(): number {
    return volumeOf(this.info.dims) * this.voxelBytes;
  }

  /** Size of all chunks with voxels of the selected channel and time, with those of others, bytes. */
  get decodedBytes(): number {
    return this.chunkCount * this.#chunkBytes;
  }

  /** Fetches the voxels of a chunk, by its position along x, y and z in the grid of chunks. */
  async fetch(chunk: Vec3, signal: AbortSignal): Promise<Brick> {
    const position = this.#selected.map((index, axis) => Math.floor(index / (this.#array.chunks[axis] as number)));
    for (const [k, axis] of this.#spatial.entries()) if (axis >= 0) position[axis] = chunk[k] as number;
    const { dims, chunks } = this.info;
    const min = chunk.map((index, axis) => index * (chunks[axis] as number)) as Vec3;
    const size = chunks.map((most, axis) => Math.min(most, (dims[axis] as number) - (min[axis] as number))) as Vec3;
    const part = `${this.#part}, chunk ${position.join()}`;
    await this.#decoders.take(signal);
    try {
      const stored = await this.#chunk(position, part, signal);
      const data = stored && (await withPause(signal, (pause) => this.#voxels(stored, size, part, pause)));
      return { min, dims: size, data };
    } finally {
      this.#decoders.release();
    }
  }

  /** Returns a chunk; undefined if it is not stored. */
  async #chunk(position: number[], part: string, signal: AbortSignal): Promise<Stored | undefined> {
    const decodesTo = this.#chunkBytes;
    const options: FileOptions = { signal, mostBytes: withSlack(decodesTo), decodesTo, mustExist: true };
    for (;;) {
      try {
        const chunk = (await this.#array.getChunk(position, options)) as unknown as Stored;
        const wanted = this.#array.chunks.reduce((product, size) => product * size, 1);
        if (chunk.data.length === wanted) return chunk;
        throw badZarr(part, `must have ${wanted} voxels, got ${chunk.data.length}`);
      } catch (error) {
        signal.throwIfAborted();
        if (error instanceof NotStored) return undefined;
        // Chunks of a shard wait for the same index: whoever asked for it first may have lost interest.
        if (!(error instanceof Abandoned)) throw translated(this.#zarrita, part, error);
      }
    }
  }

  /** Returns the first voxels of the selected channel and time of a chunk, x fastest. */
  async #voxels({ data, stride }: Stored, dims: Vec3, part: string, pause: Pause): Promise<VoxelArray> {
    const first = this.#selected.reduce(
      (sum, index, axis) => sum + (index % (this.#array.chunks[axis] as number)) * (stride[axis] as number),
      0,
    );
    const strides = this.#along(stride, 0);
    const [sx, sy, sz] = strides;
    if (isDense(data, this.VoxelArrays, dims, strides)) return data;
    const voxels = new this.VoxelArrays(volumeOf(dims));
    const [nx, ny] = dims;
    for (const { min, end } of blocks(dims, sx === 1)) {
      await pause.turn();
      const [x, count] = [min[0], end[0] - min[0]];
      for (let z = min[2]; z < end[2]; z++) {
        for (let y = min[1]; y < end[1]; y++) {
          const [start, to] = [first + x * sx + y * sy + z * sz, x + nx * (y + ny * z)];
          if (isLong(data)) shortenRow(data, start, sx, voxels.subarray(to, to + count), part);
          else copyRow(data, start, sx, voxels, to, count);
        }
      }
    }
    return voxels;
  }
}

/** Side of the blocks in which voxels are copied: in another order, each line of the cache is used while it is there. */
const BLOCK = 16;

/** Yields the blocks of a box, of whole rows if that is wanted. */
function* blocks([nx, ny, nz]: Vec3, areRows: boolean): Generator<{ min: Vec3; end: Vec3 }> {
  const width = areRows ? nx : BLOCK;
  for (let z = 0; z < nz; z += BLOCK)
    for (let y = 0; y < ny; y += BLOCK)
      for (let x = 0; x < nx; x += width)
        yield { min: [x, y, z], end: [Math.min(x + width, nx), Math.min(y + BLOCK, ny), Math.min(z + BLOCK, nz)] };
}

/** Integers of 64 bits. */
type LongArray = BigInt64Array | BigUint64Array;

/** A chunk as zarrita decodes it. */
interface Stored {
  data: VoxelArray | LongArray;
  stride: number[];
}

function isLong(data: Stored['data']): data is LongArray {
  return data instanceof BigInt64Array || data instanceof BigUint64Array;
}

const TOO_LONG = 'integers of 64 bits must fit into 32 bits';

/** Returns whether the voxels of a chunk are stored as they are needed. */
function isDense(data: Stored['data'], kind: VoxelArrays, [nx, ny, nz]: Vec3, [sx, sy, sz]: Vec3): data is VoxelArray {
  const isWhole = data.length === nx * ny * nz && data.buffer.byteLength === data.byteLength;
  return isWhole && data instanceof kind && sx === 1 && (ny === 1 || sy === nx) && (nz === 1 || sz === nx * ny);
}

function copyRow(from: VoxelArray, start: number, step: number, to: VoxelArray, at: number, count: number): void {
  if (step === 1 && count > 1) {
    to.set(from.subarray(start, start + count), at);
    return;
  }
  for (let i = 0; i < count; i++) to[at + i] = from[start + i * step] as number;
}

/** Copies a row of integers of 64 bits into ones of 32; throws `bad-file` for those that do not fit. */
function shortenRow(from: LongArray, start: number, step: number, to: VoxelArray, part: string): void {
  for (let i = 0; i < to.length; i++) {
    const value = from[start + i * step] as bigint;
    to[i] = Number(value);
    if (to[i] !== Number(value)) throw badZarr(part, `${TOO_LONG}, got ${value}`);
  }
}

/** Throws `bad-file` unless all arrays have sizes, with the same numbers of channels and times. */
export function checkSeries(arrays: readonly ZarrArray<'uint8'>[], { axes, levels }: Multiscale): void {
  for (const [k, array] of arrays.entries()) checkSizes(array, axes, `array "${levels[k]?.path}"`);
  const sizes = ({ shape }: ZarrArray<'uint8'>) =>
    axes.flatMap((axis, index) => (axis === 'c' || axis === 't' ? [`${axis} ${shape[index]}`] : [])).join(', ');
  const [first] = arrays.map(sizes);
  const wrong = arrays.findIndex((array) => sizes(array) !== first);
  const [path, found] = [levels[wrong]?.path, arrays[wrong]];
  if (found) throw badZarr(`array "${path}".shape`, `must have the ${first} of level 0, got ${sizes(found)}`);
}

function checkSizes({ shape, chunks }: ZarrArray<'uint8'>, axes: AxisName[], part: string): void {
  for (const [name, sizes] of Object.entries({ shape, chunk_shape: chunks })) {
    const isCounts =
      Array.isArray(sizes) &&
      sizes.length === axes.length &&
      sizes.every((size) => Number.isInteger(size) && size >= 1);
    if (!isCounts)
      throw badZarr(
        `${part}.${name}`,
        `must be ${axes.length} whole numbers above 0, one for each axis, got ${shown(sizes)}`,
      );
    if (sizes.some((size) => size > MOST_VOXELS))
      throw tooLarge(
        `${part}.${name}`,
        `at most ${MOST_VOXELS} voxels along each axis can be read, got ${shown(sizes)}`,
      );
  }
}

/** Returns the number of bytes of a chunk as zarrita decodes it; throws `too-large` for one that does not fit. */
function chunkBytes({ chunks, dtype }: ZarrArray<'uint8'>, part: string): number {
  const size = Number(/\d+$/.exec(dtype)?.[0]) / 8;
  const bytes = chunks.reduce((product, size) => product * size, size);
  if (bytes <= LARGEST_CHUNK) return bytes;
  throw tooLarge(
    part,
    `chunks of ${shown(chunks)} voxels of ${size} bytes; at most ${LARGEST_CHUNK} bytes can be read`,
  );
}

function spatialAxes(axes: AxisName[]): Vec3 {
  return [axes.indexOf('x'), axes.indexOf('y'), axes.indexOf('z')];
}

function selected(axis: AxisName, size: number, { channel, time }: Selection): number {
  if (axis === 'c') return integer('channel', channel, { max: size - 1 });
  return axis === 't' ? integer('time', time, { max: size - 1 }) : 0;
}

/** Returns voxel size and matrix; a slice without z is as thick as a pixel is wide. */
function placement({ scale, translation }: LevelTransform, spatial: Vec3): Pick<ZarrLevel, 'spacing' | 'affine'> {
  const [dx, dy, dz] = spatial.map((axis) => scale[axis] ?? (scale[spatial[0]] as number)) as Vec3;
  const [x, y, z] = spatial.map((axis) => translation[axis] ?? 0) as Vec3;
  return { spacing: [dx, dy, dz], affine: Float64Array.of(dx, 0, 0, 0, 0, dy, 0, 0, 0, 0, dz, 0, x, y, z, 1) };
}

/** Throws `bad-file` unless the levels show the same part of the world, from fine to coarse, with one type of voxels. */
export function checkPyramid(levels: readonly Level[], paths: readonly string[]): void {
  const [finest] = levels;
  for (const [index, level] of levels.entries()) {
    const part = `array "${paths[index]}"`;
    const before = levels[Math.max(0, index - 1)] as Level;
    if (finest?.info.voxelType !== level.info.voxelType) {
      throw badZarr(
        part,
        `must have the voxel type of level 0, ${finest?.info.voxelType}, got ${level.info.voxelType}`,
      );
    }
    for (const axis of [0, 1, 2] as const) checkAxis(finest.info, before.info, level.info, axis, part);
  }
}

function checkAxis(finest: ZarrLevel, before: ZarrLevel, level: ZarrLevel, axis: 0 | 1 | 2, part: string): void {
  const name = `${'xyz'[axis]}`;
  const spacing = level.spacing[axis];
  if (spacing < before.spacing[axis]) {
    throw badZarr(part, `must not be finer along ${name} than the level before; levels go from fine to coarse`);
  }
  const extent = ({ dims, spacing }: ZarrLevel) => dims[axis] * spacing[axis];
  const start = ({ affine }: ZarrLevel) => affine[12 + axis] as number;
  const isNear = (one: number, other: number) => Math.abs(one - other) <= TOLERANCE * spacing;
  if (isNear(extent(finest), extent(level)) && isNear(start(finest), start(level))) return;
  throw badZarr(
    part,
    `must show the same part of the world as level 0, which is ${extent(finest)} wide along ${name} from ${start(finest)}` +
      `, got ${extent(level)} from ${start(level)}: shape, scale or translation is wrong`,
  );
}

/** Returns the product of three sizes. */
export function volumeOf([x, y, z]: Vec3): number {
  return x * y * z;
}

/** Returns the level of an index; throws `invalid-argument` for another. */
export function levelAt(levels: readonly Level[], index: unknown): Level {
  const found = levels[integer('level', index, { max: levels.length - 1 })];
  if (found) return found;
  throw invalid('level', 'no such level');
}
