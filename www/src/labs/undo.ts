/** What one can go back to: states of the run, newest last, as many as fit. */

export interface Checkpoint<State> {
  /** What was done after it: 'change of rigidity', 'step'. */
  label: string;
  bytes: number;
  state: State;
}

export interface UndoLimits {
  entries: number;
  bytes: number;
}

/** Two stacks: what can be undone, and what was undone and can be done again until something else is done. */
export class UndoStack<State> {
  readonly #limits: UndoLimits;
  #past: Checkpoint<State>[] = [];
  #future: Checkpoint<State>[] = [];

  constructor(limits: UndoLimits) {
    this.#limits = limits;
  }

  /** What would be undone, in words. */
  get undoable(): string | undefined {
    return this.#past.at(-1)?.label;
  }

  get redoable(): string | undefined {
    return this.#future.at(-1)?.label;
  }

  clear(): void {
    this.#past = [];
    this.#future = [];
  }

  /** Takes the state before something is done. What had been undone is gone then. */
  push(checkpoint: Checkpoint<State>): void {
    this.#future = [];
    this.#past.push(checkpoint);
    this.#trim();
  }

  /** Forgets the newest state: what was to follow it did not happen. */
  drop(checkpoint: Checkpoint<State>): void {
    this.#past = this.#past.filter((one) => one !== checkpoint);
  }

  /** The state to go back to; `now` is kept for doing it again. */
  undo(now: Omit<Checkpoint<State>, 'label'>): State | undefined {
    return this.#exchange(this.#past, this.#future, now);
  }

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

  /** Lets the oldest go; the last one to go back to stays, however large. */
  #trim(): void {
    const size = () => [...this.#past, ...this.#future].reduce((sum, { bytes }) => sum + bytes, 0);
    while (this.#past.length > this.#limits.entries || (this.#past.length > 1 && size() > this.#limits.bytes))
      this.#past.shift();
  }
}
