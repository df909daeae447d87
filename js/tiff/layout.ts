// Which image of which page is which slice.
import type { LengthUnit, Vec3 } from '../data.js';
import type { Pause } from '../pause.js';
import { blocksOf, pageBytes } from './blocks.js';
import { type Page, TAG } from './directory.js';
import { badTiff } from './error.js';
import { type Format, formatOf, PHOTOMETRIC, sizeOf } from './format.js';
import { type ImageJ, isImageJ, parseImageJ } from './imagej.js';
import { type Stated, spacingOf } from './lengths.js';
import { type Part, type Plane, WEIGHTS } from './planes.js';
import type { Source } from './source.js';

/** A file and its pages. */
export interface OpenFile {
  source: Source;
  pages: Page[];
  /** Description in the first page, or the whole file, if that is not a TIFF. */
  text: string;
}

/** A channel of a stack. */
export interface Channel {
  name: string;
  /** Returns a slice of a frame. */
  planeAt(slice: number, frame: number): Plane;
  /** Why the channel cannot be read. */
  missing?: string;
}

/** A stack of one or several files. */
export interface Layout {
  channels: Channel[];
  slices: number;
  frames: number;
  spacing: Vec3;
  unit?: LengthUnit | undefined;
  frameSeconds?: number | undefined;
  calibration?: { slope: number; intercept: number } | undefined;
  warnings: string[];
  /** Facts that do not affect the voxels. */
  remarks?: string[];
}

/** Numbers of slices, channels and frames. */
export type Sizes = Record<'Z' | 'C' | 'T', number>;

/** The parts of each page that are a slice each. */
export interface Components {
  parts: { name: string; part: Part }[];
  warnings: string[];
}

const product = ({ Z, C, T }: Sizes) => Z * C * T;

const sampleParts = (count: number) =>
  Array.from({ length: count }, (_, k) => ({ name: `(sample ${k + 1})`, part: k }));

/** Returns what of a page is read as a slice of a channel: a sample, or the luminance of colours. */
export async function componentsOf(page: Page, format: Format): Promise<Components> {
  const { samples, photometric, compression } = format;
  const { rgb, yCbCr, palette, whiteIsZero, blackIsZero, mask } = PHOTOMETRIC;
  const one = (part: Part, ...warnings: string[]) => ({ parts: [{ name: '', part }], warnings });
  if (photometric === rgb && samples >= 3) {
    const weights = `${WEIGHTS[0]} red + ${WEIGHTS[1]} green + ${WEIGHTS[2]} blue`;
    const alpha = samples > 3 ? '; other samples, such as opacity, are left out' : '';
    return one('luminance', `colours are read as their luminance, ${weights}${alpha}`);
  }
  if (photometric === yCbCr && samples === 3 && compression === 'JPEG')
    return one(0, 'colours are read as their luminance, the Y of YCbCr');
  if (photometric === palette && samples === 1)
    return one(0, 'the image has a palette: the indices of its colours are read, not their brightness');
  if (![rgb, whiteIsZero, blackIsZero, mask].some((known) => known === photometric))
    throw badTiff(page.label, `unsupported PhotometricInterpretation ${photometric} with ${samples} samples`);
  const opacity = (await page.numbers(TAG.extraSamples, samples)).filter((kind) => kind === 1 || kind === 2).length;
  const left = Math.max(1, samples - opacity);
  if (left === 1) return one(0, ...(samples > 1 ? ['the opacity of pixels is left out'] : []));
  return { parts: sampleParts(left), warnings: [] };
}

/** Returns a warning about pages that are to be shown mirrored or rotated. */
export async function orientationOf(page: Page): Promise<string[]> {
  const orientation = await page.number(TAG.orientation, 1);
  if (orientation <= 1) return [];
  return [`the pages have orientation ${orientation}, which is not applied: the image may be mirrored or rotated`];
}

/** Returns all samples of a page as channels. */
export const allSamples = (samples: number): Components => ({ parts: sampleParts(samples), warnings: [] });

/** Image `k` of a file. */
type ImageAt = (k: number) => Omit<Plane, 'part'>;

/** Largest number of channels: that of samples of a pixel in TIFF. */
const MOST_CHANNELS = 65_535;

/** Throws `bad-file` if there are too many channels to list them. */
export function checkChannels(name: string, count: number): void {
  if (count > MOST_CHANNELS) throw badTiff(name, `${count} channels; at most ${MOST_CHANNELS} are supported`);
}

/** Returns the channels of images that are stored in `order`, the fastest first. */
function channelsOf(sizes: Sizes, order: string, imageAt: ImageAt, { parts }: Components): Channel[] {
  checkChannels(imageAt(0).page.label, sizes.C * parts.length);
  const { strideC = 1, strideZ = 1, strideT = 1 } = stridesOf(sizes, order);
  return Array.from({ length: sizes.C * parts.length }, (_, k) => {
    const [c, { name, part } = { name: '', part: 0 }] = [Math.floor(k / parts.length), parts[k % parts.length]];
    const planeAt = (z: number, t: number) => ({ ...imageAt(c * strideC + z * strideZ + t * strideT), part });
    const own = `channel ${c + 1}`;
    return { name: [own, name].filter(Boolean).join(' '), planeAt };
  });
}

/** Returns the distance, in images, of neighbours along each axis. */
function stridesOf(sizes: Sizes, order: string): Record<string, number> {
  let stride = 1;
  const found: Record<string, number> = {};
  for (const axis of order as Iterable<keyof Sizes>) {
    found[`stride${axis}`] = stride;
    stride *= sizes[axis];
  }
  return found;
}

const PLAIN = { spacing: [1, 1, 1] as Vec3, frames: 1 };

/** Returns the stack in one file that is not an OME-TIFF. */
export async function stackOf(file: OpenFile, pause: Pause): Promise<Layout> {
  if (isImageJ(file.text)) return imageJStack(file);
  const { pages, warnings } = await fullSize(file, pause);
  const [first] = pages;
  if (!first) throw badTiff(file.source.name, 'the file has no pages');
  const format = await formatOf(first);
  const components = await componentsOf(first, format);
  const shaped = shapeOf(file.text);
  const described = (shaped?.following ?? 1) / (format.width * format.height * format.samples);
  const inOne = pages.length === 1 ? Math.max(first.count(TAG.metaMorphPlanes), Math.ceil(described)) : 1;
  if (inOne > 1) await checkFollowing(first, format, inOne);
  const count = Math.max(inOne, pages.length);
  const imageAt: ImageAt = (k) => (inOne > 1 ? { page: first, after: k } : { page: pages[k] ?? first, after: 0 });
  const all = { sizes: { Z: count, C: 1, T: 1 }, order: 'ZCT' };
  const { sizes, order } = shaped?.axes && product(shaped.axes.sizes) === count ? shaped.axes : all;
  return {
    ...PLAIN,
    ...{ channels: channelsOf(sizes, order, imageAt, components), slices: sizes.Z, frames: sizes.T },
    warnings: [...warnings, ...components.warnings, ...vendor(first), ...(await orientationOf(first))],
  };
}

function vendor(page: Page): string[] {
  if (page.has(TAG.lsm))
    return ['Zeiss LSM: voxel sizes, and which pages are frames, are not read: all pages are slices'];
  if (page.count(TAG.metaMorphPlanes) > 0)
    return ['MetaMorph: voxel sizes and times are not read: all images are slices'];
  return [];
}

/** Returns the pages of full size, and what was left out: thumbnails, and coarser levels of a pyramid. */
async function fullSize(file: OpenFile, pause: Pause): Promise<{ pages: Page[]; warnings: string[] }> {
  const sizes: { page: Page; width: number; height: number; isReduced: boolean }[] = [];
  for (const page of file.pages) {
    const isReduced = ((await page.number(TAG.newSubfileType, 0)) & 1) === 1;
    sizes.push({ page, ...(await sizeOf(page)), isReduced });
    await pause.turn();
  }
  const whole = sizes.some(({ isReduced }) => !isReduced) ? sizes.filter(({ isReduced }) => !isReduced) : sizes;
  const [width, height] = [most(whole.map((size) => size.width)), most(whole.map((size) => size.height))];
  // Others differ from the largest along one axis only, and are refused when they are read.
  const kept = whole.filter((size) => size.width === width || size.height === height);
  const left = sizes.length - kept.length;
  const warnings =
    left > 0 ? [`${left} smaller pages are left out: only those of ${width} × ${height} pixels are read`] : [];
  return { pages: kept.map(({ page }) => page), warnings };
}

const most = (values: number[]) => values.reduce((one, other) => Math.max(one, other), 0);

/** The shape that tifffile writes into the first page. */
interface Shape {
  /** Sizes of the axes, and their order, if they are known. */
  axes?: { sizes: Sizes; order: string };
  /** Number of all samples, if only the first image has a directory. */
  following?: number;
}

/** Returns the shape of a stack by tifffile; undefined if the description has none. */
function shapeOf(text: string): Shape | undefined {
  if (!text.startsWith('{"')) return undefined;
  const { shape, axes, truncated } = parsedJson(text);
  if (!Array.isArray(shape) || !shape.every((size) => Number.isSafeInteger(size) && size > 0)) return undefined;
  const isKnown = typeof axes === 'string' && axes.length === shape.length && /^[ZCT]*YXS?$/.test(axes);
  const following = truncated === true && { following: shape.reduce((total, size) => total * size, 1) };
  if (!isKnown) return { ...following };
  const outer = [...axes.slice(0, axes.indexOf('Y'))];
  const sizes = { Z: 1, C: 1, T: 1 };
  for (const [k, axis] of outer.entries()) sizes[axis as keyof Sizes] *= shape[k];
  // The fastest is the last.
  return { axes: { sizes, order: [...new Set([...outer.reverse(), 'Z', 'C', 'T'])].join('') }, ...following };
}

function parsedJson(text: string): Record<string, unknown> {
  try {
    return Object(JSON.parse(text));
  } catch {
    return {};
  }
}

/**
 * Throws `bad-file` unless `count` images of the same format follow each other, of which only the first has a
 * directory.
 */
async function checkFollowing(page: Page, format: Format, count: number): Promise<void> {
  if (format.compression !== 'none' || format.block.isTile)
    throw badTiff(page.label, `${count} images are described, but only one is in the file`);
  const blocks = await blocksOf(page, format, 0, 0);
  const gap = blocks.findIndex(({ at, bytes }, k) => k + 1 < blocks.length && at + bytes !== blocks[k + 1]?.at);
  if (gap >= 0) throw badTiff(page.label, `${count} images are described, but only one has a directory`);
  const [start, bytes] = [blocks[0]?.at ?? 0, count * pageBytes(format)];
  page.source.check(start, bytes);
  if (page.isWithin(start, start + bytes))
    throw badTiff(page.label, `${count} images are described, but the file has fewer`);
}

async function imageJStack({ source, pages, text }: OpenFile): Promise<Layout> {
  const [first] = pages;
  if (!first) throw badTiff(source.name, 'the file has no pages');
  const described = parseImageJ(text);
  const format = await formatOf(first);
  const components = await componentsOf(first, format);
  // Above 4 GB, ImageJ writes one directory for all.
  const following = pages.length === 1 ? Math.max(described.images ?? 1, product(described.sizes)) : 1;
  if (following > 1) await checkFollowing(first, format, following);
  const count = Math.max(following, pages.length);
  const { sizes, warnings } = fitted(source, described.sizes, count);
  const imageAt: ImageAt = (k) => (following > 1 ? { page: first, after: k } : { page: pages[k] ?? first, after: 0 });
  const { spacing, unit, assumed } = spacingOf(described.axes ?? (await statedSizes(first, described)), sizes.Z);
  return {
    channels: channelsOf(sizes, described.order, imageAt, components),
    ...{ slices: sizes.Z, frames: sizes.T, spacing, unit },
    ...{ frameSeconds: described.frameSeconds, calibration: described.calibration },
    warnings: [...warnings, ...assumed, ...components.warnings, ...described.unused, ...(await orientationOf(first))],
  };
}

/**
 * Returns numbers of slices, channels and frames that fit the number of images, with a warning if they had to be
 * changed: recordings may have been stopped early.
 */
function fitted({ name }: Source, described: Sizes, count: number): { sizes: Sizes; warnings: string[] } {
  if (product(described) === count) return { sizes: described, warnings: [] };
  const sizes = { ...described };
  if (described.T > 1) sizes.T = Math.floor(count / (described.C * described.Z));
  else sizes.Z = Math.floor(count / described.C);
  const list = ({ Z, C, T }: Sizes) => `${Z} slices, ${C} channels, ${T} frames`;
  if (sizes.Z === 0 || sizes.T === 0)
    throw badTiff(name, `${list(described)} are described, but the file has ${count} images`);
  return {
    sizes,
    warnings: [`${list(described)} are described, but the file has ${count} images: ${list(sizes)} are read`],
  };
}

async function statedSizes(page: Page, { units, between }: ImageJ): Promise<Stated[]> {
  const resolutionUnit = await page.number(TAG.resolutionUnit, 1);
  // Without a unit, a resolution may be that of paper.
  const isScale = units !== undefined || resolutionUnit === 1;
  // ImageJ leaves out what is 1.
  const missing = units ? 1 : undefined;
  const size = async (tag: number) => {
    const perUnit = isScale ? await page.number(tag, 0) : 0;
    return Number.isFinite(perUnit) && perUnit > 0 ? 1 / perUnit : missing;
  };
  return [
    { size: await size(TAG.xResolution), unit: units?.[0] ?? '' },
    { size: await size(TAG.yResolution), unit: units?.[1] ?? '' },
    { size: between.size ?? missing, unit: between.unit },
  ];
}
