/** Common parts of the app's workers: replies to requests, and cancellation of running work. */
import { toFailure } from './refusal';

/** Work in progress in a worker, which a later request of the page can abort. */
export interface Task {
  abort: AbortController;
  ended: Promise<unknown>;
}

/** Aborts running work, if any, and waits for its end; its result or error is left to the caller who started it. */
export async function stop(work: Task | undefined): Promise<undefined> {
  work?.abort.abort();
  await work?.ended.catch(() => undefined);
}

export function buffersOf(arrays: ArrayBufferView[]): Transferable[] {
  return arrays.map((array) => array.buffer as ArrayBuffer);
}

/** For each reply marked by `withTransfer`, the buffers to transfer with it. */
const transferLists = new WeakMap<object, Transferable[]>();

/** Marks arrays of a reply to be transferred to the page instead of copied; they become unusable in the worker. */
export function withTransfer<Reply extends object>(reply: Reply, arrays: ArrayBufferView[]): Reply {
  transferLists.set(reply, buffersOf(arrays));
  return reply;
}

/** Runs the handler for a request of the page, and replies with the handler's result, or with its failure. */
export async function reply(
  handlers: Record<string, (body: never) => unknown>,
  { id, kind, body }: { id: number; kind: string; body: unknown },
): Promise<void> {
  const handler = handlers[kind] as (body: unknown) => unknown;
  try {
    const result = await handler(body);
    const transfer = result instanceof Object ? transferLists.get(result) : undefined;
    self.postMessage({ id, ok: true, body: result }, { transfer: transfer ?? [] });
  } catch (error) {
    self.postMessage({ id, ok: false, failure: toFailure(error) });
  }
}
