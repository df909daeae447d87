/** Opens volumes in the app's workers, and reduces them to the data that the page displays. */
import { type LengthUnit, VesicleError, Volume, type VolumeInit } from 'vesicle';
import startReaders, { parseVolume } from 'vesicle/import';
import { text } from '../texts';
import { isHeader } from './file-groups';
import { toNrrd } from './nrrd';
import type { FileNotes, Intensities, LevelView, NamedBytes, VolumeSource, VolumeView } from './protocol';
import { release } from './release';
import { shapeVoxels } from './shapes';
import { beyondSmall, MOST_BYTES_OF_SMALL } from './small-files';
import { quantiles } from './threshold';
import { concerning, type Warning } from './warnings';

export const HISTOGRAM_BINS = 256;

/**
 * Parses a volume from one file; for a header without its voxels, throws a `VesicleError` whose message requests the file
 * with them.
 */
function parseFile(file: NamedBytes): VolumeInit {
  try {
    return parseVolume(file.bytes);
  } catch (error) {
    if (!(error instanceof VesicleError) || error.code === 'crash' || !isHeader(file)) throw error;
    throw new VesicleError(error.code, text('files.headerWithoutData', { reason: error.message }));
  }
}

/**
 * Reads the voxels and the geometry of a volume from one file, or from a header and its data in either order; throws a
 * `VesicleError` for any other number of files.
 */
export async function readFiles(files: NamedBytes[]): Promise<VolumeInit> {
  await startReaders();
  const [first, second] = files;
  if (!first) throw new VesicleError('bad-file', text('files.noFile'));
  if (!second) return withNotes(parseFile(first), first.notes);
  const header = files.find(isHeader);
  if (!header) throw new VesicleError('bad-file', text('files.notOneVolume', { count: files.length }));
  const others = files.filter((file) => file !== header);
  // A single data file may have another name than its header says.
  if (files.length === 2) return parseVolume(header.bytes, { data: (header === first ? second : first).bytes });
  return parseVolume(header.bytes, { files: others.map(({ name, bytes }) => ({ name, bytes })) });
}

/** Returns a volume with what its file could not hold. */
function withNotes(init: VolumeInit, notes: FileNotes | undefined): VolumeInit {
  if (!notes) return init;
  const { warnings = [], affine, ...rest } = init;
  const isTurned = notes.space === 'LPS' && init.space === 'RAS' && affine !== undefined;
  const turned = isTurned && { affine: Array.from(affine, turnedAbout), space: 'LPS' as const };
  return { ...rest, ...(affine && { affine }), ...turned, warnings: [...warnings, ...notes.warnings] };
}

/** Returns an entry of a transform to RAS as that of the one to LPS: x and y change their signs. */
const turnedAbout = (entry: number, k: number) => (k % 4 < 2 ? -entry : entry);

/** One frame of a volume, the number of all its frames, and the unit of length that its file states. */
export interface OpenFrame {
  volume: Volume;
  frames: number;
  unit: LengthUnit | undefined;
  /** The voxels as they were read, where these are the intensities that the page displays. */
  voxels: Intensities | undefined;
}

/** Most pixels of a plane through an image in small files: views of larger ones hold the page for seconds. */
const MOST_PIXELS_OF_SMALL = 2 ** 22;

/** Throws a `VesicleError` if planes through an image in small files have too many pixels to be shown. */
export function checkPlanes({ dims }: Pick<Volume, 'dims'>): void {
  const [, middle = 1, longest = 1] = [...dims].sort((a, b) => a - b);
  const pixels = middle * longest;
  if (pixels <= MOST_PIXELS_OF_SMALL) return;
  throw new VesicleError('too-large', beyondSmall('files.planesTooLarge', pixels, MOST_PIXELS_OF_SMALL));
}

/**
 * Throws a `VesicleError` if an image in small files has planes with too many pixels, or too many bytes of voxels, to be shown;
 * these are given back.
 */
export function checkSmallImage({ dims: [x, y, z, frames = 1], data }: Pick<VolumeInit, 'dims' | 'data'>): void {
  checkPlanes({ dims: [x, y, z] });
  const bytes = data.BYTES_PER_ELEMENT;
  const [voxels, most] = [x * y * z * frames, MOST_BYTES_OF_SMALL / bytes];
  if (voxels <= most) return;
  release(data);
  throw new VesicleError('too-large', beyondSmall('files.tooManyVoxels', voxels, most, { bits: 8 * bytes }));
}

/**
 * Returns a frame of the computed volume of a shape, or of one in files of any supported format, the library's own or
 * one that other libraries read.
 */
export async function openFrame(source: VolumeSource, frame: number, isSmall = false): Promise<OpenFrame> {
  const { frameSeconds: _, warnings = [], ...init } = await read(source);
  if (isSmall) checkSmallImage(init);
  const [x, y, z, frames = 1] = init.dims;
  if (!Number.isInteger(frame) || frame < 0 || frame >= frames)
    throw new VesicleError('invalid-argument', text('slices.noFrame', { last: frames - 1, frame }));
  const size = x * y * z;
  const data = init.data.subarray(frame * size, (frame + 1) * size);
  const own = concerning(warnings, { frame }).map((warning) => withoutFrame(warning));
  const volume = new Volume({ ...init, data, dims: [x, y, z], warnings: own });
  return { volume, frames, unit: init.unit, voxels: displayed({ ...init, data }, volume.range) };
}

/** Returns voxels that are what {@link intensitiesOf} would make of their volume, which saves a copy; otherwise undefined. */
export function displayed(
  { data, slope = 1, intercept = 0 }: VolumeInit,
  range: [number, number],
): Intensities | undefined {
  const narrow = narrowArray(range, 0);
  const isSame = slope === 1 && intercept === 0 && data.constructor === narrow?.constructor;
  // Of a longer buffer, a part cannot be given away.
  return isSame && data.byteLength === data.buffer.byteLength ? (data as Intensities) : undefined;
}

/** Returns a warning without its place if that is a frame, which is all there is. */
function withoutFrame({ code, text, where }: Warning): Warning {
  return where && !('frame' in where) ? { code, text, where } : { code, text };
}

async function read(source: VolumeSource): Promise<VolumeInit> {
  if ('shape' in source) return shapeVoxels(source.shape);
  return readFiles(source.files);
}

/** A volume as a file, with the extension of its format. */
export interface VolumeBytes {
  extension: 'nii' | 'nrrd';
  bytes: Uint8Array;
}

/** The part of a voxel by which a file may move the voxels: less than what any interpolation between them shows. */
const MOVED = 1e-3;

/** Returns whether NIfTI, which has positions in single precision, keeps the voxels of a volume where they are. */
export function fitsNifti({ affine, spacing }: Pick<Volume, 'affine' | 'spacing'>): boolean {
  const first = affine.slice(12, 15);
  return first.every((value) => Math.abs(Math.fround(value) - value) <= MOVED * Math.min(...spacing));
}

/** Returns a volume as a file: NIfTI or, where that would move its voxels, NRRD. */
export function fileOf(volume: Volume): VolumeBytes {
  return fitsNifti(volume)
    ? { extension: 'nii', bytes: volume.toNifti() }
    : { extension: 'nrrd', bytes: toNrrd(volume) };
}

/** Returns how the notes on a source's files change its display. */
export function displayOf(source: object): Pick<VolumeView, 'inverted' | 'remarks'> {
  const { files = [] } = source as { files?: readonly NamedBytes[] };
  const remarks = files.flatMap(({ notes }) => notes?.remarks ?? []);
  const inverted = files.some(({ notes }) => notes?.inverted);
  return { ...(inverted && { inverted }), ...(remarks.length > 0 && { remarks }) };
}

/**
 * Returns the data of a volume that the page displays: metadata, and `voxels`, the intensities, by default of its first
 * frame.
 */
export function viewOf(volume: Volume, name: string, voxels = intensitiesOf(volume)): VolumeView {
  const { range } = volume;
  const histogram = volume.histogram({ bins: HISTOGRAM_BINS });
  // Quantiles, because a few extreme voxels (metal, noise) must not make all others grey.
  const [low = range[0], high = range[1]] = quantiles(histogram, range, [0.001, 0.999]);
  const window: [number, number] = high > low ? [low, high] : range;
  const { dims, frames, spacing, affine, space, unit, warnings } = volume;
  return {
    name,
    dims,
    frames,
    spacing,
    affine,
    space,
    ...(unit && { unit }),
    range,
    histogram,
    window,
    warnings,
    voxels,
  };
}

/**
 * Returns the `levels` pyramid levels coarser than the volume, the finest first; `window` holds the intensities of black
 * and white.
 */
export function levelsOf(volume: Volume, levels: number, window: [number, number]): LevelView[] {
  const isInteger = narrowArray(volume.range, 0) !== undefined;
  const [same, ...coarser] = volume.pyramid(levels + 1);
  same?.free();
  return coarser.map((level) => {
    try {
      // Means of integers are none, but need no more steps than these have: half the memory is enough.
      return { dims: level.dims, window, ...(isInteger ? inSteps(level) : { voxels: intensitiesOf(level) }) };
    } finally {
      level.free();
    }
  });
}

/** Returns the intensities of a volume in 65,536 steps. */
export function inSteps(volume: Volume): Required<Pick<LevelView, 'voxels' | 'scale'>> {
  const [nx, ny, nz] = volume.dims;
  const [low, high] = volume.range;
  const step = (high - low) / 0xffff || 1;
  const voxels = new Uint16Array(nx * ny * nz);
  for (let z = 0; z < nz; z++) {
    const values = volume.slice(2, z);
    for (let i = 0; i < values.length; i++) voxels[z * nx * ny + i] = Math.round(((values[i] ?? 0) - low) / step);
  }
  return { voxels, scale: [step, low] };
}

/** Returns the intensities of the first `frames` frames in the narrowest type that holds all of them exactly. */
export function intensitiesOf(volume: Volume, frames = 1): Intensities {
  const size = volume.dims.reduce((product, side) => product * side, frames);
  const narrow = narrowArray(volume.range, size);
  return (narrow && filled(narrow, volume, frames)) ?? filled(new Float32Array(size), volume, frames);
}

/** Returns an array of the narrowest integers that span a range; undefined if none of at most two bytes does. */
function narrowArray([low, high]: [number, number], size: number): Intensities | undefined {
  if (low >= 0 && high < 2 ** 8) return new Uint8Array(size);
  if (low >= 0 && high < 2 ** 16) return new Uint16Array(size);
  return low >= -(2 ** 15) && high < 2 ** 15 ? new Int16Array(size) : undefined;
}

/**
 * Copies the first `frames` frames into `out`, slice by slice to avoid a full copy of the volume in floats; returns
 * undefined if `out` cannot hold one of the intensities exactly.
 */
function filled(out: Float32Array, volume: Volume, frames: number): Float32Array;
function filled(out: Intensities, volume: Volume, frames: number): Intensities | undefined;
function filled(out: Intensities, volume: Volume, frames: number): Intensities | undefined {
  const [nx, ny, nz] = volume.dims;
  for (let slice = 0; slice < frames * nz; slice++) {
    const values = volume.slice(2, slice % nz, Math.floor(slice / nz));
    const first = slice * nx * ny;
    out.set(values, first);
    if (out instanceof Float32Array) continue;
    for (let i = 0; i < values.length; i++) if (out[first + i] !== values[i]) return undefined;
  }
  return out;
}
