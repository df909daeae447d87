/** Undo history: stacks of saved states, newest last, within limits. */

/** A saved state, from before a change. */
export interface Checkpoint<State> {
  /** Name of the change that followed, such as 'change of rigidity' or 'step'. */
  label: string;
  bytes: number;
  state: State;
}

/** Limits of the undo history: number of its states, and their total size in bytes. */
export interface UndoLimits {
  entries: number;
  bytes: number;
}

/** Undo and redo stacks; a new change clears the redo stack. */
export class UndoStack<State> {
  readonly #limits: UndoLimits;
  #past: Checkpoint<State>[] = [];
  #future: Checkpoint<State>[] = [];

  constructor(limits: UndoLimits) {
    this.#limits = limits;
  }

  /** Name of the change that undo would revert. */
  get undoable(): string | undefined {
    return this.#past.at(-1)?.label;
  }

  /** Name of the change that redo would repeat. */
  get redoable(): string | undefined {
    return this.#future.at(-1)?.label;
  }

  clear(): void {
    this.#past = [];
    this.#future = [];
  }

  /** Adds the state before a change, and clears the redo stack. */
  push(checkpoint: Checkpoint<State>): void {
    this.#future = [];
    this.#past.push(checkpoint);
    this.#trim();
  }

  /** Removes a state whose change did not happen. */
  drop(checkpoint: Checkpoint<State>): void {
    this.#past = this.#past.filter((one) => one !== checkpoint);
  }

  /** Returns the state before the last change, undefined if there is none; `now` is kept for redo. */
  undo(now: Omit<Checkpoint<State>, 'label'>): State | undefined {
    return this.#exchange(this.#past, this.#future, now);
  }

  /** Returns the state after the change undone last, undefined if there is none; `now` is kept for undo. */
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

  /** Removes the oldest states to undo to while limits are exceeded; of these, at least one stays, however large. */
  #trim(): void {
    const size = () => [...this.#past, ...this.#future].reduce((sum, { bytes }) => sum + bytes, 0);
    while (this.#past.length > this.#limits.entries || (this.#past.length > 1 && size() > this.#limits.bytes))
      this.#past.shift();
  }
}
