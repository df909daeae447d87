// One worker, from its start to its end: what is asked of it, and what waits for its answers.
import { VesicleCrash, VesicleError } from './error.js';
import type { Failure, Reply, Report, Request, Task } from './worker-protocol.js';

/** A worker of `node:worker_threads`, as far as it is used. */
export interface NodeWorker {
  postMessage(message: unknown, transfer: ArrayBuffer[]): void;
  terminate(): unknown;
  on(event: string, listener: (value: unknown) => void): unknown;
  ref(): void;
  unref(): void;
}

interface Waiting {
  resolve: (value: unknown) => void;
  reject: (error: unknown) => void;
  onReport: ((report: Report) => void) | undefined;
  /** The object that is asked must not be given back as garbage meanwhile. */
  asked: unknown;
}

/** What goes with a task. */
interface Extra {
  transfer?: ArrayBuffer[];
  asked?: unknown;
  onReport?: ((report: Report) => void) | undefined;
}

/** A promise and the number it goes by. */
interface Asked {
  id: number;
  answer: Promise<unknown>;
}

/** Asks, and gives each answer to whoever waits for it. */
export class Session {
  readonly #worker: Worker | NodeWorker;
  readonly #waiting = new Map<number, Waiting>();
  #last = 0;
  #started = false;
  #end: Error | undefined;

  constructor(worker: Worker | NodeWorker) {
    this.#worker = worker;
    listen(
      worker,
      (reply) => this.#hear(reply),
      (what) => this.end(this.#started ? new VesicleCrash(`The worker ended: ${what}`) : notStarted(what)),
    );
  }

  /** Why nothing can be asked any more. */
  get ended(): Error | undefined {
    return this.#end;
  }

  /** A number for an object or a request. */
  number(): number {
    this.#last += 1;
    return this.#last;
  }

  /** Posts a task. Throws at once where it cannot be posted. */
  ask(task: Task, { transfer = [], asked, onReport }: Extra = {}): Asked {
    if (this.#end) throw this.#end;
    const id = this.number();
    this.#send({ ...task, id }, transfer);
    const answer = new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject, onReport, asked }));
    // Node goes on as long as something waits, and no longer.
    if ('ref' in this.#worker) this.#worker.ref();
    return { id, answer };
  }

  /** Aborts a run or a measurement, whose promise then rejects. */
  abort(id: number): void {
    if (!this.#end) this.#send({ type: 'abort', id }, []);
  }

  /** Gives an object in the worker back. */
  free(object: number): void {
    if (!this.#end) this.#send({ type: 'free', object }, []);
  }

  /** The worker's end: all that waits, and all that comes after, rejects with the reason. */
  end(reason: Error): void {
    if (this.#end) return;
    this.#end = reason;
    this.#worker.terminate();
    for (const { reject } of this.#waiting.values()) reject(reason);
    this.#waiting.clear();
  }

  #send(request: Request, transfer: ArrayBuffer[]): void {
    try {
      this.#worker.postMessage(request, transfer);
    } catch (error) {
      const what = (error as Error).message;
      throw new VesicleError('invalid-argument', `an argument cannot be handed over to the worker: ${what}`);
    }
  }

  #hear(reply: Reply): void {
    this.#started = true;
    const waiting = this.#waiting.get(reply.id);
    if (!waiting || this.#end) return;
    if (reply.type === 'report') waiting.onReport?.(reply.report);
    else this.#settle(reply, waiting);
  }

  #settle(reply: Exclude<Reply, { type: 'report' }>, { resolve, reject }: Waiting): void {
    this.#waiting.delete(reply.id);
    if ('unref' in this.#worker && this.#waiting.size === 0) this.#worker.unref();
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
  if (failure.kind === 'aborted') return new VesicleError('aborted', 'the run was called off');
  if (failure.kind === 'error') return new VesicleError(failure.code, failure.message);
  const crash = new VesicleCrash('', { cause: failure.cause });
  crash.message = failure.message;
  return crash;
}

function listen(worker: Worker | NodeWorker, hear: (reply: Reply) => void, fail: (what: string) => void): void {
  const garbled = () => fail('a message from it could not be read');
  if ('on' in worker) {
    worker.on('message', (reply) => hear(reply as Reply));
    worker.on('error', (error) => fail(error instanceof Error ? error.message : String(error)));
    worker.on('exit', (code) => fail(`it left with code ${code}`));
    worker.on('messageerror', garbled);
    return;
  }
  worker.addEventListener('message', ({ data }) => hear(data));
  worker.addEventListener('error', (event) => {
    // Whoever waits hears of it; no need to tell the console.
    event.preventDefault();
    fail(event.message || 'its script could not be loaded');
  });
  worker.addEventListener('messageerror', garbled);
}
