/** What every worker does alike: answers, and stops what is under way. */
import { toFailure } from './refusal';

/** Work that can be stopped. */
export interface Work {
  abort: AbortController;
  ended: Promise<unknown>;
}

/** Ends what is under way, where something is; how it ends is for whoever started it. */
export async function stop(work: Work | undefined): Promise<undefined> {
  work?.abort.abort();
  await work?.ended.catch(() => undefined);
}

export function buffersOf(arrays: (Float32Array | Uint32Array)[]): Transferable[] {
  return arrays.map((array) => array.buffer as ArrayBuffer);
}

/** Replies with what the handler gives, or with what was wrong. */
export async function answer(
  handlers: Record<string, (body: never) => unknown>,
  { id, kind, body }: { id: number; kind: string; body: unknown },
): Promise<void> {
  const handler = handlers[kind] as (body: unknown) => unknown;
  try {
    self.postMessage({ id, ok: true, body: await handler(body) });
  } catch (error) {
    self.postMessage({ id, ok: false, failure: toFailure(error) });
  }
}
