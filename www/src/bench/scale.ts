/** Scale of a chart's axis, mapping values to 0 at its left end and 1 at its right. */
export interface Scale {
  at: (value: number) => number;
  /** Position on the axis, 0 to 1, at which bars start: that of the value 1 for ratios, else the left end. */
  base: number;
  ticks: number[];
}

export type Kind = 'linear' | 'log' | 'ratio';

/**
 * Returns a scale for a chart's values: from 0 to above the largest (`linear`), between powers of ten (`log`), or the
 * same with bars that start at 1 (`ratio`). Ignores values that are not finite and, on logarithmic scales, those not
 * above 0; positions outside the scale are moved to its ends.
 */
export function scaleOf(kind: Kind, values: number[]): Scale {
  const good = values.filter((value) => Number.isFinite(value) && (kind === 'linear' || value > 0));
  if (kind === 'linear') return linear(Math.max(...good, 0));
  return kind === 'ratio' ? decades([...good, 1], 1) : decades(good.length > 0 ? good : [1]);
}

function linear(most: number): Scale {
  const step = niceStep(most || 1);
  // Leaves some space to the right of the longest bar.
  const end = Math.max(most * 1.02, step);
  const ticks = Array.from({ length: Math.floor(end / step + 1e-9) + 1 }, (_, k) => k * step);
  return { at: (value) => clamped(value / end), base: 0, ticks };
}

/**
 * Returns the distance between the ticks of an axis: the least value, 1, 2 or 5 times a power of ten, that is at least
 * a quarter of the length of the axis.
 */
function niceStep(length: number): number {
  const power = 10 ** Math.floor(Math.log10(length / 4));
  const part = length / 4 / power;
  return (part > 5 ? 10 : part > 2 ? 5 : part > 1 ? 2 : 1) * power;
}

function decades(values: number[], base?: number): Scale {
  const low = Math.floor(Math.log10(Math.min(...values)) + 1e-9);
  const high = Math.max(Math.ceil(Math.log10(Math.max(...values)) - 1e-9), low + 1);
  const ticks = Array.from({ length: high - low + 1 }, (_, k) => 10 ** (low + k));
  const at = (value: number) => clamped((Math.log10(value) - low) / (high - low));
  return { at, base: at(base ?? 10 ** low), ticks };
}

const clamped = (share: number) => Math.min(Math.max(share, 0), 1);
