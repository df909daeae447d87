import { toFailure } from '../engine/channel';
import type { ExportRequest, ParamSpec, ParamValues, Unit } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import { Finish } from '../finish';
import type { Admission } from '../importers';
import { acceptDrops } from '../importers/files';
import { folded, h, section, wideButton } from '../kit/dom';
import { ExportButtons, RECENTRED } from '../kit/exports';
import type { History } from '../kit/history';
import type { MeasurePanel } from '../kit/measures';
import { ParamControls } from '../kit/params';
import { type CodeEvents, SessionControls, type SessionEvents } from '../kit/session';
import type { LabState } from '../kit/state';
import { ErrorBanner, StatusLine } from '../kit/status';
import { Transport, type TransportEvents } from '../kit/transport';
import { WarningList } from '../kit/warnings';
import type { EditedView } from '../scene/edited-view';
import { PicturePanel, type PictureSubject } from '../scene/pictures';
import { text } from '../texts';
import type { ExamplePanel, Listed } from './example-panel';
import { Saving } from './saving';
import type { SurfaceSpace } from './surface-space';

/** The user's actions that all labs have. */
export interface LabEvents<Example> extends SessionEvents {
  onFiles: (files: File[]) => void;
  onExample: (example: Example) => void;
  onParam: (name: string, value: unknown) => void;
  onCancel: () => void;
  onDismiss: () => void;
  onCopyLink: () => void;
  onError: (title: string, error: unknown) => void;
}

/** The user's actions in a lab whose model runs. */
export interface RunEvents<Example> extends LabEvents<Example>, TransportEvents, CodeEvents {}

/** Contents that differ between the labs. */
interface PartsOptions<Example extends Listed> {
  /** Name of the 3D view, for screen readers. */
  viewLabel: string;
  /** Text shown while files are dragged over the page. */
  drop: string;
  /** Called when a folder is dropped; without it, folders are not accepted. */
  onFolder?: (folder: FileSystemDirectoryHandle) => void;
  /** Which of the files that are dropped are opened together. */
  admission: Admission;
  data: ExamplePanel<Example>;
  /** Names of parameters that have controls of their own. */
  ownControls?: string[];
  /** Describes a session of the lab. */
  sessionHelp?: string;
}

/** Returns the present surface as a file, with warnings besides those that it has itself. */
export type FetchMesh = (request: ExportRequest) => Promise<Uint8Array>;

interface RunPartsOptions<Example extends Listed> extends PartsOptions<Example> {
  history: History;
  fetchMesh: FetchMesh;
  /** Heading of the column of residuals in the data of the plots. */
  residual?: string;
}

/** Arrangement of a lab's elements on its page. */
interface Layout {
  /** Class of the lab's page, besides `lab`. */
  name: string;
  options: HTMLElement;
  /** Elements over the 3D view. */
  over?: HTMLElement[];
  /** Elements beside the 3D view. */
  beside?: HTMLElement[];
  /** Returns the contents of the middle of the page, among them the view and the status line. */
  stage: (view: HTMLElement, status: HTMLElement) => HTMLElement[];
  setup: HTMLElement[];
  results: HTMLElement[];
}

/**
 * Controls and views of a lab, laid out: here those that all labs have. They display what they are given and report the
 * user's actions as events.
 */
export abstract class LabParts<Example extends Listed> {
  readonly status = new StatusLine();
  readonly banner: ErrorBanner;
  readonly data: ExamplePanel<Example>;
  /** Warnings about data and result. */
  readonly warnings = new WarningList();
  readonly saving = new Saving((message) => this.status.say(message));
  /** Starts or continues the run, in labs whose model runs. */
  protected onRun: (() => void) | undefined;
  protected readonly root: HTMLElement;
  protected readonly canvas: HTMLCanvasElement;
  readonly #link: HTMLButtonElement;
  protected readonly cancel: HTMLButtonElement;
  protected readonly session: SessionControls;
  readonly #paramsHolder = h('div');
  readonly #drop: HTMLElement;
  readonly #ownControls: string[];
  readonly #onParam: LabEvents<Example>['onParam'];
  #params: ParamControls | undefined;
  #unit: Unit = '';
  #pictures: PicturePanel | undefined;
  readonly #signal: AbortSignal;

  /** Files dropped on the page are accepted until `signal` is aborted. */
  constructor(
    root: HTMLElement,
    signal: AbortSignal,
    events: LabEvents<Example>,
    { viewLabel, drop, onFolder, admission, data, ownControls = [], sessionHelp }: PartsOptions<Example>,
  ) {
    this.root = root;
    this.#signal = signal;
    this.data = data;
    this.#ownControls = ownControls;
    this.#onParam = events.onParam;
    this.canvas = h('canvas', { tabindex: 0, role: 'application', 'aria-label': viewLabel });
    this.banner = new ErrorBanner(events.onDismiss);
    this.session = new SessionControls(events, sessionHelp ?? text('sessions.saveHelp'));
    this.#link = wideButton(text('labs.copyLink'), 'link', events.onCopyLink);
    this.cancel = h(
      'button',
      { type: 'button', hidden: true, 'data-action': 'cancel', onclick: events.onCancel },
      text('labs.cancel'),
    );
    this.#drop = h('div', { class: 'drop', hidden: true }, drop);
    acceptDrops(this.#drop, events.onFiles, signal, { admission, onFolder });
  }

  /** Unit of length of the data; empty if unknown. */
  get unit(): Unit {
    return this.#unit;
  }

  set unit(unit: Unit) {
    this.#unit = unit;
  }

  protected layOut({ name, options, over = [], beside = [], stage, setup, results }: Layout): void {
    this.root.className = `lab ${name}`;
    const scene = h('div', { class: 'scene' }, this.canvas, ...over);
    const pictures = h('div', { class: 'pictures' }, scene, ...beside);
    const view = h('div', { class: 'view' }, options, pictures, this.banner.element, this.#drop);
    const status = h('div', { class: 'saying' }, this.status.element, this.cancel);
    this.root.replaceChildren(
      h('div', { class: 'stage' }, ...stage(view, status)),
      h('div', { class: 'column setup' }, ...setup),
      h('div', { class: 'column results' }, ...results),
    );
  }

  /** Makes the controls of the method's parameters, once these are known. */
  makeParams(specs: ParamSpec[]): void {
    if (this.#params) return;
    this.#params = new ParamControls(specs, this.#ownControls, this.#onParam);
    this.#paramsHolder.replaceWith(this.#params.element);
  }

  labelOf(param: string): string {
    return this.#params?.labelOf(param) ?? param;
  }

  /** Displays the parameters in force. */
  protected displayParams(params: ParamValues): void {
    this.#params?.show(params);
  }

  /** Displays the values that the method chose for automatic parameters, by name. */
  protected displayChosen(values: Record<string, number>): void {
    this.#params?.showChosen(values);
  }

  protected hideParams(hidden: Record<string, boolean>): void {
    this.#params?.hide(hidden);
  }

  /** Shows why a value was refused, beside its control, which displays the value in force again. */
  refuseParam(name: string, message: string, inForce?: ParamValues): void {
    if (inForce) this.#params?.show(inForce);
    this.#params?.showError(name, message);
  }

  /** Creates the section of the method's parameters, which is open on a wide page if `isOpen`. */
  protected paramsSection(isOpen = false): HTMLElement {
    const panel = folded(text('labs.parameters'), this.#paramsHolder);
    panel.open = isOpen && matchMedia('(min-width: 700px)').matches;
    return panel;
  }

  /** Creates the section that saves and shares results, with pictures and films of `subject`. */
  protected saveSection(subject: PictureSubject, ...elements: HTMLElement[]): HTMLElement {
    const pictures = new PicturePanel(subject, {
      unit: () => this.unit,
      save: (...file) => this.saving.bytes(...file),
      onRun: this.onRun,
    });
    this.#pictures = pictures;
    this.#signal.addEventListener('abort', () => pictures.dispose());
    return section(text('labs.sectionSave'), ...elements, this.session.element, pictures.element, this.#link);
  }

  /** Shows the button that cancels what the lab is busy with, or hides it. */
  offerCancel(isOffered: boolean): void {
    this.cancel.hidden = !isOffered;
  }

  /** Shows the lab's state; returns whether nothing is being loaded. */
  protected showLoading(state: LabState, ready: boolean): boolean {
    this.#pictures?.showState(state);
    const idle = ready && state !== 'loading';
    this.session.enabled = idle;
    return idle;
  }

  abstract dispose(): void;
}

/** Controls and views of a lab whose model runs. */
export abstract class RunParts<Example extends Listed> extends LabParts<Example> {
  readonly transport: Transport;
  protected readonly exports: ExportButtons;
  #space: SurfaceSpace = {};
  readonly csv: HTMLButtonElement;
  protected readonly history: History;
  readonly #fetchMesh: FetchMesh;
  #edited: EditedView | undefined;
  finish: Finish | undefined;
  /** Called when the surface was saved as a file. */
  onSurfaceSaved: () => void = () => undefined;

  constructor(
    root: HTMLElement,
    signal: AbortSignal,
    events: RunEvents<Example>,
    { history, fetchMesh, residual, ...options }: RunPartsOptions<Example>,
  ) {
    super(root, signal, events, options);
    this.history = history;
    this.#fetchMesh = fetchMesh;
    this.transport = new Transport(events);
    this.session.addCode(events);
    this.onRun = events.onToggle;
    this.exports = new ExportButtons((request, type) => {
      this.#save(request, type).catch((error) => events.onError(text('labs.saveFailed'), error));
    });
    this.csv = h(
      'button',
      { type: 'button', disabled: true, onclick: () => this.saving.plots(history, this.warnings.all, residual) },
      text('labs.plotData'),
    );
  }

  override get unit(): Unit {
    return super.unit;
  }

  /** Directions of the axes of the surface, and the length of a unit, if these are known: files of it state them. */
  get surfaceSpace(): SurfaceSpace {
    return this.#space;
  }

  set surfaceSpace(space: SurfaceSpace) {
    this.#space = space;
    this.exports.space = space.space;
  }

  override set unit(unit: Unit) {
    super.unit = unit;
    if (this.finish) this.finish.unit = unit;
  }

  /** Returns the surface, edited if it is, as a file. */
  surfaceFile(given: ExportRequest): Promise<Uint8Array> {
    const request = { ...given, ...this.#space, warnings: this.surfaceWarnings };
    return this.finish?.exported(request) ?? this.#fetchMesh(request);
  }

  /** Saves the surface, or offers to save it at the origin if the format is too coarse for it where it is. */
  async #save(request: ExportRequest, type: string): Promise<void> {
    const { format, recentre } = request;
    try {
      const bytes = await this.surfaceFile(request);
      this.saving.bytes(format, bytes, type, `${this.suffix}${recentre ? RECENTRED : ''}`);
      this.onSurfaceSaved();
    } catch (error) {
      const origin = this.finish?.origin ?? this.#edited?.origin;
      if (toFailure(error).code !== 'precision' || !origin) throw error;
      this.exports.offer(format, type, origin);
    }
  }

  protected override saveSection(subject: PictureSubject, ...elements: HTMLElement[]): HTMLElement {
    return super.saveSection(subject, this.exports.element, ...elements);
  }

  /**
   * Creates the sections that edit the surface after a run and compare it with a reference. `onOpen` is called before
   * the surface is taken.
   */
  protected finishSections(view: EditedView, measures: MeasurePanel, onOpen = () => {}): HTMLElement[] {
    const mesh = () => {
      onOpen();
      return this.#fetchMesh({ format: 'ply', ...this.#space });
    };
    this.#edited = view;
    this.finish = new Finish({
      mesh,
      view,
      measures,
      warnings: () => this.surfaceWarnings,
      save: (...file) => this.saving.bytes(...file),
    });
    return this.finish.elements;
  }

  /**
   * Enables and disables controls according to the lab's state, and that of the model `beneath` an error. Returns
   * whether nothing is being loaded.
   */
  protected showRunState(state: LabState, beneath: LabState, ready: boolean, hasSurface = true): boolean {
    const idle = this.showLoading(state, ready);
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
    return this.warnings.all;
  }

  /** Shows the warnings of the last report of the run. */
  protected showRunWarnings(): void {
    this.warnings.showReport(this.history.reports.at(-1));
  }

  /** Added to the names of saved surfaces, to distinguish several of the same data. */
  protected get suffix(): string {
    return '';
  }
}
