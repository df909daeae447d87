import { RequestError } from '../engine/channel';
import type { CodeRequest, CodeRequests, Failure, Measures, RunCode } from '../engine/protocol';
import { GUIDES } from '../kit/guides';
import { mayLose } from '../kit/question';
import { labShortcuts, offerShortcuts, type Shortcut } from '../kit/shortcuts';
import type { LabState } from '../kit/state';
import { plural, text } from '../texts';
import { copyAddress, FILE_NOTE, showAddress } from './address';
import type { Listed } from './example-panel';
import type { Captured, Handoff, Lab, OpenInLab } from './lab';
import type { AnyOpening, Source } from './opening';
import type { LabEvents, LabParts, RunEvents, RunParts } from './parts';
import { Sessions } from './sessions';
import type { LabStates } from './states';
import { Work } from './work';

/** Events that the workers of all labs send. */
type EngineEvent = { event: 'failure'; failure: Failure } | { event: 'state'; state: 'running' | 'paused' | 'done' };

/** The lab's worker, as the shell uses it. */
interface Engine {
  close(): void;
}

/** The worker of a lab whose model runs. */
interface RunEngine extends Engine {
  request(kind: 'play' | 'pause', body: undefined): Promise<unknown>;
  request(kind: 'step', body: { count: number }): Promise<unknown>;
  request(kind: 'code', body: CodeRequest): Promise<RunCode>;
  request(kind: 'data', body: undefined): Promise<CodeRequests['data']['reply']>;
}

function describeEdited({ info }: Measures): string {
  const vertices = plural('counts.vertex', info.vertices);
  return text('finish.edited', { vertices, triangles: plural('counts.triangle', info.triangles) });
}

/** Milliseconds until the user is told that a pause takes long, and can cancel it. */
const PATIENCE_MS = 400;

/** Messages about copied code, by the data that its function takes. */
const COPIED = {
  files: 'sessions.codeCopied',
  saved: 'sessions.codeCopiedSaved',
  folder: 'sessions.codeCopiedFolder',
  nothing: 'sessions.codeCopiedAlone',
} as const;

type AnySource<Example> = Source<Example, unknown, unknown>;

/**
 * The common part of all labs: opening, states and failures, links and shortcuts. A lab extends it and calls
 * {@link begin} at the end of its constructor.
 */
export abstract class LabShell<Example extends Listed> implements Lab {
  readonly work = new Work();
  onChange: () => void = () => undefined;
  onShowKept: () => void = () => undefined;
  protected readonly root: HTMLElement;
  protected readonly passOn: OpenInLab;
  /** Aborted when the lab is closed, which removes all event listeners. */
  protected readonly closing = new AbortController();
  readonly #help: HTMLElement;
  #sessions: Sessions<Example> | undefined;

  protected abstract readonly id: keyof typeof GUIDES;
  protected abstract readonly client: Engine;
  protected abstract readonly ui: LabParts<Example>;
  protected abstract readonly states: LabStates;
  protected abstract readonly opening: AnyOpening<Example>;

  constructor(root: HTMLElement, help: HTMLElement, passOn: OpenInLab) {
    this.root = root;
    this.#help = help;
    this.passOn = passOn;
  }

  /** Returns the text for the status line in the present state. */
  protected abstract describe(): string;

  /** Returns the hash of an address that restores what is open and the settings in force. */
  protected abstract address(source: AnySource<Example>): string;

  /** Enables and disables controls according to the lab's state. */
  protected abstract showControls(state: LabState): void;

  /** Returns the lab's own part of a session, without a change of the run; undefined if the lab cannot save its model. */
  protected async sessionContent(): Promise<Record<string, unknown> | undefined> {
    return undefined;
  }

  /** Returns what a copied link does not contain, as sentences; false: none. */
  protected linkLacks(): (string | false)[] {
    return [];
  }

  /** Releases what the lab has besides worker and views. */
  protected closed(): void {}

  /** Begins to follow the lab's state and to listen to the keyboard. */
  protected begin(shortcuts: Shortcut[]): void {
    this.#sessions = new Sessions({
      ...{ id: this.id, ui: this.ui, states: this.states, work: this.work, opening: this.opening, passOn: this.passOn },
      address: (source) => this.address(source),
      content: () => this.sessionContent(),
      onSaved: () => this.work.settled(),
      mayReplace: () => this.mayReplace(),
    });
    this.opening.onReplaced = () => this.work.end();
    this.states.subscribe((state) => this.#showState(state));
    this.states.subscribeCancellable((isCancellable) => this.ui.offerCancel(isCancellable));
    // Until a change is in force, the state and the measures are those of the run before it.
    this.states.subscribeChanging((isChanging) => {
      this.root.toggleAttribute('data-changing', isChanging);
      if (!isChanging) this.onChange();
    });
    this.work.onChange = () => this.onChange();
    const onEscape = {
      key: 'Escape',
      shown: text('labs.keyEscape'),
      text: this.escapeText,
      act: () => this.escape(),
    };
    offerShortcuts([...shortcuts, onEscape], this.#help, GUIDES[this.id], this.closing.signal);
  }

  /** Opens what another lab passes on, or what the address asks for, or else the first example, and runs it. */
  async start(passedOn?: Handoff): Promise<void> {
    const open = passedOn && (() => this.#sessions?.passedOn(passedOn) ?? this.opening.passedOn(passedOn));
    const onFollowed = () => {
      this.forgetSession();
      this.updateAddress();
    };
    await this.opening.start(this.closing.signal, { mayFollow: () => this.mayReplace(), onFollowed }, open);
  }

  get isRunning(): boolean {
    return this.states.value === 'running';
  }

  get isPlain(): boolean {
    const { source } = this.opening;
    return !this.work.isAny && (!source || source.example !== undefined);
  }

  async capture(): Promise<Captured | undefined> {
    return this.#sessions?.capture();
  }

  close(): void {
    this.closing.abort();
    this.opening.close();
    this.client.close();
    this.closed();
    this.ui.dispose();
    this.root.replaceChildren();
  }

  protected labEvents(): Omit<LabEvents<Example>, 'onParam'> {
    return {
      onFiles: (files) => void this.#sessions?.files(files),
      onExample: (example) => void this.#openExample(example),
      onCancel: () => void this.opening.cancel(),
      onDismiss: () => this.dismiss(),
      onCopyLink: () => void this.#copyLink(),
      onSaveSession: (included) => void this.#sessions?.save(included),
      onShowKept: () => this.onShowKept(),
      onError: (title, error) => this.states.fail(title, error),
    };
  }

  /** Whether other data may take the place of those that are open; asks if work by hand would be lost. */
  protected async mayReplace(): Promise<boolean> {
    const losses = this.work.unsavedByHand;
    return losses.length === 0 || mayLose(text('work.replace'), losses, text('work.replaceGo'));
  }

  async #openExample(example: Example): Promise<void> {
    if (!(await this.mayReplace())) return this.ui.data.choose(this.opening.source?.example);
    this.forgetSession();
    await this.opening.example(example);
  }

  /** Writes what is open and the settings in force into the page's address, so that it can be shared. */
  protected updateAddress(): void {
    const { source } = this.opening;
    if (source && (this.states.value !== 'loading' || this.states.ready)) showAddress(this.address(source));
  }

  /** Shows an error message if a request fails, without waiting for the reply. */
  protected ask(request: Promise<unknown>, title = text('labs.requestFailed')): void {
    request.catch((error) => this.states.fail(title, error));
  }

  /** Waits no longer for the data of a session, since the user does something else. */
  protected forgetSession(): void {
    this.#sessions?.forget();
  }

  protected dismiss(): void {
    this.forgetSession();
    if (this.states.dismiss()) this.ui.status.say(this.describe());
  }

  /** Called for the Escape key; by default, it dismisses the error message. */
  protected escape(): void {
    this.dismiss();
  }

  protected get escapeText(): string {
    return text('labs.dismissKey');
  }

  async #copyLink(): Promise<void> {
    this.updateAddress();
    await copyAddress(this.ui.status, [!this.opening.source?.example && FILE_NOTE, ...this.linkLacks()]);
  }

  #showState(state: LabState): void {
    this.root.dataset.state = state;
    this.showControls(state);
    if (state === 'done' || state === 'paused') this.updateAddress();
    this.onChange();
  }
}

/** The common part of labs whose model runs: play, pause, step and reset. */
export abstract class RunLab<Example extends Listed> extends LabShell<Example> {
  protected abstract override readonly client: RunEngine;
  protected abstract override readonly ui: RunParts<Example>;

  /** Undoes or redoes a change. */
  protected abstract travel(way: 'undo' | 'redo'): Promise<void>;

  /** Builds the model again with the same settings, without running it, and clears the results. */
  protected abstract startOver(): Promise<void>;

  /** Called when the model's state has become that of the lab. */
  protected abstract settled(state: 'running' | 'paused' | 'done'): void;

  /** Called before the model runs or steps; `change` names that for undo. */
  protected beforeRun(_change: string, _isStep: boolean): void {}

  /** Whether the model can run now. */
  protected get canPlay(): boolean {
    return this.states.canRun;
  }

  /** Whether the model can do single steps now. */
  protected get canStep(): boolean {
    return this.states.canRun;
  }

  protected runEvents(): Omit<RunEvents<Example>, 'onParam'> {
    return {
      ...this.labEvents(),
      onToggle: () => this.#toggle(),
      onStep: (steps) => this.#step(steps),
      onReset: () => void this.#reset(),
      onUndo: () => this.#travel('undo'),
      onRedo: () => this.#travel('redo'),
      onCopyCode: () => this.ask(this.#copyCode(), text('sessions.codeFailed')),
      onSaveData: () => this.ask(this.#saveData(), text('sessions.dataFailed')),
    };
  }

  /** Returns the lab's own part of a request for code. */
  protected codeRequest(): Pick<CodeRequest, 'frame'> {
    return {};
  }

  /** Copies code that repeats the run and the edits of its surface; without a clipboard, saves it as a file. */
  async #copyCode(): Promise<void> {
    const { saving, status, finish } = this.ui;
    const request = { stem: saving.stem, edits: finish?.log ?? [], ...this.codeRequest() };
    const { code, needs, name, note = '' } = await this.client.request('code', request);
    try {
      await navigator.clipboard.writeText(code);
      status.say(`${text(COPIED[needs], { name })} ${note}`.trim());
    } catch {
      saving.bytes('mjs', new TextEncoder().encode(code), 'text/javascript');
    }
  }

  async #saveData(): Promise<void> {
    const { extension, bytes } = await this.client.request('data', undefined);
    this.ui.saving.bytes(extension, bytes, 'application/octet-stream');
  }

  protected beginRuns(own: Shortcut[] = [], toggleText?: string): void {
    this.begin(labShortcuts(this.runEvents(), own, toggleText));
    const { finish, status } = this.ui;
    this.ui.onSurfaceSaved = () => this.surfaceSaved();
    if (!finish) return;
    finish.onEdited = (edited) => {
      if (edited) this.work.did('edited');
      else this.work.settled('edited');
      status.say(edited ? describeEdited(edited) : this.describe());
    };
  }

  /** Called when the surface was saved as a file: by default, all that was made is in it. */
  protected surfaceSaved(): void {
    this.work.settled();
  }

  /** Takes the events that the workers of all labs send; returns whether this was one of them. */
  protected takes(event: { event: string }): event is EngineEvent {
    const sent = event as EngineEvent;
    if (sent.event === 'failure') this.states.fail(text('labs.runFailed'), new RequestError(sent.failure));
    else if (sent.event !== 'state') return false;
    else if (this.states.setModelState(sent.state)) this.settled(sent.state);
    return true;
  }

  /** Pauses a run for `work`, and then continues it. */
  protected async paused<Result>(work: () => Promise<Result>): Promise<Result> {
    const isRunning = this.states.modelState === 'running';
    await this.client.request('pause', undefined);
    try {
      return await work();
    } finally {
      if (isRunning) await this.client.request('play', undefined);
    }
  }

  /** Opens the present surface in the Sculpt lab, as a mesh to deform. */
  protected toSculpt(mesh: Promise<Uint8Array>, name = text('labs.surfaceName', { name: this.ui.saving.name })): void {
    const warnings = this.ui.surfaceWarnings;
    this.ask(
      mesh.then((bytes) => this.passOn({ lab: 'sculpt', name, bytes, params: {}, warnings })),
      text('labs.toSculptFailed'),
    );
  }

  #travel(way: 'undo' | 'redo'): void {
    this.ui.finish?.reset();
    void this.travel(way);
  }

  #toggle(): void {
    const running = this.states.value === 'running';
    if (!running && !this.canPlay) return;
    this.ui.banner.hide();
    if (!running) {
      this.beforeRun(text('labs.play'), false);
      this.work.did('run');
    }
    if (running) this.ask(this.#pause());
    else this.ask(this.client.request('play', undefined));
  }

  /** Pauses the run. If a step takes so long that the worker does not answer, the user can cancel that. */
  async #pause(): Promise<void> {
    const pausing = this.client.request('pause', undefined);
    const patience = setTimeout(() => this.states.load(text('labs.pausing')), PATIENCE_MS);
    const isLoading = () => this.states.value === 'loading';
    try {
      await pausing;
      if (isLoading()) this.states.restore(() => this.describe());
    } finally {
      clearTimeout(patience);
    }
  }

  #step(steps: number): void {
    if (!this.canStep || this.states.value === 'running') return;
    this.ui.banner.hide();
    this.beforeRun(plural('counts.step', steps), true);
    this.work.did('run');
    this.ui.finish?.reset();
    this.ask(this.client.request('step', { count: steps }));
  }

  /** Enters the loading state while `work` builds a model; then the model is ready to start. */
  protected async building(work: () => Promise<void>): Promise<void> {
    this.states.load(text('labs.resetting'));
    try {
      await work();
      this.states.idle(text('labs.readyToStart'));
    } catch (error) {
      this.states.fail(text('labs.buildFailed'), error);
    }
  }

  /** Starts over; after a failure of the engine, opens the data again. */
  async #reset(): Promise<void> {
    const { ready, value, engineBroken } = this.states;
    if (!ready || value === 'loading') return;
    await (engineBroken ? this.opening.reopen() : this.startOver());
  }
}
