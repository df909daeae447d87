import type { StepReport } from '../protocol';
import { count, plural } from './format';

/** Steps at which the topology changed. */
export interface Change {
  iteration: number;
  axial: number;
  annular: number;
  vanished: number;
  seeds: number;
}

/** A place in a history to come back to. */
export interface HistoryMark {
  reports: readonly StepReport[];
  /** The last iteration that counts. */
  iteration: number;
}

/** What happened since the model started: every report, and the moments worth marking. */
export class History {
  #reports: StepReport[] = [];
  /** The first iteration of each phase ('level 2', 'level 1' ...). */
  readonly phases: { iteration: number; phase: string }[] = [];
  readonly changes: Change[] = [];
  /** Milliseconds by phase and part, all steps together. */
  readonly times = new Map<string, Map<string, number>>();

  get reports(): readonly StepReport[] {
    return this.#reports;
  }

  clear(): void {
    this.rewind({ reports: [], iteration: 0 });
  }

  /** Marks this run at an iteration, which may be told only later. */
  marker(): (iteration: number) => HistoryMark {
    const reports = this.#reports;
    return (iteration) => ({ reports, iteration });
  }

  /** Everything as it was then. The list that was added to since stays as it is, for whoever marked it. */
  rewind({ reports, iteration }: HistoryMark): void {
    this.#reports = [];
    this.phases.length = 0;
    this.changes.length = 0;
    this.times.clear();
    this.add(reports.filter((report) => report.iteration <= iteration));
  }

  /** Takes reports in, oldest first; returns whether there was any. */
  add(reports: readonly StepReport[]): boolean {
    for (const report of reports) this.#addOne(report);
    return reports.length > 0;
  }

  #addOne(report: StepReport): void {
    this.#reports.push(report);
    const { iteration, phase } = report;
    // Being done is no phase of its own.
    if (!report.done && this.phases.at(-1)?.phase !== phase) this.phases.push({ iteration, phase });
    const { axial, annular, vanished, seeds } = report.events;
    if (axial + annular + vanished + seeds > 0) this.changes.push({ iteration, axial, annular, vanished, seeds });
    const now = this.phases.at(-1)?.phase ?? phase;
    const times = this.times.get(now) ?? new Map<string, number>();
    this.times.set(now, times);
    for (const [part, time] of Object.entries(report.times)) times.set(part, (times.get(part) ?? 0) + time);
  }
}

/** How far a run is, for the status line. */
export function underWay({ reports }: History): string {
  const last = reports.at(-1);
  if (!last) return 'Running.';
  const { iteration, phase, vertices, components } = last;
  const surface = vertices > 0 ? `: ${count(vertices)} vertices in ${plural(components, 'component')}` : '';
  return `Running. Iteration ${count(iteration)}, ${phase}${surface}.`;
}
