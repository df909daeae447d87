import type { Failure } from './protocol';

/** A request that a worker could not fulfil. `code` is that of the library's VesicleError, or 'internal'. */
export class RequestError extends Error {
  readonly code: string;

  constructor(failure: Failure) {
    super(failure.message);
    this.name = 'RequestError';
    this.code = failure.code;
  }
}

/** What went wrong, whoever threw it. */
export function toFailure(error: unknown): Failure {
  if (error instanceof RequestError) return { code: error.code, message: error.message };
  return { code: 'page', message: error instanceof Error ? error.message : String(error) };
}

interface Waiting {
  resolve: (body: never) => void;
  reject: (error: RequestError) => void;
}

/** What can be asked of a worker: by name, what is sent and what comes back. */
type Asked<Requests> = { [K in keyof Requests]: { body: unknown; reply: unknown } };

type Reply = { id: number; ok: true; body: unknown } | { id: number; ok: false; failure: Failure };

/** A worker that was started before anybody had something to ask of it. */
let ahead: { spawn: () => Worker; worker: Worker } | undefined;

/** Starts a worker that a channel with the same `spawn` will take over: it loads while the page does. */
export function spawnAhead(spawn: () => Worker): void {
  if (ahead?.spawn === spawn) return;
  // That of a lab that was left before it was there.
  ahead?.worker.terminate();
  const worker = spawn();
  ahead = { spawn, worker };
  // The channel's own attempt will tell what is wrong.
  worker.onerror = () => {
    ahead = undefined;
  };
}

function takeWorker(spawn: () => Worker): Worker {
  if (ahead?.spawn !== spawn) return spawn();
  const { worker } = ahead;
  ahead = undefined;
  return worker;
}

/** The page's end of a worker: requests as promises, events to one listener. */
export class Channel<Requests extends Asked<Requests>, Event extends { event: string }> {
  readonly #spawn: () => Worker;
  readonly #onEvent: (event: Event | { event: 'failure'; failure: Failure }) => void;
  readonly #waiting = new Map<number, Waiting>();
  #worker: Worker;
  /** What broke the worker, until it is started again. */
  #failure: Failure | undefined;
  #lastId = 0;

  constructor(spawn: () => Worker, onEvent: (event: Event | { event: 'failure'; failure: Failure }) => void) {
    this.#spawn = spawn;
    this.#onEvent = onEvent;
    this.#worker = this.#start();
  }

  request<K extends keyof Requests>(
    kind: K,
    body: Requests[K]['body'],
    transfer: Transferable[] = [],
  ): Promise<Requests[K]['reply']> {
    if (this.#failure) return Promise.reject(new RequestError(this.#failure));
    const id = ++this.#lastId;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, kind, body }, transfer);
    });
  }

  /** A message that has no reply. */
  protected tell(message: { kind: string }, transfer: Transferable[] = []): void {
    this.#worker.postMessage(message, transfer);
  }

  /** A fresh worker in place of one that broke; what was asked of the old one fails. */
  restart(failure: Failure): void {
    this.#worker.terminate();
    this.#fail(failure);
    this.#failure = undefined;
    this.#worker = this.#start();
  }

  /** Ends the worker and gives its memory back. What was asked of it is never answered: nobody is there to hear it. */
  close(): void {
    this.#worker.terminate();
    this.#waiting.clear();
  }

  #start(): Worker {
    const worker = takeWorker(this.#spawn);
    worker.onmessage = ({ data }: MessageEvent<Reply | Event>) => this.#receive(data);
    worker.onerror = (event) => {
      // Told on the page, and not once more in the console.
      event.preventDefault();
      this.#broken(event.message || 'the worker could not be started');
    };
    worker.onmessageerror = () => this.#broken('a message could not be read');
    return worker;
  }

  #receive(message: Reply | Event): void {
    if ('event' in message) this.#onEvent(message);
    else this.#settle(message);
  }

  #settle(reply: Reply): void {
    const waiting = this.#waiting.get(reply.id);
    this.#waiting.delete(reply.id);
    if (reply.ok) waiting?.resolve(reply.body as never);
    else waiting?.reject(new RequestError(reply.failure));
  }

  #broken(message: string): void {
    const failure: Failure = { code: 'internal', message };
    this.#failure = failure;
    // Whatever it still did would be of no use.
    this.#worker.terminate();
    this.#fail(failure);
    this.#onEvent({ event: 'failure', failure });
  }

  #fail(failure: Failure): void {
    for (const { reject } of this.#waiting.values()) reject(new RequestError(failure));
    this.#waiting.clear();
  }
}
