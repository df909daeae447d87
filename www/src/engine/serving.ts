/** Common parts of the app's workers: loading the engine, replies to requests, and work that can be cancelled. */
import init, { paramSpecs, version } from 'vesicle';
import { type Handlers as AllHandlers, type RequestTable, serve as serveChannel } from 'vesicle/channel';

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
export type Handlers<Requests extends RequestTable<Requests>> = Omit<AllHandlers<Requests>, 'hello'>;

/** A lock to be held until the worker has ended, so that the page knows when its memory is given back. */
export interface Hold {
  kind: 'hold';
  lock: string;
}

/**
 * Loads the engine at once, while the page still loads, and serves the page's requests with `handlers`; a failure to
 * load is reported when the page asks for the parameters of `method` (`hello`), of which there are none without a method. Messages without reply go to `onMessage`.
 */
export function serveLab<Message extends { kind: string }>(
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
  serve({ ...handlers, hello }, onMessage);
}

/** Serves the page's requests with `handlers` as soon as the worker is `ready`. */
export function serveWhenReady<Requests extends RequestTable<Requests>>(
  ready: Promise<unknown>,
  handlers: AllHandlers<Requests>,
): void {
  ready.catch(() => undefined);
  const waiting = Object.entries<(...given: never[]) => unknown>(handlers).map(([kind, handle]) => [
    kind,
    async (...given: never[]) => {
      await ready;
      return handle(...given);
    },
  ]);
  serve(Object.fromEntries(waiting));
}

/** Serves the page's requests with `handlers`. Messages without reply go to `onMessage`. */
export function serve<Message extends { kind: string }>(
  handlers: object,
  onMessage?: (message: Message) => void,
): void {
  serveChannel(handlers, (message: Message | Hold) => {
    if ('lock' in message) hold(message);
    else onMessage?.(message);
  });
}

function hold({ lock }: Hold): void {
  void navigator.locks?.request(lock, () => new Promise(() => undefined));
}

export function buffersOf(arrays: ArrayBufferView[]): Transferable[] {
  return arrays.map((array) => array.buffer as ArrayBuffer);
}
