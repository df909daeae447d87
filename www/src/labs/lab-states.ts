import { toFailure } from '../channel';
import { type LabState, Observable } from '../state';
import type { ErrorBanner, StatusLine } from '../ui/status';

/** The state a lab is in, with what went wrong laid over it until it has been read. */
export class LabStates {
  readonly #state = new Observable<LabState>('loading');
  readonly #banner: ErrorBanner;
  readonly #status: StatusLine;
  readonly #signal: AbortSignal;
  /** What the model does, beneath what is shown: none is there at first. */
  #model: 'loading' | 'running' | 'paused' | 'done' = 'loading';
  /** Something else is being opened: what the model does that is still there counts no more. */
  #opening = false;
  /** One change after the other. */
  #turns: Promise<unknown> = Promise.resolve();
  /** There is a model. */
  ready = false;
  /** The worker has to be started again before it can do anything. */
  engineBroken = false;

  /** Nothing is shown any more once `signal` is aborted. */
  constructor(banner: ErrorBanner, status: StatusLine, signal: AbortSignal) {
    this.#banner = banner;
    this.#status = status;
    this.#signal = signal;
  }

  /** Calls `follower` now and at every change. */
  follow(follower: (state: LabState) => void): void {
    this.#state.follow((state) => {
      if (state !== 'loading' && state !== 'error') this.#model = state;
      follower(state);
    });
  }

  get value(): LabState {
    return this.#state.value;
  }

  /** The state beneath an error that is being shown. */
  get beneath(): LabState {
    return this.value === 'error' ? this.#model : this.value;
  }

  get canChange(): boolean {
    return this.ready && !this.engineBroken && this.value !== 'loading';
  }

  get canRun(): boolean {
    return this.ready && !this.engineBroken && this.beneath === 'paused';
  }

  load(text: string): void {
    this.#banner.hide();
    this.#state.value = 'loading';
    this.#status.say(text);
  }

  /** Something else is about to be opened: once what is being changed has been. Nothing else is until it is {@link opened}. */
  async open(text: string): Promise<void> {
    this.#opening = true;
    this.load(text);
    await this.#turns;
  }

  /** All that comes from now on is of what was opened, where there is a model that has not begun; else of what was there before. */
  opened(isThere: boolean): void {
    this.#opening = false;
    if (isThere) this.#model = 'paused';
  }

  /** One change after the other, so that each begins with what the one before it left. */
  inTurn(work: () => Promise<void>): Promise<void> {
    const turn = this.#turns.then(work);
    this.#turns = turn.catch(() => undefined);
    return turn;
  }

  /** Loading is over, and nothing runs yet. */
  stand(text: string, state: 'paused' | 'done' = 'paused'): void {
    if (this.#opening) return;
    this.#state.value = state;
    this.#status.say(text);
  }

  /** Loading came to nothing: what was there before is there again, in words too. */
  back(describe: (state: LabState) => string): void {
    if (this.#opening) return;
    this.#state.value = this.#model;
    this.#status.say(describe(this.#model));
  }

  /**
   * What the model does now; false where this does not count: while something is loading only a start does, while
   * something else is being opened nothing.
   */
  enter(state: 'running' | 'paused' | 'done'): boolean {
    this.#model = state;
    if (this.#opening || (this.value === 'loading' && state !== 'running')) return false;
    this.#state.value = state;
    return true;
  }

  /** Says what went wrong; what was there stays, and what runs goes on. */
  fail(title: string, error: unknown): void {
    if (this.#signal.aborted) return;
    const failure = toFailure(error);
    if (failure.code === 'internal') this.engineBroken = true;
    // It is of what is to be replaced, or else whoever opens tells it.
    if (this.#opening) return;
    const hint =
      this.engineBroken && this.ready
        ? 'What you see is the last result; Reset starts the engine again. It said: '
        : '';
    this.#banner.show(title, hint + failure.message);
    if (this.value === 'running' && !this.engineBroken) return;
    this.#status.say('');
    if (this.#model === 'running' && this.engineBroken) this.#model = 'paused';
    // What was to replace it failed, or was refused: it goes on.
    this.#state.value = this.#model === 'running' ? 'running' : 'error';
  }

  /** The error has been read; true where the lab is back in the state from before. */
  dismiss(): boolean {
    this.#banner.hide();
    if (this.value !== 'error' || !this.ready) return false;
    this.#state.value = this.#model;
    return true;
  }
}
