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

export function buffersOf(arrays: ArrayBufferView[]): Transferable[] {
  return arrays.map((array) => array.buffer as ArrayBuffer);
}

/** What goes along with a reply. */
const along = new WeakMap<object, Transferable[]>();

/** A reply whose large arrays are handed over to the page instead of being copied; nobody here may need them any more. */
export function givingAway<Reply extends object>(reply: Reply, arrays: ArrayBufferView[]): Reply {
  along.set(reply, buffersOf(arrays));
  return reply;
}

/** Replies with what the handler gives, or with what was wrong. */
export async function answer(
  handlers: Record<string, (body: never) => unknown>,
  { id, kind, body }: { id: number; kind: string; body: unknown },
): Promise<void> {
  const handler = handlers[kind] as (body: unknown) => unknown;
  try {
    const reply = await handler(body);
    const transfer = reply instanceof Object ? along.get(reply) : undefined;
    self.postMessage({ id, ok: true, body: reply }, { transfer: transfer ?? [] });
  } catch (error) {
    self.postMessage({ id, ok: false, failure: toFailure(error) });
  }
}
