import { toFailure } from '../engine/failure';
import type { ExportRequest, Unit } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import { Finish } from '../finish';
import { h } from '../kit/dom';
import { ExportButtons, RECENTRED } from '../kit/exports';
import type { History } from '../kit/history';
import type { MeasurePanel } from '../kit/measures';
import type { CodeEvents } from '../kit/session';
import type { LabState } from '../kit/state';
import { Transport, type TransportEvents } from '../kit/transport';
import type { EditedView } from '../scene/edited-view';
import type { PictureSubject } from '../scene/pictures';
import { text } from '../texts';
import type { LabEvents, LabPage } from './page';
import type { SurfaceSpace } from './surface-space';

/** The user's actions on a run. */
interface OwnRunEvents extends TransportEvents, CodeEvents {}

/** The user's actions in a lab whose model runs. */
export interface RunEvents<Example> extends LabEvents<Example>, OwnRunEvents {}

/** The page of the lab, as the controls of a run use it. */
type RunPage = Pick<LabPage<never>, 'unit' | 'session' | 'saving' | 'warnings' | 'saveSection' | 'showLoading'>;

interface RunOptions {
  history: History;
  /** Returns the present surface as a file, with warnings besides those that it has itself. */
  fetchMesh: (request: ExportRequest) => Promise<Uint8Array>;
  /** Heading of the column of residuals in the data of the plots. */
  residual?: string;
  /** Returns what is added to the names of saved surfaces, to distinguish several of the same data; without it, nothing. */
  suffix?: () => string;
  /** Returns those of the warnings that concern the surface shown; without it, all do. */
  concerningSurface?: (warnings: readonly Warning[]) => readonly Warning[];
}

/** Controls of a lab whose model runs, besides those of its page: the run, and its surface. */
export class RunControls {
  readonly #page: RunPage;
  readonly transport: Transport;
  readonly exports: ExportButtons;
  readonly csv: HTMLButtonElement;
  readonly history: History;
  readonly #options: RunOptions;
  readonly #onRun: () => void;
  #space: SurfaceSpace = {};
  #edited: EditedView | undefined;
  finish: Finish | undefined;
  /** Called when the surface was saved as a file. */
  onSurfaceSaved: () => void = () => undefined;

  constructor(page: RunPage, events: OwnRunEvents & Pick<LabEvents<never>, 'onError'>, options: RunOptions) {
    const { history, residual } = options;
    this.#page = page;
    this.#options = options;
    this.history = history;
    this.transport = new Transport(events);
    page.session.addCode(events);
    this.#onRun = events.onToggle;
    this.exports = new ExportButtons((request, type) => {
      this.#save(request, type).catch((error) => events.onError(text('labs.saveFailed'), error));
    });
    this.csv = h(
      'button',
      { type: 'button', disabled: true, onclick: () => page.saving.plots(history, page.warnings.all, residual) },
      text('labs.plotData'),
    );
  }

  /** Unit of length of the data and of the surface; empty if unknown. */
  set unit(unit: Unit) {
    this.#page.unit = unit;
    if (this.finish) this.finish.unit = unit;
  }

  /** Directions of the axes of the surface, and the length of a unit, if these are known: files of it state them. */
  get surfaceSpace(): SurfaceSpace {
    return this.#space;
  }

  set surfaceSpace(space: SurfaceSpace) {
    this.#space = space;
    this.exports.space = space.space;
  }

  /** Returns the surface, edited if it is, as a file. */
  surfaceFile(given: ExportRequest): Promise<Uint8Array> {
    const request = { ...given, ...this.#space, warnings: this.surfaceWarnings };
    return this.finish?.exported(request) ?? this.#options.fetchMesh(request);
  }

  /** Saves the surface, or offers to save it at the origin if the format is too coarse for it where it is. */
  async #save(request: ExportRequest, type: string): Promise<void> {
    const { format, recentre } = request;
    try {
      const bytes = await this.surfaceFile(request);
      const suffix = this.#options.suffix?.() ?? '';
      this.#page.saving.bytes(format, bytes, type, `${suffix}${recentre ? RECENTRED : ''}`);
      this.onSurfaceSaved();
    } catch (error) {
      const origin = this.finish?.origin ?? this.#edited?.origin;
      if (toFailure(error).code !== 'precision' || !origin) throw error;
      this.exports.offer(format, type, origin);
    }
  }

  /** Creates the section that saves and shares results, with pictures and films of `subject`. */
  saveSection(subject: PictureSubject, ...elements: HTMLElement[]): HTMLElement {
    return this.#page.saveSection(subject, [this.exports.element, ...elements], this.#onRun);
  }

  /**
   * Creates the sections that edit the surface after a run and compare it with a reference. `onOpen` is called before
   * the surface is taken.
   */
  finishSections(view: EditedView, measures: MeasurePanel, onOpen = () => {}): HTMLElement[] {
    const mesh = () => {
      onOpen();
      return this.#options.fetchMesh({ format: 'ply', ...this.#space });
    };
    this.#edited = view;
    this.finish = new Finish({
      mesh,
      view,
      measures,
      warnings: () => this.surfaceWarnings,
      save: (...file) => this.#page.saving.bytes(...file),
    });
    return this.finish.elements;
  }

  /**
   * Enables and disables controls according to the lab's state, and that of the model `beneath` an error. Returns
   * whether nothing is being loaded.
   */
  showState(state: LabState, beneath: LabState, ready: boolean, hasSurface = true): boolean {
    const idle = this.#page.showLoading(state, ready);
    this.transport.showState(beneath, ready);
    this.exports.enabled = idle;
    if (!idle || state === 'running') this.finish?.reset();
    if (this.finish) this.finish.enabled = idle && state !== 'running' && hasSurface;
    return idle;
  }

  dispose(): void {
    this.finish?.close();
  }

  /** The warnings that concern the surface shown. */
  get surfaceWarnings(): readonly Warning[] {
    const { all } = this.#page.warnings;
    return this.#options.concerningSurface?.(all) ?? all;
  }

  /** Shows the warnings of the last report of the run. */
  showWarnings(): void {
    this.#page.warnings.showReport(this.history.reports.at(-1));
  }
}
