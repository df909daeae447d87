// The images of a DICOM file, from its data set: what places, scales and identifies each (PS3.3).
import type { DataSet } from 'dicom-parser';
import type { Vec3 } from '../data.js';
import { numberOf, numbersOf, textOf } from './elements.js';
import { cross, dot } from './geometry.js';
import { FLOAT_PIXELS, type Header, pixelsOf } from './parser.js';
import { segmentsOf, wholeFractionOf } from './segments.js';
import type { Source } from './source.js';
import type { Frame, PixelFormat, Series, Skipped } from './types.js';

/** Most frames that are taken from one file. */
const MOST_FRAMES = 100_000;
/** Largest deviation of the two directions of an image from unit length and from a right angle. */
const SKEW = 1e-2;

/** Why a file has no image that could be part of a volume. */
class Unusable extends Error {}

/** An attribute of a frame: its tag, and the tag of the functional group that has it in multi-frame files. */
type Attribute = readonly [tag: string, group?: string];

const POSITION: Attribute = ['x00200032', 'x00209113'];
const ORIENTATION: Attribute = ['x00200037', 'x00209116'];
const PIXEL_SPACING: Attribute = ['x00280030', 'x00289110'];
const SLICE_SPACING: Attribute = ['x00180088', 'x00289110'];
const SLOPE: Attribute = ['x00281053', 'x00289145'];
const INTERCEPT: Attribute = ['x00281052', 'x00289145'];

/** Attributes that tell images at the same position apart, as numbers or as text; see `grouping.ts`. */
const MARKS: readonly (readonly [name: string, kind: 'number' | 'text' | 'time', ...Attribute])[] = [
  ['stack', 'text', 'x00209056', 'x00209111'],
  ['image type', 'text', 'x00080008'],
  ['frame type', 'text', 'x00089007', 'x00189226'],
  ['complex part', 'text', 'x00089208', 'x00189226'],
  ['echo time', 'number', 'x00180081'],
  ['echo time', 'number', 'x00189082', 'x00189114'],
  ['echo', 'number', 'x00180086'],
  ['b-value', 'number', 'x00189087', 'x00189117'],
  // Of Siemens, in files without the standard attribute.
  ['b-value', 'number', 'x0019100c'],
  ['flip angle', 'number', 'x00181314'],
  ['thickness', 'number', 'x00180050', 'x00289110'],
  ['inversion time', 'number', 'x00180082'],
  ['kVp', 'number', 'x00180060'],
  ['kernel', 'text', 'x00181210'],
  ['temporal position', 'number', 'x00200100'],
  ['temporal position', 'number', 'x00209128', 'x00209111'],
  ['trigger time', 'number', 'x00181060'],
  ['trigger time', 'number', 'x00209153', 'x00189118'],
  ['frame reference time', 'number', 'x00541300'],
  ['acquisition', 'number', 'x00200012'],
  ['acquisition time', 'text', 'x0008002a'],
  ['acquisition time', 'time', 'x00080032'],
  ['acquisition time', 'text', 'x00189074', 'x00209111'],
  ['content time', 'time', 'x00080033'],
  ['instance', 'number', 'x00200013'],
  ['temporal resolution', 'number', 'x00200110'],
];

/** Returns the images of a file, or why it has none that could be part of a volume. */
export function framesIn(file: Source, header: Header): Frame[] | Skipped {
  try {
    return frames(file, header);
  } catch (problem) {
    if (problem instanceof Unusable)
      return { name: file.name, reason: problem.message, series: textOf(header.data, 'x0020000e') };
    throw problem;
  }
}

/** Returns the images of a file; throws the reason if it has none. */
function frames(file: Source, header: Header): Frame[] {
  const { data, deflated } = header;
  if (data.elements.x00041220) throw new Unusable('an index of files (DICOMDIR)');
  const pixels = pixelsOf(data);
  if (!pixels) throw new Unusable('no image');
  if (/\bMOSAIC\b/.test(textOf(data, 'x00080008')))
    throw new Unusable('a mosaic of slices in one image, which is not taken apart');
  const format = formatOf(header, pixels.vr);
  const series = seriesOf(data, header.transferSyntax);
  const count = Math.max(1, Math.floor(numberOf(data, 'x00280008') ?? 1));
  if (count > MOST_FRAMES) throw new Unusable(`${count} images in one file; at most ${MOST_FRAMES} are read`);
  const common = { file, count, pixelsAt: pixels.dataOffset, deflated, format, series, uid: textOf(data, 'x00080018') };
  const dose = numberOf(data, 'x3004000e');
  return Array.from({ length: count }, (_, index) => {
    const at = new FrameAttributes(data, index);
    return {
      ...common,
      ...geometryOf(at, index, count),
      index,
      instance: numberOf(data, 'x00200013'),
      statedStep: at.numbers(SLICE_SPACING)[0],
      slope: dose ?? at.numbers(SLOPE)[0] ?? 1,
      intercept: at.numbers(INTERCEPT)[0] ?? 0,
      marks: marksOf(at),
      segment: at.integer(['x0062000b', 'x0062000a']),
    };
  });
}

/** The attributes of one frame: its own, those that all frames share, or those of the file. */
class FrameAttributes {
  readonly data: DataSet;
  readonly #groups: readonly (DataSet | undefined)[];

  constructor(data: DataSet, index: number) {
    this.data = data;
    const item = (tag: string, k: number) => data.elements[tag]?.items?.[k]?.dataSet;
    this.#groups = [item('x52009230', index), item('x52009229', 0)];
  }

  /** Returns the data set that has an attribute; undefined if none has it. */
  #owner([tag, group]: Attribute): DataSet | undefined {
    const inGroups = this.#groups.map((one) => group && one?.elements[group]?.items?.[0]?.dataSet);
    const owner = [...inGroups, this.data].find((one) => one && (one.elements[tag]?.length ?? 0) > 0);
    return owner || undefined;
  }

  numbers(attribute: Attribute): number[] {
    return numbersOf(this.#owner(attribute), attribute[0]);
  }

  text(attribute: Attribute): string {
    return textOf(this.#owner(attribute), attribute[0]);
  }

  integer(attribute: Attribute): number | undefined {
    return this.#owner(attribute)?.uint16(attribute[0]);
  }
}

/** Returns where a frame lies; throws the reason if the file does not say. */
function geometryOf(
  at: FrameAttributes,
  index: number,
  count: number,
): Pick<Frame, 'position' | 'along' | 'down' | 'spacing' | 'isChained'> {
  // Nuclear medicine has the place of the first frame in the description of the detector (PS3.3, C.8.4.11).
  const detector = at.data.elements.x00540022?.items?.[0]?.dataSet;
  const six = firstOf(at.numbers(ORIENTATION), numbersOf(detector, 'x00200037'));
  const start = firstOf(at.numbers(POSITION), numbersOf(detector, 'x00200032'));
  const between = at.numbers(PIXEL_SPACING);
  if (six.length < 6 || start.length < 3) throw new Unusable('an image without position and orientation');
  if (!(between.length >= 2 && between.every((size) => size > 0 && size < 1e6)))
    throw new Unusable('an image without pixel spacing');
  const [along, down] = directions(six);
  const normal = cross(along, down);
  const isPlaced = count === 1 || hasPosition(at.data, index);
  const offset = isPlaced ? 0 : offsetOf(at, index);
  const position = [0, 1, 2].map((k) => (start[k] ?? 0) + offset * (normal[k] ?? 0)) as Vec3;
  if (!position.every(Number.isFinite)) throw new Unusable('an image without position and orientation');
  const isChained = !isPlaced && at.data.elements.x3004000c === undefined;
  return { position, along, down, spacing: [between[1] ?? 1, between[0] ?? 1], isChained };
}

const firstOf = (...lists: number[][]) => lists.find(({ length }) => length > 0) ?? [];

/** Whether the file places each of its frames. */
const hasPosition = (data: DataSet, index: number) =>
  data.elements.x52009230?.items?.[index]?.dataSet?.elements.x00209113 !== undefined;

/**
 * Returns the distance of a frame from the first one along the normal: that of a grid of doses (PS3.3, C.8.8.3.2), or
 * multiples of the distance between slices. Throws the reason if the file states neither.
 */
function offsetOf(at: FrameAttributes, index: number): number {
  const offsets = numbersOf(at.data, 'x3004000c');
  const offset = offsets[index];
  // Either relative to the position of the image, or coordinates along the normal, which then begin with that position.
  if (offset !== undefined) return offset - (offsets[0] ?? 0);
  const others = pointersOf(at.data).filter((tag) => !SLICE_POINTERS.includes(tag));
  if (others.length > 0)
    throw new Unusable('images of several times, angles or windows, without positions of their own');
  const [step] = at.numbers(SLICE_SPACING);
  if (step === undefined || step === 0 || !Number.isFinite(step))
    throw new Unusable('several images without positions of their own');
  return index * step;
}

/** Returns the unit vectors of an orientation; throws the reason if they are none. */
function directions(six: number[]): [Vec3, Vec3] {
  const [a, b] = [six.slice(0, 3), six.slice(3, 6)] as [Vec3, Vec3];
  const lengths = [Math.hypot(...a), Math.hypot(...b)];
  const isRight = Math.abs(dot(a, b)) <= SKEW && lengths.every((length) => Math.abs(length - 1) <= SKEW);
  if (!isRight) throw new Unusable('an image whose orientation is not that of two perpendicular unit vectors');
  return [a.map((x) => x / (lengths[0] ?? 1)) as Vec3, b.map((x) => x / (lengths[1] ?? 1)) as Vec3];
}

/** Returns how voxels are stored; throws the reason if they are not single numbers. */
function formatOf({ data, transferSyntax }: Header, representation: string | undefined): PixelFormat {
  const photometric = textOf(data, 'x00280004');
  const samples = data.uint16('x00280002') ?? 1;
  if (samples !== 1 || /^(RGB|YBR|PALETTE|HSV|CMYK)/.test(photometric))
    throw new Unusable(`an image in colour (${photometric || `${samples} samples`}); accepted: one number per voxel`);
  const [rows = 0, columns = 0] = [data.uint16('x00280010'), data.uint16('x00280011')];
  if (rows === 0 || columns === 0) throw new Unusable('an image without rows or columns');
  const float = FLOAT_PIXELS.findIndex((tag) => data.elements[tag] !== undefined);
  const bitsAllocated = float >= 0 ? 32 * (float + 1) : (data.uint16('x00280100') ?? 16);
  if (![1, 8, 16, 32, 64].includes(bitsAllocated) || (bitsAllocated === 64 && float < 0))
    throw new Unusable(`${bitsAllocated} bits per voxel; accepted: 1, 8, 16, 32, and floats of 32 or 64`);
  const bitsStored = Math.min(data.uint16('x00280101') ?? bitsAllocated, bitsAllocated);
  const highBit = Math.min(data.uint16('x00280102') ?? bitsStored - 1, bitsAllocated - 1);
  const isSound = bitsStored > 0 && highBit >= bitsStored - 1;
  return {
    ...{ rows, columns, bitsAllocated, transferSyntax, float: float >= 0 },
    inWords: bitsAllocated === 8 && representation === 'OW',
    bitsStored: isSound ? bitsStored : bitsAllocated,
    highBit: isSound ? highBit : bitsAllocated - 1,
    signed: data.uint16('x00280103') === 1,
  };
}

/** Transfer syntaxes of JPEG, which loses something; decoders of others tell whether they do. */
const LOSSY = /^1\.2\.840\.10008\.1\.2\.4\.5[01]$/;

function seriesOf(data: DataSet, transferSyntax: string): Series {
  const padding = data.uint16('x00280103') === 1 ? data.int16('x00280120') : data.uint16('x00280120');
  const day = /^(\d{4})\.?(\d\d)\.?(\d\d)/.exec(textOf(data, 'x00080020') || textOf(data, 'x00080021'));
  return {
    uid: textOf(data, 'x0020000e'),
    origin: originOf(data),
    sopClass: textOf(data, 'x00080016'),
    number: numberOf(data, 'x00200011'),
    description: textOf(data, 'x0008103e') || textOf(data, 'x00181030') || textOf(data, 'x00081030'),
    modality: textOf(data, 'x00080060'),
    patient: textOf(data, 'x00100010').replace(/=.*$/, '').split('^').filter(Boolean).join(' '),
    date: day ? day.slice(1).join('-') : '',
    frameOfReference: textOf(data, 'x00200052'),
    isLocaliser: /LOCALI[SZ]ER|SCOUT/.test(textOf(data, 'x00080008')),
    inverted: textOf(data, 'x00280004') === 'MONOCHROME1',
    units: textOf(data, 'x00541001'),
    lossy: textOf(data, 'x00282110') === '01' || LOSSY.test(transferSyntax),
    hasTable: (data.elements.x00283000?.items?.length ?? 0) > 0 && numberOf(data, 'x00281053') === undefined,
    padding,
    segments: segmentsOf(data),
    wholeFraction: wholeFractionOf(data),
  };
}

/** Returns the date that belongs to a time, so that times after midnight are later; empty if there is none, or no time. */
function dateOf(at: FrameAttributes, [tag]: Attribute): string {
  const date = tag === 'x00080032' ? 'x00080022' : 'x00080023';
  return at.text([tag]) === '' ? '' : at.text([date]);
}

/** Attributes that count slices: vectors of slices of nuclear medicine (PS3.3, C.8.4.8), and offsets of grids of doses. */
const SLICE_POINTERS = ['00540080', '3004000c'];

/** Returns the tags of the attributes that the frames of a file are counted by (Frame Increment Pointer). */
function pointersOf(data: DataSet): string[] {
  const count = Math.floor((data.elements.x00280009?.length ?? 0) / 4);
  const hex = (k: number) => (data.uint16('x00280009', k) ?? 0).toString(16).padStart(4, '0');
  return Array.from({ length: count }, (_, k) => hex(2 * k) + hex(2 * k + 1));
}

/** Returns what distinguishes series, besides their identifiers, which may have been removed. */
function originOf(data: DataSet): string {
  const tags = ['x00100020', 'x00100010', 'x0020000d', 'x00200011'];
  const more = textOf(data, 'x0020000e') === '' ? ['x0008103e', 'x00080031'] : [];
  return JSON.stringify([...tags, ...more].map((tag) => textOf(data, tag)));
}

function marksOf(at: FrameAttributes): Record<string, string | number> {
  const marks: Record<string, string | number> = {};
  for (const [name, kind, ...attribute] of MARKS) {
    if (marks[name] !== undefined) continue;
    const value =
      kind === 'number'
        ? at.numbers(attribute)[0]
        : `${kind === 'time' ? dateOf(at, attribute) : ''}${at.text(attribute)}`;
    if (value !== undefined && value !== '') marks[name] = value;
  }
  return marks;
}
