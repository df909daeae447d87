import { UndoStack } from './undo';

const LIMITS = { entries: 60, bytes: 96e6 };
/** Milliseconds within which changes of the same thing are one, as when a slider is dragged. */
const TOGETHER = 1500;

/** A moment one can go back to. */
export interface Moment<Page, Saved> {
  saved: Saved;
  page: Page;
}

/** A worker whose model can be saved, and brought back. */
export interface SavingWorker<Saved> {
  request(kind: 'save', body: undefined): Promise<Saved>;
  request(kind: 'pause', body: undefined): Promise<undefined>;
  request(kind: 'restore', body: Saved): Promise<unknown>;
}

/** Undo and redo of everything that changes the model: the worker's saved states, kept by the page. */
export class Rewinder<Page, Saved extends { state: Uint8Array }> {
  readonly #client: SavingWorker<Saved>;
  readonly #page: () => Page;
  readonly #onChange: (undoable: string | undefined, redoable: string | undefined) => void;
  readonly #stack = new UndoStack<Moment<Page, Saved>>(LIMITS);
  /** Resolves when all that was to be remembered is. */
  #ready: Promise<void> = Promise.resolve();
  #last = { together: '', at: 0 };
  #newest: Moment<Page, Saved> | undefined;
  #saving: Promise<unknown> = Promise.resolve();
  /** Counts volumes: what is still on its way from the one before is not taken. */
  #volume = 0;

  constructor(
    client: SavingWorker<Saved>,
    page: () => Page,
    onChange: (undoable: string | undefined, redoable: string | undefined) => void,
  ) {
    this.#client = client;
    this.#page = page;
    this.#onChange = onChange;
  }

  /** The newest moment that was kept, also where nothing was done after it: for when the engine fails. */
  get newest(): Moment<Page, Saved> | undefined {
    return this.#newest;
  }

  /** Settled when the worker has answered for all that was to be kept. */
  get kept(): Promise<unknown> {
    return this.#saving;
  }

  /** Another volume: no state of the one before fits it. */
  clear(): void {
    this.#volume += 1;
    this.#last = { together: '', at: 0 };
    this.#stack.clear();
    this.#newest = undefined;
    this.#tell();
  }

  /** Keeps the state as it is, for {@link newest} alone. Where the engine broke there is nothing to keep. */
  async keep(): Promise<Moment<Page, Saved> | undefined> {
    const page = this.#page();
    const volume = this.#volume;
    const saving = this.#client.request('save', undefined);
    this.#saving = saving.catch(() => undefined);
    try {
      const moment = { saved: await saving, page };
      if (volume === this.#volume) this.#newest = moment;
      return moment;
    } catch {
      // Whoever asks it next tells.
      return undefined;
    }
  }

  /**
   * Keeps the state as it is before something is done. Requests are answered in order, so the state comes before
   * whatever is asked of the worker next. Changes with the same `together` soon after each other count as one.
   * Returns how to forget it, for when nothing was done after all.
   */
  remember(label: string, together = ''): () => void {
    const now = performance.now();
    const isOne = together !== '' && together === this.#last.together && now - this.#last.at < TOGETHER;
    this.#last = { together, at: now };
    if (isOne) return () => undefined;
    const volume = this.#volume;
    const keeping = this.keep();
    const kept = this.#ready
      .then(() => keeping)
      .then((state) => {
        const checkpoint = state && { label, bytes: state.saved.state.byteLength, state };
        if (checkpoint && volume === this.#volume) this.#stack.push(checkpoint);
        return checkpoint;
      });
    this.#ready = kept.then(() => this.#tell());
    return () => {
      this.#last.together = '';
      this.#ready = kept.then((checkpoint) => {
        if (checkpoint) this.#stack.drop(checkpoint);
        this.#tell();
      });
    };
  }

  /** Goes back, or forth again; gives the moment the model is now in, or nothing where there is none. */
  async travel(way: 'undo' | 'redo'): Promise<Moment<Page, Saved> | undefined> {
    await this.#ready;
    if ((way === 'undo' ? this.#stack.undoable : this.#stack.redoable) === undefined) return undefined;
    this.#last.together = '';
    await this.#client.request('pause', undefined);
    const page = this.#page();
    const saved = await this.#client.request('save', undefined);
    const moment = this.#stack[way]({ bytes: saved.state.byteLength, state: { saved, page } });
    if (moment) {
      await this.#client.request('restore', moment.saved);
      this.#newest = moment;
    }
    this.#tell();
    return moment;
  }

  #tell(): void {
    this.#onChange(this.#stack.undoable, this.#stack.redoable);
  }
}
