import type { History } from '../ui/history';

const PLAIN = ['iteration', 'phase', 'residual', 'tolerance', 'vertices', 'triangles', 'components', 'euler'] as const;
const EVENTS = ['creations', 'deletions', 'inversions', 'axial', 'annular', 'vanished', 'seeds'] as const;

/**
 * Returns the history of a run as CSV for saving, one line per iteration, with the data of the lab's plots, its list of
 * topology changes and its table of times (in milliseconds). `residual` is the heading of the residual's column, which
 * is a different quantity for each method.
 */
export function toCsv({ reports }: History, residual = 'energy'): string {
  const parts = [...new Set(reports.flatMap(({ times }) => Object.keys(times)))];
  const head = [
    ...PLAIN.map((name) => (name === 'residual' ? residual : name)),
    ...EVENTS,
    ...parts.map(millisecondsHeader),
  ];
  const lines = reports.map((report) => [
    ...PLAIN.map((name) => report[name]),
    ...EVENTS.map((name) => report.events[name]),
    ...parts.map((part) => Number((report.times[part] ?? 0).toFixed(3))),
  ]);
  return `${[head, ...lines].map((line) => line.join(',')).join('\n')}\n`;
}

const millisecondsHeader = (part: string) => `${part} (ms)`;
