// The description of a stack by ImageJ.
import { positive, type Stated, secondsIn } from './lengths.js';

/** A stack as its description says. */
export interface ImageJ {
  sizes: { Z: number; C: number; T: number };
  /** Slices (Z), channels (C) and frames (T), the fastest first. */
  order: string;
  /** Number of images; undefined if it is not stated. */
  images: number | undefined;
  /** Units along x, y and z; undefined if none is stated. */
  units: readonly [string, string, string] | undefined;
  /** Distance of the slices. */
  between: Stated;
  /** Sizes along x, y and z, if the description has them all. */
  axes?: Stated[];
  frameSeconds: number | undefined;
  /** Intensity of a stored value: value * slope + intercept. */
  calibration: { slope: number; intercept: number } | undefined;
  /** Warnings about lines that are not used. */
  unused: string[];
}

/** Returns whether a text is the description of a stack by ImageJ, or by SCIFIO. */
export const isImageJ = (text: string): boolean => /^(ImageJ|SCIFIO)=/.test(text);

/** Parses the description of a stack by ImageJ, or SCIFIO, which has lines of its own besides. */
export function parseImageJ(text: string): ImageJ {
  const lines = new Map<string, string>();
  for (const line of text.split(/\r?\n/)) {
    const equals = line.indexOf('=');
    if (equals > 0 && !lines.has(line.slice(0, equals)))
      lines.set(line.slice(0, equals), line.slice(equals + 1).trim());
  }
  const size = (name: string) => Math.max(1, Math.floor(positive(lines.get(name)) ?? 1));
  const sizes = { Z: size('slices'), C: size('channels'), T: size('frames') };
  const images = lines.has('images') ? size('images') : undefined;
  // ImageJ leaves slices out of a stack that is not a hyperstack.
  if (images && !lines.has('slices')) sizes.Z = Math.max(1, Math.floor(images / (sizes.C * sizes.T)));
  const unit = lines.get('unit');
  const units =
    unit === undefined ? undefined : ([unit, lines.get('yunit') ?? unit, lines.get('zunit') ?? unit] as const);
  // Distances below 0 only reverse the display in ImageJ.
  const between = { size: positive(lines.get('spacing')?.replace(/^-/, '')), unit: units?.[2] ?? '' };
  const found = { sizes, order: 'CZT', images, units, between };
  return { ...found, ...timesIn(lines), ...calibrationIn(lines), ...scifioIn(lines) };
}

/** Axes of SCIFIO. */
const AXES = new Map([
  ['Z', 'Z'],
  ['Channel', 'C'],
  ['Time', 'T'],
] as const);

/** Returns the numbers, order and sizes that SCIFIO states; nothing if it states none. */
function scifioIn(lines: Map<string, string>): Pick<ImageJ, 'sizes' | 'order' | 'axes'> | undefined {
  const [names = [], lengths = [], scales = [], units = []] = ['axes', 'lengths', 'scales', 'units'].map((name) =>
    lines.get(name)?.split(','),
  );
  const outer = names.slice(2).map((name) => AXES.get(name as 'Z'));
  const isKnown = names[0] === 'X' && names[1] === 'Y' && outer.every((axis) => axis !== undefined);
  if (!isKnown || !lines.has('SCIFIO') || lengths.length !== names.length) return undefined;
  const sizes = { Z: 1, C: 1, T: 1 };
  for (const [k, axis] of outer.entries()) if (axis) sizes[axis] = Math.floor(positive(lengths[k + 2]) ?? 1);
  const axes = ['X', 'Y', 'Z'].map((axis) => {
    const [size, unit = ''] = [positive(scales[names.indexOf(axis)]), units[names.indexOf(axis)]];
    return { size, unit: unit === 'null' ? '' : unit };
  });
  return { sizes, order: [...new Set([...outer, 'C', 'Z', 'T'])].join(''), axes };
}

function timesIn(lines: Map<string, string>): Pick<ImageJ, 'frameSeconds'> {
  const seconds = secondsIn(lines.get('tunit') ?? 'sec');
  const interval = positive(lines.get('finterval'));
  return { frameSeconds: interval && seconds && interval * seconds };
}

/** Number of ImageJ's function of a straight line, and of those that do nothing. */
const [LINE, NONE] = ['0', ['', '20', '22']];

function calibrationIn(lines: Map<string, string>): Pick<ImageJ, 'calibration' | 'unused'> {
  const kind = lines.get('cf') ?? '';
  if (NONE.includes(kind)) return { calibration: undefined, unused: [] };
  const [intercept, slope] = [Number(lines.get('c0') ?? Number.NaN), Number(lines.get('c1') ?? Number.NaN)];
  const isLine = kind === LINE && Number.isFinite(intercept) && Number.isFinite(slope) && slope !== 0;
  const unused = ['the calibration of intensities is not a straight line: stored values are given'];
  return isLine ? { calibration: { slope, intercept }, unused: [] } : { calibration: undefined, unused };
}
