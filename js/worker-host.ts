/**
 * Script of the worker of `vesicle/worker`: runs the library itself and keeps a table of the objects created for the
 * page. It exports nothing; bundlers that do not detect it need it as the entry point of a worker.
 *
 * @packageDocumentation
 */
import { type RequestContext, serve, withTransfer } from './channel.js';
import { VesicleError } from './error.js';
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
  type Call,
  type Free,
  FUNCTIONS,
  isReference,
  lookUp,
  MEMBERS,
  mapObjects,
  type Reference,
  type Report,
  type Requests,
  SLICED,
  STATICS,
} from './worker-protocol.js';
import type { ClassName, FunctionName, Library, LibraryObject } from './worker-types.js';

type Context = RequestContext<Report>;
type Entry = { object: LibraryObject } | { failed: unknown };

const LIBRARY: Pick<Library, ClassName | FunctionName> = {
  ...{ Volume, Mesh, DeformableModel, ImplicitSurface, SurfaceTracker, MultiresolutionModel, LabelSurfaces },
  ...{ version, paramSpecs, parsePoints, animationGlb },
};

const CLASSES = Object.keys(MEMBERS) as ClassName[];

/**
 * The worker's side of the connection: handles the page's requests in order, also between the slices of a run in
 * progress.
 */
class Host {
  readonly #objects = new Map<number, Entry>();
  #last = 0;

  async call(call: Call, context: Context): Promise<unknown> {
    return this.#outgoing(await this.#perform(call, context));
  }

  #perform(call: Call, context: Context): unknown {
    if (call.slices) return this.#sliced(call, call.slices, context);
    if (Object.hasOwn(ABORTABLE, call.name)) return this.#abortable(call, context);
    return call.name === 'copyTo' ? this.#copyTo(call) : this.#call(call);
  }

  make({ as: { vesicle: at, class: name }, args }: Requests['make']['body']): undefined {
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

  #abortable({ on, name, args }: Call, { signal, report }: Context): Promise<unknown> {
    const { target } = this.#find(on, name);
    const given = this.#incoming(args);
    const options = given.pop() as object;
    const listeners = report && { [ABORTABLE[name as keyof typeof ABORTABLE]]: report };
    const work = target[name] as (...args: unknown[]) => Promise<unknown>;
    return work.call(target, ...given, { ...options, signal, ...listeners });
  }

  /** Calls an operation of `inSlices`. */
  #sliced({ on, name, args }: Call, options: object, { signal }: Context): Promise<unknown> {
    const { target } = this.#find(on, 'inSlices');
    lookUp(lookUp(SLICED, classOf(target as unknown as LibraryObject)), name);
    const sliced = (target as unknown as Mesh | Volume | ImplicitSurface).inSlices({ ...options, signal });
    return (record(sliced)[name] as (...args: unknown[]) => Promise<unknown>)(...this.#incoming(args));
  }

  free(at: number): void {
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
   * Prepares a result for posting: objects become references, and typed arrays are marked for transfer, which is safe
   * because results are newly allocated.
   */
  #outgoing(result: unknown): unknown {
    const arrays: ArrayBufferView[] = [];
    const value = mapObjects('', result, (_, found) => {
      if (ArrayBuffer.isView(found)) arrays.push(found);
      if (isBinary(found)) return found;
      return CLASSES.some((name) => found instanceof LIBRARY[name]) ? this.#keep(found as LibraryObject) : undefined;
    });
    return value instanceof Object ? withTransfer(value, arrays) : value;
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

function start(module: Requests['init']['body']): Promise<undefined> {
  const source = typeof module === 'string' ? new URL(module) : module;
  return init(source && { module: source }).then(() => undefined);
}

const host = new Host();

serve<Requests, Free>(
  {
    init: start,
    make: (object) => host.make(object),
    call: (call, context) => host.call(call, context),
  },
  ({ free }) => host.free(free),
);
