import { RequestError } from '../engine/failure';
import type { CodeRequest, CodeRequests, FailureEvent, Measures, RunCode, StateEvent } from '../engine/protocol';
import { labShortcuts, type Shortcut } from '../kit/shortcuts';
import { plural, text } from '../texts';
import type { Listed } from './example-panel';
import type { LabPage } from './page';
import type { RunControls, RunEvents } from './run-controls';
import type { Engine, LabShell, ShelledLab } from './shell';

/** Events that the workers of all labs send. */
type EngineEvent = FailureEvent | StateEvent;

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

/** A lab whose model runs. */
export interface RunningLab<Example extends Listed> extends ShelledLab<Example> {
  readonly client: RunEngine;
  readonly ui: { readonly page: LabPage<Example>; readonly run: RunControls; dispose(): void };

  /** Undoes or redoes a change. */
  travel(way: 'undo' | 'redo'): Promise<void>;

  /** Builds the model again with the same settings, without running it, and clears the results. */
  startOver(): Promise<void>;

  /** Called when the model's state has become that of the lab. */
  settled(state: 'running' | 'paused' | 'done'): void;

  /** Called before the model runs or steps; `change` names that for undo. */
  beforeRun?(change: string, isStep: boolean): void;

  /** Whether the model can run now; without it, whenever the lab's state allows. */
  readonly canPlay?: boolean;

  /** Whether the model can do single steps now; without it, whenever the lab's state allows. */
  readonly canStep?: boolean;

  /** Called when the surface was saved as a file; without it, all that was made counts as saved. */
  surfaceSaved?(): void;

  /** Returns the lab's own part of a request for code. */
  codeRequest?(): Pick<CodeRequest, 'frame'>;
}

/** The play, pause, step and reset of labs whose model runs. */
export class Runs<Example extends Listed> {
  readonly #shell: LabShell<Example>;
  readonly #lab: RunningLab<Example>;

  constructor(shell: LabShell<Example>, lab: RunningLab<Example>) {
    this.#shell = shell;
    this.#lab = lab;
  }

  /** Returns the handlers of the user's actions that these labs have. */
  events(): Omit<RunEvents<Example>, 'onParam'> {
    return {
      ...this.#shell.events(),
      onToggle: () => this.#toggle(),
      onStep: (steps) => this.#step(steps),
      onReset: () => void this.#reset(),
      onUndo: () => this.#travel('undo'),
      onRedo: () => this.#travel('redo'),
      onCopyCode: () => this.#shell.ask(this.#copyCode(), text('sessions.codeFailed')),
      onSaveData: () => this.#shell.ask(this.#saveData(), text('sessions.dataFailed')),
    };
  }

  /** Copies code that repeats the run and the edits of its surface; without a clipboard, saves it as a file. */
  async #copyCode(): Promise<void> {
    const { saving, status } = this.#lab.ui.page;
    const { finish } = this.#lab.ui.run;
    const request = { stem: saving.stem, edits: finish?.log ?? [], ...this.#lab.codeRequest?.() };
    const { code, needs, name, note = '' } = await this.#lab.client.request('code', request);
    try {
      await navigator.clipboard.writeText(code);
      status.say(`${text(COPIED[needs], { name })} ${note}`.trim());
    } catch {
      saving.bytes('mjs', new TextEncoder().encode(code), 'text/javascript');
    }
  }

  async #saveData(): Promise<void> {
    const { extension, bytes } = await this.#lab.client.request('data', undefined);
    this.#lab.ui.page.saving.bytes(extension, bytes, 'application/octet-stream');
  }

  /** Begins to follow the lab's state and to listen to the keyboard. */
  begin(own: Shortcut[] = [], toggleText?: string): void {
    this.#shell.begin(labShortcuts(this.events(), own, toggleText));
    const { page, run } = this.#lab.ui;
    const { finish } = run;
    const { work } = this.#shell;
    run.onSurfaceSaved = () => (this.#lab.surfaceSaved ? this.#lab.surfaceSaved() : work.settled());
    if (!finish) return;
    finish.onEdited = (edited) => {
      if (edited) work.did('edited');
      else work.settled('edited');
      page.status.say(edited ? describeEdited(edited) : this.#lab.describe());
    };
  }

  /** Takes the events that the workers of all labs send; returns whether this was one of them. */
  takes(event: { event: string }): event is EngineEvent {
    const sent = event as EngineEvent;
    if (sent.event === 'failure') this.#lab.states.fail(text('labs.runFailed'), new RequestError(sent.failure));
    else if (sent.event !== 'state') return false;
    else if (this.#lab.states.setModelState(sent.state)) this.#lab.settled(sent.state);
    return true;
  }

  /** Pauses a run for `work`, and then continues it. */
  async paused<Result>(work: () => Promise<Result>): Promise<Result> {
    const isRunning = this.#lab.states.modelState === 'running';
    await this.#lab.client.request('pause', undefined);
    try {
      return await work();
    } finally {
      if (isRunning) await this.#lab.client.request('play', undefined);
    }
  }

  /** Opens the present surface in the Sculpt lab, as a mesh to deform. */
  toSculpt(mesh: Promise<Uint8Array>, name = text('labs.surfaceName', { name: this.#lab.ui.page.saving.name })): void {
    const warnings = this.#lab.ui.run.surfaceWarnings;
    this.#shell.ask(
      mesh.then((bytes) => this.#shell.passOn({ lab: 'sculpt', name, bytes, params: {}, warnings })),
      text('labs.toSculptFailed'),
    );
  }

  #travel(way: 'undo' | 'redo'): void {
    this.#lab.ui.run.finish?.reset();
    void this.#lab.travel(way);
  }

  #toggle(): void {
    const running = this.#lab.states.value === 'running';
    if (!running && !(this.#lab.canPlay ?? this.#lab.states.canRun)) return;
    this.#lab.ui.page.banner.hide();
    if (!running) {
      this.#lab.beforeRun?.(text('labs.play'), false);
      this.#shell.work.did('run');
    }
    if (running) this.#shell.ask(this.#pause());
    else this.#shell.ask(this.#lab.client.request('play', undefined));
  }

  /** Pauses the run. If a step takes so long that the worker does not answer, the user can cancel that. */
  async #pause(): Promise<void> {
    const pausing = this.#lab.client.request('pause', undefined);
    const patience = setTimeout(() => this.#lab.states.load(text('labs.pausing')), PATIENCE_MS);
    const isLoading = () => this.#lab.states.value === 'loading';
    try {
      await pausing;
      if (isLoading()) this.#lab.states.restore(() => this.#lab.describe());
    } finally {
      clearTimeout(patience);
    }
  }

  #step(steps: number): void {
    if (!(this.#lab.canStep ?? this.#lab.states.canRun) || this.#lab.states.value === 'running') return;
    this.#lab.ui.page.banner.hide();
    this.#lab.beforeRun?.(plural('counts.step', steps), true);
    this.#shell.work.did('run');
    this.#lab.ui.run.finish?.reset();
    this.#shell.ask(this.#lab.client.request('step', { count: steps }));
  }

  /** Enters the loading state while `work` builds a model; then the model is ready to start. */
  async building(work: () => Promise<void>): Promise<void> {
    this.#lab.states.load(text('labs.resetting'));
    try {
      await work();
      this.#lab.states.idle(text('labs.readyToStart'));
    } catch (error) {
      this.#lab.states.fail(text('labs.buildFailed'), error);
    }
  }

  /** Starts over; after a failure of the engine, opens the data again. */
  async #reset(): Promise<void> {
    const { ready, value, engineBroken } = this.#lab.states;
    if (!ready || value === 'loading') return;
    await (engineBroken ? this.#lab.opening.reopen() : this.#lab.startOver());
  }
}
