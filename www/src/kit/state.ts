/** State of a lab; set as `data-state` on the lab's element. */
export type LabState = 'loading' | 'running' | 'paused' | 'done' | 'error';

/** A value with subscribers, which are called when it changes. Setting an equal value calls none. */
export class Observable<T> {
  #value: T;
  readonly #subscribers = new Set<(value: T) => void>();

  constructor(value: T) {
    this.#value = value;
  }

  get value(): T {
    return this.#value;
  }

  set value(value: T) {
    if (Object.is(value, this.#value)) return;
    this.#value = value;
    for (const follower of this.#subscribers) follower(value);
  }

  /** Calls `subscriber` now and at every change; returns a function that unsubscribes it. */
  subscribe(subscriber: (value: T) => void): () => void {
    this.#subscribers.add(subscriber);
    subscriber(this.#value);
    return () => this.#subscribers.delete(subscriber);
  }
}
