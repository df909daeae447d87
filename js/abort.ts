// Work that ends as a whole.

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
  const abort = () => stop.abort(outer?.reason);
  outer?.addEventListener('abort', abort);
  try {
    return await work(stop.signal);
  } catch (error) {
    stop.abort(error);
    throw error;
  } finally {
    outer?.removeEventListener('abort', abort);
  }
}
