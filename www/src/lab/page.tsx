import { type ReadonlySignal, signal } from '@preact/signals';
import { type ComponentChildren, render } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import type { ParamSpec, ParamValues, Unit } from '../engine/protocol';
import type { Admission } from '../importers';
import { acceptDrops } from '../importers/files';
import { ParamControls, Params } from '../kit/params';
import { type CodeEvents, SessionControls, type SessionEvents } from '../kit/session';
import type { LabState } from '../kit/state';
import { Banner, ErrorBanner, Status, StatusLine } from '../kit/status';
import { Button, Folded, Section } from '../kit/ui/parts';
import { Warnings } from '../kit/warnings';
import { PicturePanel, type PictureSubject, Pictures } from '../scene/pictures';
import { text } from '../texts';
import type { Listed, OpenData } from './example-panel';
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
  data: OpenData<Example>;
  /** Names of parameters that have controls of their own. */
  ownControls?: string[];
  /** Called with the method's parameters once these are known, to make controls of their own for some. */
  onParams?: (specs: ParamSpec[]) => void;
  /** Describes a session of the lab. */
  sessionHelp?: string;
}

/** Arrangement of a lab's views on its page. */
interface Layout {
  /** Class of the lab's page, besides `lab`. */
  name: string;
  options: ComponentChildren;
  /** Views over the 3D view. */
  over?: ComponentChildren;
  /** Views beside the 3D view. */
  beside?: ComponentChildren;
  /** Returns the contents of the middle of the page, among them the view and the status line. */
  stage: (view: ComponentChildren, status: ComponentChildren) => ComponentChildren;
  setup: ComponentChildren;
  results: ComponentChildren;
}

/**
 * The page of a lab: the controls and views that all labs have, laid out with its own. They display what they are given and
 * report the user's actions as events.
 */
export class LabPage<Example extends Listed> {
  readonly status = new Status();
  readonly banner = new Banner();
  readonly data: OpenData<Example>;
  /** Warnings about data and result. */
  readonly warnings = new Warnings();
  readonly params = new Params();
  readonly saving = new Saving((message) => this.status.say(message));
  readonly root: HTMLElement;
  readonly canvas = document.createElement('canvas');
  /** Unit of length of the data; empty if unknown. */
  unit: Unit = '';
  /** The controls for code, in labs whose model runs. */
  code: CodeEvents | undefined;
  /** Whether a session can be saved. */
  readonly canSave = signal(false);
  readonly #isCancellable = signal(false);
  readonly #isOver = signal(false);
  readonly #events: LabEvents<Example>;
  readonly #options: PageOptions<Example>;
  #pictures: Pictures | undefined;
  readonly #signal: AbortSignal;

  /** Files dropped on the page are accepted until `closed` is aborted. */
  constructor(root: HTMLElement, closed: AbortSignal, events: LabEvents<Example>, options: PageOptions<Example>) {
    const { viewLabel, onFolder, admission, data } = options;
    this.root = root;
    this.data = data;
    this.#signal = closed;
    this.#events = events;
    this.#options = options;
    const attributes = { tabindex: '0', role: 'application', 'aria-label': viewLabel };
    for (const [name, value] of Object.entries(attributes)) this.canvas.setAttribute(name, value);
    const onOver = (isOver: boolean) => {
      this.#isOver.value = isOver;
    };
    acceptDrops(onOver, events.onFiles, closed, { admission, onFolder });
    closed.addEventListener('abort', () => render(null, root));
  }

  /** Arranges the views. */
  layOut({ name, options, over, beside, stage, setup, results }: Layout): void {
    this.root.className = `lab ${name}`;
    const view = (
      <div class="view">
        {options}
        <div class="pictures">
          <Scene canvas={this.canvas} over={over} />
          {beside}
        </div>
        <ErrorBanner banner={this.banner} onDismiss={this.#events.onDismiss} />
        <DropHint isOver={this.#isOver} hint={this.#options.drop} />
      </div>
    );
    const status = (
      <div class="saying">
        <StatusLine status={this.status} />
        <Cancel isOffered={this.#isCancellable} onCancel={this.#events.onCancel} />
      </div>
    );
    render(
      <>
        <div class="stage">{stage(view, status)}</div>
        <div class="column setup">{setup}</div>
        <div class="column results">{results}</div>
      </>,
      this.root,
    );
  }

  /** Makes the controls of the method's parameters, once these are known. */
  makeParams(specs: ParamSpec[]): void {
    if (this.params.specs.peek().length > 0) return;
    this.params.specs.value = specs;
    this.#options.onParams?.(specs);
  }

  labelOf(param: string): string {
    return this.params.labelOf(param);
  }

  /** Displays the parameters in force. */
  showParams(params: ParamValues): void {
    this.params.show(params);
  }

  /** Displays the values that the method chose for automatic parameters, by name. */
  showChosen(values: Record<string, number>): void {
    this.params.chosen.value = values;
  }

  hideParams(hidden: Record<string, boolean>): void {
    this.params.hide(hidden);
  }

  /** Shows why a value was refused, beside its control, which displays the value in force again. */
  refuseParam(name: string, message: string, inForce?: ParamValues): void {
    if (inForce) this.params.show(inForce);
    this.params.refuse(name, message);
  }

  /** Returns the section of the method's parameters, which is open on a wide page if `isOpen`. */
  paramsSection(isOpen = false): ComponentChildren {
    return (
      <Folded title={text('labs.parameters')} isOpen={isOpen && matchMedia('(min-width: 700px)').matches}>
        <ParamControls params={this.params} skip={this.#options.ownControls ?? []} onChange={this.#events.onParam} />
      </Folded>
    );
  }

  /**
   * Returns the section that saves and shares results, with pictures and films of `subject`. `onRun` starts or continues
   * the run, if the model runs.
   */
  saveSection(subject: PictureSubject, views?: ComponentChildren, onRun?: () => void): ComponentChildren {
    const pictures = new Pictures(subject, {
      unit: () => this.unit,
      save: (...file) => this.saving.bytes(...file),
      onRun,
    });
    this.#pictures = pictures;
    this.#signal.addEventListener('abort', () => pictures.dispose());
    const help = this.#options.sessionHelp ?? text('sessions.saveHelp');
    return (
      <Section title={text('labs.sectionSave')}>
        {views}
        <SessionControls {...{ events: this.#events, code: this.code, help, isEnabled: this.canSave }} />
        <PicturePanel pictures={pictures} />
        <Button class="wide" data-action="link" onClick={this.#events.onCopyLink}>
          {text('labs.copyLink')}
        </Button>
      </Section>
    );
  }

  /** Shows the button that cancels what the lab is busy with, or hides it. */
  offerCancel(isOffered: boolean): void {
    this.#isCancellable.value = isOffered;
  }

  /** Shows the lab's state; returns whether nothing is being loaded. */
  showLoading(state: LabState, ready: boolean): boolean {
    this.#pictures?.showState(state);
    const idle = ready && state !== 'loading';
    this.canSave.value = idle;
    return idle;
  }
}

/** Says that files which are dragged over the page can be dropped. */
function DropHint({ isOver, hint }: { isOver: ReadonlySignal<boolean>; hint: string }) {
  return (
    <div class="drop" hidden={!isOver.value}>
      {hint}
    </div>
  );
}

function Cancel({ isOffered, onCancel }: { isOffered: ReadonlySignal<boolean>; onCancel: () => void }) {
  return (
    <Button data-action="cancel" hidden={!isOffered.value} onClick={onCancel}>
      {text('labs.cancel')}
    </Button>
  );
}

/** The 3D view, with what is over it: views draw on the canvas before the page is laid out. */
function Scene({ canvas, over }: { canvas: HTMLCanvasElement; over: ComponentChildren }) {
  const scene = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => scene.current?.prepend(canvas), [canvas]);
  return (
    <div class="scene" ref={scene}>
      {over}
    </div>
  );
}
