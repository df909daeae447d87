import { toFailure } from '../engine/failure';
import { type LabState, Observable } from '../kit/state';
import type { Banner, Status } from '../kit/status';
import { text } from '../texts';

/**
 * The state of a lab: loading, running, paused, done, or an error, which covers the other states until the user
 * dismisses it.
 */
export class LabStates {
  readonly #state = new Observable<LabState>('loading');
  readonly #banner: Banner;
  readonly #status: Status;
  readonly #signal: AbortSignal;
  /** State of the model, also while the lab displays an error; 'loading' until there is a model. */
  #model: 'loading' | 'running' | 'paused' | 'done' = 'loading';
  /** Whether other data is being opened; the state of the present model is then recorded, but not displayed. */
  #opening = false;
  /** Settles when the last change queued by {@link enqueue} is complete. */
  #queue: Promise<unknown> = Promise.resolve();
  readonly #changes = new Observable(0);
  readonly #cancellable = new Observable(false);
  /** Whether something else can be opened in place of what is being opened. */
  #hasOther = false;
  /** Whether what was open is opened again, which would begin anew if it was cancelled. */
  #isReopening = false;
  /** Whether the worker has a model of the lab's data. */
  ready = false;
  /** Whether the worker has to be restarted before it can serve requests. */
  engineBroken = false;

  /** Once `signal` is aborted, because the lab is closed, no failure is displayed any more. */
  constructor(banner: Banner, status: Status, signal: AbortSignal) {
    this.#banner = banner;
    this.#status = status;
    this.#signal = signal;
    this.#state.subscribe(() => this.#offerCancel());
  }

  /** Calls `subscriber` with the lab's state now and at every change. */
  subscribe(subscriber: (state: LabState) => void): void {
    this.#state.subscribe((state) => {
      if (state !== 'loading' && state !== 'error') this.#model = state;
      subscriber(state);
    });
  }

  /** Calls `subscriber` now, and whenever changes begin or are complete, with whether changes are under way. */
  subscribeChanging(subscriber: (isChanging: boolean) => void): void {
    this.#changes.subscribe((count) => subscriber(count > 0));
  }

  /** Calls `subscriber` now, and whenever it changes, with whether the lab is busy with something that can be cancelled. */
  subscribeCancellable(subscriber: (isCancellable: boolean) => void): void {
    this.#cancellable.subscribe(subscriber);
  }

  /** Cancelling opens again the data that were open before, or else the first example. */
  #offerCancel(): void {
    if (this.value !== 'loading') this.#isReopening = false;
    this.#cancellable.value = this.value === 'loading' && !this.#isReopening && (this.ready || this.#hasOther);
  }

  get value(): LabState {
    return this.#state.value;
  }

  /** The lab's state; while an error is displayed, the model's state beneath it. */
  get modelState(): LabState {
    return this.value === 'error' ? this.#model : this.value;
  }

  /** Whether other data is being opened. */
  get isOpening(): boolean {
    return this.#opening;
  }

  /** Whether the settings can be changed now: there is a model, the engine works, and nothing is being loaded. */
  get canChange(): boolean {
    return this.ready && !this.engineBroken && this.value !== 'loading';
  }

  /** Whether the model can be run or stepped now: it is paused, and the engine works. */
  get canRun(): boolean {
    return this.ready && !this.engineBroken && this.modelState === 'paused';
  }

  /** Enters the lab's loading state; `text` is for the status line. */
  load(text: string): void {
    this.#banner.hide();
    this.#state.value = 'loading';
    this.#status.say(text);
  }

  /**
   * Prepares for opening other data: enters the loading state, with `text` in the status line, and waits until queued
   * changes are complete. Until {@link finishOpening} is called, the present model's state is recorded, but not displayed.
   *
   * @param hasOther - Whether a lab that has no data yet could open something else instead.
   * @param isReopening - Whether what was open is opened again.
   */
  async open(text: string, hasOther: boolean, isReopening: boolean): Promise<void> {
    this.#opening = true;
    this.load(text);
    [this.#hasOther, this.#isReopening] = [hasOther, isReopening];
    this.#offerCancel();
    await this.#queue;
  }

  /** Answers that the opening is being cancelled; what was open is opened again. */
  cancel(text: string): void {
    this.#isReopening = true;
    this.#offerCancel();
    this.#status.say(text);
  }

  /** Ends {@link open}. From now on the state is that of the new model if `hasModel`, else that of the previous one. */
  finishOpening(hasModel: boolean): void {
    this.#opening = false;
    if (hasModel) this.#model = 'paused';
  }

  /**
   * Runs `work`, which changes the model, after all changes queued before, so that each starts from the result of the
   * previous one.
   */
  enqueue(work: () => Promise<void>): Promise<void> {
    this.#changes.value += 1;
    return this.inTurn(work).finally(() => {
      this.#changes.value -= 1;
    });
  }

  /** Runs `work`, which changes nothing, after all changes queued before, and before all later ones. */
  inTurn<Result>(work: () => Promise<Result>): Promise<Result> {
    const turn = this.#queue.then(work);
    this.#queue = turn.catch(() => undefined);
    return turn;
  }

  /**
   * Ends the loading state with a model that is not running; `text` is for the status line. Ignored while other data is
   * being opened.
   */
  idle(text: string, state: 'paused' | 'done' = 'paused'): void {
    if (this.#opening) return;
    this.#state.value = state;
    this.#status.say(text);
  }

  /**
   * Returns the lab to the model's state after loading has failed or changed nothing; `describe` gives the text for the
   * status line. Ignored while other data is being opened.
   */
  restore(describe: (state: LabState) => string): void {
    if (this.#opening) return;
    this.#state.value = this.#model;
    this.#status.say(describe(this.#model));
  }

  /**
   * Records the model's new state and makes it the lab's state. Returns false if the lab's state does not change:
   * during loading unless the new state is 'running', and always while other data is being opened.
   */
  setModelState(state: 'running' | 'paused' | 'done'): boolean {
    this.#model = state;
    if (this.#opening || (this.value === 'loading' && state !== 'running')) return false;
    this.#state.value = state;
    return true;
  }

  /**
   * Displays a failure, unless other data is being opened. The model stays, and a run continues; after an internal
   * error, the engine counts as broken, and the run as stopped.
   */
  fail(title: string, error: unknown): void {
    if (this.#signal.aborted) return;
    const failure = toFailure(error);
    if (failure.code === 'internal') this.engineBroken = true;
    // The failure concerns the model being replaced, or else `Opening` reports it.
    if (this.#opening) return;
    const message =
      this.engineBroken && this.ready ? text('labs.engineHint', { message: failure.message }) : failure.message;
    this.#banner.show(title, message);
    if (this.value === 'running' && !this.engineBroken) return;
    this.#status.say('');
    if (this.#model === 'running' && this.engineBroken) this.#model = 'paused';
    // If the failed change was to replace a running model, that one continues.
    this.#state.value = this.#model === 'running' ? 'running' : 'error';
  }

  /**
   * Hides the error message; returns whether this has ended the error state, so that the model's state applies again.
   */
  dismiss(): boolean {
    this.#banner.hide();
    if (this.value !== 'error' || !this.ready) return false;
    this.#state.value = this.#model;
    return true;
  }
}
