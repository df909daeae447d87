/**
 * Script of the worker of `vesicle/worker`: runs the library itself and keeps a table of the objects created for the
 * page. It exports nothing; bundlers that do not detect it need it as the entry point of a worker.
 *
 * @packageDocumentation
 */
import { VesicleCrash, VesicleError } from './error.js';
import init, {
  animationGlb,
  DeformableModel,
  ImplicitSurface,
  LabelSurfaces,
  Mesh,
  MultiresolutionModel,
  paramSpecs,
  parsePoints,
  SurfaceTracker,
  Volume,
  version,
} from './index.js';
import type { MeshArrays, PositionOptions } from './mesh.js';
import {
  ABORTABLE,
  type Failure,
  FUNCTIONS,
  isReference,
  lookUp,
  MEMBERS,
  mapObjects,
  type Reference,
  type Reply,
  type Report,
  type Request,
  SLICED,
  STATICS,
  type Task,
} from './worker-protocol.js';
import type { ClassName, FunctionName, Library, LibraryObject } from './worker-types.js';

type Post = (reply: Reply, transfer: ArrayBuffer[]) => void;
type Call = Extract<Task, { type: 'call' }>;
type Entry = { object: LibraryObject } | { failed: unknown };

const LIBRARY: Pick<Library, ClassName | FunctionName> = {
  ...{ Volume, Mesh, DeformableModel, ImplicitSurface, SurfaceTracker, MultiresolutionModel, LabelSurfaces },
  ...{ version, paramSpecs, parsePoints, animationGlb },
};

const CLASSES = Object.keys(MEMBERS) as ClassName[];

/**
 * Reason with which the worker aborts tasks on request of the page. The page does not send its own reason, and rejects
 * with that.
 */
const ABORTED = new VesicleError('aborted', 'the run was aborted');

/**
 * The worker's side of the connection: handles the page's requests in order, also between the slices of a run in
 * progress.
 */
class Host {
  readonly #post: Post;
  readonly #objects = new Map<number, Entry>();
  readonly #controllers = new Map<number, AbortController>();
  #last = 0;

  constructor(post: Post) {
    this.#post = post;
  }

  receive(request: Request): void {
    if (request.type === 'abort') this.#controllers.get(request.id)?.abort(ABORTED);
    else if (request.type === 'free') this.#free(request.object);
    else void this.#answer(request.id, request);
  }

  async #answer(id: number, task: Task): Promise<void> {
    try {
      const [value, transfer] = this.#outgoing(await this.#perform(id, task));
      this.#post({ type: 'value', id, value }, transfer);
    } catch (error) {
      this.#post({ type: 'error', id, failure: failureOf(error) }, []);
    }
  }

  #perform(id: number, task: Task): unknown {
    if (task.type === 'init') return start(task.module);
    if (task.type === 'make') return this.#make(task.as, task.args);
    if (task.slices) return this.#sliced(id, task, task.slices);
    if (Object.hasOwn(ABORTABLE, task.name)) return this.#abortable(id, task);
    return task.name === 'copyTo' ? this.#copyTo(task) : this.#call(task);
  }

  #make({ vesicle: at, class: name }: Reference, args: unknown[]): void {
    lookUp(MEMBERS, name);
    try {
      const Class = LIBRARY[name] as unknown as new (...args: unknown[]) => LibraryObject;
      this.#objects.set(at, { object: new Class(...this.#incoming(args)) });
    } catch (failed) {
      // All later requests for this object fail with the same error.
      this.#objects.set(at, { failed });
      throw failed;
    }
  }

  #call({ on, name, args }: Call): unknown {
    const { target, kind } = this.#find(on, name);
    const member = target[name];
    return kind === 'value' ? member : (member as (...args: unknown[]) => unknown).apply(target, this.#incoming(args));
  }

  /**
   * Returns the object or class that a call addresses, and the kind of the member called; throws unless the tables of
   * the protocol list the member.
   */
  #find(on: Call['on'], name: string): { target: Record<string, unknown>; kind: string } {
    if (on === undefined) return { target: LIBRARY, kind: lookUp(FUNCTIONS, name) };
    if (typeof on === 'string') {
      return { kind: lookUp<string>(lookUp(STATICS, on), name), target: record(LIBRARY[on]) };
    }
    const object = this.#object(on);
    return { kind: lookUp<string>(MEMBERS[classOf(object)], name), target: record(object) };
  }

  #object({ vesicle: at, part }: Reference): LibraryObject {
    const entry = this.#objects.get(at);
    if (!entry) throw new VesicleError('freed', 'this object was freed and can no longer be used');
    if ('failed' in entry) throw entry.failed;
    if (part === undefined) return entry.object;
    if (lookUp<string>(MEMBERS[classOf(entry.object)], part) === 'live')
      return record(entry.object)[part] as LibraryObject;
    throw new VesicleError('invalid-argument', `${part}: not an object`);
  }

  /**
   * Runs `Mesh.copyTo` on the page's arrays, whose buffers were transferred with the request and are transferred back.
   */
  #copyTo({ on, args }: Call): unknown {
    const { target } = this.#find(on, 'copyTo');
    const [arrays, options] = this.#incoming(args) as [MeshArrays, PositionOptions?];
    return { counts: (target as unknown as Mesh).copyTo(arrays, options), arrays };
  }

  #abortable(id: number, { on, name, args, reports }: Call): Promise<unknown> {
    const { target } = this.#find(on, name);
    const given = this.#incoming(args);
    const options = given.pop() as object;
    const listener = (report: Report) => this.#post({ type: 'report', id, report }, []);
    const listeners = reports && { [ABORTABLE[name as keyof typeof ABORTABLE]]: listener };
    const work = target[name] as (...args: unknown[]) => Promise<unknown>;
    return this.#withSignal(id, (signal) => work.call(target, ...given, { ...options, signal, ...listeners }));
  }

  /** Calls an operation of `inSlices`. */
  #sliced(id: number, { on, name, args }: Call, options: object): Promise<unknown> {
    const { target } = this.#find(on, 'inSlices');
    lookUp(lookUp(SLICED, classOf(target as unknown as LibraryObject)), name);
    const given = this.#incoming(args);
    return this.#withSignal(id, (signal) => {
      const operations = record(
        (target as unknown as Mesh | Volume | ImplicitSurface).inSlices({ ...options, signal }),
      );
      return (operations[name] as (...args: unknown[]) => Promise<unknown>)(...given);
    });
  }

  /** Calls `work` with a signal that the page aborts by the id of its request. */
  async #withSignal(id: number, work: (signal: AbortSignal) => Promise<unknown>): Promise<unknown> {
    const abort = new AbortController();
    this.#controllers.set(id, abort);
    try {
      return await work(abort.signal);
    } finally {
      this.#controllers.delete(id);
    }
  }

  #free(at: number): void {
    const entry = this.#objects.get(at);
    this.#objects.delete(at);
    if (entry && 'object' in entry) entry.object.free();
  }

  #incoming(args: unknown[]): unknown[] {
    return args.map((arg) =>
      mapObjects('', arg, (_, value) => {
        if (isReference(value)) return this.#object(value);
        return isBinary(value) ? value : undefined;
      }),
    );
  }

  /**
   * Prepares a result for posting: objects become references, and the buffers of typed arrays are collected for
   * transfer, which is safe because results are newly allocated.
   */
  #outgoing(result: unknown): [unknown, ArrayBuffer[]] {
    const buffers = new Set<ArrayBuffer>();
    const value = mapObjects('', result, (_, found) => {
      if (ArrayBuffer.isView(found)) buffers.add(found.buffer as ArrayBuffer);
      if (isBinary(found)) return found;
      return CLASSES.some((name) => found instanceof LIBRARY[name]) ? this.#keep(found as LibraryObject) : undefined;
    });
    return [value, [...buffers]];
  }

  #keep(object: LibraryObject): Reference {
    this.#last -= 1;
    this.#objects.set(this.#last, { object });
    return { vesicle: this.#last, class: classOf(object) };
  }
}

const isBinary = (value: object): boolean => ArrayBuffer.isView(value) || value instanceof ArrayBuffer;

const record = (value: object) => value as Record<string, unknown>;

function classOf(object: LibraryObject): ClassName {
  return CLASSES.find((name) => object instanceof LIBRARY[name]) as ClassName;
}

function start(module: Extract<Task, { type: 'init' }>['module']): Promise<void> {
  const source = typeof module === 'string' ? new URL(module) : module;
  return init(source && { module: source }).then(() => undefined);
}

function failureOf(error: unknown): Failure {
  if (error === ABORTED) return { kind: 'aborted' };
  if (error instanceof VesicleCrash) {
    return { kind: 'crash', message: error.message, cause: error.cause ? asError(error.cause) : undefined };
  }
  if (error instanceof VesicleError) return { kind: 'error', code: error.code, message: error.message };
  const other = asError(error);
  return { kind: 'other', name: other.name, error: other };
}

const asError = (error: unknown) => (error instanceof Error ? error : new Error(String(error)));

async function inNode(): Promise<void> {
  // Hidden from bundlers: a page never gets here.
  const threads = 'node:worker_threads';
  const { parentPort } = await import(/* @vite-ignore */ /* webpackIgnore: true */ threads);
  const host = new Host((reply, transfer) => parentPort.postMessage(reply, transfer));
  parentPort.on('message', (request: Request) => host.receive(request));
}

function inBrowser(): void {
  const port = globalThis as unknown as { postMessage: Post };
  const host = new Host((reply, transfer) => port.postMessage(reply, transfer));
  addEventListener('message', ({ data }: MessageEvent<Request>) => host.receive(data));
}

if ('postMessage' in globalThis) inBrowser();
else void inNode();
