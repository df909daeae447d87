// Volumes of segmentations: one frame for each segment and slice, or the labels of each slice (PS3.3, A.51 and A.90).
import type { VolumeInit } from '../data.js';
import { withPause } from '../pause.js';
import { listed } from './error.js';
import { affineOf, distancesOf, largest, placementProblem, shiftOf, shown, smallest } from './geometry.js';
import { isAlike } from './grouping.js';
import type { Parser } from './parser.js';
import { arrayOf, PixelReader } from './pixels.js';
import { LABEL_MAP } from './segments.js';
import type { Frame } from './types.js';
import { allocated, DicomVolume, type Reading, reader, spacingOf, withWarnings } from './volume.js';

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

/** Returns the slices of the frames of a segmentation, which has none where no segment is, or why they have none. */
function slicesOf(images: readonly Frame[]): Slices | string {
  const normal = distancesOf(images);
  const order = images.map((image, k) => [image, normal[k] ?? 0] as const).toSorted((a, b) => a[1] - b[1]);
  const frames = order.map(([image]) => image);
  const distances = distancesOf(frames);
  const least = smallest(frames.flatMap(({ spacing }) => spacing));
  const steps = distances
    .slice(1)
    .map((distance, k) => distance - (distances[k] ?? 0))
    .filter((step) => step > OFF * least);
  const step = stepOf(frames, distances, smallest(steps));
  if (step === Infinity) return { frames, slices: frames.map(() => 0), count: 1 };
  const slices = distances.map((distance) => Math.round(distance / step));
  const count = (slices.at(-1) ?? 0) + 1;
  const isEven = distances.every((distance, k) => Math.abs(distance / step - (slices[k] ?? 0)) <= OFF);
  if (!isEven)
    return `a segmentation with frames at uneven distances, ${shown(smallest(steps))} to ${shown(largest(steps))}`;
  if (count <= MOST_SLICES) return { frames, slices, count };
  const most = `${count} slices of ${shown(step)}, and at most ${MOST_SLICES} are possible`;
  return `a segmentation with gaps of up to ${shown(largest(steps))} between its frames: these are ${most}`;
}

/** Returns the distance between slices: that which the file states, if frames are at multiples of it, else the least one. */
function stepOf([first]: readonly Frame[], distances: readonly number[], least: number): number {
  const stated = Math.abs(first?.statedStep ?? 0);
  const fits = distances.every((distance) => Math.abs(distance / stated - Math.round(distance / stated)) <= OFF);
  // Frames at different positions are in different slices.
  return least !== Infinity && fits && Math.round(least / stated) >= 1 ? stated : least;
}

/** Returns why the frames of a file are no volume of labels; undefined if they may be one. */
function problemOf(images: readonly Frame[]): string | undefined {
  const [first] = images as [Frame];
  const { float, signed, bitsAllocated } = first.format;
  if (float || (first.series.sopClass === LABEL_MAP && (signed || bitsAllocated > 16)))
    return 'a segmentation whose labels are no unsigned integers of up to 16 bits';
  if (!images.every((image) => isAlike(first, image)))
    return 'a segmentation with frames of several orientations or pixel spacings';
  return undefined;
}

/** Returns how many frames are at the position of another one with the same segment. */
function repeatedIn({ frames, slices }: Slices): number {
  return frames.length - new Set(frames.map(({ segment }, k) => `${segment} ${slices[k]}`)).size;
}

/** Returns what should be known of the segments of a volume. */
function warningsOf(frames: Slices): string[] {
  const [{ series }] = frames.frames as [Frame];
  const repeated = repeatedIn(frames);
  const texts = repeated > 0 ? [`${repeated} frames are at the position of another one of the same segment.`] : [];
  if (series.sopClass === LABEL_MAP) return texts;
  const unnamed = frames.frames.filter(({ segment }) => !segment).length;
  if (unnamed > 0)
    texts.push(`${unnamed} frames name no segment: their voxels have label ${labelOf(frames.frames[0] as Frame)}.`);
  const described = new Set(series.segments.map(({ value }) => value));
  const others = new Set(frames.frames.map(labelOf).filter((label) => !described.has(label)));
  const labels = listed([...others].map(String));
  return others.size > 0 ? [...texts, `Segments that the file does not describe: ${labels}.`] : texts;
}

/** A volume of labels. */
export class SegmentationVolume extends DicomVolume {
  readonly kind = 'segmentation';
  readonly #parser: Parser;
  readonly #slices: Slices;
  readonly #affine: number[];

  /** Returns the volume of the frames of one file, or why they are none. */
  static of(parser: Parser, images: readonly Frame[]): SegmentationVolume | string {
    const problem = problemOf(images);
    if (problem !== undefined) return problem;
    const slices = slicesOf(images);
    if (typeof slices === 'string') return slices;
    const shift = shiftOf(slices.frames);
    if (shift !== undefined) return shift;
    const { frames, count } = slices;
    const affine = affineOf(frames, count, Math.abs(frames[0]?.statedStep ?? 0) || 1);
    return placementProblem(affine) ?? new SegmentationVolume(parser, slices, affine);
  }

  private constructor(parser: Parser, slices: Slices, affine: number[]) {
    const { frames, count } = slices;
    const [first] = frames as [Frame];
    super(first.series, '', {
      dims: [first.format.columns, first.format.rows, count],
      spacing: spacingOf(affine),
      frames: 1,
      images: frames.length,
      warnings: warningsOf(slices).map(reader),
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
    const isWide = first.format.bitsAllocated > 8 || frames.some((frame) => labelOf(frame) > 255);
    const Kind = isWide || this.segments.some(({ value }) => value > 255) ? Uint16Array : Uint8Array;
    const data = allocated(Kind, nx * ny * nz, frames);
    const best = wholeFraction > 0 ? allocated(arrayOf(first.format), data.length, frames) : undefined;
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
        else if (best) takeFractions(data, best, values, at, labelOf(frame), wholeFraction);
        else shared += takeSegment(data, values, at, labelOf(frame));
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
      ...withWarnings([...this.warnings, ...(shared > 0 ? [reader(text)] : [])]),
    };
  }
}

/** Returns the label of the voxels of a frame: the number of its segment, or of the only one. */
function labelOf({ segment, series }: Frame): number {
  if (segment) return segment;
  return series.segments.length === 1 ? (series.segments[0]?.value ?? 1) : 1;
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
