/** Undo history: stacks of saved states, newest last, within limits. */

/** A saved state of a lab, kept for undo or redo. */
export interface Checkpoint<State> {
  /**
   * Displayed name of the change that undo reverts, or redo repeats, by restoring this state, such as 'change of
   * rigidity' or 'step'.
   */
  label: string;
  bytes: number;
  state: State;
}

/** Limits of the undo history: number of its states, and their total size in bytes. */
export interface UndoLimits {
  entries: number;
  bytes: number;
}

/** Undo and redo stacks of a lab's saved states; a new change clears the redo stack. */
export class UndoStack<State> {
  readonly #limits: UndoLimits;
  #past: Checkpoint<State>[] = [];
  #future: Checkpoint<State>[] = [];

  constructor(limits: UndoLimits) {
    this.#limits = limits;
  }

  /** Name of the change that undo would revert; undefined if there is none. */
  get undoable(): string | undefined {
    return this.#past.at(-1)?.label;
  }

  /** Name of the change that redo would repeat; undefined if there is none. */
  get redoable(): string | undefined {
    return this.#future.at(-1)?.label;
  }

  /** State that undo would restore; undefined if there is none. */
  get past(): State | undefined {
    return this.#past.at(-1)?.state;
  }

  /** State that redo would restore; undefined if there is none. */
  get future(): State | undefined {
    return this.#future.at(-1)?.state;
  }

  clear(): void {
    this.#past = [];
    this.#future = [];
  }

  /** All states to undo and to redo, the next one last in each list. */
  get entries(): { undo: Checkpoint<State>[]; redo: Checkpoint<State>[] } {
    return { undo: this.#past, redo: this.#future };
  }

  set entries({ undo, redo }) {
    this.#past = [...undo];
    this.#future = [...redo];
    this.#trim();
  }

  /** Adds the state before a change to the undo stack, and clears the redo stack. */
  push(checkpoint: Checkpoint<State>): void {
    this.#future = [];
    this.#past.push(checkpoint);
    this.#trim();
  }

  /** Removes a state from the undo stack, because the change for which it was saved has failed. */
  drop(checkpoint: Checkpoint<State>): void {
    this.#past = this.#past.filter((one) => one !== checkpoint);
  }

  /**
   * Returns the state before the last change, undefined if there is none; `now`, the present state, is kept for redo.
   */
  undo(now: Omit<Checkpoint<State>, 'label'>): State | undefined {
    return this.#exchange(this.#past, this.#future, now);
  }

  /**
   * Returns the state after the change undone last, undefined if there is none; `now`, the present state, is kept for
   * undo.
   */
  redo(now: Omit<Checkpoint<State>, 'label'>): State | undefined {
    return this.#exchange(this.#future, this.#past, now);
  }

  #exchange(
    from: Checkpoint<State>[],
    to: Checkpoint<State>[],
    now: Omit<Checkpoint<State>, 'label'>,
  ): State | undefined {
    const checkpoint = from.pop();
    if (!checkpoint) return undefined;
    to.push({ ...now, label: checkpoint.label });
    this.#trim();
    return checkpoint.state;
  }

  /**
   * Removes the oldest states from the undo stack while it has too many, or both stacks together have too many bytes;
   * at least one stays, however large.
   */
  #trim(): void {
    const size = () => [...this.#past, ...this.#future].reduce((sum, { bytes }) => sum + bytes, 0);
    while (this.#past.length > this.#limits.entries || (this.#past.length > 1 && size() > this.#limits.bytes))
      this.#past.shift();
  }
}
