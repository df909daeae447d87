import { Channel, type RequestTable } from 'vesicle/channel';
import { text } from '../texts';
import { RequestError, workerFailure } from './failure';
import type { Failure } from './protocol';
import type { Hold } from './serving';

/**
 * Worker that {@link preloadWorker} has started and no {@link EngineChannel} has taken over yet; undefined if there is none.
 */
let preloaded: { spawn: () => Worker; worker: Worker } | undefined;

/**
 * Starts a lab's worker before the lab's own code is loaded, so that both load in parallel. The next {@link EngineChannel}
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
  worker.onerror = null;
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

/** Ends the connection of a lab that is being closed, whose requests are then never settled. */
const CLOSED = new Error('the lab was closed');

type Connection<Requests extends RequestTable<Requests>, Event, Message> = Channel<Requests, Event, Message | Hold>;

interface Waiting<To> {
  send: (connection: To) => void;
  refuse: (error: unknown) => void;
}

/**
 * The page's connection to a lab's worker, which can be replaced by a new one: requests return promises, events go to
 * one listener, and a `Message` has no reply.
 */
export class EngineChannel<
  Requests extends RequestTable<Requests>,
  Event extends { event: string },
  Message extends { kind: string } = never,
> {
  readonly #spawn: () => Worker;
  readonly #onEvent: (event: Event | { event: 'failure'; failure: Failure }) => void;
  /** The connection to the worker; undefined until the one before has ended. */
  #connection: Connection<Requests, Event, Message> | undefined;
  /** Name of the lock that the worker holds until it has ended. */
  #lock = '';
  /** Requests and messages that wait for the worker. */
  #waiting: Waiting<Connection<Requests, Event, Message>>[] = [];
  #isClosed = false;

  constructor(spawn: () => Worker, onEvent: (event: Event | { event: 'failure'; failure: Failure }) => void) {
    this.#spawn = spawn;
    this.#onEvent = onEvent;
    this.#start();
  }

  request<K extends keyof Requests & string>(
    kind: K,
    body: Requests[K]['body'],
    transfer: Transferable[] = [],
  ): Promise<Requests[K]['reply']> {
    return new Promise((resolve, reject) => {
      const refuse = (error: unknown) => error === CLOSED || reject(requestError(error));
      const send = (connection: Connection<Requests, Event, Message>) => {
        // It throws, and does not reject, where nothing can be sent.
        const answered = async () => connection.request(kind, body, { transfer });
        void answered().then(resolve, refuse);
      };
      this.#send({ send, refuse });
    });
  }

  /** Posts a message that has no reply to the worker. */
  post(message: Message, transfer: Transferable[] = []): void {
    this.#send({ send: (connection) => connection.post(message, transfer), refuse: () => undefined });
  }

  #send(one: Waiting<Connection<Requests, Event, Message>>): void {
    if (this.#connection) one.send(this.#connection);
    else this.#waiting.push(one);
  }

  /**
   * Replaces the worker by a new one, after it broke or to cancel its work. Requests still pending at the old one are
   * rejected with `failure`.
   */
  restart(failure: Failure): void {
    const error = new RequestError(failure);
    for (const { refuse } of this.#waiting) refuse(error);
    this.#waiting = [];
    // The one before, which has not ended, is waited for already.
    if (!this.#connection) return;
    this.#connection.end(error);
    this.#connection = undefined;
    void released(this.#lock).then(() => this.#isClosed || this.#start());
  }

  /** Terminates the worker and frees its memory. Pending requests are never settled, since the lab is being closed. */
  close(): void {
    this.#isClosed = true;
    this.#connection?.end(CLOSED);
  }

  #start(): void {
    const connection = new Channel<Requests, Event, Message | Hold>(takeWorker(this.#spawn), {
      onEvent: this.#onEvent,
      onEnd: (error) => this.#onEvent({ event: 'failure', failure: workerFailure(error) }),
      errorOfEnd: (what, hasStarted) => new Error(hasStarted ? what : text('shell.workerFailed')),
    });
    this.#connection = connection;
    this.#lock = `${LOCK} ${Math.random()}`;
    connection.post({ kind: 'hold', lock: this.#lock });
    for (const { send } of this.#waiting) send(connection);
    this.#waiting = [];
  }
}

const requestError = (error: unknown) =>
  error instanceof RequestError ? error : new RequestError(workerFailure(error));
