// Work that ends as a whole.

/** Functions to call when a signal aborts. */
const CALLS = new WeakMap<AbortSignal, Set<() => void>>();

/**
 * Calls `act` when the signal aborts. Signals get one listener for all calls: Node warns of a leak where one has more
 * than ten, as many requests at a time would.
 *
 * @returns A function that undoes it.
 */
export function onAbort(signal: AbortSignal | undefined, act: () => void): () => void {
  if (!signal) return () => {};
  const calls = CALLS.get(signal) ?? listened(signal);
  // The same function may be given twice.
  const call = () => act();
  calls.add(call);
  return () => calls.delete(call);
}

function listened(signal: AbortSignal): Set<() => void> {
  const calls = new Set<() => void>();
  CALLS.set(signal, calls);
  const callAll = () => {
    for (const call of calls) call();
  };
  signal.addEventListener('abort', callAll, { once: true });
  return calls;
}

/**
 * Calls `work` with a signal that aborts with `outer`, with its reason, and when the work fails, so that none of its
 * requests goes on after that.
 *
 * @throws What `work` throws; `outer.reason` if `outer` has aborted before.
 */
export async function endingTogether<Result>(
  outer: AbortSignal | undefined,
  work: (signal: AbortSignal) => Promise<Result>,
): Promise<Result> {
  outer?.throwIfAborted();
  const stop = new AbortController();
  const forget = onAbort(outer, () => stop.abort(outer?.reason));
  try {
    return await work(stop.signal);
  } catch (error) {
    stop.abort(error);
    throw error;
  } finally {
    forget();
  }
}
