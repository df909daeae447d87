// Reads the metadata of an OME-Zarr image: its axes, and the transform of each level to world space.
import { shortened } from '../short-text.js';
import type { Warning } from '../warning.js';
import { badZarr, shown } from './error.js';

/** Role of an axis of the arrays. */
export type AxisName = 'x' | 'y' | 'z' | 'c' | 't';

/** The metadata of an image, with vectors in the order of the axes of its arrays. */
export interface Multiscale {
  /** The axes of all arrays, in their order. */
  axes: AxisName[];
  /** Unit of all lengths; undefined if the metadata states none. */
  unit: 'mm' | undefined;
  /** Where each level is, finest first. */
  levels: LevelTransform[];
  /** Warnings about assumptions. */
  warnings: Warning[];
}

/** Location of a level, and the transform world = scale * index + translation along each axis. */
export interface LevelTransform {
  /** Path of the array, relative to the group of the image. */
  path: string;
  scale: number[];
  translation: number[];
}

type Json = Record<string, unknown>;

const SPACE: readonly AxisName[] = ['x', 'y', 'z'];

/** Type of each axis in OME-NGFF, and how it is called by writers that abbreviate nothing. */
const TYPES: Record<AxisName, string> = { x: 'space', y: 'space', z: 'space', c: 'channel', t: 'time' };

/** Largest number of levels: with each half as long as the one before, the limits of sizes allow no more. */
const MOST_LEVELS = 32;

/** Millimetres per unit of length, by its name in OME-NGFF (that of UDUNITS-2), and by symbols that are also written. */
const MILLIMETRES: Record<string, number> = {
  ...{ picometer: 1e-9, pm: 1e-9, angstrom: 1e-7, Å: 1e-7, nanometer: 1e-6, nm: 1e-6 },
  ...{ micrometer: 1e-3, micron: 1e-3, um: 1e-3, µm: 1e-3, μm: 1e-3, millimeter: 1, mm: 1 },
  ...{ centimeter: 10, cm: 10, inch: 25.4, decimeter: 100, foot: 304.8, yard: 914.4 },
  ...{ meter: 1e3, m: 1e3, hectometer: 1e5, kilometer: 1e6, km: 1e6 },
};

/**
 * Returns the metadata of the first image in the attributes of a group.
 *
 * @param attributes - Attributes of the group: `multiscales` of OME-NGFF 0.4, or `ome` of 0.5.
 * @throws `VesicleError` `bad-file` naming the field and what is accepted.
 */
export function parseMultiscale(attributes: Json): Multiscale {
  const image = imageOf(attributes);
  const { names, units } = parseAxes(image.axes);
  const { unit, factors, warnings } = millimetres(names, units);
  const whole = parseTransform(image.coordinateTransformations ?? [], names.length, 'coordinateTransformations');
  const datasets = list(image.datasets, 'multiscales[0].datasets');
  if (datasets.length > MOST_LEVELS) {
    throw badZarr('multiscales[0].datasets', `must be at most ${MOST_LEVELS} levels, got ${datasets.length}`);
  }
  const levels = datasets.map((dataset, index) => {
    const { path, ...own } = parseDataset(dataset, names.length, index);
    const { scale, translation } = composed(own, whole);
    return { path, scale: product(scale, factors), translation: product(translation, factors) };
  });
  return { axes: names, unit, levels, warnings };
}

function imageOf(attributes: Json): Json {
  const { multiscales, ...rest } = (attributes.ome ?? attributes) as Json;
  if (multiscales === undefined && 'bioformats2raw.layout' in rest) {
    throw badZarr('multiscales', 'missing; the store holds a series of images: give the path of one, such as "0"');
  }
  if (multiscales === undefined) {
    throw badZarr('multiscales', 'missing; must be the group of an image of OME-NGFF 0.4 or 0.5, or give its path');
  }
  const image = list(multiscales, 'multiscales')[0] as Json;
  const version = rest.version ?? image.version;
  if (version === undefined || /^0\.[45]/.test(String(version))) return image;
  throw badZarr('multiscales', `version ${shown(version)}; supported are 0.4 and 0.5 of OME-NGFF`);
}

function list(value: unknown, part: string): Json[] {
  const isList = Array.isArray(value) && value.length > 0;
  if (isList && value.every((entry) => typeof entry === 'object' && entry !== null)) return value;
  throw badZarr(part, `must be a list of one or more objects, got ${shown(value)}`);
}

function parseAxes(value: unknown): { names: AxisName[]; units: unknown[] } {
  const axes = list(value, 'multiscales[0].axes');
  const names = axes.map((axis, index) => axisName(axis, `multiscales[0].axes[${index}]`));
  const got = `got ${shortened(names.join(', '))}`;
  if (new Set(names).size < names.length) throw badZarr('multiscales[0].axes', `repeated, ${got}`);
  for (const needed of ['x', 'y'] as const) {
    if (!names.includes(needed)) {
      throw badZarr('multiscales[0].axes', `must include x and y, and may include z, c and t, ${got}`);
    }
  }
  return { names, units: axes.map(({ unit }) => unit) };
}

function axisName({ name, type }: Json, part: string): AxisName {
  const known = Object.hasOwn(TYPES, String(name)) ? (name as AxisName) : nameOfType(type);
  if (known && (type === undefined || type === TYPES[known])) return known;
  throw badZarr(
    part,
    `must be x, y or z of type "space", c of type "channel", or t of type "time", got ${shown(name)} of type ${shown(type)}`,
  );
}

/** Channels and time are found by their type, whatever their name. */
function nameOfType(type: unknown): AxisName | undefined {
  if (type === 'channel') return 'c';
  return type === 'time' ? 't' : undefined;
}

/** The unit of the world, and the factor of each axis by which lengths are converted to it. */
type Lengths = { unit: 'mm' | undefined; factors: number[]; warnings: Warning[] };

/**
 * Returns the factor of each axis by which lengths become millimetres; 1 if no unit of length is known. An axis without a
 * unit has that of the others, if they agree.
 */
function millimetres(names: AxisName[], units: unknown[]): Lengths {
  const spatial = names.map((name) => SPACE.includes(name));
  const known = units.map((unit, axis) => (spatial[axis] ? lengthOf(unit) : 1));
  const lengths = new Set(known.filter((length, axis) => spatial[axis] && length !== undefined));
  if (lengths.size === 0) return { unit: undefined, factors: names.map(() => 1), warnings: [] };
  const unknown = [...names.keys()].filter((axis) => known[axis] === undefined);
  const wrong = unknown.find((axis) => lengths.size > 1 || !isMissing(units[axis]));
  if (wrong !== undefined) {
    throw badZarr(
      `multiscales[0].axes[${wrong}].unit`,
      `must be a unit of length if other axes have one, such as "micrometer", got ${shown(units[wrong])}`,
    );
  }
  const [length = 1] = [...lengths];
  const factors = known.map((own) => own ?? length);
  return { unit: 'mm', factors, warnings: unknown.length > 0 ? [sameUnit(unknown.map((axis) => names[axis]))] : [] };
}

function isMissing(unit: unknown): boolean {
  return unit === undefined || unit === null || unit === '';
}

function sameUnit(names: unknown[]): Warning {
  const text = `The image states no unit of length for ${names.join(', ')}; that of its other axes was assumed.`;
  return { code: 'reader', text };
}

function lengthOf(unit: unknown): number | undefined {
  return Object.hasOwn(MILLIMETRES, String(unit)) ? MILLIMETRES[String(unit)] : undefined;
}

function parseDataset(dataset: Json, rank: number, index: number): LevelTransform {
  const part = `multiscales[0].datasets[${index}]`;
  const { path, coordinateTransformations } = dataset;
  if (typeof path !== 'string') throw badZarr(`${part}.path`, `must be a string, got ${shown(path)}`);
  if (coordinateTransformations === undefined) {
    throw badZarr(
      `${part}.coordinateTransformations`,
      'missing; must be a scale, and may be followed by a translation',
    );
  }
  return { path, ...parseTransform(coordinateTransformations, rank, `${part}.coordinateTransformations`) };
}

type Transform = Omit<LevelTransform, 'path'>;

/** Returns the composition of a list of scales and translations. */
function parseTransform(value: unknown, rank: number, part: string): Transform {
  if (!Array.isArray(value)) throw badZarr(part, `must be a list, got ${shown(value)}`);
  const identity = { scale: new Array(rank).fill(1), translation: new Array(rank).fill(0) };
  return value
    .map((step, index) => parseStep(Object(step) as Json, rank, `${part}[${index}]`))
    .reduce(composed, identity);
}

function parseStep(step: Json, rank: number, part: string): Transform {
  const [scale, translation] = [new Array(rank).fill(1), new Array(rank).fill(0)];
  if (step.type === 'identity') return { scale, translation };
  if (step.type === 'translation') return { scale, translation: vector(step.translation, rank, `${part}.translation`) };
  if (step.type !== 'scale') {
    throw badZarr(`${part}.type`, `must be "scale", "translation" or "identity", got ${shown(step.type)}`);
  }
  const factors = vector(step.scale, rank, `${part}.scale`);
  if (factors.every((factor) => factor > 0)) return { scale: factors, translation };
  throw badZarr(`${part}.scale`, `all numbers must be > 0, got ${shown(factors)}`);
}

function vector(value: unknown, rank: number, part: string): number[] {
  const isVector = Array.isArray(value) && value.length === rank && value.every(Number.isFinite);
  if (isVector) return value;
  throw badZarr(part, `must be ${rank} finite numbers, one for each axis, got ${shown(value)}`);
}

/** Returns the transform that applies `first`, then `second`. */
function composed(first: Transform, second: Transform): Transform {
  return {
    scale: product(first.scale, second.scale),
    translation: product(first.translation, second.scale).map(
      (offset, axis) => offset + (second.translation[axis] as number),
    ),
  };
}

function product(values: number[], factors: number[]): number[] {
  return values.map((value, axis) => value * (factors[axis] as number));
}
