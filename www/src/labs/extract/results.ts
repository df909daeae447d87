import type { StepReport, Surface, VolumeView } from '../../engine/protocol';
import { count } from '../../kit/format';
import { type History, type HistoryMark, underWay } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { LabStates } from '../../lab/states';
import { plural, text } from '../../texts';
import type { ExtractClient } from './client';
import type { ExtractParts } from './parts';
import type { ProgressEvent, SectionsEvent, SnapshotEvent } from './protocol';

export type ResultEvent = SnapshotEvent | ProgressEvent | SectionsEvent;

const VANISHED = text('extract.vanishedHint');

/** Displays the results of the Extract lab's worker: surface, cross-sections, measures and history of steps. */
export class ExtractResults {
  readonly #client: ExtractClient;
  readonly #ui: ExtractParts;
  readonly #states: LabStates;
  readonly #history: History;
  /** Pyramid level that the model is on; 0 is the finest. */
  #level = 0;
  /** Newest snapshot of the model, until it is displayed. */
  #snapshot: SnapshotEvent | undefined;
  /** The displayed surface, which is returned to the worker when another is displayed. */
  #shown: Surface | undefined;
  #framePending = 0;
  /** Counts requests for the pyramid, so that only the reply to the newest is displayed. */
  #pyramids = 0;

  constructor(client: ExtractClient, ui: ExtractParts, states: LabStates, history: History) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#history = history;
  }

  take(event: ResultEvent): void {
    if (event.event === 'snapshot') this.#takeSnapshot(event);
    else if (event.event === 'progress') this.#takeReports(event.reports);
    else this.#ui.stage.showSections(event.sections);
  }

  /** Clears the displayed history of steps, for a newly built model. */
  startOver(): void {
    this.#history.clear();
    this.#ui.replaceHistory();
  }

  /**
   * Returns a function that creates a mark, for undo to return to, in the history of the present run at an iteration
   * that may become known later.
   */
  marker(): (iteration: number) => HistoryMark {
    return this.#history.marker();
  }

  rewind(mark: HistoryMark): void {
    this.#history.rewind(mark);
    this.#ui.replaceHistory();
  }

  /**
   * Requests the `levels` coarser levels of the image pyramid from the worker, and displays them with the volume
   * itself; of a volume larger than memory none, since only parts of its levels are read.
   */
  async showPyramid({ dims, large }: VolumeView, levels: number): Promise<void> {
    const asked = ++this.#pyramids;
    if (large) return this.#ui.pyramid.clear();
    try {
      const coarser = await this.#client.request('pyramid', { levels });
      if (asked === this.#pyramids) this.#ui.pyramid.setLevels(dims, coarser, this.#level);
    } catch (error) {
      if (asked === this.#pyramids) this.#states.fail(text('extract.pyramidFailed'), error);
    }
  }

  /** Describes the lab's state in the status line; if the surface has vanished, a banner explains possible causes. */
  showState(state: LabState): void {
    this.#ui.page.status.say(this.describe(state));
    if (this.#history.reports.at(-1)?.vertices === 0) this.#ui.page.banner.show(text('extract.vanished'), VANISHED);
  }

  /** Returns the text for the status line in a state of the lab. */
  describe(state: LabState): string {
    const last = this.#history.reports.at(-1);
    if (!last) return state === 'running' ? text('labs.running') : text('labs.readyToStart');
    if (last.vertices === 0) return text('extract.vanishedAt', { iteration: count(last.iteration) });
    if (state === 'running') return text('labs.running');
    const where = text('labs.surfaceSize', {
      vertices: plural('counts.vertex', last.vertices),
      components: plural('counts.component', last.components),
    });
    if (state === 'done') return text('extract.converged', { iterations: count(last.iteration), surface: where });
    return text('extract.pausedAt', { iteration: count(last.iteration), surface: where });
  }

  /**
   * Forgets the displayed buffers, which belong to an engine that was replaced, so that they are not returned to the
   * new one.
   */
  forgetBuffers(): void {
    this.#shown = undefined;
  }

  close(): void {
    this.#pyramids += 1;
    cancelAnimationFrame(this.#framePending);
  }

  /**
   * Displays a snapshot at the next animation frame, and then returns the buffers of the previous one to the worker,
   * which sends no further snapshot without free buffers.
   */
  #takeSnapshot(event: SnapshotEvent): void {
    this.#takeReports(event.reports);
    if (this.#snapshot) this.#return(this.#snapshot.surface);
    this.#snapshot = event;
    this.#level = event.level;
    this.#ui.pyramid.setInUse(event.level);
    this.#showMeasures(event);
    this.#framePending ||= requestAnimationFrame(() => this.#showSnapshot());
  }

  #showSnapshot(): void {
    this.#framePending = 0;
    const snapshot = this.#snapshot;
    if (!snapshot) return;
    this.#snapshot = undefined;
    this.#ui.stage.showSurface(snapshot.surface);
    this.#ui.stage.showSections(snapshot.sections);
    // The previous surface is no longer drawn.
    if (this.#shown) this.#return(this.#shown);
    this.#shown = snapshot.surface;
    this.#ui.showHistory();
  }

  /**
   * Returns to the worker a surface that is no longer drawn, which also tells it that the page is ready for the next
   * surface.
   */
  #return({ values: _, ...drawn }: Surface): void {
    const { positions, normals, indices } = drawn;
    this.#client.post({ kind: 'return', drawn }, [positions.buffer, normals.buffer, indices.buffer]);
  }

  #takeReports(reports: StepReport[]): void {
    if (!this.#history.add(reports)) return;
    this.#ui.run.transport.showReport(reports.at(-1));
    if (this.#states.value === 'running') this.#ui.page.status.report(() => underWay(this.#history));
  }

  #showMeasures({ measures }: SnapshotEvent): void {
    const last = this.#history.reports.at(-1);
    if (measures) this.#ui.measures.showMeasures(measures);
    else if (last) this.#ui.measures.showReport(last);
  }
}
