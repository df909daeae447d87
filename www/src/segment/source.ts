/** Opens volumes and label maps. Used by the worker only. */

import { type LengthUnit, Volume, type VolumeInit } from 'vesicle';
import { importVolume } from '../importers';
import { text } from '../texts';
import { groupFiles } from '../worker/file-groups';
import { Refusal } from '../worker/refusal';
import { readFiles } from '../worker/volumes';
import { labelHead, labelTooth } from './labelling';
import type { ImageSource, LabelArray, Labelling, NamedBytes, Vec3 } from './protocol';

/** Number of different values beyond which a volume is no label map. */
const MOST_LABELS = 65_536;
/** Largest distance in voxels between the corners of two grids that count as the same one. */
const TOLERANCE = 0.01;

/** A volume and its label map, in the same grid. */
export interface OpenVolume {
  volume: Volume;
  labels: LabelArray;
  labelFile: string | undefined;
  /** Length of a world unit, if the volume's file states it. */
  unit: LengthUnit | undefined;
}

/**
 * Opens a volume with its label map, which is that of a second file, computed, or empty. With several frames, the first
 * one of the label map is used.
 */
export async function openImage({ files, labelling }: ImageSource): Promise<OpenVolume> {
  const [image, map] = await readBoth(files);
  const volume = new Volume(image.init);
  try {
    const labels = map ? labelsOf(map.init, volume) : computed(volume, labelling);
    return { volume, labels, labelFile: map?.name, unit: image.init.unit };
  } catch (error) {
    volume.free();
    throw error;
  }
}

/** Reads a label map; throws if it is none, or does not have the grid of `volume`. */
export async function openLabels(files: NamedBytes[], volume: Volume): Promise<LabelArray> {
  const groups = groupFiles(files);
  if (groups.length !== 1) throw new Refusal('bad-file', text('segment.oneLabelMap'));
  return labelsOf(await readFiles(groups[0] ?? []), volume);
}

/** Returns the label map as a volume in the geometry of another one. */
export function mapLike(volume: Volume, data: LabelArray, unit: LengthUnit | undefined): Volume {
  const { dims, affine, space } = volume;
  return new Volume({ data, dims, affine, space, ...(unit && { unit }) });
}

interface NamedVolume {
  name: string;
  init: VolumeInit;
}

/** Reads the volume and, if the files contain two, the label map. */
async function readBoth(files: NamedBytes[]): Promise<[NamedVolume, NamedVolume?]> {
  const foreign = await importVolume(files);
  if (foreign) return [{ name: '', init: foreign }];
  const groups = groupFiles(files);
  if (groups.length > 2) throw new Refusal('bad-file', text('segment.atMostTwo', { count: groups.length }));
  const read: NamedVolume[] = [];
  for (const group of groups) read.push({ name: group[0]?.name ?? '', init: await readFiles(group) });
  const [first, second] = read;
  if (!first) throw new Refusal('bad-file', text('files.noFile'));
  if (!second) return [first];
  return isMap(first, second) ? [second, first] : [first, second];
}

/** Whether the first of two volumes is the label map: by its name, or else because it has fewer different values. */
function isMap(one: NamedVolume, other: NamedVolume): boolean {
  const isNamed = ({ name }: NamedVolume) => /label|seg|mask|annot/i.test(name);
  if (isNamed(one) !== isNamed(other)) return isNamed(one);
  return valuesIn(one) < valuesIn(other);
}

/** Returns the number of different values of a volume, or {@link MOST_LABELS} if there are more. */
function valuesIn({ init: { data } }: NamedVolume): number {
  const found = new Set<number>();
  for (const value of data) {
    found.add(value);
    if (found.size > MOST_LABELS) break;
  }
  return found.size;
}

/** Returns the voxels of a label map, in the type of its file unless this has slope and intercept. */
function labelsOf(init: VolumeInit, volume: Volume): LabelArray {
  const map = new Volume(init);
  try {
    requireSameGrid(map, volume);
    // Says what is wrong with voxels that are no labels.
    map.labels();
    const count = map.dims.reduce((product, size) => product * size, 1);
    if ((init.slope ?? 1) === 1 && (init.intercept ?? 0) === 0) return init.data.slice(0, count) as LabelArray;
    return Int32Array.from(map.intensities());
  } finally {
    map.free();
  }
}

function requireSameGrid(map: Volume, volume: Volume): void {
  const sizes = ({ dims }: Volume) => dims.join(' × ');
  if (sizes(map) !== sizes(volume))
    throw new Refusal('invalid-argument', text('segment.otherSize', { map: sizes(map), volume: sizes(volume) }));
  const unit = Math.min(...volume.spacing);
  const [ours, theirs] = [corners(volume), corners(map)];
  const off = Math.max(...ours.map((x, i) => Math.abs(x - (theirs[i] ?? 0)))) / unit;
  if (off > TOLERANCE)
    throw new Refusal('invalid-argument', text('segment.otherPosition', { voxels: off.toPrecision(2) }));
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

function computed(volume: Volume, labelling: Labelling | undefined): LabelArray {
  const { dims } = volume;
  if (labelling) return LABELLINGS[labelling](volume.intensities(), dims);
  return new Uint8Array(dims[0] * dims[1] * dims[2]);
}
