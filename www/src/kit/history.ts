import type { StepReport } from '../engine/protocol';
import { plural, text } from '../texts';
import { count } from './format';

/** Numbers of topology changes at one iteration: joins (axial), cuts (annular), components that vanished, and seeds. */
export interface Change {
  iteration: number;
  axial: number;
  annular: number;
  vanished: number;
  seeds: number;
}

/** A position in the history of a run, to return to by undo. */
export interface HistoryMark {
  reports: readonly StepReport[];
  /** Iteration of the last report that belongs to the marked part of the history. */
  iteration: number;
}

/** Record of a run, for plots, logs and undo: all step reports, phase changes and topology changes. */
export class History {
  #reports: StepReport[] = [];
  /** First iteration of each phase; phases are named as in the reports ('level 2', 'level 1' ...). */
  readonly phases: { iteration: number; phase: string }[] = [];
  readonly changes: Change[] = [];
  /** Accumulated milliseconds of all steps, by phase and by part of a step. */
  readonly times = new Map<string, Map<string, number>>();

  get reports(): readonly StepReport[] {
    return this.#reports;
  }

  clear(): void {
    this.rewind({ reports: [], iteration: 0 });
  }

  /**
   * Returns a function that creates a mark in the current run, to return to by undo, for an iteration that becomes
   * known only later.
   */
  marker(): (iteration: number) => HistoryMark {
    const reports = this.#reports;
    return (iteration) => ({ reports, iteration });
  }

  /**
   * Restores the history as it was at a mark, for undo. Builds a new list of reports, since later marks still refer to
   * the old one.
   */
  rewind({ reports, iteration }: HistoryMark): void {
    this.#reports = [];
    this.phases.length = 0;
    this.changes.length = 0;
    this.times.clear();
    this.add(reports.filter((report) => report.iteration <= iteration));
  }

  /** Appends reports of steps, oldest first; returns whether the list contains any. */
  add(reports: readonly StepReport[]): boolean {
    for (const report of reports) this.#addOne(report);
    return reports.length > 0;
  }

  #addOne(report: StepReport): void {
    this.#reports.push(report);
    const { iteration, phase } = report;
    // Being done is not a phase.
    if (!report.done && this.phases.at(-1)?.phase !== phase) this.phases.push({ iteration, phase });
    const { axial, annular, vanished, seeds } = report.events;
    if (axial + annular + vanished + seeds > 0) this.changes.push({ iteration, axial, annular, vanished, seeds });
    const now = this.phases.at(-1)?.phase ?? phase;
    const times = this.times.get(now) ?? new Map<string, number>();
    this.times.set(now, times);
    for (const [part, time] of Object.entries(report.times)) times.set(part, (times.get(part) ?? 0) + time);
  }
}

/** Describes the progress of a run in words for the status line. */
export function underWay({ reports }: History): string {
  const last = reports.at(-1);
  if (!last) return text('measures.running');
  const { iteration, phase, vertices, components } = last;
  const surface = vertices > 0 ? plural('measures.runningSurface', components, { vertices: count(vertices) }) : '';
  return text('measures.runningAt', { iteration: count(iteration), phase, surface });
}

/** Describes in words the totals of all topology changes of a run. */
export function totals(changes: Change[]): string {
  const sum = (of: (change: Change) => number) => changes.reduce((total, change) => total + of(change), 0);
  const values = {
    joins: plural(
      'measures.joins',
      sum((change) => change.axial),
    ),
    cuts: plural(
      'measures.cuts',
      sum((change) => change.annular),
    ),
    vanished: plural(
      'measures.vanished',
      sum((change) => change.vanished),
    ),
  };
  const seeds = sum((change) => change.seeds);
  if (seeds === 0) return text('measures.eventTotals', values);
  return text('measures.eventTotalsSeeded', { ...values, seeded: count(seeds) });
}
