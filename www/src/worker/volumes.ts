/** Opens volumes in the app's workers, and reduces them to the data that the page displays. */
import { VesicleError, Volume, type VolumeInit } from 'vesicle';
import startReaders, { parseVolume } from 'vesicle/import';
import { importVolume } from '../importers';
import type { LevelView, NamedBytes, VolumeSource, VolumeView } from '../protocol';
import { quantize } from '../quantize';
import { shapeVoxels } from '../shapes';
import { text } from '../texts';
import { quantiles } from '../threshold';
import { Refusal } from './refusal';

export const HISTOGRAM_BINS = 256;

function isHeader({ name }: NamedBytes): boolean {
  return /\.(nhdr|mhd)$/i.test(name);
}

/**
 * Parses a volume from one file; for a header without its voxels, throws a `Refusal` whose message requests the file
 * with them.
 */
function parseFile(file: NamedBytes): VolumeInit {
  try {
    return parseVolume(file.bytes);
  } catch (error) {
    if (!(error instanceof VesicleError) || !isHeader(file)) throw error;
    throw new Refusal(error.code, text('files.headerWithoutData', { reason: error.message }));
  }
}

/**
 * Parses a volume from one file, or from a header and its data in either order; throws a `Refusal` for any other number
 * of files.
 */
export async function parseFiles(files: NamedBytes[]): Promise<Volume> {
  return new Volume(await readFiles(files));
}

/** Reads the voxels and the geometry of a volume as {@link parseFiles} does, without making a volume of them. */
export async function readFiles(files: NamedBytes[]): Promise<VolumeInit> {
  await startReaders();
  const [first, second] = files;
  if (!first) throw new Refusal('bad-file', text('files.noFile'));
  if (!second) return parseFile(first);
  if (files.length > 2) throw new Refusal('bad-file', text('files.notOneVolume', { count: files.length }));
  const [header, data] = isHeader(second) && !isHeader(first) ? [second, first] : [first, second];
  return parseVolume(header.bytes, { data: data.bytes });
}

/**
 * Returns the computed volume of a shape, or reads a volume from files in any supported format, the library's own or
 * one that other libraries read.
 */
export async function volumeFrom(source: VolumeSource): Promise<Volume> {
  if (!('files' in source)) return new Volume(shapeVoxels(source.shape));
  const foreign = await importVolume(source.files);
  return foreign ? new Volume(foreign) : parseFiles(source.files);
}

/** Reduces a volume to the data that the page displays: grey values of its first `pictures` frames, and metadata. */
export function viewOf(volume: Volume, name: string, pictures = 1): VolumeView {
  const { range } = volume;
  const histogram = volume.histogram(HISTOGRAM_BINS);
  // Quantiles, because a few extreme voxels (metal, noise) must not make all others grey.
  const [low = range[0], high = range[1]] = quantiles(histogram, range, [0.001, 0.999]);
  const window: [number, number] = high > low ? [low, high] : range;
  const { dims, frames, spacing, affine, space } = volume;
  return {
    name,
    dims,
    frames,
    spacing,
    affine,
    space,
    range,
    histogram,
    window,
    voxels: greys(volume, window, pictures),
  };
}

/**
 * Returns the `levels` pyramid levels coarser than the volume, the finest first, as grey values: `window` holds the
 * intensities of black and white.
 */
export function levelsOf(volume: Volume, levels: number, window: [number, number]): LevelView[] {
  const [, ...coarser] = volume.pyramid(levels + 1);
  return coarser.map((level) => {
    try {
      return { dims: level.dims, voxels: greys(level, window) };
    } finally {
      level.free();
    }
  });
}

/**
 * Converts the first `frames` frames to grey values, slice by slice to avoid a full copy of the volume in floats.
 * `window` holds the intensities of black and white.
 */
function greys(volume: Volume, window: [number, number], frames = 1): Uint8Array {
  const [nx, ny, nz] = volume.dims;
  const voxels = new Uint8Array(nx * ny * nz * frames);
  for (let frame = 0; frame < frames; frame++)
    for (let z = 0; z < nz; z++) quantize(volume.slice(2, z, frame), window, voxels, (frame * nz + z) * nx * ny);
  return voxels;
}
