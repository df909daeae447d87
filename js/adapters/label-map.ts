// Shared by the adapters: surfaces of a host's label map, which follow the voxels that the host changes.
import { invalid } from '../check.js';
import type { Vec3, VolumeInit, VoxelArray } from '../data.js';
import type { LabelOptions, LabelSurfaces } from '../label-surfaces.js';
import type { SliceOptions, StepReport } from '../stepper.js';
import type { Volume } from '../volume.js';

/** The classes of this library that adapters of label maps need: `{ Volume, LabelSurfaces }`, from any entry point. */
export interface LabelClasses {
  Volume: typeof Volume;
  LabelSurfaces: typeof LabelSurfaces;
}

type SurfaceOptions = Omit<LabelOptions, 'volume'>;

/** A box of voxels: the index of the first, and their numbers along x, y and z. */
export interface Region {
  min: Vec3;
  dims: Vec3;
}

/** Slices along the third axis, from `first` to `last`, both included. */
export interface SliceRange {
  first: number;
  last: number;
}

/**
 * Most steps that {@link LabelMap.settle} makes at once; strokes settle in fewer. A page that opens a large label map is
 * not blocked until all of it is smooth.
 */
const STEPS = 8;

/** A label map of a host, 3D, as a `Volume`, and its surfaces. */
export class LabelMap {
  readonly surfaces: LabelSurfaces;
  readonly #volume: Volume;
  /** The voxels as the surfaces know them. */
  readonly #known: VoxelArray;
  readonly #dims: Vec3;
  #report: StepReport | undefined;

  private constructor(surfaces: LabelSurfaces, volume: Volume, known: VoxelArray, [x, y, z]: VolumeInit['dims']) {
    this.surfaces = surfaces;
    this.#volume = volume;
    this.#known = known;
    this.#dims = [x, y, z];
  }

  /** Copies the voxels of `init`, and creates their surfaces. Throws what `Volume` and `LabelSurfaces` throw. */
  static make(classes: LabelClasses, init: VolumeInit, options: SurfaceOptions = {}): LabelMap {
    checkClasses(classes);
    const volume = new classes.Volume(init);
    try {
      const surfaces = new classes.LabelSurfaces({ volume, ...options });
      return new LabelMap(surfaces, volume, init.data.slice(), init.dims);
    } catch (error) {
      volume.free();
      throw error;
    }
  }

  /** Does what {@link make} does, and smooths the surfaces until they are settled, all in slices. */
  static async create(
    classes: LabelClasses,
    init: VolumeInit,
    options: SurfaceOptions,
    slices: SliceOptions,
  ): Promise<LabelMap> {
    checkClasses(classes);
    const volume = new classes.Volume(init);
    const known = init.data.slice();
    let surfaces: LabelSurfaces | undefined;
    try {
      surfaces = await classes.LabelSurfaces.create({ volume, ...options }, slices);
      const map = new LabelMap(surfaces, volume, known, init.dims);
      map.#report = await surfaces.run(slices);
      return map;
    } catch (error) {
      surfaces?.free();
      volume.free();
      throw error;
    }
  }

  /**
   * Adopts the voxels of the host that have changed since the last call, of all slices or of some; returns the box
   * around them, or undefined if none has. Throws `invalid-argument` if `voxels` is of another type or length, and what
   * `LabelSurfaces.refresh` throws; nothing has changed then.
   */
  follow(voxels: VoxelArray, slices?: SliceRange): Region | undefined {
    if (voxels.constructor !== this.#known.constructor || voxels.length !== this.#known.length) {
      throw invalid('voxels', 'must have the type and the number of those that the surfaces were made from');
    }
    const region = changedRegion(this.#known, voxels, this.#dims, slices);
    if (!region) return undefined;
    this.#write(region, voxels);
    try {
      this.surfaces.refresh(region);
    } catch (error) {
      this.#write(region, this.#known);
      throw error;
    }
    copyBox(voxels, this.#known, this.#dims, region);
    this.#report = undefined;
    return region;
  }

  #write(region: Region, voxels: VoxelArray): void {
    this.#volume.write({ ...region, data: boxOf(voxels, this.#dims, region) });
  }

  /** Smooths the surfaces where they have changed; returns whether they are settled. */
  settle(): boolean {
    if (!this.#report?.done) this.#report = this.surfaces.step(STEPS);
    return this.#report.done;
  }

  free(): void {
    this.surfaces.free();
    this.#volume.free();
  }
}

function checkClasses(classes: LabelClasses): void {
  for (const name of ['Volume', 'LabelSurfaces'] as const) {
    if (typeof Object(classes)[name] === 'function') continue;
    throw invalid(name, "needs the class of this library: import { LabelSurfaces, Volume } from 'vesicle'");
  }
}

/** Returns the box around the voxels that differ, undefined if none does. The arrays are of the same type and length. */
export function changedRegion(
  before: VoxelArray,
  now: VoxelArray,
  dims: Vec3,
  slices: SliceRange = { first: 0, last: dims[2] - 1 },
): Region | undefined {
  const [nx, ny] = dims;
  const start = nx * ny * Math.max(0, slices.first);
  const end = Math.min(nx * ny * (slices.last + 1), now.length);
  const min: Vec3 = [Infinity, Infinity, Infinity];
  const max: Vec3 = [-1, -1, -1];
  eachDifference(before, now, start, end, (index) => {
    const row = Math.floor(index / nx);
    const place: Vec3 = [index - row * nx, row % ny, Math.floor(row / ny)];
    for (let axis = 0 as 0 | 1 | 2; axis < 3; axis++) {
      if (place[axis] < min[axis]) min[axis] = place[axis];
      if (place[axis] > max[axis]) max[axis] = place[axis];
    }
  });
  if (max[0] < 0) return undefined;
  return { min, dims: [max[0] - min[0] + 1, max[1] - min[1] + 1, max[2] - min[2] + 1] };
}

/**
 * Calls `visit` with the index of each voxel from `start` to `end` that differs. Compares four bytes at a time, since a
 * host may not say where it has changed 16 million voxels.
 */
function eachDifference(
  before: VoxelArray,
  now: VoxelArray,
  start: number,
  end: number,
  visit: (index: number) => void,
): void {
  const compare = (from: number, to: number) => {
    for (let i = from; i < to; i++) if (before[i] !== now[i]) visit(i);
  };
  const size = now.BYTES_PER_ELEMENT;
  const perWord = 4 / size;
  if (perWord < 1 || now.byteOffset % 4 !== 0 || before.byteOffset % 4 !== 0) {
    compare(start, end);
    return;
  }
  const words = Math.floor((now.length * size) / 4);
  const [mine, theirs] = [
    new Uint32Array(before.buffer, before.byteOffset, words),
    new Uint32Array(now.buffer, now.byteOffset, words),
  ];
  const last = Math.min(words, Math.floor(end / perWord));
  const first = Math.min(last, Math.ceil(start / perWord));
  compare(start, Math.min(end, first * perWord));
  for (let w = first; w < last; w++) if (mine[w] !== theirs[w]) compare(w * perWord, (w + 1) * perWord);
  compare(Math.max(start, last * perWord), end);
}

/** Yields the index of the first voxel of each row of a box along x. */
function* rows([nx, ny]: Vec3, { min, dims }: Region): Generator<number> {
  for (let z = min[2]; z < min[2] + dims[2]; z++)
    for (let y = min[1]; y < min[1] + dims[1]; y++) yield min[0] + nx * (y + ny * z);
}

function boxOf(voxels: VoxelArray, dims: Vec3, region: Region): VoxelArray {
  const Kind = voxels.constructor as new (length: number) => VoxelArray;
  const box = new Kind(region.dims[0] * region.dims[1] * region.dims[2]);
  let to = 0;
  for (const from of rows(dims, region)) {
    box.set(voxels.subarray(from, from + region.dims[0]), to);
    to += region.dims[0];
  }
  return box;
}

function copyBox(from: VoxelArray, to: VoxelArray, dims: Vec3, region: Region): void {
  for (const first of rows(dims, region)) to.set(from.subarray(first, first + region.dims[0]), first);
}
