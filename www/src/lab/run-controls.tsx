import { type ReadonlySignal, signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { toFailure } from '../engine/failure';
import type { ExportRequest, Unit } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import { Finish } from '../finish';
import { ExportButtons, Exports, RECENTRED } from '../kit/exports';
import type { History } from '../kit/history';
import type { SurfaceMeasures } from '../kit/measures';
import type { CodeEvents } from '../kit/session';
import type { LabState } from '../kit/state';
import { RunState, Transport, type TransportEvents } from '../kit/transport';
import { Button } from '../kit/ui/parts';
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
type RunPage = Pick<LabPage<never>, 'unit' | 'code' | 'saving' | 'warnings' | 'saveSection' | 'showLoading'>;

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
  readonly transport = new RunState();
  readonly exports: Exports;
  /** Whether there are data of plots to save. */
  readonly hasPlots = signal(false);
  readonly history: History;
  readonly #options: RunOptions;
  readonly #events: OwnRunEvents;
  #space: SurfaceSpace = {};
  #edited: EditedView | undefined;
  finish: Finish | undefined;
  /** Called when the surface was saved as a file. */
  onSurfaceSaved: () => void = () => undefined;

  constructor(page: RunPage, events: OwnRunEvents & Pick<LabEvents<never>, 'onError'>, options: RunOptions) {
    const { history } = options;
    this.#page = page;
    this.#options = options;
    this.history = history;
    this.#events = events;
    page.code = events;
    this.exports = new Exports((request, type) => {
      this.#save(request, type).catch((error) => events.onError(text('labs.saveFailed'), error));
    });
  }

  /** The controls of the run. */
  get controls(): ComponentChildren {
    return <Transport run={this.transport} events={this.#events} />;
  }

  /** The button that saves the data of the plots. */
  get plotData(): ComponentChildren {
    const { saving, warnings } = this.#page;
    const save = () => saving.plots(this.history, warnings.all, this.#options.residual);
    return <PlotData isEnabled={this.hasPlots} onSave={save} />;
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
    this.exports.of(space.space);
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

  /** Returns the section that saves and shares results, with pictures and films of `subject`. */
  saveSection(subject: PictureSubject, more?: ComponentChildren): ComponentChildren {
    const views = (
      <>
        <ExportButtons exports={this.exports} />
        {more}
      </>
    );
    return this.#page.saveSection(subject, views, this.#events.onToggle);
  }

  /**
   * Returns the sections that edit the surface after a run and compare it with a reference. `onOpen` is called before
   * the surface is taken.
   */
  finishSections(view: EditedView, measures: SurfaceMeasures, onOpen = () => {}): ComponentChildren {
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
    return this.finish.sections;
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

function PlotData({ isEnabled, onSave }: { isEnabled: ReadonlySignal<boolean>; onSave: () => void }) {
  return (
    <Button disabled={!isEnabled.value} onClick={onSave}>
      {text('labs.plotData')}
    </Button>
  );
}
