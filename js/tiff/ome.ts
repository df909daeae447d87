// The description of an OME-TIFF.
import { positive, type Stated, secondsIn } from './lengths.js';
import { type Tag, tagsOf } from './xml.js';

/** Pages that an element `TiffData` places. */
export interface TiffData {
  /** Index of the first of the pages in their file. */
  ifd: number;
  /** Number of pages; undefined for all of the file. */
  count: number | undefined;
  /** First slice, channel and frame. */
  first: { Z: number; C: number; T: number };
  /** The file, if it is named. */
  file?: { uuid: string; name: string };
}

/** One image of a description. */
export interface OmeImage {
  name: string;
  /** Type of the samples, by its name. */
  type: string;
  /** Number of pixels, 0 if it is not stated; of slices, channels and frames. */
  sizes: { X: number; Y: number; Z: number; C: number; T: number };
  /** Slices (Z), channels (C) and frames (T), the fastest first. */
  order: string;
  axes: Stated[];
  frameSeconds: number | undefined;
  channels: string[];
  tiffData: TiffData[];
}

/** A description in OME's XML. */
export interface Ome {
  /** Identifier of the file. */
  uuid: string;
  images: OmeImage[];
  /** Name of the file that has the description, if it is not in this one. */
  elsewhere: string | undefined;
}

/** Returns whether a text is OME's XML. */
export const isOme = (text: string): boolean => /<(\w+:)?OME[\s>]/.test(text.slice(0, 10_000));

/** Parses OME's XML. */
export function parseOme(text: string): Ome {
  const ome: Ome = { uuid: '', images: [], elsewhere: undefined };
  for (const tag of tagsOf(text)) {
    if (tag.isEnd) continue;
    if (tag.name === 'OME') ome.uuid = tag.attribute('UUID') ?? '';
    else if (tag.name === 'BinaryOnly') ome.elsewhere = tag.attribute('MetadataFile') ?? '';
    else if (tag.name === 'Image') ome.images.push(imageOf(tag));
    else addTo(ome.images.at(-1), tag);
  }
  return ome;
}

const imageOf = (tag: Tag): OmeImage => ({
  name: tag.attribute('Name') ?? '',
  type: '',
  ...{ sizes: { X: 0, Y: 0, Z: 1, C: 1, T: 1 }, order: 'ZCT', axes: [], frameSeconds: undefined },
  ...{ channels: [], tiffData: [] },
});

function addTo(image: OmeImage | undefined, tag: Tag): void {
  if (!image) return;
  if (tag.name === 'Pixels') addPixels(image, tag);
  else if (tag.name === 'Channel') image.channels.push(tag.attribute('Name') ?? '');
  else if (tag.name === 'TiffData') image.tiffData.push(tiffDataOf(tag));
  else if (tag.name === 'UUID') {
    const last = image.tiffData.at(-1);
    if (last) last.file = { uuid: tag.text.trim(), name: tag.attribute('FileName') ?? '' };
  }
}

function addPixels(image: OmeImage, tag: Tag): void {
  const size = (name: string) => Math.max(1, Math.floor(positive(tag.attribute(name)) ?? 1));
  const pixels = (name: string) => positive(tag.attribute(name)) ?? 0;
  image.sizes = { X: pixels('SizeX'), Y: pixels('SizeY'), Z: size('SizeZ'), C: size('SizeC'), T: size('SizeT') };
  image.type = tag.attribute('Type') ?? '';
  const order = /^XY([ZCT]{3})$/.exec(tag.attribute('DimensionOrder') ?? '')?.[1];
  if (order && new Set(order).size === 3) image.order = order;
  image.axes = ['X', 'Y', 'Z'].map((axis) => ({
    size: positive(tag.attribute(`PhysicalSize${axis}`)),
    unit: tag.attribute(`PhysicalSize${axis}Unit`) ?? 'µm',
  }));
  const [increment, unit] = [positive(tag.attribute('TimeIncrement')), tag.attribute('TimeIncrementUnit') ?? 's'];
  const seconds = secondsIn(unit);
  image.frameSeconds = increment && seconds && increment * seconds;
}

function tiffDataOf(tag: Tag): TiffData {
  const index = (name: string) => {
    const value = Number(tag.attribute(name) ?? 0);
    return Number.isSafeInteger(value) && value >= 0 ? value : 0;
  };
  const count = tag.attribute('PlaneCount');
  // As of the specification: one page if the first is named, else all.
  const whole = tag.attribute('IFD') === undefined ? undefined : 1;
  return {
    ifd: index('IFD'),
    count: count === undefined ? whole : index('PlaneCount'),
    first: { Z: index('FirstZ'), C: index('FirstC'), T: index('FirstT') },
  };
}
