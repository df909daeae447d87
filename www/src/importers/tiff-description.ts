/** Parses the description of the stack in a TIFF file: OME's XML, or the lines of ImageJ. */

import type { LengthUnit } from 'vesicle';

export interface Stack {
  /**
   * Indices of the pages of the file, or files, that make up the volume: all slices of the first frame, then those of
   * the next.
   */
  pages: number[];
  frames: number;
  /** Voxel sizes along x, y and z in `unit`; undefined where the description has none. */
  spacing: [number | undefined, number | undefined, number | undefined];
  /**
   * Whether the pages' resolution tags count pixels per unit of length of the description, as in ImageJ; else they are
   * not used.
   */
  perUnit: boolean;
  /** Unit of the voxel sizes, if the description states it. */
  unit?: LengthUnit;
  /** Length of the description's unit, in which the resolution tags are, in `unit`. */
  scale: number;
}

/** Units in descriptions: the unit that lengths are converted to, and their length in it. */
const UNITS: Record<string, [LengthUnit, number]> = {
  nm: ['um', 1e-3],
  um: ['um', 1],
  micron: ['um', 1],
  microns: ['um', 1],
  mm: ['mm', 1],
  cm: ['mm', 10],
  m: ['m', 1],
};

/** Returns the unit that a description names; the prefix for micro may be written in several ways. */
const unitNamed = (name: string) => UNITS[name.trim().replace(/^(\\u00B5|[µμ])/i, 'u')];

/**
 * Parses the description of a stack of `count` pages; if it is neither OME's nor ImageJ's, all pages are slices of one
 * frame.
 */
export function describedIn(text: string, count: number): Stack {
  if (/<OME[\s>]/.test(text)) return fromOme(text, count);
  if (text.startsWith('ImageJ=')) return fromImageJ(text, count);
  return { pages: range(count), frames: 1, spacing: [undefined, undefined, undefined], perUnit: false, scale: 1 };
}

const range = (count: number) => Array.from({ length: count }, (_, k) => k);

/** Parses a number above 0 in a description; undefined for anything else. */
function positive(text: string | undefined): number | undefined {
  const value = Number(text);
  return text !== undefined && Number.isFinite(value) && value > 0 ? value : undefined;
}

function fromOme(text: string, count: number): Stack {
  const pixels = /<Pixels\b[^>]*>/.exec(text)?.[0] ?? '';
  const attribute = (name: string) => new RegExp(`\\b${name}\\s*=\\s*["']([^"']*)["']`).exec(pixels)?.[1];
  const size = (name: string) => Math.max(1, Math.floor(positive(attribute(name)) ?? 1));
  const sizes = { Z: size('SizeZ'), C: size('SizeC'), T: size('SizeT') };
  const order = /^XY([ZCT]{3})$/.exec(attribute('DimensionOrder') ?? '')?.[1] ?? 'ZCT';
  const axes = ['PhysicalSizeX', 'PhysicalSizeY', 'PhysicalSizeZ'].map((name) => ({
    size: positive(attribute(name)),
    unit: unitNamed(attribute(`${name}Unit`) ?? 'µm'),
  }));
  const unit = axes[0]?.unit?.[0];
  const isOneUnit = unit !== undefined && axes.every((axis) => axis.unit?.[0] === unit);
  const spacing = axes.map(({ size, unit }) => size && size * (isOneUnit ? (unit?.[1] ?? 1) : 1)) as Stack['spacing'];
  const isKnown = isOneUnit && spacing.some(Boolean);
  return { ...ordered(sizes, order, count), spacing, perUnit: false, scale: 1, ...(isKnown && { unit }) };
}

function fromImageJ(text: string, count: number): Stack {
  const lines = new Map(text.split('\n').map((line) => line.split('=', 2) as [string, string | undefined]));
  const size = (name: string) => Math.max(1, Math.floor(positive(lines.get(name)) ?? 1));
  const [channels, frames] = [size('channels'), size('frames')];
  const slices = lines.has('slices') ? size('slices') : Math.floor(count / (channels * frames));
  const [unit, scale] = unitNamed(lines.get('unit') ?? '') ?? [undefined, 1];
  const between = positive(lines.get('spacing'));
  const spacing: Stack['spacing'] = [undefined, undefined, between && between * scale];
  const pages = ordered({ Z: slices, C: channels, T: frames }, 'CZT', count);
  return { ...pages, spacing, perUnit: true, scale, ...(unit && { unit }) };
}

/**
 * Returns the pages of the first channel, frame after frame, from a file that stores slices (Z), channels (C) and
 * frames (T) in `order`, the fastest first. If `count`, the number of pages of the file, is too small for that, all
 * pages are slices of one frame.
 */
function ordered(sizes: Record<string, number>, order: string, count: number): Pick<Stack, 'pages' | 'frames'> {
  const { Z = 1, T = 1 } = sizes;
  const stride = (letter: string) => {
    const before = [...order].slice(0, order.indexOf(letter));
    return before.reduce((product, other) => product * (sizes[other] ?? 1), 1);
  };
  const pages = range(T).flatMap((t) => range(Z).map((z) => z * stride('Z') + t * stride('T')));
  // A description that does not fit the pages is ignored.
  const fits = pages.every((page) => page < count);
  return fits ? { pages, frames: T } : { pages: range(count), frames: 1 };
}
