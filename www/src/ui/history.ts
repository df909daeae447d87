import type { StepReport } from '../protocol';

/** Steps at which the topology changed. */
export interface Change {
  iteration: number;
  axial: number;
  annular: number;
  vanished: number;
}

/** What happened since the model started: every report, and the moments worth marking. */
export class History {
  readonly reports: StepReport[] = [];
  /** The first iteration of each phase ('level 2', 'level 1' ...). */
  readonly phases: { iteration: number; phase: string }[] = [];
  readonly changes: Change[] = [];
  /** Milliseconds by part, all steps together. */
  readonly times = new Map<string, number>();

  clear(): void {
    this.reports.length = 0;
    this.phases.length = 0;
    this.changes.length = 0;
    this.times.clear();
  }

  /** Takes reports in, oldest first; returns whether there was any. */
  add(reports: StepReport[]): boolean {
    for (const report of reports) this.#addOne(report);
    return reports.length > 0;
  }

  #addOne(report: StepReport): void {
    this.reports.push(report);
    const { iteration, phase } = report;
    if (this.phases.at(-1)?.phase !== phase) this.phases.push({ iteration, phase });
    const { axial, annular, vanished } = report.events;
    if (axial + annular + vanished > 0) this.changes.push({ iteration, axial, annular, vanished });
    for (const [part, time] of Object.entries(report.times)) this.times.set(part, (this.times.get(part) ?? 0) + time);
  }
}
