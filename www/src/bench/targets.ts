import { LANGUAGE } from '../texts';

/** Target of a measurement: its largest or smallest permitted value. */
export interface Target {
  limit: number;
  sense: 'most' | 'least';
  /** Start of the names of the hosts to which the target applies; all hosts if undefined. */
  host?: string;
}

/** A bar of a chart: a measured value, or the reason why there is none. */
export interface Bar {
  /** The host (browser, Node or native code) or software that was measured. */
  label: string;
  value?: number;
  /** Remark displayed beside the value. */
  remark?: string;
  /** Reason, displayed in place of the bar, why there is no value. */
  skipped?: string;
}

/**
 * A group of bars in a chart: one measurement, with a bar for each host or package, and the target of the measurement.
 */
export interface Figure {
  name: string;
  bars: Bar[];
  target?: Target;
}

export const atMost = (limit: number, host?: string): Target => ({ limit, sense: 'most', host });
export const atLeast = (limit: number): Target => ({ limit, sense: 'least' });

/**
 * Returns whether a bar meets its figure's target; undefined if the bar has no value or the target does not apply to
 * it.
 */
export function meetsTarget({ target }: Figure, { label, value }: Bar): boolean | undefined {
  if (!target || value === undefined || (target.host && !label.startsWith(target.host))) return undefined;
  return target.sense === 'most' ? value <= target.limit : value >= target.limit;
}

/**
 * Returns the verdict on a figure, a measurement on several hosts: met only if all bars to which the target applies
 * meet it, not measured if none of them has a value.
 */
export function verdict(figure: Figure): 'met' | 'not met' | 'not measured' {
  const judged = figure.bars.map((bar) => meetsTarget(figure, bar)).filter((met) => met !== undefined);
  if (judged.length === 0) return 'not measured';
  return judged.every(Boolean) ? 'met' : 'not met';
}

/**
 * Formats a measured number with its unit, to three significant digits (integers from 100); seconds below 0.1 as
 * milliseconds.
 */
export function withUnit(value: number, unit: string): string {
  if (unit === 's' && value < 0.1) return withUnit(1000 * value, 'ms');
  const digits = Math.abs(value) >= 100 ? { maximumFractionDigits: 0 } : { maximumSignificantDigits: 3 };
  const number = new Intl.NumberFormat(LANGUAGE, digits).format(value);
  return unit === '×' ? `${number}×` : `${number} ${unit}`;
}

export function formatTarget({ limit, sense, host }: Target, unit: string): string {
  return `${sense === 'most' ? '≤' : '≥'} ${withUnit(limit, unit)}${host ? ` ${host}` : ''}`;
}

/** Shortens a host's name and version to the name and the major version, for display. */
export const shortHost = (host: string) => host.replace(/^(\S+ \d+)\..*/, '$1');
