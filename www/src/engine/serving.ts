/** Common parts of the app's workers: loading the engine, replies to requests, and work that can be cancelled. */
import init, { paramSpecs, version } from 'vesicle';
import { toFailure } from './refusal';

/** Work of a session that takes long, which a later request of the page can abort. */
export class Work {
  #abort: AbortController | undefined;
  #ended: Promise<unknown> = Promise.resolve();

  get isUnderWay(): boolean {
    return this.#abort !== undefined;
  }

  /** Aborts without waiting. */
  abort(): void {
    this.#abort?.abort();
  }

  /** Aborts the work, if any, and waits for its end; its result or error is left to the caller who started it. */
  async stop(): Promise<undefined> {
    // Other work may begin before this goes on.
    while (this.#abort) {
      this.#abort.abort();
      await this.#ended.catch(() => undefined);
    }
  }

  /** Begins work, and aborts what is under way; returns its result. */
  async begin<Result>(work: (signal: AbortSignal) => Promise<Result>): Promise<Result> {
    this.#abort?.abort();
    const abort = new AbortController();
    this.#abort = abort;
    const ended = work(abort.signal).finally(() => {
      if (this.#abort === abort) this.#abort = undefined;
    });
    this.#ended = ended;
    return ended;
  }
}

/** Handlers of the requests in a lab's table. */
export type Handlers<Requests extends { [K in keyof Requests]: { body: unknown; reply: unknown } }> = {
  [K in Exclude<keyof Requests, 'hello'>]: (
    body: Requests[K]['body'],
  ) => Promise<Requests[K]['reply']> | Requests[K]['reply'];
};

/** Returns a function that sends events to the page. */
export const sender =
  <Event>() =>
  (event: Event, transfer: Transferable[] = []): void =>
    self.postMessage(event, { transfer });

/**
 * Loads the engine at once, while the page still loads, and serves the page's requests with `handlers`; a failure to
 * load is reported when the page asks for the parameters of `method` (`hello`), of which there are none without a method. Messages without reply go to `onMessage`.
 */
export function serve<Message extends { kind: string }>(
  method: Parameters<typeof paramSpecs>[0] | undefined,
  handlers: object,
  onMessage?: (message: Message) => void,
): void {
  const starting = init();
  starting.catch(() => undefined);
  const hello = async () => {
    await starting;
    return { version: version(), specs: method ? paramSpecs(method) : [] };
  };
  self.onmessage = ({ data }: MessageEvent<Message | { id: number; kind: string; body: unknown }>) => {
    if ('id' in data) void reply({ ...handlers, hello }, data);
    else onMessage?.(data);
  };
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

/** Holds a lock until the worker has ended, so that the page knows when its memory is given back. */
function hold(lock: string): undefined {
  void navigator.locks?.request(lock, () => new Promise(() => undefined));
}

/**
 * Runs the handler for a request of the page when the engine is `ready`, and replies with the handler's result, or with its
 * failure.
 */
export async function reply(
  handlers: Record<string, (body: never) => unknown>,
  { id, kind, body }: { id: number; kind: string; body: unknown },
  ready?: Promise<unknown>,
): Promise<void> {
  const handler = (kind === 'hold' ? hold : handlers[kind]) as (body: unknown) => unknown;
  try {
    await ready;
    const result = await handler(body);
    const transfer = result instanceof Object ? transferLists.get(result) : undefined;
    self.postMessage({ id, ok: true, body: result }, { transfer: transfer ?? [] });
  } catch (error) {
    self.postMessage({ id, ok: false, failure: toFailure(error) });
  }
}
