// Work that lets other things happen, and ends when it is aborted.
import { EventLoopYield } from './stepper.js';

/** Milliseconds of work before yielding to the event loop. */
const SLICE_MS = 12;

/** Yields to the event loop now and then. */
export class Pause {
  readonly #signal: AbortSignal | undefined;
  readonly #yield = new EventLoopYield();
  #end = performance.now() + SLICE_MS;

  constructor(signal: AbortSignal | undefined) {
    this.#signal = signal;
  }

  /** Yields if that was long ago. @throws `signal.reason` when aborted. */
  async turn(): Promise<void> {
    if (performance.now() >= this.#end) {
      await this.#yield.wait();
      this.#end = performance.now() + SLICE_MS;
    }
    this.#signal?.throwIfAborted();
  }

  close(): void {
    this.#yield.close();
  }
}

/** Calls `work` with a pause of its own. */
export async function withPause<T>(signal: AbortSignal | undefined, work: (pause: Pause) => Promise<T>): Promise<T> {
  signal?.throwIfAborted();
  const pause = new Pause(signal);
  try {
    return await work(pause);
  } finally {
    pause.close();
  }
}
