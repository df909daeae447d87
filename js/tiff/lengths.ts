// Lengths and times in the units of descriptions.
import type { LengthUnit, Vec3 } from '../data.js';
import { shortened } from '../short-text.js';

/** Micrometres in each unit of length, by the names that OME and ImageJ have for it. */
const MICROMETRES = named({
  1e-6: 'pm picometer',
  1e-4: 'Å \u212b angstrom angstroms',
  1e-3: 'nm nanometer nanometers nanometre nanometres',
  1: 'um micron microns micrometer micrometers micrometre micrometres',
  1e3: 'mm millimeter millimeters millimetre millimetres',
  1e4: 'cm centimeter centimeters centimetre centimetres',
  1e5: 'dm',
  1e6: 'm meter meters metre metres',
  1e9: 'km',
  25.4: 'thou',
  25400: 'in inch inches',
  304800: 'ft',
  914400: 'yd',
});

/** Seconds in each unit of time. */
const SECONDS = named({
  1e-9: 'ns',
  1e-6: 'us usec',
  1e-3: 'ms msec millisecond milliseconds',
  1: 's sec secs second seconds',
  60: 'min mins minute minutes',
  3600: 'h hr hour hours',
  86400: 'd day days',
});

/** Returns the sizes of units by their names, which are given by their sizes. */
function named(units: Record<number, string>): Map<string, number> {
  return new Map(
    Object.entries(units).flatMap(([size, names]) => names.split(' ').map((name) => [name, Number(size)])),
  );
}

/** Returns the name of a unit with the signs for micro as u, which ImageJ also writes as an escape. */
const plain = (name: string) => name.trim().replace(/^(\\u00B5|[µμ])/i, 'u');

/** Returns the seconds in a unit of time; undefined if it is not known. */
export const secondsIn = (name: string): number | undefined => SECONDS.get(plain(name));

/** Bounds of sizes and numbers in descriptions: beyond them, sizes in another unit would be 0 or infinite. */
const [LEAST, MOST] = [1e-25, 1e25];

/** Returns the number that is written in a description; undefined if it is not above 0, or absurd. */
export function positive(text: string | undefined): number | undefined {
  const value = text?.trim() ? Number(text) : Number.NaN;
  return value >= LEAST && value <= MOST ? value : undefined;
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
 * Returns the sizes of voxels along x, y and z in one unit of the library, the one closest to that of x; 1 where none
 * is stated, and as they are stated if a unit is not known. A single slice needs no distance.
 */
export function spacingOf(axes: Stated[], slices: number): Spacing {
  const scales = axes.map(({ size, unit }) => (size === undefined ? undefined : MICROMETRES.get(plain(unit))));
  const raw = axes.map(({ size }) => size ?? 1) as Vec3;
  const isStated = axes.map(({ size }) => size !== undefined);
  const scale = scales.find((known) => known !== undefined);
  if (scale === undefined) return { spacing: raw, assumed: [] };
  if (isStated.some((stated, k) => stated && scales[k] === undefined)) {
    const list = axes
      .map(({ size, unit }) => (size === undefined ? 'none' : `${size} ${shortened(unit, 50)}`))
      .join(', ');
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
