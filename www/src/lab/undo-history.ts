import type { Moments } from './session/moments';
import { UndoStack } from './undo';

/** Limits of the undo history: number of states, and their total size in bytes. */
const LIMITS = { entries: 60, bytes: 96e6 };
/** Milliseconds within which repeated changes of the same setting are undone as one, as when a slider is dragged. */
const MERGE_MS = 1500;

/** A saved state of a lab to go back to: of the worker's model, and of the page. */
export interface SavedMoment<Page, Saved> {
  saved: Saved;
  page: Page;
}

/** Interface to a lab's worker whose model can be saved and restored, as undo needs it. */
export interface SavingWorker<Saved> {
  request(kind: 'save', body: undefined): Promise<Saved>;
  request(kind: 'pause', body: undefined): Promise<undefined>;
  request(kind: 'restore', body: Saved): Promise<unknown>;
}

/** Undo and redo of all changes to the model: keeps the worker's saved states, and the page's state with each. */
export class UndoHistory<Page, Saved extends { state: Uint8Array }> {
  readonly #client: SavingWorker<Saved>;
  readonly #page: () => Page;
  readonly #onChange: (undoable: string | undefined, redoable: string | undefined) => void;
  readonly #stack = new UndoStack<SavedMoment<Page, Saved>>(LIMITS);
  /** Resolves when all saves for the undo history are complete. */
  #ready: Promise<void> = Promise.resolve();
  #lastChange = { mergeKey: '', at: 0 };
  #newest: SavedMoment<Page, Saved> | undefined;
  #saving: Promise<unknown> = Promise.resolve();
  /** Counts the volumes, meshes or images opened, so that saved states of a previous one are discarded. */
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

  /**
   * The newest saved state, even if no change followed it: to resume from after a failure of the engine; undefined if
   * there is none.
   */
  get newest(): SavedMoment<Page, Saved> | undefined {
    return this.#newest;
  }

  /** Promise that settles when the worker has answered the last save request. */
  get saved(): Promise<unknown> {
    return this.#saving;
  }

  /** Forgets all saved states, since they do not fit the volume, mesh or image opened next. */
  clear(): void {
    this.#volume += 1;
    this.#lastChange = { mergeKey: '', at: 0 };
    this.#stack.clear();
    this.#newest = undefined;
    this.#notify();
  }

  /** Returns the present state and those to undo and redo; undefined if the worker could not save its model. */
  async moments(): Promise<Moments<SavedMoment<Page, Saved>> | undefined> {
    const now = await this.save();
    await this.#ready;
    return now && { now, ...this.#stack.entries };
  }

  /** Takes over the states of a session, whose present one the worker has restored. */
  adopt({ now, ...entries }: Moments<SavedMoment<Page, Saved>>): void {
    this.#stack.entries = entries;
    this.#newest = now;
    this.#notify();
  }

  /**
   * Saves the present state as {@link newest}, without adding it to the undo stack. Returns undefined if the worker
   * could not save its model.
   */
  async save(): Promise<SavedMoment<Page, Saved> | undefined> {
    const page = this.#page();
    const volume = this.#volume;
    const saving = this.#client.request('save', undefined);
    this.#saving = saving.catch(() => undefined);
    try {
      const moment = { saved: await saving, page };
      if (volume === this.#volume) this.#newest = moment;
      return moment;
    } catch {
      // The next request reports the failure.
      return undefined;
    }
  }

  /**
   * Saves the present state before a change, so that undo can restore it; `label` names the change. The worker answers
   * requests in order, so the state is that before any request made after this call. Changes with the same `mergeKey`,
   * unless empty, in short succession ({@link MERGE_MS}) are undone as one. Returns a function that forgets the state,
   * to call if the change fails.
   */
  checkpoint(label: string, mergeKey = ''): () => void {
    const now = performance.now();
    const isOne = mergeKey !== '' && mergeKey === this.#lastChange.mergeKey && now - this.#lastChange.at < MERGE_MS;
    this.#lastChange = { mergeKey, at: now };
    if (isOne) return () => undefined;
    const volume = this.#volume;
    const keeping = this.save();
    const kept = this.#ready
      .then(() => keeping)
      .then((state) => {
        const checkpoint = state && { label, bytes: state.saved.state.byteLength, state };
        if (checkpoint && volume === this.#volume) this.#stack.push(checkpoint);
        return checkpoint;
      });
    this.#ready = kept.then(() => this.#notify());
    return () => {
      this.#lastChange.mergeKey = '';
      this.#ready = kept.then((checkpoint) => {
        if (checkpoint) this.#stack.drop(checkpoint);
        this.#notify();
      });
    };
  }

  /**
   * Undoes or redoes a change: restores the worker's model, and returns the state restored, from which the caller
   * restores the page; undefined if there is nothing to undo or redo.
   */
  async step(direction: 'undo' | 'redo'): Promise<SavedMoment<Page, Saved> | undefined> {
    await this.#ready;
    if ((direction === 'undo' ? this.#stack.undoable : this.#stack.redoable) === undefined) return undefined;
    this.#lastChange.mergeKey = '';
    await this.#client.request('pause', undefined);
    const page = this.#page();
    const saved = await this.#client.request('save', undefined);
    const moment = this.#stack[direction]({ bytes: saved.state.byteLength, state: { saved, page } });
    if (moment) {
      await this.#client.request('restore', moment.saved);
      this.#newest = moment;
    }
    this.#notify();
    return moment;
  }

  #notify(): void {
    this.#onChange(this.#stack.undoable, this.#stack.redoable);
  }
}
