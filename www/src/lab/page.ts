import type { ParamSpec, ParamValues, Unit } from '../engine/protocol';
import type { Admission } from '../importers';
import { acceptDrops } from '../importers/files';
import { folded, h, section, wideButton } from '../kit/dom';
import { ParamControls } from '../kit/params';
import { SessionControls, type SessionEvents } from '../kit/session';
import type { LabState } from '../kit/state';
import { ErrorBanner, StatusLine } from '../kit/status';
import { WarningList } from '../kit/warnings';
import { PicturePanel, type PictureSubject } from '../scene/pictures';
import { text } from '../texts';
import type { ExamplePanel, Listed } from './example-panel';
import { Saving } from './saving';

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

/** Contents that differ between the labs. */
export interface PageOptions<Example extends Listed> {
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
  /** Called with the method's parameters once these are known, to make controls of their own for some. */
  onParams?: (specs: ParamSpec[]) => void;
  /** Describes a session of the lab. */
  sessionHelp?: string;
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
 * The page of a lab: the controls and views that all labs have, laid out with its own. They display what they are given and
 * report the user's actions as events.
 */
export class LabPage<Example extends Listed> {
  readonly status = new StatusLine();
  readonly banner: ErrorBanner;
  readonly data: ExamplePanel<Example>;
  /** Warnings about data and result. */
  readonly warnings = new WarningList();
  readonly saving = new Saving((message) => this.status.say(message));
  readonly root: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly session: SessionControls;
  readonly #link: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #paramsHolder = h('div');
  readonly #drop: HTMLElement;
  readonly #ownControls: string[];
  readonly #onParam: LabEvents<Example>['onParam'];
  readonly #onParams: PageOptions<Example>['onParams'];
  #params: ParamControls | undefined;
  /** Unit of length of the data; empty if unknown. */
  unit: Unit = '';
  #pictures: PicturePanel | undefined;
  readonly #signal: AbortSignal;

  /** Files dropped on the page are accepted until `signal` is aborted. */
  constructor(
    root: HTMLElement,
    signal: AbortSignal,
    events: LabEvents<Example>,
    { viewLabel, drop, onFolder, admission, data, ownControls = [], onParams, sessionHelp }: PageOptions<Example>,
  ) {
    this.root = root;
    this.#signal = signal;
    this.data = data;
    this.#ownControls = ownControls;
    this.#onParam = events.onParam;
    this.#onParams = onParams;
    this.canvas = h('canvas', { tabindex: 0, role: 'application', 'aria-label': viewLabel });
    this.banner = new ErrorBanner(events.onDismiss);
    this.session = new SessionControls(events, sessionHelp ?? text('sessions.saveHelp'));
    this.#link = wideButton(text('labs.copyLink'), 'link', events.onCopyLink);
    this.#cancel = h(
      'button',
      { type: 'button', hidden: true, 'data-action': 'cancel', onclick: events.onCancel },
      text('labs.cancel'),
    );
    this.#drop = h('div', { class: 'drop', hidden: true }, drop);
    acceptDrops(this.#drop, events.onFiles, signal, { admission, onFolder });
  }

  /** Arranges the elements. */
  layOut({ name, options, over = [], beside = [], stage, setup, results }: Layout): void {
    this.root.className = `lab ${name}`;
    const scene = h('div', { class: 'scene' }, this.canvas, ...over);
    const pictures = h('div', { class: 'pictures' }, scene, ...beside);
    const view = h('div', { class: 'view' }, options, pictures, this.banner.element, this.#drop);
    const status = h('div', { class: 'saying' }, this.status.element, this.#cancel);
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
    this.#onParams?.(specs);
  }

  labelOf(param: string): string {
    return this.#params?.labelOf(param) ?? param;
  }

  /** Displays the parameters in force. */
  showParams(params: ParamValues): void {
    this.#params?.show(params);
  }

  /** Displays the values that the method chose for automatic parameters, by name. */
  showChosen(values: Record<string, number>): void {
    this.#params?.showChosen(values);
  }

  hideParams(hidden: Record<string, boolean>): void {
    this.#params?.hide(hidden);
  }

  /** Shows why a value was refused, beside its control, which displays the value in force again. */
  refuseParam(name: string, message: string, inForce?: ParamValues): void {
    if (inForce) this.#params?.show(inForce);
    this.#params?.showError(name, message);
  }

  /** Creates the section of the method's parameters, which is open on a wide page if `isOpen`. */
  paramsSection(isOpen = false): HTMLElement {
    const panel = folded(text('labs.parameters'), this.#paramsHolder);
    panel.open = isOpen && matchMedia('(min-width: 700px)').matches;
    return panel;
  }

  /**
   * Creates the section that saves and shares results, with pictures and films of `subject`. `onRun` starts or continues
   * the run, if the model runs.
   */
  saveSection(subject: PictureSubject, elements: HTMLElement[] = [], onRun?: () => void): HTMLElement {
    const pictures = new PicturePanel(subject, {
      unit: () => this.unit,
      save: (...file) => this.saving.bytes(...file),
      onRun,
    });
    this.#pictures = pictures;
    this.#signal.addEventListener('abort', () => pictures.dispose());
    return section(text('labs.sectionSave'), ...elements, this.session.element, pictures.element, this.#link);
  }

  /** Shows the button that cancels what the lab is busy with, or hides it. */
  offerCancel(isOffered: boolean): void {
    this.#cancel.hidden = !isOffered;
  }

  /** Shows the lab's state; returns whether nothing is being loaded. */
  showLoading(state: LabState, ready: boolean): boolean {
    this.#pictures?.showState(state);
    const idle = ready && state !== 'loading';
    this.session.enabled = idle;
    return idle;
  }
}
