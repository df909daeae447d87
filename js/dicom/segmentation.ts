// Volumes of segmentations: one frame for each segment and slice, or the labels of each slice (PS3.3, A.51 and A.90).
import type { VolumeInit } from '../data.js';
import { withPause } from '../pause.js';
import { affineOf, distancesOf } from './geometry.js';
import type { Parser } from './parser.js';
import { PixelReader } from './pixels.js';
import { LABEL_MAP } from './segments.js';
import type { Frame } from './types.js';
import { allocated, DicomVolume, type Reading, reader, spacingOf } from './volume.js';

/** Part of the distance between slices by which a frame of a segmentation may be off. */
const OFF = 0.1;
/** Most slices between the first and last frame of a segmentation. */
const MOST_SLICES = 65_536;

/** Frames sorted along the normal, and the slice of each, some of which may have no frame. */
interface Slices {
  frames: Frame[];
  slices: number[];
  count: number;
}

/** Returns the slices of the frames of a segmentation, which has none where no segment is; undefined if they are uneven. */
function slicesOf(images: readonly Frame[]): Slices | undefined {
  const normal = distancesOf(images);
  const order = images.map((image, k) => [image, normal[k] ?? 0] as const).toSorted((a, b) => a[1] - b[1]);
  const frames = order.map(([image]) => image);
  const distances = distancesOf(frames);
  const least = Math.min(...frames.map(({ spacing }) => Math.min(...spacing)));
  const steps = distances
    .slice(1)
    .map((distance, k) => distance - (distances[k] ?? 0))
    .filter((step) => step > OFF * least);
  const step = stepOf(frames, distances, Math.min(...steps, Infinity));
  if (step === Infinity) return { frames, slices: frames.map(() => 0), count: 1 };
  const slices = distances.map((distance) => Math.round(distance / step));
  const count = (slices.at(-1) ?? 0) + 1;
  const isEven = distances.every((distance, k) => Math.abs(distance / step - (slices[k] ?? 0)) <= OFF);
  return isEven && count <= MOST_SLICES ? { frames, slices, count } : undefined;
}

/** Returns the distance between slices: that which the file states, if frames are at multiples of it, else the least one. */
function stepOf([first]: readonly Frame[], distances: readonly number[], least: number): number {
  const stated = Math.abs(first?.statedStep ?? 0);
  const fits = distances.every((distance) => Math.abs(distance / stated - Math.round(distance / stated)) <= OFF);
  return stated > 0 && least !== Infinity && fits ? stated : least;
}

/** A volume of labels. */
export class SegmentationVolume extends DicomVolume {
  readonly kind = 'segmentation';
  readonly #parser: Parser;
  readonly #slices: Slices;
  readonly #affine: number[];

  /** Returns the volume of the frames of one file; undefined if they are at uneven distances. */
  static of(parser: Parser, images: readonly Frame[]): SegmentationVolume | undefined {
    const slices = slicesOf(images);
    return slices && new SegmentationVolume(parser, slices);
  }

  private constructor(parser: Parser, slices: Slices) {
    const { frames, count } = slices;
    const [first] = frames as [Frame];
    const affine = affineOf(frames, count, Math.abs(first.statedStep ?? 0) || 1);
    super(first.series, '', {
      dims: [first.format.columns, first.format.rows, count],
      spacing: spacingOf(affine),
      frames: 1,
      images: frames.length,
      warnings: [],
      remarks: [],
      uneven: undefined,
    });
    this.#parser = parser;
    this.#slices = slices;
    this.#affine = affine;
  }

  protected override async readVoxels(reading: Reading): Promise<VolumeInit> {
    const { frames, slices } = this.#slices;
    const [nx, ny, nz] = this.dims;
    const [first] = frames as [Frame];
    const { wholeFraction, sopClass } = first.series;
    const data = allocated(
      first.format.bitsAllocated > 8 || this.segments.some(({ value }) => value > 255) ? Uint16Array : Uint8Array,
      nx * ny * nz,
    );
    const best = wholeFraction > 0 ? allocated(Uint8Array, data.length) : undefined;
    const pixels = new PixelReader(this.#parser, reading.decoders);
    // A voxel of several segments gets the one that comes last in the file.
    const order = frames.map((_, k) => k).toSorted((a, b) => (frames[a]?.segment ?? 0) - (frames[b]?.segment ?? 0));
    let shared = 0;
    await withPause(reading.signal, async (pause) => {
      for (const [done, k] of order.entries()) {
        const frame = frames[k] as Frame;
        const values = await pixels.read(frame);
        const at = (slices[k] ?? 0) * nx * ny;
        if (sopClass === LABEL_MAP) data.set(values, at);
        else if (best) takeFractions(data, best, values, at, frame.segment ?? 1, wholeFraction);
        else shared += takeSegment(data, values, at, frame.segment ?? 1);
        reading.onProgress?.({ done: done + 1, total: order.length });
        await pause.turn();
      }
    });
    const text = `${shared} voxels are in several segments; each has the label of the last one.`;
    return {
      data,
      dims: [nx, ny, nz],
      affine: this.#affine,
      space: 'LPS',
      unit: 'mm',
      ...(shared > 0 && { warnings: [reader(text)] }),
    };
  }
}

/** Gives the voxels of a frame the label of its segment; returns how many had another. */
function takeSegment(data: VolumeInit['data'], values: ArrayLike<number>, at: number, label: number): number {
  let shared = 0;
  for (let k = 0; k < values.length; k++) {
    if (values[k] === 0) continue;
    if (data[at + k] !== 0) shared += 1;
    data[at + k] = label;
  }
  return shared;
}

/** Gives the voxels of a frame the label of its segment where its fraction is the largest so far, and at least a half. */
function takeFractions(
  data: VolumeInit['data'],
  best: VolumeInit['data'],
  values: ArrayLike<number>,
  at: number,
  label: number,
  whole: number,
): void {
  for (let k = 0; k < values.length; k++) {
    const value = values[k] ?? 0;
    if (value < whole / 2 || value <= (best[at + k] ?? 0)) continue;
    best[at + k] = value;
    data[at + k] = label;
  }
}
