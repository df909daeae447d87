import {
  boolean,
  checkProperties,
  choice,
  denseCopy,
  integer,
  invalid,
  number,
  numbers,
  ordered,
  positive,
  shallowCopy,
  typedArray,
  vec3,
} from './check.js';
import type { Bytes, LengthUnit, Space, Vec3, VolumeFileOptions, VolumeInit, VoxelArray } from './data.js';
import { VesicleError } from './error.js';
import { mark, notA } from './kind.js';
import { Handle } from './runtime.js';
// Entry points without sequences lack `RawFrames`, which an import by name would demand.
import {
  isOfSmall,
  limitOf,
  MOST_COMPRESSED_OF_SMALL,
  MOST_ENRICHED_OF_SMALL,
  MOST_RESAMPLED_OF_SMALL,
  MOST_WRITTEN_OF_SMALL,
  noted,
  notedLike,
} from './small-files.js';
import { checkedSlices, finishInSlices, type SliceOptions } from './stepper.js';
import * as glue from './vesicle.js';
import { RawVolume } from './vesicle.js';
import { bytesOf, readerArguments } from './volume-file.js';
import type { Warning } from './warning.js';
import { checkedWarnings, placeOf } from './warnings.js';

const INIT = [
  ...['data', 'dims', 'affine', 'spacing', 'origin'],
  ...['slope', 'intercept', 'frameSeconds', 'space', 'unit', 'warnings'],
];
const UNITS: readonly LengthUnit[] = ['m', 'mm', 'um'];

/** File formats that {@link Volume.toBytes} writes. */
export type VolumeFormat = 'nifti' | 'nrrd' | 'mha';

const ELEMENTS = [
  ...[Uint8Array, Int8Array, Uint16Array, Int16Array],
  ...[Uint32Array, Int32Array, Float32Array, Float64Array],
];

/** Long operations of a volume in slices of work, as returned by {@link Volume.inSlices}. */
export interface VolumeInSlices {
  /** As {@link Volume.enrichSlices}. */
  enrichSlices(options?: { factor?: number; method?: 'flow' | 'linear' }): Promise<Volume>;
}

/**
 * Returns the handle of the WebAssembly object behind a volume, for the other modules of the library; throws
 * `invalid-argument` if `volume` is no {@link Volume}.
 */
export let volumeHandle: (parameter: string, volume: Volume) => Handle<RawVolume>;
/** Creates a volume that owns the WebAssembly object returned by `make`, for the other modules of the library. */
export let wrapVolume: (make: () => RawVolume) => Volume;

/**
 * A regular grid of intensities, with one or several frames, and its transform to world space.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link Volume.free}.
 */
export class Volume {
  readonly #handle: Handle<RawVolume>;

  static {
    wrapVolume = wrap;
    volumeHandle = (parameter, volume) => {
      if (volume instanceof Volume) return volume.#handle;
      throw notA('Volume', parameter, volume);
    };
    mark(Volume.prototype, 'Volume');
  }

  /**
   * Creates a volume from voxels in memory.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the property that is missing, misspelled, of the wrong
   *   length or not finite; `too-large` where there is no memory for the voxels.
   */
  constructor(init: VolumeInit) {
    const made: unknown = init;
    this.#handle = made instanceof Handle ? made : new Handle('Volume', () => fromInit(init));
    if (!(made instanceof Handle)) notedLike(init.data, this);
  }

  /**
   * Parses a volume file: NIfTI-1 or 2 (`.nii`, `.nii.gz`, or `.hdr` and `.img`), Analyze 7.5 (`.hdr` and `.img`), NRRD
   * (`.nrrd`, or `.nhdr` and data) or MetaImage (`.mha`, or `.mhd` and data), detected from the bytes. NIfTI files may be
   * gzipped as a whole, the voxels of NRRD and MetaImage compressed inside the file. Of colours the luminance (Rec. 709)
   * is read, with a warning; other vectors are refused.
   *
   * Entry points with one method lack it: use `parseVolume` of `vesicle/import`.
   *
   * @param options - `data`: the bytes of the file with the voxels, if `bytes` is a detached header. `files`: the files
   *   beside the header instead, among which those that it names are found, such as the slices of a list or a numbered
   *   series. `space`: orientation of the world axes, for files that do not tell it.
   * @throws {@link VesicleError} `bad-file` naming the format and the field, or the files that are missing or of the
   *   wrong size; `too-large`.
   */
  static parse(bytes: Uint8Array, options?: VolumeFileOptions): Volume {
    const given = readerArguments(bytes, options);
    return noted(
      wrap(() => RawVolume.parse(...given)),
      bytesOf(given),
    );
  }

  /**
   * Joins volumes on the same grid, in order, into the frames of a 4D volume. Volumes that are already 4D contribute
   * all their frames, in order.
   *
   * Entry points with one method lack it, but for `vesicle/tracking`.
   *
   * @param options - `frameSeconds`: from one frame to the next; default that of the first volume.
   * @throws {@link VesicleError} `invalid-argument` where the grids differ, or there is none.
   */
  static fromFrames(frames: Volume[], options: { frameSeconds?: number } = {}): Volume {
    const { frameSeconds } = checkProperties('options', options, ['frameSeconds']);
    if (frameSeconds !== undefined) positive('frameSeconds', frameSeconds);
    const handles = denseCopy('frames', frames).map((frame, index) => volumeHandle(`frames[${index}]`, frame));
    const joined = wrap(() => {
      const collected = new glue.RawFrames();
      for (const handle of handles) handle.use((raw) => collected.push(raw));
      return collected.join(frameSeconds);
    });
    return frames.every(isOfSmall) ? noted(joined, 0) : joined;
  }

  /** Returns a volume that is made of this one, and is of small files if this is. */
  #derived(make: (raw: RawVolume) => RawVolume): Volume {
    return notedLike(
      this,
      wrap(() => this.#handle.use(make)),
    );
  }

  /**
   * Encodes the volume as a NIfTI-1 file, or as NIfTI-2 if a dimension exceeds 32,767, or slope, intercept, time between
   * frames or the position of the volume, by more than a thousandth of a voxel, would change when rounded to single
   * precision, as NIfTI-1 stores them.
   */
  toNifti(): Bytes {
    return this.#handle.use((raw) => raw.toNifti() as Bytes);
  }

  /**
   * Encodes the volume as a file: NIfTI (as {@link Volume.toNifti}), NRRD (`.nrrd`) or MetaImage (`.mha`), with all
   * frames.
   *
   * NIfTI keeps stored values, slope and intercept. The two others have neither slope nor intercept: if these are not 1
   * and 0, the intensities are stored instead, in `float32`, or `float64` for 32-bit integers and `float64`. NIfTI is in
   * RAS, MetaImage in LPS, NRRD in the volume's space. MetaImage does not say what the distance between frames means, so
   * {@link Volume.parse} reads no time from it.
   *
   * Entry points with one method lack it.
   *
   * @param options - `gzip`: compress; the whole file for NIfTI (`.nii.gz`), the voxels inside the file for the others.
   *   Default false.
   * @throws {@link VesicleError} `invalid-argument`: another format; `too-large`, also for more than 256 MiB of intensities,
   *   24 MiB compressed, in place of voxels that come from a file of at most 128 KiB: write those as NIfTI.
   */
  toBytes(format: VolumeFormat, options: { gzip?: boolean } = {}): Bytes {
    choice('format', format, ['nifti', 'nrrd', 'mha']);
    const { gzip = false } = checkProperties('options', options, ['gzip']);
    boolean('gzip', gzip);
    const most = limitOf(undefined, isOfSmall(this), gzip ? MOST_COMPRESSED_OF_SMALL : MOST_WRITTEN_OF_SMALL);
    return this.#handle.use((raw) => raw.toBytes(format, gzip, most) as Bytes);
  }

  /** Number of voxels along x, y and z. */
  get dims(): Vec3 {
    return this.#handle.use((raw) => triple(raw.dims()));
  }

  /** Number of frames; 1 for a 3D volume. */
  get frames(): number {
    return this.#handle.use((raw) => raw.frames());
  }

  /** Seconds from one frame to the next; 0 if they are not known. */
  get frameSeconds(): number {
    return this.#handle.use((raw) => raw.frameSeconds());
  }

  /** Voxel size along x, y and z, world units. */
  get spacing(): Vec3 {
    return this.#handle.use((raw) => triple(raw.spacing()));
  }

  /** Transform from voxel index to world: 16 numbers, column-major. */
  get affine(): Float64Array {
    return this.#handle.use((raw) => raw.affine());
  }

  /** Orientation of the world axes. */
  get space(): Space {
    return this.#handle.use((raw) => raw.space() as Space);
  }

  /**
   * Length of a world unit; undefined if neither the file nor the maker of the volume states it. A volume made from this
   * one has the same.
   */
  get unit(): LengthUnit | undefined {
    const unit = this.#handle.use((raw) => raw.unit());
    return unit === '' ? undefined : (unit as LengthUnit);
  }

  /**
   * Warnings: things to know about the volume before relying on it; empty if there are none. A volume made from this one has those
   * that still hold for it.
   */
  get warnings(): Warning[] {
    return this.#handle.use((raw) => raw.warnings() as Warning[]);
  }

  /** Smallest and largest finite intensity of all frames, after slope and intercept. */
  get range(): [number, number] {
    const [low, high] = this.#handle.use((raw) => raw.range()) as unknown as [number, number];
    return [low, high];
  }

  /**
   * Returns the intensity histogram of one frame: the number of voxels in each of `bins` equal parts of
   * {@link Volume.range}. Voxels that are not finite are not counted.
   *
   * @param options - The number of bins, and the frame, the first by default. The two as arguments of their own are
   *   deprecated.
   * @throws {@link VesicleError} `invalid-argument`: `bins` not from 1 to 65,536, or no such frame.
   */
  histogram(options: { bins: number; frame?: number } | number, frame?: number): Uint32Array {
    const given = typeof options === 'number' ? { bins: options, frame } : shallowCopy('options', options);
    const chosen = checkProperties('options', given, ['bins', 'frame']);
    const bins = integer('bins', chosen.bins, { min: 1 });
    const index = integer('frame', chosen.frame ?? 0);
    return this.#handle.use((raw) => raw.histogram(bins, index));
  }

  /**
   * Samples the intensity at a world point by trilinear interpolation; outside the volume the border is replicated.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such frame, or a point that is not finite.
   */
  sample(world: Vec3, frame = 0): number {
    const point = vec3('world', world);
    integer('frame', frame);
    return this.#handle.use((raw) => raw.sample(point, frame));
  }

  /**
   * Returns the intensities of the slice at `index` along `axis`, row-major: for axis 0 (sagittal) rows of y, for 1 and
   * 2 rows of x. In single precision, see {@link Volume.intensities}.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such axis, slice or frame.
   */
  slice(axis: 0 | 1 | 2, index: number, frame = 0): Float32Array {
    integer('axis', axis, { max: 2 });
    integer('index', index);
    integer('frame', frame);
    return this.#handle.use((raw) => raw.slice(axis, index, frame));
  }

  /**
   * Returns all intensities of one frame, x fastest, for upload as a 3D texture. In single precision, with 24 bits:
   * integers are exact up to 16,777,216, and intensities near 4·10⁹ are multiples of 256, so that smaller differences are
   * lost. Methods do not use these, and keep them. Voxels that are NaN are NaN here; {@link Volume.slice} and
   * {@link Volume.sample} give {@link Volume.range}'s lower end for them, so that they can be shown and interpolated.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such frame; `too-large`.
   */
  intensities(frame = 0): Float32Array {
    integer('frame', frame);
    return this.#handle.use((raw) => raw.intensities(frame));
  }

  /**
   * Builds an image pyramid: one volume a level, from fine to coarse, each with `factor` times fewer voxels along each
   * axis (rounded down) than the one before; the first is this one.
   *
   * @param levels - Number of levels, this volume included.
   * @param options - `factor`: above 1, at most 2; default the square root of 3.
   * @throws {@link VesicleError} `invalid-argument`: factor out of range, or more levels than the size allows; `too-large`, also for
   *   more than 50 million voxels in all but the first of an image from a file of at most 128 KiB.
   */
  pyramid(levels: number, options: { factor?: number } = {}): Volume[] {
    const { factor = Math.sqrt(3) } = checkProperties('options', options, ['factor']);
    integer('levels', levels, { min: 1 });
    number('factor', factor);
    this.#checkLevels(levels, factor);
    const raw = this.#handle.use((raw) => raw.pyramid(levels, factor));
    return raw.map((level) =>
      notedLike(
        this,
        wrap(() => level),
      ),
    );
  }

  /** Refuses a pyramid of an image of small files that would take long. */
  #checkLevels(levels: number, factor: number): void {
    if (!isOfSmall(this) || !(factor > 1)) return;
    const share = factor ** -3;
    const below = (share * (1 - share ** (levels - 1))) / (1 - share);
    const voxels = Math.round(below * this.dims.reduce((count, n) => count * n, this.frames));
    if (voxels <= MOST_RESAMPLED_OF_SMALL) return;
    const most = `${MOST_RESAMPLED_OF_SMALL}, for images from files of up to 128 KiB`;
    throw new VesicleError('too-large', `factor: ${voxels} voxels in all levels but the first are more than ${most}`);
  }

  /**
   * Reduces the resolution of all frames by averaging the finite voxels of each block: fewer and larger voxels of the
   * same type. Incomplete blocks at the far ends are dropped. For images that were interpolated to smaller pixels than
   * were measured.
   *
   * @param factors - Block size in voxels along x, y and z, 1 to 16 each.
   * @throws {@link VesicleError} `invalid-argument`: a factor out of range, or beyond the volume; `too-large`.
   */
  binned(factors: Vec3): Volume {
    const counts = Uint32Array.from(numbers('factors', factors, 3), (factor) => integer('factors', factor, { min: 1 }));
    return this.#derived((raw) => raw.binned(counts));
  }

  /**
   * Inserts in-between slices along the axis of the largest spacing, by symmetric optical flow between neighbouring
   * slices, in all frames. The original slices stay unchanged, at their positions; voxels keep their type.
   *
   * Entry points with one method lack it, but for `vesicle/tracking`.
   *
   * @param options - `factor`: number by which the distance between slices is divided, 1 to 16; default the
   *   smallest that brings slices to about twice as far apart as pixels, at most 3; 1 changes nothing. More make
   *   surfaces no more accurate. `method`: `'linear'` interpolates linearly instead.
   * @throws {@link VesicleError} `invalid-argument`: factor out of range, or a single slice; `too-large`.
   */
  enrichSlices(options: { factor?: number; method?: 'flow' | 'linear' } = {}): Volume {
    const [factor, byFlow] = enrichment(options);
    const most = limitOf(undefined, isOfSmall(this), MOST_ENRICHED_OF_SMALL);
    return this.#derived((raw) => raw.enrichSlices(factor, byFlow, most));
  }

  /**
   * Returns long operations of this volume that yield to the event loop between slices of work and can be aborted. Results and
   * errors are those of the methods of the same name, bit for bit.
   *
   * Entry points with one method lack it, but for `vesicle/tracking`.
   *
   * @param options - `signal`: aborts operations, which reject with `signal.reason`; `budgetMs`: duration of a slice of
   *   work, milliseconds, default 12.
   * @throws {@link VesicleError} `invalid-argument`.
   */
  inSlices(options?: SliceOptions): VolumeInSlices {
    const slices = checkedSlices(options);
    // Throws if the volume was freed.
    this.#handle.use(() => undefined);
    return {
      enrichSlices: async (given = {}) => {
        const [factor, byFlow] = enrichment(given);
        slices.signal?.throwIfAborted();
        const most = limitOf(undefined, isOfSmall(this), MOST_ENRICHED_OF_SMALL);
        const work = new Handle('Volume', () => this.#handle.use((raw) => raw.enrichInSlices(factor, byFlow, most)));
        const raw = await finishInSlices(work, (one) => one.advance(), slices);
        return notedLike(
          this,
          wrap(() => raw),
        );
      },
    };
  }

  /**
   * Returns the labels in one frame of a label map and their numbers of voxels, by ascending value. Labels are
   * intensities, integers other than 0, which is the background.
   *
   * Entry points with one method lack it.
   *
   * @throws {@link VesicleError} `invalid-argument`: voxels of floats, an intensity that is not an integer (because of
   *   slope or intercept), more than 65,536 labels, or no such frame.
   */
  labels(frame = 0): { value: number; voxels: number }[] {
    integer('frame', frame);
    const pairs = this.#handle.use((raw) => raw.labels(frame));
    return Array.from({ length: pairs.length / 2 }, (_, i) => ({
      value: pairs[2 * i] as number,
      voxels: pairs[2 * i + 1] as number,
    }));
  }

  /**
   * Returns the mask of the voxels of a label map that have a label, or one of several: 1 there, 0 elsewhere, as bytes
   * on the same grid, in all frames.
   *
   * Entry points with one method lack it.
   *
   * @param value - The label or labels; each must be one of the labels of some frame.
   * @throws {@link VesicleError} `invalid-argument`: a value that is no label (the message lists those there are), or a
   *   volume that is no label map, as for {@link Volume.labels}; `too-large`.
   */
  label(value: number | number[]): Volume {
    const list = Array.isArray(value) ? denseCopy('value', value) : [value];
    const values = Float64Array.from(list, (label) => number('value', label));
    return this.#derived((raw) => raw.label(values));
  }

  /**
   * Returns the mask of the voxels whose intensity is from `low` to `high`, both included: 1 there, 0 elsewhere, as
   * bytes on the same grid, in all frames. Voxels that are NaN are 0.
   *
   * Entry points with one method lack it.
   *
   * @param low - May be `-Infinity`.
   * @param high - May be `Infinity`.
   * @throws {@link VesicleError} `invalid-argument`: NaN, or `low` above `high`; `too-large`.
   */
  threshold(low: number, high: number): Volume {
    ordered('low', low);
    ordered('high', high);
    return this.#derived((raw) => raw.threshold(low, high));
  }

  /**
   * Returns the Dice coefficient, 2 |A ∩ B| / (|A| + |B|), of the voxels of two volumes whose intensity is not 0, or of
   * those that have a label, over all frames: 1 if they are the same or there are none, 0 if no voxel is in both.
   *
   * Entry points with one method lack it.
   *
   * @param options - `label`: compare the voxels of this label; an integer other than 0.
   * @throws {@link VesicleError} `invalid-argument`: volumes that differ in dimensions, number of frames, space, or in
   *   position by more than a thousandth of a voxel; a label for volumes of floats.
   */
  dice(other: Volume, options: { label?: number } = {}): number {
    const { label } = checkProperties('options', options, ['label']);
    if (label !== undefined) number('label', label);
    const handle = volumeHandle('other', other);
    return this.#handle.use((raw) => handle.use((compared) => raw.dice(compared, label)));
  }

  /**
   * Returns the voxels of a box, in all frames, as a volume of its own. World positions, voxel type, slope and intercept
   * stay.
   *
   * Entry points with one method lack it.
   *
   * @param box - Voxel indices: from `min`, included, to `max`, excluded, along x, y and z.
   * @throws {@link VesicleError} `invalid-argument`: a box that is empty, extends beyond the volume, or has no finite
   *   voxel; `too-large`.
   */
  crop(box: { min: Vec3; max: Vec3 }): Volume {
    const { min, max } = checkProperties('box', shallowCopy('box', box), ['min', 'max']);
    const [from, to] = [counts('box.min', min), counts('box.max', max)];
    return this.#derived((raw) => raw.crop(from, to));
  }

  /**
   * Resamples all frames to another grid. The voxel type, slope and intercept stay; integers are rounded.
   *
   * Nothing is smoothed: for a much coarser grid, use {@link Volume.binned} or {@link Volume.pyramid} first. Between the
   * centres of the outermost voxels and the edges of the volume the border is replicated.
   *
   * Entry points with one method lack it.
   *
   * @param options - One of the first three. `dims`: numbers of voxels in the same field of view, whose edges stay in
   *   place. `spacing`: voxel size, world units, in the same field of view; the result has the nearest size of which a
   *   whole number of voxels fills it. `like`: the grid of another volume, in its space; what is outside this volume
   *   gets intensity 0, or the one nearest to 0 that the voxel type can store. `interpolation`: `'linear'` (default)
   *   interpolates intensities as {@link Volume.sample} does, `'nearest'` takes the nearest voxel. Use `'nearest'` for
   *   label maps.
   * @param how - Deprecated: the interpolation.
   * @throws {@link VesicleError} `invalid-argument`: none or several of the grids, a size out of range, or a volume whose
   *   file states another unit of length; `too-large`, also for more than 50 million voxels, in all frames, of an image from
   *   a file of at most 128 KiB.
   */
  resample(
    options: ({ dims: Vec3 } | { spacing: Vec3 } | { like: Volume }) & { interpolation?: 'linear' | 'nearest' },
    how?: 'linear' | 'nearest',
  ): Volume {
    const { interpolation = how ?? 'linear', ...grid } = shallowCopy('options', options);
    const resample = resampling(grid);
    const nearest = choice('interpolation', interpolation, ['linear', 'nearest']) === 'nearest';
    const most = limitOf(undefined, isOfSmall(this), MOST_RESAMPLED_OF_SMALL);
    return this.#derived((raw) => resample(raw, nearest, most));
  }

  /**
   * Returns one frame as a 3D volume.
   *
   * Entry points with one method lack it.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such frame, or one without a finite voxel; `too-large`.
   */
  frame(index: number): Volume {
    integer('frame', index);
    return this.#derived((raw) => raw.frame(index));
  }

  /**
   * Changes voxels of one frame in place, such as those under a brush. {@link Volume.range} follows. Objects made from
   * the volume before, such as models and the levels of a pyramid, keep the voxels as they were.
   *
   * Entry points with one method lack it.
   *
   * @param region - `min`: index of the first voxel along x, y and z; `dims`: numbers of voxels; `data`: their stored
   *   values, x fastest, in the type of the volume's voxels.
   * @throws {@link VesicleError} `invalid-argument`: an empty region or one beyond the volume, data of another type or
   *   length, intensities beyond the range of `float32`, no finite voxel left, or no such frame; `too-large`. The volume
   *   is then unchanged.
   */
  write(region: { min: Vec3; dims: Vec3; data: VoxelArray }, frame = 0): void {
    const { data, ...box } = checkProperties('region', shallowCopy('region', region), ['min', 'dims', 'data']);
    const [first, sizes] = checkedRegion(box as typeof region);
    const voxels = voxelArray('region.data', data);
    integer('frame', frame);
    this.#handle.use((raw) => raw.write(first, sizes, voxels, frame));
  }

  /** Frees the memory; the volume cannot be used afterwards. Objects made from it stay valid. */
  free(): void {
    this.#handle.free();
  }

  /** The same as {@link Volume.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

/** Returns a copy of the first index and the numbers of voxels of a region; throws unless they are counts. */
export function checkedRegion(region: { min: Vec3; dims: Vec3 }): [Uint32Array, Uint32Array] {
  const { min, dims } = checkProperties('region', shallowCopy('region', region), ['min', 'dims']);
  return [counts('region.min', min), counts('region.dims', dims)];
}

function wrap(make: () => RawVolume): Volume {
  // The constructor distinguishes a handle from the options of users.
  return new Volume(new Handle('Volume', make) as unknown as VolumeInit);
}

function fromInit(init: VolumeInit): RawVolume {
  const given = checkProperties('init', init, INIT);
  const { data, slope = 1, intercept = 0, frameSeconds, space = 'RAS', unit } = given;
  if (unit !== undefined) choice('unit', unit, UNITS);
  const warnings = checkedWarnings('warnings', given.warnings);
  const volume = new RawVolume(
    voxelArray('data', data),
    dims(given.dims),
    affine(given),
    number('slope', slope),
    number('intercept', intercept),
    frameSeconds === undefined ? 0 : positive('frameSeconds', frameSeconds),
    choice('space', space, ['RAS', 'LPS']),
  );
  return withWarnings(unit === undefined ? volume : volume.withUnit(unit), warnings);
}

/** Returns a volume with warnings added. */
export function withWarnings(volume: RawVolume, warnings: readonly Warning[]): RawVolume {
  return warnings.reduce((raw, one) => raw.withWarning(one.code, one.text, ...placeOf(one)), volume);
}

function voxelArray(parameter: string, data: unknown): VoxelArray {
  const kind = ELEMENTS.find((element) => data instanceof element) as (new (length: number) => VoxelArray) | undefined;
  if (kind) return typedArray(parameter, data, kind);
  throw invalid(parameter, `must be a typed array: ${ELEMENTS.map((element) => element.name).join(', ')}`);
}

/** Returns one integer of at least 0 for each of x, y and z. */
function counts(parameter: string, given: unknown): Uint32Array {
  return Uint32Array.from(vec3(parameter, given), (count) => integer(parameter, count));
}

/** Returns the factor and whether the optical flow is used, of {@link Volume.enrichSlices}, once they are checked. */
function enrichment(given: { factor?: number; method?: 'flow' | 'linear' }): [number | undefined, boolean] {
  const { factor, method = 'flow' } = checkProperties('options', given, ['factor', 'method']);
  if (factor !== undefined) integer('factor', factor, { min: 1 });
  choice('method', method, ['flow', 'linear']);
  return [factor, method === 'flow'];
}

type Grids = { dims: Vec3; spacing: Vec3; like: Volume };

/** Returns the call that resamples to the one grid that is given. */
function resampling(given: Partial<Grids>): (raw: RawVolume, nearest: boolean, most?: number) => RawVolume {
  const names = ['dims', 'spacing', 'like'] as const;
  checkProperties('options', given, [...names, 'interpolation']);
  if (names.filter((name) => given[name] !== undefined).length !== 1) {
    throw invalid('options', 'give one of dims, spacing, like');
  }
  if (given.dims !== undefined) {
    const dims = counts('dims', given.dims);
    return (raw, nearest, most) => raw.resampleToDims(dims, nearest, most);
  }
  if (given.spacing !== undefined) {
    const spacing = vec3('spacing', given.spacing);
    return (raw, nearest, most) => raw.resampleToSpacing(spacing, nearest, most);
  }
  const like = volumeHandle('like', given.like as Volume);
  return (raw, nearest, most) => like.use((other) => raw.resampleLike(other, nearest, most));
}

function dims(given: unknown): Uint32Array {
  const sizes = numbers('dims', given, 3, 4);
  for (const size of sizes) integer('dims', size, { min: 1 });
  return Uint32Array.from([...sizes, 1].slice(0, 4));
}

function affine({ affine, spacing, origin }: Partial<VolumeInit>): Float64Array {
  if (affine === undefined) return placed(spacing, origin);
  if (spacing !== undefined || origin !== undefined) {
    throw invalid('affine', 'give either affine, or spacing and origin');
  }
  return numbers('affine', affine, 16);
}

function placed(spacing: Vec3 = [1, 1, 1], origin: Vec3 = [0, 0, 0]): Float64Array {
  const [dx, dy, dz] = triple(vec3('spacing', spacing).map((size) => positive('spacing', size)));
  const [x, y, z] = triple(vec3('origin', origin));
  return Float64Array.of(dx, 0, 0, 0, 0, dy, 0, 0, 0, 0, dz, 0, x, y, z, 1);
}

function triple(values: ArrayLike<number>): Vec3 {
  return [values[0] as number, values[1] as number, values[2] as number];
}
