/**
 * Requests of a page to a worker of its own: the connection on which `vesicle/worker` stands, for code that runs beside
 * the library in a worker.
 *
 * ```js
 * // worker.js
 * import init, { DeformableModel, Volume } from 'vesicle';
 * import { serve, withTransfer } from 'vesicle/channel';
 *
 * serve({
 *   async extract({ file, iso }, { signal, report }) {
 *     await init();
 *     using volume = Volume.parse(file);
 *     using model = new DeformableModel({ volume, params: { iso } });
 *     await model.run({ signal, onStep: report });
 *     const arrays = model.mesh.arrays();
 *     return withTransfer(arrays, [arrays.positions, arrays.normals, arrays.indices]);
 *   },
 * });
 *
 * // page.js
 * import { Channel } from 'vesicle/channel';
 *
 * const worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
 * const channel = new Channel(worker);
 * const onReport = ({ iteration, vertices }) => console.log(iteration, vertices);
 * const { positions, indices } = await channel.request('extract', { file, iso: 95 }, { signal, onReport });
 * ```
 *
 * In TypeScript a {@link RequestTable} types both ends: `new Channel<Requests>(worker)` and `serve<Requests>({ … })` with
 * `interface Requests { extract: { body: { file: Uint8Array; iso: number }; reply: MeshArrays; report: StepReport } }`.
 *
 * Bodies, replies, reports, events and messages are whatever `postMessage` can send. The worker handles requests in
 * order, each up to its first `await`, and others meanwhile. In Node, the worker keeps the program running until it has
 * answered all requests, and no longer, whatever events it may send.
 *
 * **Errors.** A request rejects with what its handler throws: a {@link VesicleError} with its code, a
 * {@link VesicleCrash}, with which the channel ends, any other error with its name and message.
 *
 * @module vesicle/channel
 */
import { onAbort } from './abort.js';
import { type ErrorCode, VesicleCrash, VesicleError } from './error.js';

export { type ErrorCode, VesicleCrash, VesicleError } from './error.js';

/** The methods of the class `Worker` of `node:worker_threads` that the library uses. */
export interface NodeWorker {
  postMessage(message: unknown, transfer: ArrayBuffer[]): void;
  terminate(): unknown;
  on(event: string, listener: (value: unknown) => void): unknown;
  ref(): void;
  unref(): void;
}

/** Constraint on a table of requests: by kind, the types of body, reply and reports. */
export type RequestTable<Requests> = {
  [K in keyof Requests]: { body: unknown; reply: unknown; report?: unknown };
};

type ReportOf<Request> = Request extends { report: infer Report } ? Report : never;

/** Options of {@link Channel.request}. */
export interface RequestOptions<Report = never> {
  /** Buffers in the body to transfer instead of copying them. */
  transfer?: Transferable[];
  /**
   * Aborts the signal of the handler. The promise rejects with its reason when the handler has ended, whatever the
   * handler returns or throws then.
   */
  signal?: AbortSignal | undefined;
  /** Receives the reports of the handler; an error that it throws aborts as `signal` does. */
  onReport?: ((report: Report) => void) | undefined;
  /** Converts the reply; called with that of an aborted request, too, whose promise then rejects. */
  receive?: (reply: unknown) => unknown;
  /** An object to be kept from garbage collection until the request is settled. */
  holds?: unknown;
}

/** Options of a {@link Channel}. */
export interface ChannelOptions<Event = never> {
  /** Receives what the worker sends of its own accord. */
  onEvent?: (event: Event) => void;
  /** Called when the worker ends by itself or crashes: with the error with which all pending requests reject. */
  onEnd?: (error: Error) => void;
  /**
   * Makes the error of a worker that ended by itself, because of `what`, before or after it had sent anything; a plain
   * `Error` by default.
   */
  errorOfEnd?: (what: string, hasStarted: boolean) => Error;
}

/** An error in the worker, from which the page makes an equal one. */
type Failure =
  | { kind: 'error'; code: ErrorCode; message: string }
  | { kind: 'crash'; message: string; cause: string | undefined }
  | { kind: 'aborted' }
  /** Any other error, in parts: cloning loses the name unless it is one of JavaScript's own, and in Node more. */
  | { kind: 'other'; name: string; message: string; stack: string | undefined };

interface Request {
  id: number;
  kind: string;
  body: unknown;
  /** Whether the page listens to reports. */
  reports: boolean;
}

interface Abort {
  /** Id of the request to abort. */
  abort: number;
}

type Answer = { id: number; value: unknown } | { id: number; failure: Failure };
type Report = { id: number; report: unknown };

/** All messages are of the channel, which wraps those of its users, so that no key of theirs is treated as one of its own. */
type ToWorker<Message> = Request | Abort | { message: Message };
type ToPage<Event> = Answer | Report | { event: Event };

interface PendingRequest {
  resolve: (reply: unknown) => void;
  reject: (error: unknown) => void;
  options: RequestOptions<unknown>;
  /** Ends listening to the signal. */
  forget: () => void;
  /** Why the request was aborted; undefined if it was not. */
  aborted?: { reason: unknown };
}

/**
 * The page's end of the connection to a worker, which it owns. `Requests` is a {@link RequestTable}, `Event` what the
 * worker sends of its own accord, `Message` what the page sends without expecting a reply.
 */
export class Channel<Requests extends RequestTable<Requests>, Event = never, Message = never> {
  readonly #worker: Worker | NodeWorker;
  readonly #onEvent: ((event: Event) => void) | undefined;
  readonly #onEnd: ((error: Error) => void) | undefined;
  readonly #pending = new Map<number, PendingRequest>();
  #lastId = 0;
  /** Whether the worker has sent anything. */
  #hasStarted = false;
  #end: Error | undefined;

  constructor(worker: Worker | NodeWorker, { onEvent, onEnd, errorOfEnd = endOf }: ChannelOptions<Event> = {}) {
    this.#worker = worker;
    this.#onEvent = onEvent;
    this.#onEnd = onEnd;
    listen(
      worker,
      (message) => this.#receive(message as ToPage<Event>),
      (what) => this.#fail(errorOfEnd(what, this.#hasStarted)),
    );
  }

  /** The error with which the channel ended; undefined while it is usable. */
  get ended(): Error | undefined {
    return this.#end;
  }

  /**
   * Sends a request to the worker, and resolves with the reply of its handler.
   *
   * @throws At once, without a promise: the error with which the channel has ended; {@link VesicleError}
   *   `invalid-argument` if the body cannot be sent.
   */
  request<K extends keyof Requests & string>(
    kind: K,
    body: Requests[K]['body'],
    options: RequestOptions<ReportOf<Requests[K]>> = {},
  ): Promise<Requests[K]['reply']> {
    if (this.#end) throw this.#end;
    const { transfer = [], signal, onReport } = options;
    if (signal?.aborted) return Promise.reject(signal.reason);
    this.#lastId += 1;
    const id = this.#lastId;
    this.#send({ id, kind, body, reports: onReport !== undefined }, transfer);
    // Keeps Node running as long as requests are pending, and no longer.
    if ('ref' in this.#worker) this.#worker.ref();
    const forget = onAbort(signal, () => this.#abort(id, signal?.reason));
    return new Promise<Requests[K]['reply']>((resolve, reject) => {
      this.#pending.set(id, { resolve, reject, options: options as RequestOptions<unknown>, forget });
    });
  }

  /** Sends a message that has no reply; nothing is sent after the end of the channel. */
  post(message: Message, transfer: Transferable[] = []): void {
    if (!this.#end) this.#send({ message }, transfer);
  }

  /** Terminates the worker: all pending requests reject with `reason`, and later ones throw it. */
  end(reason: Error): void {
    if (this.#end) return;
    this.#end = reason;
    this.#worker.terminate();
    for (const { reject, forget } of this.#pending.values()) {
      forget();
      reject(reason);
    }
    this.#pending.clear();
  }

  #fail(error: Error): void {
    if (this.#end) return;
    this.end(error);
    this.#onEnd?.(error);
  }

  #send(message: ToWorker<Message>, transfer: Transferable[]): void {
    try {
      this.#worker.postMessage(message, transfer as ArrayBuffer[]);
    } catch (error) {
      const what = (error as Error).message;
      throw new VesicleError('invalid-argument', `an argument cannot be sent to the worker: ${what}`);
    }
  }

  #abort(id: number, reason: unknown): void {
    const request = this.#pending.get(id);
    if (!request || request.aborted) return;
    request.aborted = { reason };
    this.#send({ abort: id }, []);
  }

  #receive(message: ToPage<Event>): void {
    this.#hasStarted = true;
    if (this.#end) return;
    if ('event' in message) this.#onEvent?.(message.event);
    else if ('report' in message) this.#report(message);
    else this.#settle(message);
  }

  #report({ id, report }: Report): void {
    const request = this.#pending.get(id);
    if (!request || request.aborted) return;
    try {
      request.options.onReport?.(report);
    } catch (error) {
      this.#abort(id, error);
    }
  }

  #settle(answer: Answer): void {
    const request = this.#pending.get(answer.id);
    if (!request) return;
    this.#pending.delete(answer.id);
    request.forget();
    if ('unref' in this.#worker && this.#pending.size === 0) this.#worker.unref();
    if ('failure' in answer) {
      const error = errorOf(answer.failure);
      request.reject(request.aborted && !(error instanceof VesicleCrash) ? request.aborted.reason : error);
      if (error instanceof VesicleCrash) this.#fail(error);
    } else this.#resolve(request, answer.value);
  }

  #resolve({ resolve, reject, options, aborted }: PendingRequest, value: unknown): void {
    try {
      const reply = options.receive ? options.receive(value) : value;
      if (aborted) reject(aborted.reason);
      else resolve(reply);
    } catch (error) {
      reject(error);
    }
  }
}

const endOf = (what: string, hasStarted: boolean) =>
  new Error(`the worker ${hasStarted ? 'ended' : 'could not be started'}: ${what}`);

/** Errors of JavaScript's own that the page makes again as such. */
const NATIVE: Record<string, ErrorConstructor> = { TypeError, RangeError, SyntaxError, ReferenceError };

function errorOf(failure: Failure): Error {
  if (failure.kind === 'other') {
    const { name, message, stack } = failure;
    const Native = (Object.hasOwn(NATIVE, name) && NATIVE[name]) || Error;
    return Object.assign(new Native(message), { name, ...(stack !== undefined && { stack }) });
  }
  if (failure.kind === 'aborted') return new VesicleError('aborted', 'the run was aborted');
  if (failure.kind === 'error') return new VesicleError(failure.code, failure.message);
  const crash = new VesicleCrash('', { cause: failure.cause });
  crash.message = failure.message;
  return crash;
}

function listen(worker: Worker | NodeWorker, receive: (message: unknown) => void, fail: (what: string) => void): void {
  const garbled = () => fail('a message could not be deserialised');
  if ('on' in worker) {
    worker.on('message', receive);
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

/** Second argument of the handler of a request. */
export interface RequestContext<Report = never> {
  /** Aborts when the page aborts the request. */
  signal: AbortSignal;
  /** Sends a report to the page; undefined where the page does not listen. */
  report: ((report: Report) => void) | undefined;
}

/** Handlers of requests, by kind. */
export type Handlers<Requests extends RequestTable<Requests>> = {
  [K in keyof Requests]: (
    body: Requests[K]['body'],
    context: RequestContext<ReportOf<Requests[K]>>,
  ) => Promise<Requests[K]['reply']> | Requests[K]['reply'];
};

/** Reason with which requests abort in the worker; the page rejects with a reason of its own. */
const ABORTED = new VesicleError('aborted', 'the run was aborted');

const controllers = new Map<number, AbortController>();

/**
 * Handles the page's requests, in the worker; call it once, at once. Messages that are not requests go to `onMessage`.
 */
export function serve<Requests extends RequestTable<Requests>, Message = never>(
  handlers: Handlers<Requests>,
  onMessage?: (message: Message) => void,
): void {
  const receive = (data: ToWorker<Message>) => {
    if ('abort' in data) controllers.get(data.abort)?.abort(ABORTED);
    else if ('message' in data) onMessage?.(data.message);
    else void answer(handlers as Record<string, Handler>, data);
  };
  withPort((port) => {
    if (port.on) port.on('message', receive as (data: unknown) => void);
    else addEventListener('message', ({ data }) => receive(data));
  });
}

/** Sends an event of the worker's own accord to the page. */
export function send<Event>(event: Event, transfer: Transferable[] = []): void {
  post({ event }, transfer);
}

function post(message: ToPage<unknown>, transfer: Transferable[] = []): void {
  withPort((port) => port.postMessage(message, transfer));
}

/** For each reply marked by `withTransfer`, the buffers to transfer with it. */
const transfers = new WeakMap<object, Transferable[]>();

/** Marks arrays or buffers in a reply to be transferred to the page instead of copied; they are lost to the worker. */
export function withTransfer<Reply extends object>(
  reply: Reply,
  arrays: Iterable<ArrayBufferView | ArrayBuffer>,
): Reply {
  const buffers = Array.from(arrays, (array) => (ArrayBuffer.isView(array) ? (array.buffer as ArrayBuffer) : array));
  transfers.set(reply, [...new Set(buffers)]);
  return reply;
}

type Handler = (body: unknown, context: RequestContext<unknown>) => unknown;

async function answer(handlers: Record<string, Handler>, { id, kind, body, reports }: Request): Promise<void> {
  const controller = new AbortController();
  controllers.set(id, controller);
  const report = reports ? (value: unknown) => post({ id, report: value }) : undefined;
  try {
    const handler = Object.hasOwn(handlers, kind) ? handlers[kind] : undefined;
    if (!handler) throw new VesicleError('invalid-argument', `${kind}: the worker has no handler of such requests`);
    const value = await handler(body, { signal: controller.signal, report });
    post({ id, value }, transfers.get(value as object));
  } catch (error) {
    post({ id, failure: failureOf(error) });
  } finally {
    controllers.delete(id);
  }
}

function failureOf(error: unknown): Failure {
  if (error === ABORTED) return { kind: 'aborted' };
  const { name, message, stack, code, cause } = partsOf(error);
  // Not by the class: `vesicle/inline` has classes of its own.
  if (name === 'VesicleCrash') return { kind: 'crash', message, cause };
  if (name === 'VesicleError' && code !== undefined) return { kind: 'error', code: code as ErrorCode, message };
  return { kind: 'other', name, message, stack };
}

/** Parts of whatever was thrown, as strings, which can be sent; none where even that fails. */
function partsOf(error: unknown) {
  const part = (name: string) => {
    const value = (error as Record<string, unknown> | undefined)?.[name];
    return typeof value === 'string' ? value : undefined;
  };
  try {
    const { cause } = (error ?? {}) as { cause?: unknown };
    const message = error instanceof Error || part('message') !== undefined ? (part('message') ?? '') : String(error);
    const given = { stack: part('stack'), code: part('code'), cause: cause === undefined ? undefined : String(cause) };
    return { name: part('name') ?? 'Error', message, ...given };
  } catch {
    const message = 'the error of a handler cannot be sent';
    return { name: 'Error', message, stack: undefined, code: undefined, cause: undefined };
  }
}

/** The worker's end of the connection; only that of Node has `on`. */
interface Port {
  postMessage(message: unknown, transfer: Transferable[]): void;
  on?: (event: 'message', listener: (data: unknown) => void) => void;
}

let port: Port | undefined;
/** In Node, what waits for the port to be loaded. */
const waiting: ((port: Port) => void)[] = [];

/** Acts at once, so that errors are the caller's; but in Node after the port was loaded, in order. */
function withPort(act: (port: Port) => void): void {
  if ('postMessage' in globalThis) port = globalThis as unknown as Port;
  if (port) act(port);
  else if (waiting.push(act) === 1) void loadPort();
}

async function loadPort(): Promise<void> {
  // Hidden from bundlers: a page never gets here.
  const threads = 'node:worker_threads';
  const { parentPort } = await import(/* @vite-ignore */ /* webpackIgnore: true */ threads);
  for (const act of waiting) act(parentPort);
  port = parentPort;
}
