/** What was asked of a figure. */
export interface Target {
  limit: number;
  sense: 'most' | 'least';
  /** Where it counts; everywhere unless said. */
  host?: string;
}

export interface Bar {
  /** Where it was measured, or whose it is. */
  label: string;
  value?: number;
  /** Beside the value. */
  remark?: string;
  /** Why there is no value. */
  skipped?: string;
}

export interface Figure {
  name: string;
  bars: Bar[];
  target?: Target;
}

export const atMost = (limit: number, host?: string): Target => ({ limit, sense: 'most', host });
export const atLeast = (limit: number): Target => ({ limit, sense: 'least' });

/** Whether a bar keeps to its figure's target; undefined where nothing is asked of it. */
export function meets({ target }: Figure, { label, value }: Bar): boolean | undefined {
  if (!target || value === undefined || (target.host && !label.startsWith(target.host))) return undefined;
  return target.sense === 'most' ? value <= target.limit : value >= target.limit;
}

/** A figure is as good as the worst of the bars that something is asked of. */
export function verdict(figure: Figure): 'met' | 'not met' | 'not measured' {
  const judged = figure.bars.map((bar) => meets(figure, bar)).filter((met) => met !== undefined);
  if (judged.length === 0) return 'not measured';
  return judged.every(Boolean) ? 'met' : 'not met';
}

/** A number with its unit, three digits of it. */
export function withUnit(value: number, unit: string): string {
  if (unit === 's' && value < 0.1) return withUnit(1000 * value, 'ms');
  const digits = Math.abs(value) >= 100 ? { maximumFractionDigits: 0 } : { maximumSignificantDigits: 3 };
  const number = new Intl.NumberFormat('en', digits).format(value);
  return unit === '×' ? `${number}×` : `${number} ${unit}`;
}

export function askedOf({ limit, sense, host }: Target, unit: string): string {
  return `${sense === 'most' ? '≤' : '≥'} ${withUnit(limit, unit)}${host ? ` ${host}` : ''}`;
}

/** A host without the small numbers of its version. */
export const shortHost = (host: string) => host.replace(/^(\S+ \d+)\..*/, '$1');
