import { decimals, shortenedPoint } from '../engine/placing';
import type { Vec3 } from '../engine/protocol';
import { LANGUAGE, text } from '../texts';

export { count } from '../texts';

// To make one takes much longer than to use it.
const FOUR_DIGITS = new Intl.NumberFormat(LANGUAGE, { maximumSignificantDigits: 4 });

/**
 * Formats a number with up to four significant digits; magnitudes below 10⁻³ and from 10⁷ on as three digits times a
 * power of ten; a dash if it is not finite.
 */
export function figure(value: number): string {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e7)) return value.toExponential(2);
  return FOUR_DIGITS.format(value);
}

/**
 * Formats a point with four significant digits of each coordinate, or with as many decimals as say as much of something
 * of this size where it is far from the origin.
 */
export function place(point: Vec3, size: number): string {
  const far = new Intl.NumberFormat(LANGUAGE, {
    maximumFractionDigits: Math.min(20, decimals(size, 4)),
    useGrouping: false,
  });
  const short = shortenedPoint(point, 4, size);
  const isNear = short.every((value, axis) => value === Number((point[axis] ?? 0).toPrecision(4)));
  return short.map((value) => (isNear ? figure(value) : far.format(value))).join(', ');
}

/** Units of length, each a thousandth of the one before. */
const UNITS = ['m', 'mm', 'µm', 'nm'];

/**
 * Formats lengths, areas (power 2) or volumes (power 3) with their unit, as "0.5 × 0.5 × 2 µm". If the smallest
 * value would need a power of ten, all are converted to a smaller unit; units other than those of length are kept.
 */
export function lengths(values: readonly number[], unit: string, power: 1 | 2 | 3 = 1): string {
  const raised = ['', '²', '³'][power - 1] ?? '';
  const least = Math.min(...values.map(Math.abs).filter((value) => value > 0));
  const finer = UNITS[UNITS.indexOf(unit) + 1];
  if (least < 1e-3 && UNITS.includes(unit) && finer)
    return lengths(
      values.map((value) => value * 1000 ** power),
      finer,
      power,
    );
  return `${values.map(figure).join(' × ')} ${unit && unit + raised}`.trim();
}

export function milliseconds(value: number): string {
  return value < 1000
    ? text('controls.milliseconds', { value: figure(Math.round(value)) })
    : text('controls.seconds', { value: (value / 1000).toFixed(2) });
}

/** Returns Lachaud and Montanvert's symbol for the image on a level of the pyramid: I₀ is the volume itself. */
export function levelSymbol(level: number): string {
  return `I${[...String(level)].map((digit) => '₀₁₂₃₄₅₆₇₈₉'[Number(digit)]).join('')}`;
}

/** Formats a number of bytes, as "12.3 MB". */
export function bytes(value: number): string {
  const units = ['B', 'kB', 'MB', 'GB', 'TB', 'PB'];
  const step = value < 1000 ? 0 : Math.min(Math.floor(Math.log10(value) / 3), units.length - 1);
  return `${(value / 1000 ** step).toFixed(step === 0 ? 0 : 1)} ${units[step]}`;
}
