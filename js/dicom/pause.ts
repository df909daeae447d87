// Pauses in long work, in which signals can abort it and pages can answer.
import { EventLoopYield } from '../stepper.js';

/** Milliseconds of work between pauses. */
const BUDGET_MS = 12;

/** Calls `work` with a function that, called often, pauses now and then, and throws `signal.reason` once it aborts. */
export async function pausing<T>(
  signal: AbortSignal | undefined,
  work: (pause: () => Promise<void>) => Promise<T>,
): Promise<T> {
  const loop = new EventLoopYield();
  let until = performance.now() + BUDGET_MS;
  signal?.throwIfAborted();
  try {
    return await work(async () => {
      if (performance.now() >= until) {
        await loop.wait();
        until = performance.now() + BUDGET_MS;
      }
      signal?.throwIfAborted();
    });
  } finally {
    loop.close();
  }
}
