/**
 * Reads DICOM: sorts the images of a folder into volumes, says what is wrong with each, and reads their voxels. Series of
 * slices, enhanced multi-frame images, doses, volumes with time, and segmentations; uncompressed, deflated, RLE, JPEG,
 * JPEG-LS, JPEG 2000 and HTJ2K.
 *
 * Needs the package `dicom-parser`, which reads data sets; for compressed images also one of
 * `@cornerstonejs/codec-libjpeg-turbo-8bit`, `@cornerstonejs/jpeg-lossless-decoder-js`, `@cornerstonejs/codec-charls`,
 * `@cornerstonejs/codec-openjpeg` and `@cornerstonejs/codec-openjph`. Each is imported when it is needed.
 *
 * @example
 * const { volumes } = await openDicom(files);
 * const volume = new Volume(await volumes[0].read());
 *
 * @module vesicle/dicom
 */
import { checkProperties, invalid } from '../check.js';
import type { VolumeInit } from '../data.js';
import { VesicleError } from '../error.js';
import type { InputFiles } from '../input-file.js';
import { withPause } from '../pause.js';
import { checkListener, checkSignal } from '../stepper.js';
import { badDicom, listed } from './error.js';
import { affineOf, evennessOf, placementProblem } from './geometry.js';
import { type Conflict, grouped, isNearlyParallel, type Stack, stacksOf } from './grouping.js';
import { framesIn } from './header.js';
import { importParser, type Parser, readHeader } from './parser.js';
import { SegmentationVolume } from './segmentation.js';
import { LABEL_MAP, SEGMENTATION } from './segments.js';
import { type Source, sourcesOf } from './source.js';
import type { Frame, Skipped } from './types.js';
import { type DicomProgress, type DicomReadOptions, type DicomVolume, ImageVolume } from './volume.js';

export type { DecoderSource } from '../decoder-source.js';
export type { InputFile, InputFiles } from '../input-file.js';
export type { DecoderName, Decoders } from './codecs.js';
export type { Segment, Skipped } from './types.js';
export { type DicomProgress, type DicomReadOptions, DicomVolume } from './volume.js';

/** Options of {@link openDicom}. */
export interface DicomOptions {
  /** Aborts the opening, which then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /** Called after each file. */
  onProgress?: (progress: DicomProgress) => void;
}

/** Volumes of a folder of DICOM files, and the files that are part of none. */
export interface DicomListing {
  /** The volumes, of which those with most voxels come first, and localisers last. */
  volumes: DicomVolume[];
  /** Files that are part of no volume, each with the reason. */
  skipped: Skipped[];
}

/** Images that may be read of however small files, and the bytes that each of more of them has at least. */
const FREE_IMAGES = 100_000;
const BYTES_PER_IMAGE = 1024;
const TOO_MANY = { reason: 'too many images of very few voxels', damaged: true };

/**
 * Looks at files, in any order and of any kind, and returns the volumes that the DICOM images among them make up. Of files
 * that are given as `Blob` or `File` only the headers are read.
 *
 * Images are of one volume if they are of one series, have the same size, pixel spacing, orientation and type of voxels. Of
 * several at the same position, those that differ in what was measured (echo, b-value, reconstruction…) are different
 * volumes, those that differ in time are frames of one. Slices are sorted along their normal, and placed by their
 * positions, also if the gantry was tilted. A file that is there twice counts once.
 *
 * A damaged file is skipped; since it may be part of any volume, all have a warning then.
 *
 * @throws `VesicleError` `invalid-argument`: `dicom-parser` is missing, or an argument is wrong. `signal.reason` when aborted.
 */
export async function openDicom(files: InputFiles, given?: DicomOptions): Promise<DicomListing> {
  const readers = sourcesOf(files);
  const { signal, onProgress } = checkProperties<DicomOptions>('options', given, ['signal', 'onProgress']);
  checkSignal(signal);
  checkListener('onProgress', onProgress);
  const parser = await importParser();
  const images: Frame[] = [];
  const skipped: Skipped[] = [];
  const most = FREE_IMAGES + readers.reduce((sum, { size }) => sum + size, 0) / BYTES_PER_IMAGE;
  await withPause(signal, async (pause) => {
    for (const [k, file] of readers.entries()) {
      const found = await imagesIn(parser, file);
      if ('reason' in found) skipped.push(found);
      else if (images.length + found.length > most) skipped.push({ ...TOO_MANY, name: file.name });
      else for (const image of found) images.push(image);
      onProgress?.({ done: k + 1, total: readers.length });
      await pause.turn();
    }
  });
  const volumes = volumesOf(parser, images, skipped);
  return { volumes: volumes.toSorted((a, b) => rank(b) - rank(a)), skipped };
}

/**
 * Reads the one volume that DICOM files make up.
 *
 * @throws As {@link openDicom} and {@link DicomVolume.read}; `bad-file` if there is no volume, with the reasons;
 *   `invalid-argument` if there are several: choose one by {@link openDicom}.
 */
export async function readDicom(files: InputFiles, options: DicomReadOptions = {}): Promise<VolumeInit> {
  const { signal } = options;
  const { volumes, skipped } = await openDicom(files, signal ? { signal } : {});
  const [volume, second] = volumes;
  if (!volume) throw badDicom('files', `no volume: ${reasonsOf(skipped)}`);
  if (second) {
    const names = volumes.map(({ name, dims }) => `${name} (${dims.join(' × ')})`);
    throw invalid(
      'files',
      `hold ${volumes.length} volumes, of which openDicom returns a list to choose from: ${listed(names, '; ')}`,
    );
  }
  return volume.read(options);
}

/** Returns the images of a file; one that is damaged is skipped, and may be part of any volume. */
async function imagesIn(parser: Parser, file: Source): Promise<Frame[] | Skipped> {
  try {
    const header = await readHeader(parser, file);
    if (header) return framesIn(file, header);
    return { name: file.name, reason: 'no DICOM file', ...(isNamedDicom(file) && { damaged: true }) };
  } catch (error) {
    if (!(error instanceof VesicleError)) throw error;
    return { name: file.name, reason: error.message, damaged: true };
  }
}

const isNamedDicom = ({ name }: Source) => /\.(dcm|dicom|ima)$/i.test(name);

/** Returns the volumes of images; adds those that are part of none to `skipped`. */
function volumesOf(parser: Parser, images: readonly Frame[], skipped: Skipped[]): DicomVolume[] {
  const damaged = skipped.filter((one) => one.damaged || one.series);
  const isSegment = ({ series }: Frame) => series.sopClass === SEGMENTATION || series.sopClass === LABEL_MAP;
  const skip = (group: readonly Frame[], reason: string) => {
    for (const name of new Set(group.map(({ file }) => file.name))) skipped.push({ name, reason });
  };
  const segmentations = [...grouped(images.filter(isSegment), ({ file }) => file).values()].flatMap((group) => {
    const volume = SegmentationVolume.of(parser, group);
    if (typeof volume !== 'string') return volume;
    skip(group, volume);
    return [];
  });
  const stacks = stacksOf(images.filter((image) => !isSegment(image))).map(usable);
  const left = stacks.filter((one) => 'reason' in one);
  for (const { images, reason } of left) skip(images, reason);
  const whole = stacks.filter((one) => 'frames' in one);
  const rest = new Rest(whole, left, damaged);
  const volumes = whole.map((stack) => new ImageVolume(parser, { ...stack, ...beside(stack, rest) }));
  return named([...volumes, ...segmentations]);
}

/** Returns a stack, or why it is no volume. */
function usable(stack: Stack | Conflict): Stack | Conflict {
  if ('reason' in stack) return stack;
  const [slices = []] = stack.frames;
  const images = stack.frames.flat();
  if (slices.length === 1) return { images, reason: 'a single image, which is no volume' };
  const evenness = evennessOf(slices);
  if (evenness.kind === 'shifted') return { images, reason: evenness.reason };
  const reason = placementProblem(affineOf(slices, evenness.kind === 'uneven' ? evenness.count : slices.length));
  return reason === undefined ? stack : { images, reason };
}

const firstOf = ({ frames }: Stack) => frames[0]?.[0] as Frame;

/** Images and volumes beside the stacks of each series. */
class Rest {
  readonly #unlabelled: Map<string, Stack[]>;
  readonly #left: Map<string, Conflict[]>;
  readonly #damaged: Skipped[];
  readonly #files = new Map<string, string[]>();

  constructor(stacks: readonly Stack[], left: readonly Conflict[], damaged: Skipped[]) {
    const plain = stacks.filter(({ label }) => label === '');
    this.#unlabelled = grouped(plain, (stack) => firstOf(stack).series.uid);
    this.#left = grouped(left, ({ images }) => images[0]?.series.uid ?? '');
    this.#damaged = damaged;
  }

  /** Returns some of the conflicts of a series, and how many more there are. */
  conflicts({ uid }: Frame['series']): { some: Conflict[]; more: number } {
    const all = this.#left.get(uid) ?? [];
    return { some: all.slice(0, MOST_CONFLICTS), more: Math.max(0, all.length - MOST_CONFLICTS) };
  }

  /** Returns the names of files that may be of a series, but could not be read. */
  files({ uid }: Frame['series']): string[] {
    const known = this.#files.get(uid);
    const names = known ?? this.#damaged.filter((one) => one.damaged || one.series === uid).map(({ name }) => name);
    if (!known) this.#files.set(uid, names);
    return names;
  }

  /** Whether another volume has images that may belong to a stack. */
  hasPartOf(stack: Stack): boolean {
    const first = firstOf(stack);
    const others = this.#unlabelled.get(first.series.uid) ?? [];
    return others.slice(0, MOST_OTHERS).some((other) => other !== stack && isPartOf(other, first));
  }
}

/** Conflicts that a volume mentions each. */
const MOST_CONFLICTS = 10;
/** Volumes of a series that are compared with each of them. */
const MOST_OTHERS = 100;

/** Returns what should be known of images that are not part of a stack, but may be missing in it. */
function beside(stack: Stack, rest: Rest): Pick<Stack, 'notes' | 'remarks'> {
  const first = firstOf(stack);
  const notes = [...stack.notes];
  const remarks: string[] = [];
  const { some, more } = rest.conflicts(first.series);
  for (const { images, reason } of some) {
    const count = images.length === 1 ? 'One image' : `${images.length} images`;
    const text = `${count} of the series ${images.length === 1 ? 'is' : 'are'} not part of the volume (${sizeOf(images)}): ${reason}.`;
    const isLocaliser = images.every((image) => image.series.isLocaliser || !isNearlyParallel(image, first));
    (isLocaliser ? remarks : notes).push(text);
  }
  if (more > 0) notes.push(`${more} more groups of images of the series are not part of the volume.`);
  const files = rest.files(first.series);
  if (files.length > 0) notes.push(`${listed(files)} could not be read, and may be missing in the volume.`);
  if (rest.hasPartOf(stack))
    notes.push(
      'Other images of the series differ in size, spacing, type of voxels or slightly in orientation: they are a volume of their own.',
    );
  return { notes, remarks };
}

/** Whether a volume of the same series is nearly parallel to an image. */
function isPartOf(stack: Stack, image: Frame): boolean {
  const one = firstOf(stack);
  return one.series.origin === image.series.origin && isNearlyParallel(one, image);
}

const sizeOf = ([image]: Frame[]) => `${image?.format.columns} × ${image?.format.rows}`;

/** Returns volumes with names of their own: with the size, and the number, where several have the same. */
function named(volumes: DicomVolume[]): DicomVolume[] {
  const marks: ((volume: DicomVolume, k: number) => string)[] = [
    ({ dims }) => dims.join(' × '),
    (_, k) => String(k + 1),
  ];
  for (const mark of marks)
    for (const group of grouped(volumes, ({ name }) => name).values())
      if (group.length > 1)
        for (const [k, volume] of group.entries())
          (volume as { name: string }).name = `${volume.name}, ${mark(volume, k)}`;
  return volumes;
}

/** Returns a number that is the larger, the more likely a volume is the one that is wanted. */
function rank({ dims, frames, kind }: DicomVolume): number {
  return dims[0] * dims[1] * dims[2] * frames * (kind === 'image' ? 1 : 1e-6);
}

/** Returns why files are part of no volume, each reason once. */
function reasonsOf(skipped: readonly Skipped[]): string {
  const counts = grouped(skipped, ({ reason }) => reason);
  const texts = Array.from(
    counts,
    ([reason, files]) => `${reason} (${files.length === 1 ? files[0]?.name : `${files.length} files`})`,
  );
  return listed(texts, '; ') || 'no files';
}
