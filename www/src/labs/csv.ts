import type { History } from '../ui/history';

const PLAIN = ['iteration', 'phase', 'residual', 'tolerance', 'vertices', 'triangles', 'components', 'euler'] as const;
const EVENTS = ['creations', 'deletions', 'inversions', 'axial', 'annular', 'vanished', 'seeds'] as const;

/** One line an iteration: all that the plots, the list of events and the table of times show. Times in milliseconds; `residual` is what the method calls it. */
export function toCsv({ reports }: History, residual = 'energy'): string {
  const parts = [...new Set(reports.flatMap(({ times }) => Object.keys(times)))];
  const head = [...PLAIN.map((name) => (name === 'residual' ? residual : name)), ...EVENTS, ...parts.map(inMs)];
  const lines = reports.map((report) => [
    ...PLAIN.map((name) => report[name]),
    ...EVENTS.map((name) => report.events[name]),
    ...parts.map((part) => Number((report.times[part] ?? 0).toFixed(3))),
  ]);
  return `${[head, ...lines].map((line) => line.join(',')).join('\n')}\n`;
}

const inMs = (part: string) => `${part} (ms)`;
