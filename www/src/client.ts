import type {
  Failure,
  FromWorker,
  ReplyMessage,
  RequestKind,
  RequestMessage,
  Requests,
  ReturnMessage,
  SurfaceBuffers,
  WorkerEvent,
} from './protocol';

/** A request that the worker could not fulfil. `code` is that of the library's VesicleError, or 'internal'. */
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

/** The page's end of the worker: requests as promises, events to one listener. */
export class Client {
  readonly #onEvent: (event: WorkerEvent) => void;
  readonly #waiting = new Map<number, Waiting>();
  #worker: Worker;
  #lastId = 0;

  constructor(onEvent: (event: WorkerEvent) => void) {
    this.#onEvent = onEvent;
    this.#worker = this.#start();
  }

  request<K extends RequestKind>(
    kind: K,
    body: Requests[K]['body'],
    transfer: Transferable[] = [],
  ): Promise<Requests[K]['reply']> {
    const id = ++this.#lastId;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, kind, body } as RequestMessage, transfer);
    });
  }

  /** Gives a snapshot's buffers back, which also tells the worker that the page is ready for another. */
  giveBack({ positions, normals, indices }: SurfaceBuffers): void {
    const message: ReturnMessage = { kind: 'return', buffers: { positions, normals, indices } };
    this.#worker.postMessage(message, [positions.buffer, normals.buffer, indices.buffer]);
  }

  /** A fresh worker in place of one that broke; what was asked of the old one fails. */
  restart(failure: Failure): void {
    this.#worker.terminate();
    for (const { reject } of this.#waiting.values()) reject(new RequestError(failure));
    this.#waiting.clear();
    this.#worker = this.#start();
  }

  #start(): Worker {
    const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle' });
    worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.#receive(data);
    worker.onerror = (event) => this.#broken(event.message || 'the worker could not be started');
    worker.onmessageerror = () => this.#broken('a message could not be read');
    return worker;
  }

  #receive(message: FromWorker): void {
    if ('event' in message) this.#onEvent(message);
    else this.#settle(message);
  }

  #settle(reply: ReplyMessage): void {
    const waiting = this.#waiting.get(reply.id);
    this.#waiting.delete(reply.id);
    if (reply.ok) waiting?.resolve(reply.body as never);
    else waiting?.reject(new RequestError(reply.failure));
  }

  #broken(message: string): void {
    const failure: Failure = { code: 'internal', message };
    for (const { reject } of this.#waiting.values()) reject(new RequestError(failure));
    this.#waiting.clear();
    this.#onEvent({ event: 'failure', failure });
  }
}
