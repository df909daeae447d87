// Lengths and times in the units of descriptions.
import type { LengthUnit, Vec3 } from '../data.js';

/** Micrometres in each unit of length, by the names that OME and ImageJ have for it. */
const MICROMETRES = new Map([
  ...['pm', 'picometer'].map((name) => [name, 1e-6] as const),
  ...['Å', 'Å', 'angstrom', 'angstroms'].map((name) => [name, 1e-4] as const),
  ...['nm', 'nanometer', 'nanometers', 'nanometre', 'nanometres'].map((name) => [name, 1e-3] as const),
  ...['um', 'micron', 'microns', 'micrometer', 'micrometers', 'micrometre', 'micrometres'].map(
    (name) => [name, 1] as const,
  ),
  ...['mm', 'millimeter', 'millimeters', 'millimetre', 'millimetres'].map((name) => [name, 1e3] as const),
  ...['cm', 'centimeter', 'centimeters', 'centimetre', 'centimetres'].map((name) => [name, 1e4] as const),
  ...['in', 'inch', 'inches'].map((name) => [name, 25400] as const),
  ...['m', 'meter', 'meters', 'metre', 'metres'].map((name) => [name, 1e6] as const),
]);

/** Seconds in each unit of time. */
const SECONDS = new Map([
  ...['ns'].map((name) => [name, 1e-9] as const),
  ...['us', 'usec'].map((name) => [name, 1e-6] as const),
  ...['ms', 'msec', 'millisecond', 'milliseconds'].map((name) => [name, 1e-3] as const),
  ...['s', 'sec', 'secs', 'second', 'seconds'].map((name) => [name, 1] as const),
  ...['min', 'mins', 'minute', 'minutes'].map((name) => [name, 60] as const),
  ...['h', 'hr', 'hour', 'hours'].map((name) => [name, 3600] as const),
  ...['d', 'day', 'days'].map((name) => [name, 86400] as const),
]);

/** Returns the name of a unit with the signs for micro as u, which ImageJ also writes as an escape. */
const plain = (name: string) => name.trim().replace(/^(\\u00B5|[µμ])/i, 'u');

/** Returns the seconds in a unit of time; undefined if it is not known. */
export const secondsIn = (name: string): number | undefined => SECONDS.get(plain(name));

/** Returns the number that is written in a description; undefined if it is not above 0 and finite. */
export function positive(text: string | undefined): number | undefined {
  const value = text?.trim() ? Number(text) : Number.NaN;
  return Number.isFinite(value) && value > 0 ? value : undefined;
}

/** The size of voxels along an axis as it is stated. */
export interface Stated {
  size: number | undefined;
  /** Name of its unit. */
  unit: string;
}

/** The size of voxels in one unit. */
export interface Spacing {
  spacing: Vec3;
  unit?: LengthUnit;
  /** Warnings about sizes that had to be assumed. */
  assumed: string[];
}

/**
 * Returns the sizes of voxels along x, y and z in one unit of the library, the one closest to that of x; 1 where none is
 * stated, and as they are stated if a unit is not known. A single slice needs no distance.
 */
export function spacingOf(axes: Stated[], slices: number): Spacing {
  const scales = axes.map(({ size, unit }) => (size === undefined ? undefined : MICROMETRES.get(plain(unit))));
  const raw = axes.map(({ size }) => size ?? 1) as Vec3;
  const isStated = axes.map(({ size }) => size !== undefined);
  const scale = scales.find((known) => known !== undefined);
  if (scale === undefined) return { spacing: raw, assumed: [] };
  if (isStated.some((stated, k) => stated && scales[k] === undefined)) {
    const list = axes.map(({ size, unit }) => (size === undefined ? 'none' : `${size} ${unit}`)).join(', ');
    return { spacing: raw, assumed: [`voxel sizes along x, y, z are ${list}: they are used without a unit`] };
  }
  const [unit, base] =
    scale < 1e3 ? (['um', 1] as const) : scale < 1e6 ? (['mm', 1e3] as const) : (['m', 1e6] as const);
  const spacing = raw.map((size, k) => (isStated[k] ? size * ((scales[k] ?? base) / base) : 1)) as Vec3;
  return {
    spacing,
    unit,
    assumed: notStated(
      isStated.map((stated, k) => stated || (k === 2 && slices === 1)),
      unit,
    ),
  };
}

function notStated(isStated: boolean[], unit: LengthUnit): string[] {
  const without = ['x', 'y', 'z'].filter((_, k) => !isStated[k]);
  if (without.length === 0) return [];
  return [`no voxel size is stated along ${without.join(' and ')}: 1 ${unit === 'um' ? 'µm' : unit} is assumed`];
}
