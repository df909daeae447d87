import { cellOf, keyOf, merged, type Warning } from '../engine/warnings';
import { csvOf } from '../kit/csv';
import type { History } from '../kit/history';

const PLAIN = ['iteration', 'phase', 'residual', 'tolerance', 'vertices', 'triangles', 'components', 'euler'] as const;
const EVENTS = ['creations', 'deletions', 'inversions', 'axial', 'annular', 'vanished', 'seeds'] as const;

/**
 * Returns the history of a run as CSV for saving, one line per iteration, with the data of the lab's plots, its list of
 * topology changes and its table of times (in milliseconds). `residual` is the heading of the residual's column, which
 * is a different quantity for each method.
 *
 * If there are warnings, those given or of a report, a last column has their codes, which is a cell of text for any
 * program that reads CSV; lines of comments would not be.
 */
export function toCsv({ reports }: History, warnings: readonly Warning[] = [], residual = 'energy'): string {
  const last = reports.at(-1)?.warnings ?? [];
  // The others are of the data, and hold at all iterations.
  const ofData = warnings.filter((one) => !last.some((other) => keyOf(other) === keyOf(one)));
  const warned = warnings.length > 0 || reports.some((report) => report.warnings?.length);
  const parts = [...new Set(reports.flatMap(({ times }) => Object.keys(times)))];
  const head = [
    ...PLAIN.map((name) => (name === 'residual' ? residual : name)),
    ...EVENTS,
    ...parts.map(millisecondsHeader),
    ...(warned ? ['warnings'] : []),
  ];
  const lines = reports.map((report) => [
    ...PLAIN.map((name) => report[name]),
    ...EVENTS.map((name) => report.events[name]),
    ...parts.map((part) => Number((report.times[part] ?? 0).toFixed(3))),
    ...(warned ? [cellOf(merged(ofData, report.warnings ?? []))] : []),
  ]);
  return csvOf([head, ...lines]);
}

const millisecondsHeader = (part: string) => `${part} (ms)`;
