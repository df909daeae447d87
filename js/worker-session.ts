// Connection to one worker from start to end: pending requests and their answers.
import { VesicleCrash, VesicleError } from './error.js';
import type { Failure, Reply, Report, Request, Task } from './worker-protocol.js';

/** The methods of the class `Worker` of `node:worker_threads` that the library uses. */
export interface NodeWorker {
  postMessage(message: unknown, transfer: ArrayBuffer[]): void;
  terminate(): unknown;
  on(event: string, listener: (value: unknown) => void): unknown;
  ref(): void;
  unref(): void;
}

interface PendingRequest {
  resolve: (value: unknown) => void;
  reject: (error: unknown) => void;
  onReport: ((report: Report) => void) | undefined;
  /** Proxy of the object that the request calls, kept from garbage collection until the answer arrives. */
  target: unknown;
}

/**
 * Options of a request to the worker: buffers to transfer, the proxy of the called object, and the listener of reports.
 */
interface RequestOptions {
  transfer?: ArrayBuffer[];
  target?: unknown;
  onReport?: ((report: Report) => void) | undefined;
}

/** The promise of an answer from the worker, and the id of its request. */
interface PendingAnswer {
  id: number;
  answer: Promise<unknown>;
}

/** Sends requests to a worker and settles the promise of each with its answer. */
export class Session {
  readonly #worker: Worker | NodeWorker;
  readonly #pending = new Map<number, PendingRequest>();
  #last = 0;
  #started = false;
  #end: Error | undefined;

  constructor(worker: Worker | NodeWorker) {
    this.#worker = worker;
    listen(
      worker,
      (reply) => this.#receive(reply),
      (what) => this.end(this.#started ? new VesicleCrash(`The worker ended: ${what}`) : notStarted(what)),
    );
  }

  /** The error with which the worker ended; undefined while the worker is usable. */
  get ended(): Error | undefined {
    return this.#end;
  }

  /** Returns a new id, for an object or a request. */
  nextId(): number {
    this.#last += 1;
    return this.#last;
  }

  /**
   * Posts a task to the worker. Throws if the worker has ended or an argument cannot be sent; other failures reject the
   * answer.
   */
  post(task: Task, { transfer = [], target, onReport }: RequestOptions = {}): PendingAnswer {
    if (this.#end) throw this.#end;
    const id = this.nextId();
    this.#send({ ...task, id }, transfer);
    const answer = new Promise((resolve, reject) => this.#pending.set(id, { resolve, reject, onReport, target }));
    // Keeps Node running as long as requests are pending, and no longer.
    if ('ref' in this.#worker) this.#worker.ref();
    return { id, answer };
  }

  /** Aborts the run or the coverage measurement requested under `id`, whose promise then rejects. */
  abort(id: number): void {
    if (!this.#end) this.#send({ type: 'abort', id }, []);
  }

  /** Frees the object with the id `object` in the worker. */
  free(object: number): void {
    if (!this.#end) this.#send({ type: 'free', object }, []);
  }

  /** Terminates the worker: all pending requests reject with `reason`, and later ones throw it. */
  end(reason: Error): void {
    if (this.#end) return;
    this.#end = reason;
    this.#worker.terminate();
    for (const { reject } of this.#pending.values()) reject(reason);
    this.#pending.clear();
  }

  #send(request: Request, transfer: ArrayBuffer[]): void {
    try {
      this.#worker.postMessage(request, transfer);
    } catch (error) {
      const what = (error as Error).message;
      throw new VesicleError('invalid-argument', `an argument cannot be sent to the worker: ${what}`);
    }
  }

  #receive(reply: Reply): void {
    this.#started = true;
    const request = this.#pending.get(reply.id);
    if (!request || this.#end) return;
    if (reply.type === 'report') request.onReport?.(reply.report);
    else this.#settle(reply, request);
  }

  #settle(reply: Exclude<Reply, { type: 'report' }>, { resolve, reject }: PendingRequest): void {
    this.#pending.delete(reply.id);
    if ('unref' in this.#worker && this.#pending.size === 0) this.#worker.unref();
    if (reply.type === 'value') {
      resolve(reply.value);
      return;
    }
    const error = errorOf(reply.failure);
    reject(error);
    if (error instanceof VesicleCrash) this.end(error);
  }
}

const notStarted = (what: string) => new Error(`init: the worker could not be started: ${what}`);

function errorOf(failure: Failure): Error {
  if (failure.kind === 'other') return Object.assign(failure.error, { name: failure.name });
  if (failure.kind === 'aborted') return new VesicleError('aborted', 'the run was aborted');
  if (failure.kind === 'error') return new VesicleError(failure.code, failure.message);
  const crash = new VesicleCrash('', { cause: failure.cause });
  crash.message = failure.message;
  return crash;
}

function listen(worker: Worker | NodeWorker, receive: (reply: Reply) => void, fail: (what: string) => void): void {
  const garbled = () => fail('a message could not be deserialised');
  if ('on' in worker) {
    worker.on('message', (reply) => receive(reply as Reply));
    worker.on('error', (error) => fail(error instanceof Error ? error.message : String(error)));
    worker.on('exit', (code) => fail(`exited with code ${code}`));
    worker.on('messageerror', garbled);
    return;
  }
  worker.addEventListener('message', ({ data }) => receive(data));
  worker.addEventListener('error', (event) => {
    // All pending requests reject with it; the console need not report it.
    event.preventDefault();
    fail(event.message || 'its script could not be loaded');
  });
  worker.addEventListener('messageerror', garbled);
}
