// A volume of DICOM images: what is known before its voxels are read, and the reading.
import { checkProperties, choice } from '../check.js';
import type { Vec3, VolumeInit, VoxelArray } from '../data.js';
import { VesicleError } from '../error.js';
import { withPause } from '../pause.js';
import { shortened } from '../short-text.js';
import { noted, STORE_PLAIN, unpackingProblem } from '../small-files.js';
import { checkListener, checkSignal } from '../stepper.js';
import type { Warning } from '../warning.js';
import type { Decoders } from './codecs.js';
import { badDicom, listed } from './error.js';
import { affineOf, distancesOf, evennessOf } from './geometry.js';
import type { Stack } from './grouping.js';
import { type Parser, PLAIN } from './parser.js';
import { arrayOf, checkLength, PixelReader } from './pixels.js';
import { secondsOf } from './time.js';
import type { Frame, Segment, Series } from './types.js';

/** Progress of reading: numbers of images, or files, that are done and that there are. */
export interface DicomProgress {
  done: number;
  total: number;
}

/** Options of {@link DicomVolume.read}. */
export interface DicomReadOptions {
  /**
   * Treatment of slices at uneven distances, some of which are missing, for example: `'refuse'` them, or `'resample'`
   * them evenly, by linear interpolation between neighbouring slices. Default `'refuse'`.
   */
  uneven?: 'refuse' | 'resample';
  /** Decoders for compressed images, which pages give and Node finds; see {@link Decoders}. */
  decoders?: Decoders;
  /** Aborts the reading, which then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /** Called after each image that has been read. */
  onProgress?: (progress: DicomProgress) => void;
}

/** Most characters of the name of a volume, to which its size and a number may be added. */
const LONGEST_NAME = 150;

const OPTIONS = ['uneven', 'decoders', 'signal', 'onProgress'];

/** A volume that DICOM images make up. */
export abstract class DicomVolume {
  /** Whether voxels are intensities, or labels of a segmentation. */
  abstract readonly kind: 'image' | 'segmentation';
  /** Description of the series, with what tells the volume from others of the series. */
  readonly name: string;
  /** Name of the patient, for people to choose by. It is in no volume, error or warning. */
  readonly patient: string;
  /** Kind of device, such as `CT`, `MR` or `PT`. */
  readonly modality: string;
  /** Day of the study, `YYYY-MM-DD`; empty if it is not known. */
  readonly date: string;
  /** Identifiers of the series, and of the coordinate system that volumes may have in common. */
  readonly series: string;
  readonly frameOfReference: string;
  /** Number of voxels along x, y and z; of even slices, if the volume is resampled. */
  readonly dims: Vec3;
  /** Voxel size along x, y and z, millimetres. */
  readonly spacing: Vec3;
  /** Number of frames; 1 for a 3D volume. */
  readonly frames: number;
  /** Number of images. */
  readonly images: number;
  /** Things to know before relying on the volume, which it will have as its warnings. */
  readonly warnings: readonly Warning[];
  /** Facts about the intensities: their unit, the padding value, that small ones are bright. */
  readonly remarks: readonly string[];
  /** Why the slices are uneven, so that the volume must be resampled or refused; undefined if they are even. */
  readonly uneven: string | undefined;
  /** Whether small intensities are meant to be shown bright (MONOCHROME1); stored values are as in the file. */
  readonly inverted: boolean;
  /** Segments of a segmentation: the labels of voxels, with names and colours. */
  readonly segments: readonly Segment[];

  /** @internal */
  constructor(
    series: Series,
    label: string,
    known: Pick<DicomVolume, 'dims' | 'spacing' | 'frames' | 'images' | 'warnings' | 'remarks' | 'uneven'>,
  ) {
    const { dims, spacing, frames, images, warnings, remarks, uneven } = known;
    const named =
      series.description ||
      [series.modality, series.number].filter((part) => part !== undefined && part !== '').join(' ');
    this.name = shortened([named || 'DICOM', label].filter(Boolean).join(', '), LONGEST_NAME);
    this.patient = series.patient;
    this.modality = series.modality;
    this.date = series.date;
    this.series = series.uid;
    this.frameOfReference = series.frameOfReference;
    this.dims = dims;
    this.spacing = spacing;
    this.frames = frames;
    this.images = images;
    this.warnings = warnings;
    this.remarks = [...remarksOn(series), ...remarks];
    this.uneven = uneven;
    this.inverted = series.inverted;
    this.segments = series.segments;
  }

  /**
   * Reads the voxels. The volume is in the space LPS, in millimetres.
   *
   * @throws `VesicleError` `bad-file`: slices at uneven distances, unless they are to be resampled; an image that is
   *   damaged, cut off, or of a compression that is not supported. `invalid-argument`: a decoder that is not installed;
   *   `too-large`: not enough memory. `signal.reason` when aborted.
   */
  async read(given?: DicomReadOptions): Promise<VolumeInit> {
    const options = checkProperties<DicomReadOptions>('options', given, OPTIONS);
    const { uneven = 'refuse', signal, onProgress, decoders = {} } = options;
    choice('uneven', uneven, ['refuse', 'resample']);
    checkSignal(signal);
    checkListener('onProgress', onProgress);
    if (this.uneven !== undefined && uneven === 'refuse')
      throw badDicom(this.name, `${this.uneven}. Add what is missing, or read with uneven: 'resample'`);
    return this.readVoxels({ signal, onProgress, decoders });
  }

  /** @internal */
  protected abstract readVoxels(reading: Reading): Promise<VolumeInit>;
}

/** @internal */
export interface Reading {
  signal: AbortSignal | undefined;
  onProgress: ((progress: DicomProgress) => void) | undefined;
  decoders: Decoders;
}

function remarksOn({ units, padding, inverted }: Series): string[] {
  return [
    ...(units && units !== 'NONE'
      ? [`Intensities are in ${units}${units === 'BQML' ? ' (Bq/ml), not standardised uptake values' : ''}.`]
      : []),
    ...(padding === undefined ? [] : [`Stored value of voxels outside of what was measured: ${padding}.`]),
    ...(inverted ? ['Small values are meant to be shown bright (MONOCHROME1); values are as stored.'] : []),
  ];
}

export const reader = (text: string): Warning => ({ code: 'reader', text });

/**
 * Returns an array of voxels; throws `bad-file` if frames lack bytes, `too-large` if there is no memory for it, or it is too
 * large for its files.
 */
export function allocated(
  Kind: new (length: number) => VoxelArray,
  length: number,
  frames: readonly Frame[],
): VoxelArray {
  for (const frame of frames) checkLength(frame);
  const files = [...new Set(frames.map(({ file }) => file))];
  const stored = files.reduce((sum, { size }) => sum + size, 0);
  const bytes = length * new Kind(0).BYTES_PER_ELEMENT;
  const problem = unpackingProblem(bytes, stored, frames.every(isPlain) ? ADD_SLICES : STORE_PLAIN);
  const part = files.length === 1 ? shortened(files[0]?.name ?? '') : `${files.length} files`;
  if (problem) throw new VesicleError('too-large', `DICOM: ${part}: ${problem}`);
  try {
    return noted(new Kind(length), stored);
  } catch {
    throw new VesicleError('too-large', `DICOM: voxels: no memory for ${length} voxels`);
  }
}

/** Advice about small files of which nothing is compressed: most of their slices have no image. */
const ADD_SLICES = 'add the slices that have no image';

/** Whether the voxels of an image are neither compressed themselves, nor with its file. */
const isPlain = ({ deflated, format }: Frame) => !deflated && PLAIN.includes(format.transferSyntax);

/** Lengths of the columns of an affine transform. */
export const spacingOf = (affine: readonly number[]): Vec3 =>
  [0, 4, 8].map((at) => Math.hypot(affine[at] ?? 0, affine[at + 1] ?? 0, affine[at + 2] ?? 0)) as Vec3;

/** A volume of intensities. */
export class ImageVolume extends DicomVolume {
  readonly kind = 'image';
  readonly #parser: Parser;
  readonly #stack: Stack;
  readonly #affine: number[];
  readonly #seconds: number | undefined;

  constructor(parser: Parser, stack: Stack) {
    const { frames, label, notes } = stack;
    const slices = frames[0] as Frame[];
    const [first] = slices as [Frame];
    const evenness = evennessOf(slices);
    const count = evenness.kind === 'uneven' ? evenness.count : slices.length;
    const affine = affineOf(slices, count);
    const { seconds, note } = secondsOf(frames);
    const off = evenness.kind === 'even' && evenness.note ? [evenness.note] : [];
    const texts = [...notes, ...off, ...(note ? [note] : []), ...generalWarnings(first)];
    super(first.series, label, {
      dims: [first.format.columns, first.format.rows, count],
      spacing: spacingOf(affine),
      frames: frames.length,
      images: frames.length * slices.length,
      warnings: texts.map(reader),
      remarks: stack.remarks ?? [],
      uneven: evenness.kind === 'even' ? undefined : evenness.reason,
    });
    this.#parser = parser;
    this.#stack = stack;
    this.#affine = affine;
    this.#seconds = seconds;
  }

  protected override async readVoxels(reading: Reading): Promise<VolumeInit> {
    const { frames } = this.#stack;
    const images = frames.flat();
    const [first] = images as [Frame];
    const isOneScale = images.every(({ slope, intercept }) => slope === first.slope && intercept === first.intercept);
    const Kind = isOneScale ? arrayOf(first.format) : first.format.bitsAllocated > 16 ? Float64Array : Float32Array;
    const [nx, ny, nz] = this.dims;
    const data = allocated(Kind, nx * ny * nz * frames.length, images);
    const pixels = new PixelReader(this.#parser, reading.decoders);
    const progress = { done: 0, total: this.images };
    await withPause(reading.signal, async (pause) => {
      for (const [k, slices] of frames.entries()) {
        const out = data.subarray(k * nx * ny * nz, (k + 1) * nx * ny * nz);
        const fill = new SliceFiller(out, distancesOf(slices), nx * ny, nz);
        for (const slice of slices) {
          const stored = await pixels.read(slice);
          fill.add(isOneScale ? stored : rescaled(stored, slice, Kind));
          progress.done += 1;
          reading.onProgress?.({ ...progress });
          await pause.turn();
        }
      }
    });
    return {
      data,
      dims: frames.length > 1 ? [nx, ny, nz, frames.length] : [nx, ny, nz],
      affine: this.#affine,
      ...(isOneScale && first.slope !== 0 && { slope: first.slope, intercept: first.intercept }),
      ...(frames.length > 1 && this.#seconds !== undefined && { frameSeconds: this.#seconds }),
      space: 'LPS',
      unit: 'mm',
      ...withWarnings([...this.warnings, ...interpolated(this.uneven), ...foundIn(pixels, first.series)]),
    };
  }
}

export const withWarnings = (warnings: Warning[]) => (warnings.length > 0 ? { warnings } : {});

/** Returns warnings about compressed images, which are known once they are read. */
function foundIn({ lossy, endless }: PixelReader, series: Series): Warning[] {
  const files = [...endless];
  const text = `${listed(files)} may be cut off or damaged: the compressed image has no end.`;
  return [...(lossy.size > 0 && !series.lossy ? [reader(LOSSY)] : []), ...(files.length > 0 ? [reader(text)] : [])];
}

function interpolated(uneven: string | undefined): Warning[] {
  if (uneven === undefined) return [];
  const reason = (uneven[0]?.toUpperCase() ?? '') + uneven.slice(1);
  return [reader(`${reason}. Slices at equal distances were interpolated between their neighbours.`)];
}

const LOSSY = 'The images were compressed with loss: intensities differ from those that were measured.';

/** Returns warnings about the intensities or positions of all images. */
function generalWarnings({ series, isChained, slope }: Frame): string[] {
  return [
    ...(slope === 0 ? ['The slope of intensities is 0, which cannot be: values are as stored.'] : []),
    ...(series.lossy ? [LOSSY] : []),
    ...(series.hasTable
      ? ['Intensities are given by a table in the file, which is not applied: values are as stored.']
      : []),
    ...(isChained
      ? ['Only the first slice has a position: the others follow at the distance that the file states.']
      : []),
  ];
}

function rescaled(
  stored: VoxelArray,
  { slope, intercept }: Frame,
  Kind: new (length: number) => VoxelArray,
): VoxelArray {
  const out = new Kind(stored.length);
  for (let k = 0; k < stored.length; k++) out[k] = (stored[k] ?? 0) * slope + intercept;
  return out;
}

/** Fills even slices of a volume from slices in order, interpolated where they are uneven. */
class SliceFiller {
  readonly #out: VoxelArray;
  /** Positions of the slices in units of the distance between even ones. */
  readonly #positions: number[];
  readonly #size: number;
  readonly #isEven: boolean;
  #before: VoxelArray | undefined;
  #taken = 0;
  #next = 0;

  constructor(out: VoxelArray, distances: number[], size: number, count: number) {
    const extent = distances.at(-1) ?? 0;
    this.#out = out;
    this.#positions = distances.map((distance) => (extent === 0 ? 0 : (distance / extent) * (count - 1)));
    this.#size = size;
    this.#isEven = distances.length === count;
  }

  add(slice: VoxelArray): void {
    if (this.#isEven) {
      this.#out.set(slice, this.#size * this.#taken++);
      return;
    }
    const [from, to] = [this.#positions[this.#taken - 1] ?? 0, this.#positions[this.#taken] ?? 0];
    const isLast = this.#taken === this.#positions.length - 1;
    const count = this.#out.length / this.#size;
    for (; this.#next < count && (isLast || this.#next <= to + NEAR); this.#next++)
      this.#mix(slice, to > from ? (this.#next - from) / (to - from) : 1);
    this.#before = slice;
    this.#taken += 1;
  }

  #mix(after: VoxelArray, t: number): void {
    const before = this.#before ?? after;
    const at = this.#size * this.#next;
    const isWhole = !(this.#out instanceof Float32Array || this.#out instanceof Float64Array);
    for (let k = 0; k < this.#size; k++) {
      const [a, b] = [before[k] ?? 0, after[k] ?? 0];
      // A slice that is in its place keeps its values.
      const value = Math.abs(1 - t) <= NEAR ? b : a + t * (b - a);
      this.#out[at + k] = isWhole ? Math.round(value) : value;
    }
  }
}

/** Part of the distance between slices within which a slice is where an even one is. */
const NEAR = 0.02;
