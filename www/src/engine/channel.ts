import { text } from '../texts';
import type { Failure } from './protocol';

/**
 * Error of a request that a lab's worker could not fulfil. `code` is that of a VesicleError, or 'internal' if the
 * engine (the worker's WebAssembly module) broke.
 */
export class RequestError extends Error {
  readonly code: string;

  constructor(failure: Failure) {
    super(failure.message);
    this.name = 'RequestError';
    this.code = failure.code;
  }
}

/**
 * Converts any thrown value to a `Failure`, the error code and message that the page displays; an error that is no
 * `RequestError` gets the code 'page'.
 */
export function toFailure(error: unknown): Failure {
  if (error instanceof RequestError) return { code: error.code, message: error.message };
  return { code: 'page', message: error instanceof Error ? error.message : String(error) };
}

interface PendingRequest {
  resolve: (body: never) => void;
  reject: (error: RequestError) => void;
}

/** Constraint on a lab's request table: maps the name of each request to the types of its body and reply. */
type RequestTable<Requests> = { [K in keyof Requests]: { body: unknown; reply: unknown } };

type Reply = { id: number; ok: true; body: unknown } | { id: number; ok: false; failure: Failure };

/**
 * Worker that {@link preloadWorker} has started and no {@link Channel} has taken over yet; undefined if there is none.
 */
let preloaded: { spawn: () => Worker; worker: Worker } | undefined;

/**
 * Starts a lab's worker before the lab's own code is loaded, so that both load in parallel. The next {@link Channel}
 * created with the same `spawn` takes the worker over.
 */
export function preloadWorker(spawn: () => Worker): void {
  if (preloaded?.spawn === spawn) return;
  // It belongs to a lab that was closed before it had opened.
  preloaded?.worker.terminate();
  const worker = spawn();
  preloaded = { spawn, worker };
  // Forget it: the channel then starts its own worker, and reports what is wrong.
  worker.onerror = () => {
    preloaded = undefined;
  };
}

function takeWorker(spawn: () => Worker): Worker {
  if (preloaded?.spawn !== spawn) return spawn();
  const { worker } = preloaded;
  preloaded = undefined;
  return worker;
}

const LOCK = 'vesicle worker';
/** Most milliseconds to wait for a worker to end; browsers end a busy one after about two seconds. */
const ENDING_MS = 5000;

/**
 * Resolves when nobody holds a lock any more: that of a terminated worker, whose memory is given back then. Does not
 * wait in a page that has no locks since it came without encryption.
 */
async function released(lock: string): Promise<void> {
  const signal = AbortSignal.timeout(ENDING_MS);
  await navigator.locks?.request(lock, { signal }, () => undefined).catch(() => undefined);
}

/**
 * The page's connection to a lab's worker: requests return promises, events go to one listener, and a `Message` has no
 * reply.
 */
export class Channel<
  Requests extends RequestTable<Requests>,
  Event extends { event: string },
  Message extends { kind: string } = never,
> {
  readonly #spawn: () => Worker;
  readonly #onEvent: (event: Event | { event: 'failure'; failure: Failure }) => void;
  readonly #pending = new Map<number, PendingRequest>();
  /** The worker; undefined until the one before has ended. */
  #worker: Worker | undefined;
  /** Name of the lock that the worker holds until it has ended. */
  #lock = '';
  /** Messages that wait for the worker. */
  #unsent: [message: object, transfer: Transferable[]][] = [];
  #isClosed = false;
  /** Failure that broke the worker, if any; every request is rejected with it until the worker is restarted. */
  #failure: Failure | undefined;
  #lastId = 0;

  constructor(spawn: () => Worker, onEvent: (event: Event | { event: 'failure'; failure: Failure }) => void) {
    this.#spawn = spawn;
    this.#onEvent = onEvent;
    this.#start();
  }

  request<K extends keyof Requests>(
    kind: K,
    body: Requests[K]['body'],
    transfer: Transferable[] = [],
  ): Promise<Requests[K]['reply']> {
    if (this.#failure) return Promise.reject(new RequestError(this.#failure));
    const id = ++this.#lastId;
    return new Promise((resolve, reject) => {
      this.#pending.set(id, { resolve, reject });
      this.#send({ id, kind, body }, transfer);
    });
  }

  /** Posts a message that has no reply to the worker. */
  post(message: Message, transfer: Transferable[] = []): void {
    this.#send(message, transfer);
  }

  #send(message: object, transfer: Transferable[]): void {
    if (this.#worker) this.#worker.postMessage(message, transfer);
    else this.#unsent.push([message, transfer]);
  }

  /**
   * Replaces the worker by a new one, after it broke or to cancel its work. Requests still pending at the old one are
   * rejected with `failure`.
   */
  restart(failure: Failure): void {
    this.#fail(failure);
    this.#failure = undefined;
    this.#unsent = [];
    // The one before, which has not ended, is waited for already.
    if (!this.#worker) return;
    this.#worker.terminate();
    this.#worker = undefined;
    void released(this.#lock).then(() => this.#isClosed || this.#start());
  }

  /** Terminates the worker and frees its memory. Pending requests are never settled, since the lab is being closed. */
  close(): void {
    this.#worker?.terminate();
    this.#isClosed = true;
    this.#pending.clear();
  }

  #start(): void {
    const worker = takeWorker(this.#spawn);
    this.#worker = worker;
    this.#lock = `${LOCK} ${Math.random()}`;
    worker.postMessage({ id: 0, kind: 'hold', body: this.#lock });
    for (const [message, transfer] of this.#unsent) worker.postMessage(message, transfer);
    this.#unsent = [];
    worker.onmessage = ({ data }: MessageEvent<Reply | Event>) => this.#receive(data);
    worker.onerror = (event) => {
      // The page shows the error; the console need not repeat it.
      event.preventDefault();
      this.#broken(event.message || text('shell.workerFailed'));
    };
    worker.onmessageerror = () => this.#broken(text('shell.messageUnreadable'));
  }

  #receive(message: Reply | Event): void {
    if ('event' in message) this.#onEvent(message);
    else this.#settle(message);
  }

  #settle(reply: Reply): void {
    const request = this.#pending.get(reply.id);
    this.#pending.delete(reply.id);
    if (reply.ok) request?.resolve(reply.body as never);
    else request?.reject(new RequestError(reply.failure));
  }

  #broken(message: string): void {
    const failure: Failure = { code: 'internal', message };
    this.#failure = failure;
    // Its further results could not be trusted.
    this.#worker?.terminate();
    this.#fail(failure);
    this.#onEvent({ event: 'failure', failure });
  }

  #fail(failure: Failure): void {
    for (const { reject } of this.#pending.values()) reject(new RequestError(failure));
    this.#pending.clear();
  }
}
