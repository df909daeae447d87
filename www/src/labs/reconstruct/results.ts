import { count, figure } from '../../kit/format';
import { type History, underWay } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { LabStates } from '../../lab/states';
import { plural, text } from '../../texts';
import type { ReconstructClient } from './client';
import { fitValues } from './measures';
import { overallProgress, phaseName } from './panels/phases';
import type { ReconstructParts } from './parts';
import type { ConstraintsEvent, MeasuredEvent, ProgressEvent, SurfaceEvent, TimedEvent } from './protocol';

export type ResultEvent = ProgressEvent | SurfaceEvent | ConstraintsEvent | MeasuredEvent | TimedEvent;

/** Displays the results of the Reconstruct lab's worker: progress, constraints, surface and measures. */
export class ReconstructResults {
  readonly #client: ReconstructClient;
  readonly #ui: ReconstructParts;
  readonly #states: LabStates;
  readonly #history: History;
  /** Whether the newest surface, displayed or about to be, is complete; previews must not replace it. */
  #complete = false;
  /** The newest surface, until it is displayed at the next animation frame. */
  #surface: SurfaceEvent | undefined;
  #framePending = 0;

  constructor(client: ReconstructClient, ui: ReconstructParts, states: LabStates, history: History) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#history = history;
  }

  /** Whether there is a complete surface, which can be saved or passed to another lab. */
  get complete(): boolean {
    return this.#complete;
  }

  take(event: ResultEvent): void {
    switch (event.event) {
      case 'progress':
        this.#history.add(event.reports);
        this.#showHistory();
        if (this.#states.value === 'running') this.#ui.page.status.report(() => underWay(this.#history));
        break;
      case 'surface':
        this.#takeSurface(event);
        break;
      case 'constraints':
        this.#ui.view.showConstraints(event.surface, event.exterior);
        break;
      case 'measured':
        this.#showMeasures(event);
        break;
      case 'timed':
        this.#ui.timing.add(event.timing);
    }
  }

  /**
   * Describes the lab's state in the status line; if a finished run has no surface, a banner explains possible causes.
   */
  showState(state: LabState): void {
    this.#showHistory();
    this.#ui.page.status.say(this.describe(state));
    if (state === 'done' && this.#history.reports.at(-1)?.vertices === 0) this.#showNothing();
  }

  /** Returns the text for the status line in a state of the lab. */
  describe(state: LabState): string {
    const last = this.#history.reports.at(-1);
    if (state === 'running') return text('labs.running');
    if (!last) return text('labs.readyToStart');
    if (state !== 'done')
      return text('reconstruct.pausedAt', { iteration: count(last.iteration), phase: phaseName(last.phase) });
    if (last.vertices === 0) return text('reconstruct.noSurfaceDone');
    return text('reconstruct.done', {
      vertices: plural('counts.vertex', last.vertices),
      components: plural('counts.component', last.components),
      residual: figure(last.residual),
    });
  }

  /** Clears the history of iterations for a new run; the surface stays displayed until the new one is complete. */
  startOver(): void {
    this.#history.clear();
  }

  /** Clears the history of iterations and the surface; only the points stay displayed. */
  clear(): void {
    this.#complete = false;
    this.#surface = undefined;
    this.#history.clear();
    this.#ui.clearSurface();
    this.#showHistory();
  }

  close(): void {
    cancelAnimationFrame(this.#framePending);
  }

  /**
   * Displays a surface at the next animation frame; only then may the worker send another. A preview is dropped while a
   * complete surface is displayed.
   */
  #takeSurface(event: SurfaceEvent): void {
    if (event.preview && this.#complete) {
      this.#client.post({ kind: 'shown' });
      return;
    }
    this.#surface = event;
    this.#complete = !event.preview;
    this.#framePending ||= requestAnimationFrame(() => {
      this.#framePending = 0;
      if (this.#surface) this.#ui.view.showSurface(this.#surface.surface);
      this.#surface = undefined;
      this.#client.post({ kind: 'shown' });
    });
  }

  #showMeasures({ measures, fit }: MeasuredEvent): void {
    if (measures) this.#ui.measures.showMeasures(measures);
    this.#ui.measures.extra.value = fitValues(fit);
    this.#ui.showChoice(fit.choice);
    this.#ui.warning.value = fit.warning ?? '';
  }

  #showHistory(): void {
    const last = this.#history.reports.at(-1);
    this.#ui.run.transport.showReport(last && { ...last, progress: overallProgress(last) });
    this.#ui.page.warnings.showReport(last);
    this.#ui.showPhases(this.#history, this.#states.value === 'running');
    this.#ui.plots.update();
    this.#ui.run.hasPlots.value = this.#history.reports.length > 0;
  }

  /**
   * For a run that ended without a surface: clears the one displayed, which belongs to other settings, and shows a
   * banner with possible causes.
   */
  #showNothing(): void {
    this.#complete = false;
    this.#ui.clearSurface();
    this.#ui.page.banner.show(text('reconstruct.noSurface'), text('reconstruct.noSurfaceHint'));
  }
}
