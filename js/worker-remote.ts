// The page's proxies of the objects in the worker.

import { checkProperties, invalid } from './check.js';
import { type CoverageOptions, checkedCoverage } from './coverage.js';
import { VesicleError } from './error.js';
import { mark } from './kind.js';
import type { MeshArrays, MeshSnapshot, PositionOptions } from './mesh.js';
import { checkedRun, checkedSlices, type RunOptions, type SliceOptions } from './stepper.js';
import {
  type Connection,
  isPlain,
  isReference,
  MEMBERS,
  mapObjects,
  type Reference,
  type Report,
  SLICED,
  STATICS,
} from './worker-protocol.js';
import { currentConnection } from './worker-start.js';
import type { ClassName, FunctionName, RemoteClass, RemoteFunction } from './worker-types.js';

const markedForTransfer = new WeakSet<object>();

/**
 * Marks a typed array, or all typed arrays inside an object, to be transferred to the worker without a copy when passed
 * as an argument. Afterwards it is empty here, as is every other array on the same buffer, and cannot be passed again.
 *
 * @returns The value itself.
 * @throws {@link VesicleError} `invalid-argument` if `value` is not an object.
 */
export function transfer<T extends object>(value: T): T {
  if (value === null || typeof value !== 'object') throw invalid('value', 'must be a typed array or an object');
  markedForTransfer.add(value);
  return value;
}

/** Identity and state of a remote object: its reference, the connection to its worker, and whether it was freed. */
class RemoteState {
  freed = false;

  constructor(
    readonly reference: Reference,
    readonly connection: Connection | undefined,
    /** The error that kept the request for the object's creation from being posted; undefined if it was posted. */
    readonly failed?: unknown,
    /** For a live mesh: its model, which must not be garbage-collected while the mesh is used. */
    readonly owner?: Remote,
  ) {}
}

let stateOf: (remote: Remote) => RemoteState;

const finalizers = new FinalizationRegistry<RemoteState>(release);

function release(state: RemoteState): void {
  state.freed = true;
  state.connection?.post({ free: state.reference.vesicle });
}

/** Base class of the page's proxies of objects in the worker. */
class Remote {
  readonly #state: RemoteState;
  readonly #parts = new Map<string, Remote>();

  static {
    stateOf = (remote) => remote.#state;
  }

  constructor(state: RemoteState) {
    this.#state = state;
    if (!state.owner) finalizers.register(this, state, state);
  }

  /** Returns the proxy of the live mesh in the model's property `name`, the same object at every call. */
  part(name: string): Remote {
    const { reference, connection, failed } = this.#state;
    const made = () =>
      new classes.Mesh(new RemoteState({ ...reference, class: 'Mesh', part: name }, connection, failed, this));
    const part = this.#parts.get(name) ?? made();
    this.#parts.set(name, part);
    return part;
  }

  free(): void {
    // A live mesh is freed with its model.
    if (this.#state.owner || this.#state.freed) return;
    finalizers.unregister(this.#state);
    release(this.#state);
  }

  [Symbol.dispose](): void {
    this.free();
  }
}

/**
 * Returns the connection to the worker of a proxy. Throws if the proxy cannot be used: its object was not created or was
 * freed, or its worker ended.
 */
function connectionOf(remote: Remote): Connection {
  const { failed, connection, reference, owner } = stateOf(remote);
  if (failed !== undefined) throw failed;
  const { freed } = owner ? stateOf(owner) : stateOf(remote);
  if (freed) throw new VesicleError('freed', `this ${reference.class} was freed and can no longer be used`);
  if (connection === currentConnection()) return connection;
  throw new VesicleError('freed', `this ${reference.class} was lost when its worker ended; make a new one`);
}

/**
 * Returns the reference of a proxy, for messages to the worker; throws, as `connectionOf` does, if the proxy cannot be
 * used.
 */
function referenceOf(remote: Remote): Reference {
  connectionOf(remote);
  return stateOf(remote).reference;
}

/**
 * Prepares the arguments of a call for posting to the worker: references instead of proxies, copies of typed arrays
 * unless marked by `transfer`, and the buffers to transfer.
 */
function serialize(args: readonly unknown[]): { args: unknown[]; transfer: ArrayBuffer[] } {
  const buffers = new Set<ArrayBuffer>();
  const pack = (path: string, value: object, moved: boolean): unknown => {
    if (value instanceof Remote) return referenceOf(value);
    const moves = moved || markedForTransfer.has(value);
    if (ArrayBuffer.isView(value)) {
      const sent = moves ? transferable(path, value) : copyOfView(path, value);
      buffers.add(sent.buffer as ArrayBuffer);
      return sent;
    }
    if (!Array.isArray(value) && !isPlain(value)) throw unsendable(path, value);
    // Nested values are serialised one by one, and are transferred, too.
    return moves && !moved ? mapObjects(path, value, (at, inner) => pack(at, inner, true)) : undefined;
  };
  const sent = args.map((arg, k) => mapObjects(`argument ${k + 1}`, arg, (path, value) => pack(path, value, false)));
  return { args: sent, transfer: [...buffers] };
}

function unsendable(path: string, value: object): VesicleError {
  const name = typeof value === 'function' ? 'function' : (value.constructor?.name ?? 'object');
  const accepted = 'numbers, strings, arrays, typed arrays, plain objects and objects of vesicle/worker are accepted';
  return invalid(path, `a ${name} cannot be sent to the worker; ${accepted}`);
}

/**
 * Returns a typed array that can be transferred with its buffer to the worker: `array` itself, or a copy if it is
 * empty; throws `invalid-argument` for shared memory.
 */
function transferable(path: string, array: ArrayBufferView): ArrayBufferView {
  if (!(array.buffer instanceof ArrayBuffer)) throw invalid(path, 'shared memory cannot be transferred');
  return array.byteLength > 0 ? array : copyOfView(path, array);
}

/**
 * Copies a typed array for posting, without the rest of its buffer; throws `invalid-argument` if it was already
 * transferred.
 */
function copyOfView(path: string, array: ArrayBufferView): ArrayBufferView {
  try {
    // Works for all typed arrays, and copies also where a subclass's slice returns a view.
    return Uint8Array.prototype.slice.call(array);
  } catch {
    throw invalid(path, 'not a typed array, or already transferred');
  }
}

/** Converts a result from the worker for the page: references become proxies. */
function deserialize(value: unknown, connection: Connection): unknown {
  return mapObjects('', value, (_, found) => {
    if (isReference(found)) return new classes[found.class](new RemoteState(found, connection));
    return ArrayBuffer.isView(found) ? found : undefined;
  });
}

/** The object or class that is called; undefined for a free function. */
type Target = Remote | ClassName | undefined;

/** Posts a call of `name` to the worker, and resolves with its result. */
async function post(on: Target, name: string, args: readonly unknown[], more: Extras = {}): Promise<unknown> {
  const { signal, listener, slices } = more;
  signal?.throwIfAborted();
  const connection = on instanceof Remote ? connectionOf(on) : currentConnection();
  const target = on instanceof Remote ? referenceOf(on) : on;
  const sent = serialize(args);
  const call = { on: target, name, args: sent.args, ...(slices && { slices }) };
  return connection.request('call', call, {
    ...{ transfer: sent.transfer, holds: on, signal, onReport: listener },
    // Also of an aborted call: an object that is not needed any more is freed with its proxy.
    receive: (value) => deserialize(value, connection),
  });
}

async function run(remote: Remote, given?: RunOptions): Promise<unknown> {
  const { signal, onStep, ...rest } = checkedRun(given);
  return post(remote, 'run', [rest], { signal, listener: onStep as Listener | undefined });
}

async function coverage(remote: Remote, given?: CoverageOptions): Promise<unknown> {
  const { signal, onProgress, ...rest } = checkedCoverage(given);
  return post(remote, 'coverage', [rest], { signal, listener: onProgress as Listener | undefined });
}

type Listener = (report: Report) => void;

/** Signal and listener, which stay on the page, of an abortable call, and options of an operation of `inSlices`. */
interface Extras {
  signal?: AbortSignal | undefined;
  listener?: Listener | undefined;
  slices?: SliceOptions;
}

const ARRAYS = ['positions', 'origin', 'normals', 'indices', 'uvs', 'colors'] as const;

/** Implements `Mesh.copyTo`: the buffers of `out` are transferred to the worker and back. */
async function copyTo(remote: Remote, out: MeshArrays, options?: PositionOptions): Promise<unknown> {
  const { uvs, colors, origin: _, ...given } = checkProperties('out', out, ARRAYS);
  const connection = connectionOf(remote);
  const sent = serialize([transfer({ ...given, ...(uvs && { uvs }), ...(colors && { colors }) }), options]);
  const call = { on: referenceOf(remote), name: 'copyTo', args: sent.args };
  const answer = connection.request('call', call, { transfer: sent.transfer, holds: remote });
  // Transferred arrays cannot be sent again until they are back.
  Object.assign(out, { positions: new Float32Array(), normals: new Float32Array(), indices: new Uint32Array() });
  for (const name of ['uvs', 'colors', 'origin'] as const) delete out[name];
  const { counts, arrays } = (await answer) as { counts: unknown; arrays: MeshArrays };
  Object.assign(out, arrays);
  return counts;
}

/** Implements `Mesh.snapshot`: the buffers of `reuse` are transferred to the worker and back. */
async function snapshot(
  remote: Remote,
  reuse: Partial<MeshSnapshot> = {},
  options?: PositionOptions,
): Promise<unknown> {
  const given = checkProperties('reuse', reuse, [...ARRAYS, 'vertices', 'triangles']);
  return post(remote, 'snapshot', [transfer({ ...given }), options]);
}

/** Id of the object that was requested last. */
let lastId = 0;

/**
 * Requests the creation of an object in the worker; if the request fails, every later use of the object fails with the
 * same error.
 */
function make(name: ClassName, args: readonly unknown[]): { state: RemoteState; created: Promise<unknown> } {
  try {
    const connection = currentConnection();
    lastId += 1;
    const reference = { vesicle: lastId, class: name };
    const { args: given, transfer } = serialize(args);
    const created = connection.request('make', { as: reference, args: given }, { transfer });
    return { state: new RemoteState(reference, connection), created };
  } catch (error) {
    return { state: new RemoteState({ vesicle: 0, class: name }, undefined, error), created: Promise.reject(error) };
  }
}

type Class = (new (...args: unknown[]) => Remote) & Record<string, unknown>;

/** Creates the proxy class for a class of the library, with exactly the members in the protocol's tables. */
function remoteClass(name: ClassName): Class {
  const named = {
    [name]: class extends Remote {
      constructor(...args: unknown[]) {
        super(args[0] instanceof RemoteState ? args[0] : ignoreRejection(make(name, args)));
      }
    },
  };
  const proxy = named[name] as unknown as Class;
  mark(proxy.prototype, name, true);
  for (const method of Object.keys(STATICS[name])) {
    const call = async (...args: unknown[]) => post(name, method, args);
    define(proxy, method, { value: method === 'propose' ? propose : call });
  }
  for (const [member, kind] of Object.entries(MEMBERS[name]))
    define(proxy.prototype, member, memberOf(name, member, kind));
  // Meshes are created by static methods only.
  const create = 'create' in STATICS[name] ? slicedCreator(name) : creator(proxy, name);
  if (name !== 'Mesh') define(proxy, 'create', { value: create });
  return proxy;
}

/** Implements `inSlices`: the operations are at hand at once, and run in the worker. */
function inSlices(remote: Remote, operations: object, options?: SliceOptions): Record<string, unknown> {
  const { signal, ...slices } = checkedSlices(options);
  const operation = (name: string) => [
    name,
    async (...args: unknown[]) => post(remote, name, args, { signal, slices }),
  ];
  return Object.fromEntries(Object.keys(operations).map(operation));
}

const SPECIAL: Record<string, (remote: Remote, ...args: never[]) => Promise<unknown>> = {
  run,
  coverage,
  copyTo,
  snapshot,
};

function memberOf(of: ClassName, name: string, kind: string): PropertyDescriptor {
  const special = Object.hasOwn(SPECIAL, name) ? SPECIAL[name] : undefined;
  const call = async (remote: Remote, args: unknown[]) =>
    special ? special(remote, ...(args as never[])) : post(remote, name, args);
  if (name === 'inSlices') {
    const operations = SLICED[of as keyof typeof SLICED];
    return { value: asMethod((remote, [options]) => inSlices(remote, operations, options as SliceOptions)) };
  }
  if (kind === 'live') return { get: asMethod((remote) => remote.part(name)) };
  if (kind === 'value') return { get: asMethod((remote) => call(remote, [])) };
  return { value: asMethod(call) };
}

/**
 * Returns a function to be used as a method or getter, which calls `work` with the object it is called on and its
 * arguments.
 */
function asMethod<T>(work: (remote: Remote, args: unknown[]) => T): (this: Remote, ...args: unknown[]) => T {
  return function (this: Remote, ...args) {
    return work(this, args);
  };
}

function define(target: object, name: string, what: PropertyDescriptor): void {
  // Attributes as for methods and getters written in a class.
  const writable = 'value' in what ? { writable: true } : {};
  Object.defineProperty(target, name, { configurable: true, enumerable: false, ...writable, ...what });
}

/**
 * Keeps a failed creation from being reported as unhandled rejection: every use of the object reports it. Returns the
 * object's state.
 */
function ignoreRejection({ state, created }: ReturnType<typeof make>): RemoteState {
  created.catch(() => undefined);
  return state;
}

function creator(proxy: Class, name: ClassName): (...args: unknown[]) => Promise<Remote> {
  return async (...args) => {
    const request = make(name, args);
    const object = new proxy(request.state);
    await request.created;
    return object;
  };
}

/** Implements `SurfaceTracker.propose`, which can be aborted. */
async function propose(volume: unknown, query?: unknown, options?: SliceOptions): Promise<unknown> {
  const { signal, ...rest } = checkedSlices(options);
  return post('SurfaceTracker', 'propose', [volume, query, rest], { signal });
}

/** Returns the static method that creates an object in slices, which can be aborted. */
function slicedCreator(name: ClassName): (given: unknown, options?: SliceOptions) => Promise<unknown> {
  return async (given, options) => {
    const { signal, ...rest } = checkedSlices(options);
    return post(name, 'create', [given, rest], { signal });
  };
}

const classes = Object.fromEntries(
  Object.keys(MEMBERS).map((name) => [name, remoteClass(name as ClassName)]),
) as Record<ClassName, Class>;

/** Proxy classes for the classes of the library, by name: the classes that `vesicle/worker` exports. */
export const remoteClasses = classes as unknown as { readonly [N in ClassName]: RemoteClass<N> };

/** Returns an asynchronous function that calls the free function `name` of the library in the worker. */
export function remoteFunction<N extends FunctionName>(name: N): RemoteFunction<N> {
  const call = async (...args: unknown[]) => post(undefined, name, args);
  return call as unknown as RemoteFunction<N>;
}
