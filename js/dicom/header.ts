// The images of a DICOM file, from its data set: what places, scales and identifies each (PS3.3).
import type { DataSet, Element } from 'dicom-parser';
import type { Vec3 } from '../data.js';
import { shortened } from '../short-text.js';
import { integerOf, lengthOf, numberOf, numbersOf, textOf } from './elements.js';
import { badDicom } from './error.js';
import { cross, dot } from './geometry.js';
import { FLOAT_PIXELS, type Header, PLAIN, pixelsOf } from './parser.js';
import { segmentsOf, wholeFractionOf } from './segments.js';
import type { Source } from './source.js';
import type { Frame, PixelFormat, Series, Skipped } from './types.js';

/** Most frames that are taken from one file. */
const MOST_FRAMES = 100_000;
/** Largest deviation of the two directions of an image from unit length and from a right angle. */
const SKEW = 1e-2;
/** Largest coordinate: about that of single precision, in which volumes lie. */
const FARTHEST = 1e30;

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
/** Factor of stored values in grids of doses. */
const DOSE: Attribute = ['x3004000e'];

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
  const common = commonOf(file, header);
  const { count } = common;
  const known = new FileAttributes(header.data);
  // There may be very many frames without anything of their own.
  let alike: Described | undefined;
  const frame = (index: number): Frame => {
    const own = known.ownOf(index);
    if (!own) alike ??= describedBy(known);
    return placed(known, own ? describedBy(known, own) : (alike as Described), own, index, common);
  };
  if (count > 1) {
    // Why frames have no place is to be said before anything else.
    frame(1);
    checkPixels(common);
  }
  return Array.from({ length: count }, (_, index) => frame(index));
}

/** Returns the attributes that all frames of a file share; throws the reason if it has no frames that can be read. */
function commonOf(file: Source, header: Header): Common {
  const { data, deflated, transferSyntax } = header;
  if (data.elements.x00041220) throw new Unusable('an index of files (DICOMDIR)');
  const pixels = pixelsOf(data);
  if (!pixels) throw new Unusable('no image');
  if (/\bMOSAIC\b/.test(textOf(data, 'x00080008')))
    throw new Unusable('a mosaic of slices in one image, which is not taken apart');
  const count = Math.max(1, Math.floor(numberOf(data, 'x00280008') ?? 1));
  if (count > MOST_FRAMES) throw new Unusable(`${count} images in one file; at most ${MOST_FRAMES} are read`);
  return {
    ...{ file, count, deflated, pixelsAt: pixels.dataOffset, pixelsEnd: endOf(pixels, header, file) },
    ...{ format: formatOf(header, pixels.vr), series: seriesOf(data, transferSyntax) },
    ...{ uid: textOf(data, 'x00080018'), instance: numberOf(data, 'x00200013') },
  };
}

/** Returns where the value of pixel data ends, in a file that may be cut off. */
function endOf({ dataOffset, length, hadUndefinedLength }: Element, { data, deflated }: Header, file: Source): number {
  const end = deflated ? data.byteArray.length : file.size;
  return hadUndefinedLength ? end : Math.min(dataOffset + length, end);
}

/** Bytes before the compressed data of a frame: a tag, and a length. */
const FRAGMENT_HEAD = 8;

/** Throws `bad-file` if a file cannot have as many frames as it states. */
function checkPixels({ file, count, format, pixelsAt, pixelsEnd }: Common): void {
  const { rows, columns, bitsAllocated, transferSyntax } = format;
  const each = PLAIN.includes(transferSyntax) ? (rows * columns * bitsAllocated) / 8 : FRAGMENT_HEAD;
  const [needed, found] = [Math.ceil(count * each), Math.max(0, pixelsEnd - pixelsAt)];
  if (needed > found) throw badDicom(file.name, `pixel data: ${count} images need ${needed} bytes, it has ${found}`);
}

/** The attributes of a file that all its frames share. */
class FileAttributes {
  readonly data: DataSet;
  readonly #items: readonly Element[];
  readonly #shared: DataSet | undefined;
  /** Values that each frame needs, which are read once. */
  readonly #numbers = new Map<string, number[]>();
  readonly #texts = new Map<string, string>();

  constructor(data: DataSet) {
    this.data = data;
    this.#items = data.elements.x52009230?.items ?? [];
    this.#shared = data.elements.x52009229?.items?.[0]?.dataSet;
  }

  /** Returns the functional groups of a frame, if it has some of its own. */
  ownOf(index: number): DataSet | undefined {
    return this.#items[index]?.dataSet;
  }

  /** Returns the data set of a frame's own that has an attribute. */
  #own([tag, group]: Attribute, own: DataSet | undefined): DataSet | undefined {
    const one = group && own?.elements[group]?.items?.[0]?.dataSet;
    return one && (one.elements[tag]?.length ?? 0) > 0 ? one : undefined;
  }

  /** Returns the data set that has an attribute for all frames. */
  #common(attribute: Attribute): DataSet | undefined {
    const isOfFile = (this.data.elements[attribute[0]]?.length ?? 0) > 0;
    return this.#own(attribute, this.#shared) ?? (isOfFile ? this.data : undefined);
  }

  numbers(attribute: Attribute, own?: DataSet): number[] {
    const data = this.#own(attribute, own);
    if (data) return numbersOf(data, attribute[0]);
    return remembered(this.#numbers, attribute, () => numbersOf(this.#common(attribute), attribute[0]));
  }

  text(attribute: Attribute, own?: DataSet): string {
    const data = this.#own(attribute, own);
    if (data) return textOf(data, attribute[0], this.data);
    return remembered(this.#texts, attribute, () => textOf(this.#common(attribute), attribute[0], this.data));
  }

  integer(attribute: Attribute, own?: DataSet): number | undefined {
    return integerOf(this.#own(attribute, own) ?? this.#common(attribute), attribute[0]);
  }

  /** Distances of the frames along the normal in a grid of doses (PS3.3, C.8.8.3.2). */
  get offsets(): number[] {
    return this.numbers(['x3004000c']);
  }

  /** Whether frames are counted by something else than slices. */
  get isOfOthers(): boolean {
    this.#isOfOthers ??= pointersOf(this.data).some((tag) => !SLICE_POINTERS.includes(tag));
    return this.#isOfOthers;
  }

  #isOfOthers: boolean | undefined;
}

/** Returns the value of an attribute, which is read once. */
function remembered<Value>(known: Map<string, Value>, [tag, group = '']: Attribute, read: () => Value): Value {
  const key = group + tag;
  const value = known.get(key) ?? read();
  known.set(key, value);
  return value;
}

/** Place and scale of a frame, before it is counted. */
interface Described extends Pick<Frame, 'along' | 'down' | 'spacing' | 'slope' | 'intercept' | 'marks'> {
  /** Position of the frame, or of the first one. */
  start: number[];
  normal: Vec3;
  statedStep: number | undefined;
  segment: number | undefined;
}

/** Returns place and scale of a frame with groups of its own, or of all that have none; throws the reason if it has no place. */
function describedBy(known: FileAttributes, own?: DataSet): Described {
  // Nuclear medicine has the place of the first frame in the description of the detector (PS3.3, C.8.4.11).
  const detector = known.data.elements.x00540022?.items?.[0]?.dataSet;
  const six = firstOf(known.numbers(ORIENTATION, own), numbersOf(detector, 'x00200037'));
  const start = firstOf(known.numbers(POSITION, own), numbersOf(detector, 'x00200032'));
  const between = known.numbers(PIXEL_SPACING, own);
  if (six.length < 6 || start.length < 3) throw new Unusable('an image without position and orientation');
  if (!(between.length >= 2 && between.every((size) => size > 0 && size < 1e6)))
    throw new Unusable('an image without pixel spacing');
  const [along, down] = directions(six);
  return {
    ...{ start, along, down, normal: cross(along, down), spacing: [between[1] ?? 1, between[0] ?? 1] },
    statedStep: known.numbers(SLICE_SPACING, own)[0],
    slope: known.numbers(DOSE)[0] ?? known.numbers(SLOPE, own)[0] ?? 1,
    intercept: known.numbers(INTERCEPT, own)[0] ?? 0,
    marks: marksOf(known, own),
    segment: known.integer(['x0062000b', 'x0062000a'], own),
  };
}

/** Attributes that all frames of a file share. */
type Common = Omit<Frame, keyof Described | 'position' | 'isChained' | 'index'>;

/** Returns a frame at its place; throws the reason if the file does not say where that is. */
function placed(known: FileAttributes, of: Described, own: DataSet | undefined, index: number, common: Common): Frame {
  const { file, count, pixelsAt, pixelsEnd, deflated, format, series, uid, instance } = common;
  const { along, down, spacing, slope, intercept, statedStep, marks, segment } = of;
  const isPlaced = count === 1 || own?.elements.x00209113 !== undefined;
  const isChained = !isPlaced && known.data.elements.x3004000c === undefined;
  const position = positionAt(of, isPlaced ? 0 : offsetOf(known, of, index));
  // One by one, since objects that others are spread into take several times the memory and time.
  // biome-ignore format: a line for each group of attributes
  return {
    file, index, count, pixelsAt, pixelsEnd, deflated, format, series, uid, instance,
    position, along, down, spacing, slope, intercept, statedStep, marks, isChained, segment,
  };
}

/** Returns the position at a distance along the normal; throws if it is beyond the coordinates of volumes. */
function positionAt({ start, normal }: Described, offset: number): Vec3 {
  const [x = 0, y = 0, z = 0] = start;
  const position: Vec3 = [x + offset * normal[0], y + offset * normal[1], z + offset * normal[2]];
  if (position.every((coordinate) => Math.abs(coordinate) <= FARTHEST)) return position;
  throw new Unusable('an image without position and orientation');
}

const firstOf = (...lists: number[][]) => lists.find(({ length }) => length > 0) ?? [];

/**
 * Returns the distance of a frame from the first one along the normal: that of a grid of doses, or multiples of the
 * distance between slices. Throws the reason if the file states neither.
 */
function offsetOf(known: FileAttributes, { statedStep }: Described, index: number): number {
  const { offsets } = known;
  const offset = offsets[index];
  // Either relative to the position of the image, or coordinates along the normal, which then begin with that position.
  if (offset !== undefined) return offset - (offsets[0] ?? 0);
  if (known.isOfOthers)
    throw new Unusable('images of several times, angles or windows, without positions of their own');
  if (statedStep === undefined || statedStep === 0) throw new Unusable('several images without positions of their own');
  return index * statedStep;
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
  const samples = integerOf(data, 'x00280002') ?? 1;
  if (samples !== 1 || /^(RGB|YBR|PALETTE|HSV|CMYK)/.test(photometric))
    throw new Unusable(
      `an image in colour (${shortened(photometric, 20) || `${samples} samples`}); accepted: one number per voxel`,
    );
  const [rows = 0, columns = 0] = [integerOf(data, 'x00280010'), integerOf(data, 'x00280011')];
  if (rows === 0 || columns === 0) throw new Unusable('an image without rows or columns');
  const float = FLOAT_PIXELS.findIndex((tag) => data.elements[tag] !== undefined);
  const bitsAllocated = float >= 0 ? 32 * (float + 1) : (integerOf(data, 'x00280100') ?? 16);
  if (![1, 8, 16, 32, 64].includes(bitsAllocated) || (bitsAllocated === 64 && float < 0))
    throw new Unusable(`${bitsAllocated} bits per voxel; accepted: 1, 8, 16, 32, and floats of 32 or 64`);
  const bitsStored = Math.min(integerOf(data, 'x00280101') ?? bitsAllocated, bitsAllocated);
  const highBit = Math.min(integerOf(data, 'x00280102') ?? bitsStored - 1, bitsAllocated - 1);
  const isSound = bitsStored > 0 && highBit >= bitsStored - 1;
  return {
    ...{ rows, columns, bitsAllocated, transferSyntax, float: float >= 0 },
    inWords: bitsAllocated === 8 && representation === 'OW',
    bitsStored: isSound ? bitsStored : bitsAllocated,
    highBit: isSound ? highBit : bitsAllocated - 1,
    signed: integerOf(data, 'x00280103') === 1,
  };
}

/** Transfer syntaxes of JPEG, which loses something; decoders of others tell whether they do. */
const LOSSY = /^1\.2\.840\.10008\.1\.2\.4\.5[01]$/;

function seriesOf(data: DataSet, transferSyntax: string): Series {
  const padding = integerOf(data, 'x00280120');
  const day = /^(\d{4})\.?(\d\d)\.?(\d\d)/.exec(textOf(data, 'x00080020') || textOf(data, 'x00080021'));
  return {
    uid: textOf(data, 'x0020000e'),
    origin: originOf(data),
    sopClass: textOf(data, 'x00080016'),
    number: numberOf(data, 'x00200011'),
    description: shortened(textOf(data, 'x0008103e') || textOf(data, 'x00181030') || textOf(data, 'x00081030')),
    modality: shortened(textOf(data, 'x00080060')),
    patient: patientOf(data),
    date: day ? day.slice(1).join('-') : '',
    frameOfReference: textOf(data, 'x00200052'),
    isLocaliser: /LOCALI[SZ]ER|SCOUT/.test(textOf(data, 'x00080008')),
    inverted: textOf(data, 'x00280004') === 'MONOCHROME1',
    units: shortened(textOf(data, 'x00541001')),
    lossy: textOf(data, 'x00282110') === '01' || LOSSY.test(transferSyntax),
    hasTable: (data.elements.x00283000?.items?.length ?? 0) > 0 && numberOf(data, 'x00281053') === undefined,
    padding:
      padding !== undefined && padding > 32_767 && integerOf(data, 'x00280103') === 1 ? padding - 65_536 : padding,
    segments: segmentsOf(data),
    wholeFraction: wholeFractionOf(data),
  };
}

/** Returns the name of the patient in words: of three ways in which it may be written, the first. */
function patientOf(data: DataSet): string {
  const [alphabetic = ''] = textOf(data, 'x00100010').split('=', 1);
  return shortened(alphabetic.split('^').filter(Boolean).join(' '));
}

/** Returns the date that belongs to a time, so that times after midnight are later; empty if there is none, or no time. */
function dateOf(known: FileAttributes, [tag]: Attribute): string {
  const date = tag === 'x00080032' ? 'x00080022' : 'x00080023';
  return known.text([tag]) === '' ? '' : known.text([date]);
}

/** Attributes that count slices: vectors of slices of nuclear medicine (PS3.3, C.8.4.8), and offsets of grids of doses. */
const SLICE_POINTERS = ['00540080', '3004000c'];

/** Returns the tags of the attributes that the frames of a file are counted by (Frame Increment Pointer). */
function pointersOf(data: DataSet): string[] {
  const element = data.elements.x00280009;
  const count = element && !element.items ? Math.floor(lengthOf(data, element) / 4) : 0;
  const hex = (k: number) => (data.uint16('x00280009', k) ?? 0).toString(16).padStart(4, '0');
  return Array.from({ length: count }, (_, k) => hex(2 * k) + hex(2 * k + 1));
}

/** Returns what distinguishes series, besides their identifiers, which may have been removed. */
function originOf(data: DataSet): string {
  const tags = ['x00100020', 'x00100010', 'x0020000d', 'x00200011'];
  const more = textOf(data, 'x0020000e') === '' ? ['x0008103e', 'x00080031'] : [];
  return JSON.stringify([...tags, ...more].map((tag) => textOf(data, tag)));
}

function marksOf(known: FileAttributes, own: DataSet | undefined): Record<string, string | number> {
  const marks: Record<string, string | number> = {};
  for (const [name, kind, ...attribute] of MARKS) {
    if (marks[name] !== undefined) continue;
    const value =
      kind === 'number'
        ? known.numbers(attribute, own)[0]
        : `${kind === 'time' ? dateOf(known, attribute) : ''}${known.text(attribute, own)}`;
    if (value !== undefined && value !== '') marks[name] = value;
  }
  return marks;
}
