/** Opens volumes and label maps. Used by the worker only. */
import { type LengthUnit, Volume, type VolumeInit } from 'vesicle';
import { VesicleError } from 'vesicle/channel';
import { groupFiles } from '../../engine/file-groups';
import type { KnownLabel, LabelArray } from '../../engine/labels';
import { labelsLike } from '../../engine/likeness';
import type { Intensities } from '../../engine/protocol';
import { labelsIn } from '../../engine/slicer';
import { tooManyLabels } from '../../engine/small-files';
import { checkSmallImage, displayed, readFiles } from '../../engine/volumes';
import { merged, type Warning } from '../../engine/warnings';
import { invert, toWorld } from '../../scene/anatomy';
import { text } from '../../texts';
import { labelHead, labelTooth } from './labelling';
import type { ImageSource, Labelling, NamedBytes, Vec3 } from './protocol';

/** Number of different values beyond which a volume is no label map. */
const MOST_LABELS = 65_536;
/** Largest number of labels that are opened: each has a row in the list, and a surface that is drawn by itself. */
const MOST_OPENED = 4000;
/** Largest distance in voxels between the corners of two grids that count as the same one. */
const TOLERANCE = 0.01;
/** Largest distance in voxels, along an axis, between the voxels of two grids that count as the same. */
const SNAP = 0.1;

/** A label map in the grid of a volume. */
export interface OpenMap {
  voxels: LabelArray;
  /** Names and colours of labels that its file has. */
  known: KnownLabel[];
  /** Name of its file, with a note if there is something to say of it; undefined if it has none. */
  file: string | undefined;
  /** Warnings about the map. */
  warnings: readonly Warning[];
}

/** A volume and its label map, in the same grid. */
export interface OpenVolume {
  volume: Volume;
  map: OpenMap;
  /** Length of a world unit, if the volume's file states it. */
  unit: LengthUnit | undefined;
  /** Number of labels, if the volume looks like a label map, which it then is, too, unless it has one label; else 0. */
  looksLike: number;
  /** The voxels as they were read, where these are the intensities that the page displays. */
  voxels: Intensities | undefined;
}

/**
 * Opens a volume with its label map, which is that of a second file, computed, or empty. With several frames, the first
 * one of the label map is used. A DICOM segmentation alone is both.
 */
export async function openImage({ files, labelling }: ImageSource, isSmall = false): Promise<OpenVolume> {
  const { image, map, looksLike } = await readBoth(files);
  if (isSmall) checkSmallImage(image.init);
  const volume = new Volume(image.init);
  try {
    const labels = map
      ? labelsOf(map, volume, { isBoth: map === image, isSmall })
      : { ...computed(volume, labelling), warnings: nameWarnings(image) };
    const voxels = volume.frames === 1 ? displayed(image.init, volume.range) : undefined;
    return { volume, map: labels, unit: image.init.unit, looksLike, voxels };
  } catch (error) {
    volume.free();
    throw error;
  }
}

/** Reads a label map; throws if it is none, or does not have the grid of `volume`. */
export async function openLabels(files: NamedBytes[], volume: Volume, isSmall: boolean): Promise<OpenMap> {
  const groups = groupFiles(files);
  const [first] = groups;
  if (!first || groups.length !== 1) throw new VesicleError('bad-file', text('segment.oneLabelMap'));
  return labelsOf(await readMap(first), volume, { isBoth: false, isSmall });
}

/** Returns the label map as a volume in the geometry of another one, with the warnings of both. */
export function mapLike(
  { volume, unit }: Pick<OpenVolume, 'volume' | 'unit'>,
  data: LabelArray,
  own: readonly Warning[],
): Volume {
  const { dims, affine, space } = volume;
  return new Volume({ data, dims, affine, space, ...(unit && { unit }), warnings: merged(volume.warnings, own) });
}

interface NamedVolume {
  name: string;
  init: VolumeInit;
  known: KnownLabel[];
  /** Whether the file is one of segments, which may be cropped to them. */
  isCropped: boolean;
}

interface Both extends Pick<OpenVolume, 'looksLike'> {
  image: NamedVolume;
  map: NamedVolume | undefined;
}

/** Reads the volume and, if the files contain two, the label map; one that names its labels, or looks like a map, is both. */
async function readBoth(files: NamedBytes[]): Promise<Both> {
  const groups = groupFiles(files);
  if (groups.length > 2) throw new VesicleError('bad-file', text('segment.atMostTwo', { count: groups.length }));
  const [first, second] = await Promise.all(groups.map(readMap));
  if (!first) throw new VesicleError('bad-file', text('files.noFile'));
  if (!second) return alone(first);
  const [map, image] = isMap(first, second) ? [first, second] : [second, first];
  return { image, map, looksLike: 0 };
}

function alone(image: NamedVolume): Both {
  if (image.known.length > 0) return { image, map: image, looksLike: 0 };
  const looksLike = labelsLike(image.init.data, 1);
  // Unless its name tells, a mask may as well be an image of two intensities.
  if (looksLike === 1 && isNamed(image)) return { image, map: image, looksLike: 0 };
  return { image, map: looksLike > 1 ? image : undefined, looksLike };
}

/** Returns a warning about an image whose name says that it is a label map; none about others. */
function nameWarnings(image: NamedVolume): Warning[] {
  if (!isNamed(image) || !hasIntegers(image)) return [];
  const { name } = image;
  return [{ code: 'reader', text: text('segment.openedAsImage', { name, button: text('segment.openMap') }) }];
}

/** Reads a label map, or what may be one, with what its file says of the labels. */
async function readMap(group: NamedBytes[]): Promise<NamedVolume> {
  const known = group.flatMap(({ bytes }) => labelsIn(bytes));
  return { name: group[0]?.name ?? '', init: await readFiles(group), known, isCropped: known.length > 0 };
}

/**
 * Whether the first of two volumes is the label map: because it names its labels, by its name, or else because it alone has
 * integers, or fewer different values.
 */
function isMap(one: NamedVolume, other: NamedVolume): boolean {
  if (isNamed(one) !== isNamed(other)) return isNamed(one);
  if (hasIntegers(one) !== hasIntegers(other)) return hasIntegers(one);
  return valuesIn(one) < valuesIn(other);
}

/** Whether a volume names its labels, or has the name of a label map. */
const isNamed = ({ name, known }: NamedVolume) => known.length > 0 || /label|seg|mask|annot/i.test(name);

const hasIntegers = ({ init: { data } }: NamedVolume) =>
  !(data instanceof Float32Array || data instanceof Float64Array) || data.every(Number.isInteger);

/** Returns the number of different values of a volume, or {@link MOST_LABELS} if there are more. */
function valuesIn({ init: { data } }: NamedVolume): number {
  const found = new Set<number>();
  for (const value of data) {
    found.add(value);
    if (found.size > MOST_LABELS) break;
  }
  return found.size;
}

/**
 * Returns the label map in the grid of a volume, in the type of its file unless this has slope and intercept; `isBoth` if
 * the volume was made of it.
 */
function labelsOf(
  { name, init, known, isCropped }: NamedVolume,
  volume: Volume,
  { isBoth, isSmall }: { isBoth: boolean; isSmall: boolean },
): OpenMap {
  const map = isBoth ? volume : new Volume(init);
  try {
    if (!isCropped) requireSameGrid(map, volume);
    // Says what is wrong with voxels that are no labels.
    // Those that are described are listed, too.
    const labels = new Set([...map.labels(), ...known].map(({ value }) => value)).size;
    const refusal = isSmall && tooManyLabels(labels);
    if (refusal) throw new VesicleError('too-large', refusal);
    if (labels > MOST_OPENED)
      throw new VesicleError('too-large', text('segment.tooMany', { labels, most: MOST_OPENED }));
    const count = map.dims.reduce((product, size) => product * size, 1);
    const isPlain = (init.slope ?? 1) === 1 && (init.intercept ?? 0) === 0;
    const voxels = isPlain ? (init.data.slice(0, count) as LabelArray) : Int32Array.from(map.intensities());
    return { voxels: isCropped ? placed(map, voxels, volume) : voxels, known, file: name, warnings: map.warnings };
  } finally {
    if (!isBoth) map.free();
  }
}

/**
 * Returns the labels of a map whose voxels are voxels of a volume, such as a cropped one, in the grid of the volume;
 * axes may have another order or direction.
 */
function placed(map: Volume, labels: LabelArray, volume: Volume): LabelArray {
  const inverse = invert(volume.affine);
  const sign = map.space === volume.space ? 1 : -1;
  const indexOf = (at: Vec3) => {
    const [x, y, z] = toWorld(map.affine, at);
    return toWorld(inverse, [sign * x, sign * y, z]);
  };
  const first = indexOf([0, 0, 0]);
  const start = first.map(Math.round) as Vec3;
  const steps = (
    [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ] as Vec3[]
  ).map((along) => indexOf(along).map((x, axis) => Math.round(x - (first[axis] ?? 0))));
  const target = ([x, y, z]: Vec3) =>
    start.map((from, axis) => [x, y, z].reduce((sum, n, k) => sum + n * (steps[k]?.[axis] ?? 0), from)) as Vec3;
  for (let corner = 0; corner < 8; corner++) {
    const at = map.dims.map((size, axis) => ((corner >> axis) & 1) * (size - 1)) as Vec3;
    const exact = indexOf(at);
    if (target(at).some((x, axis) => !(Math.abs(x - (exact[axis] ?? 0)) <= SNAP)) || !isPermutation(steps))
      throw new VesicleError('invalid-argument', text('segment.otherGrid'));
  }
  return copied(labels, map.dims, volume.dims, target);
}

/** Whether each row and each column has a single entry, 1 or −1. */
function isPermutation(steps: number[][]): boolean {
  const lengths = [...steps, ...[0, 1, 2].map((axis) => steps.map((step) => step[axis] ?? 0))];
  return lengths.every((entries) => entries.reduce((sum, x) => sum + Math.abs(x), 0) === 1);
}

/** Copies labels to a larger grid; `target` returns the index there of a voxel. */
function copied(labels: LabelArray, dims: Vec3, larger: Vec3, target: (at: Vec3) => Vec3): LabelArray {
  const out = new (labels.constructor as new (length: number) => LabelArray)(larger[0] * larger[1] * larger[2]);
  for (let i = 0; i < labels.length; i++) {
    const label = labels[i] ?? 0;
    if (label === 0) continue;
    const row = Math.floor(i / dims[0]);
    const at = target([i - row * dims[0], row % dims[1], Math.floor(row / dims[1])]);
    if (at.some((x, axis) => x < 0 || x >= (larger[axis] ?? 0)))
      throw new VesicleError('invalid-argument', text('segment.outside'));
    out[(at[2] * larger[1] + at[1]) * larger[0] + at[0]] = label;
  }
  return out;
}

function requireSameGrid(map: Volume, volume: Volume): void {
  const sizes = ({ dims }: Volume) => dims.join(' × ');
  if (sizes(map) !== sizes(volume))
    throw new VesicleError('invalid-argument', text('segment.otherSize', { map: sizes(map), volume: sizes(volume) }));
  const unit = Math.min(...volume.spacing);
  const [ours, theirs] = [corners(volume), corners(map)];
  const off = Math.max(...ours.map((x, i) => Math.abs(x - (theirs[i] ?? 0)))) / unit;
  if (off > TOLERANCE)
    throw new VesicleError('invalid-argument', text('segment.otherPosition', { voxels: off.toPrecision(2) }));
}

/** Returns the positions of the eight corners of a grid in RAS space, packed xyz. */
function corners({ dims, affine, space }: Volume): number[] {
  const signs = space === 'LPS' ? [-1, -1, 1] : [1, 1, 1];
  return [0, 1, 2, 3, 4, 5, 6, 7].flatMap((corner) =>
    signs.map((sign, row) => {
      const along = (axis: 0 | 1 | 2) => (affine[4 * axis + row] ?? 0) * ((corner >> axis) & 1) * (dims[axis] - 1);
      return sign * (along(0) + along(1) + along(2) + (affine[12 + row] ?? 0));
    }),
  );
}

const LABELLINGS: Record<Labelling, (intensities: Float32Array, dims: Vec3) => Uint8Array> = {
  tooth: labelTooth,
  head: labelHead,
};

/** Returns the label map of a volume without one: computed from its intensities, or empty. */
function computed(volume: Volume, labelling: Labelling | undefined): Omit<OpenMap, 'warnings'> {
  const { dims } = volume;
  const voxels = labelling
    ? LABELLINGS[labelling](volume.intensities(), dims)
    : new Uint8Array(dims[0] * dims[1] * dims[2]);
  return { voxels, known: [], file: undefined };
}
