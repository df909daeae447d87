// The page's side of the objects in the worker.
import { invalid, knownOnly } from './check.js';
import { type CoverageOptions, checkedCoverage } from './coverage.js';
import { VesicleError } from './error.js';
import type { MeshArrays } from './mesh.js';
import { checkedRun, type RunOptions } from './stepper.js';
import {
  type ABORTABLE,
  isPlain,
  isReference,
  MEMBERS,
  type Reference,
  type Report,
  STATICS,
  swapped,
  type Task,
} from './worker-protocol.js';
import type { Session } from './worker-session.js';
import { currentSession } from './worker-start.js';
import type { ClassName, FunctionName, RemoteClass, RemoteFunction } from './worker-types.js';

const handedOver = new WeakSet<object>();

/**
 * Lets a typed array, or all that are in an object, go to the worker without a copy when it is next given to something. It
 * is empty here afterwards, as is every other array over the same buffer.
 *
 * @returns The value itself.
 */
export function transfer<T extends object>(value: T): T {
  if (value === null || typeof value !== 'object') throw invalid('value', 'a typed array or an object is needed');
  handedOver.add(value);
  return value;
}

/** Where an object is in the worker. */
class Place {
  freed = false;

  constructor(
    readonly reference: Reference,
    readonly session: Session | undefined,
    /** Why there is no object, where not even the request for it could be posted. */
    readonly failed?: unknown,
    /** Of a live mesh: its model, which must stay as long as the mesh is used. */
    readonly owner?: Remote,
  ) {}
}

let placeOf: (remote: Remote) => Place;

const garbage = new FinalizationRegistry<Place>(release);

function release(place: Place): void {
  place.freed = true;
  place.session?.free(place.reference.vesicle);
}

/** An object in the worker. */
class Remote {
  readonly #place: Place;
  readonly #parts = new Map<string, Remote>();

  static {
    placeOf = (remote) => remote.#place;
  }

  constructor(place: Place) {
    this.#place = place;
    if (!place.owner) garbage.register(this, place, place);
  }

  /** The same live mesh every time. */
  part(name: string): Remote {
    const { reference, session, failed } = this.#place;
    const made = () => new classes.Mesh(new Place({ ...reference, class: 'Mesh', part: name }, session, failed, this));
    const part = this.#parts.get(name) ?? made();
    this.#parts.set(name, part);
    return part;
  }

  free(): void {
    // A live mesh goes with its model.
    if (this.#place.owner || this.#place.freed) return;
    garbage.unregister(this.#place);
    release(this.#place);
  }

  [Symbol.dispose](): void {
    this.free();
  }
}

/** The session of an object that can be asked. Throws where it failed, is freed, or went with its worker. */
function sessionOf(remote: Remote): Session {
  const { failed, session, reference, owner } = placeOf(remote);
  if (failed !== undefined) throw failed;
  const { freed } = owner ? placeOf(owner) : placeOf(remote);
  if (freed) throw new VesicleError('freed', `this ${reference.class} was freed and cannot be used any more`);
  if (session === currentSession()) return session;
  throw new VesicleError('freed', `this ${reference.class} was lost when its worker ended; make a new one`);
}

/** What stands for an object that can be asked. */
function referenceOf(remote: Remote): Reference {
  sessionOf(remote);
  return placeOf(remote).reference;
}

/** Arguments as they are posted, and the buffers that go with them. */
function packed(args: readonly unknown[]): { args: unknown[]; transfer: ArrayBuffer[] } {
  const buffers = new Set<ArrayBuffer>();
  const pack = (path: string, value: object, moved: boolean): unknown => {
    if (value instanceof Remote) return referenceOf(value);
    const moves = moved || handedOver.has(value);
    if (ArrayBuffer.isView(value)) {
      const sent = moves ? whole(path, value) : copied(path, value);
      buffers.add(sent.buffer as ArrayBuffer);
      return sent;
    }
    if (!Array.isArray(value) && !isPlain(value)) throw unsendable(path, value);
    // What is inside is looked at one by one, and goes the same way.
    return moves && !moved ? swapped(path, value, (at, inner) => pack(at, inner, true)) : undefined;
  };
  const sent = args.map((arg, k) => swapped(`argument ${k + 1}`, arg, (path, value) => pack(path, value, false)));
  return { args: sent, transfer: [...buffers] };
}

function unsendable(path: string, value: object): VesicleError {
  const name = typeof value === 'function' ? 'function' : (value.constructor?.name ?? 'object');
  const accepted = 'numbers, strings, arrays, typed arrays, plain objects and objects of vesicle/worker are accepted';
  return invalid(path, `a ${name} cannot be sent to the worker; ${accepted}`);
}

/** An array that gives its buffer away. */
function whole(path: string, array: ArrayBufferView): ArrayBufferView {
  if (!(array.buffer instanceof ArrayBuffer)) throw invalid(path, 'memory that is shared cannot be handed over');
  return array.byteLength > 0 ? array : copied(path, array);
}

/** Only what the array shows of its buffer. */
function copied(path: string, array: ArrayBufferView): ArrayBufferView {
  try {
    // The same for all typed arrays, and a copy also where a class makes it a view.
    return Uint8Array.prototype.slice.call(array);
  } catch {
    throw invalid(path, 'is no typed array, or was handed over before');
  }
}

/** The same with remote objects for what stands for them. */
function received(value: unknown, session: Session): unknown {
  return swapped('', value, (_, found) => {
    if (isReference(found)) return new classes[found.class](new Place(found, session));
    return ArrayBuffer.isView(found) ? found : undefined;
  });
}

/** Asks for something of an object, of a class, or of neither. */
async function ask(
  session: Session,
  on: Remote | ClassName | undefined,
  name: string,
  args: unknown[],
): Promise<unknown> {
  const target = on instanceof Remote ? referenceOf(on) : on;
  const sent = packed(args);
  const { answer } = session.ask({ type: 'call', on: target, name, args: sent.args }, { ...sent, asked: on });
  return received(await answer, session);
}

async function run(remote: Remote, given?: RunOptions): Promise<unknown> {
  const { signal, onStep, ...rest } = checkedRun(given);
  return abortable(remote, 'run', rest, signal, onStep as Listener | undefined);
}

async function coverage(remote: Remote, given?: CoverageOptions): Promise<unknown> {
  const { signal, onProgress, ...rest } = checkedCoverage(given);
  return abortable(remote, 'coverage', rest, signal, onProgress as Listener | undefined);
}

type Listener = (report: Report) => void;

/** The signal and the listener stay here: the one aborts the task from here, the other is called with what comes back. */
async function abortable(
  remote: Remote,
  name: keyof typeof ABORTABLE,
  options: object,
  signal: AbortSignal | undefined,
  listener: Listener | undefined,
): Promise<unknown> {
  signal?.throwIfAborted();
  const session = sessionOf(remote);
  const stop = new AbortController();
  const onReport = listener && ((report: Report) => tell(listener, report, stop));
  const task: Task = { type: 'call', on: referenceOf(remote), name, args: [options], reports: !!listener };
  const { id, answer } = session.ask(task, { asked: remote, onReport });
  const abort = () => stop.abort(signal?.reason);
  signal?.addEventListener('abort', abort);
  stop.signal.addEventListener('abort', () => session.abort(id));
  try {
    const result = await answer;
    stop.signal.throwIfAborted();
    return result;
  } catch (error) {
    // Whoever stopped it hears why; but of a worker that has ended, everybody hears.
    throw stop.signal.aborted && !session.ended ? stop.signal.reason : error;
  } finally {
    signal?.removeEventListener('abort', abort);
  }
}

/** What a listener throws ends the task, though that may be some steps ahead. */
function tell(listener: Listener, report: Report, stop: AbortController): void {
  if (stop.signal.aborted) return;
  try {
    listener(report);
  } catch (error) {
    stop.abort(error);
  }
}

/** The buffers of `out` go there and back. */
async function copyTo(remote: Remote, out: MeshArrays): Promise<unknown> {
  const { uvs, colors, ...given } = knownOnly('out', out, ['positions', 'normals', 'indices', 'uvs', 'colors']);
  const session = sessionOf(remote);
  const sent = packed([transfer({ ...given, ...(uvs && { uvs }), ...(colors && { colors }) })]);
  const task: Task = { type: 'call', on: referenceOf(remote), name: 'copyTo', args: sent.args };
  const { answer } = session.ask(task, { ...sent, asked: remote });
  // Until they are back: what was handed over cannot be sent again.
  Object.assign(out, { positions: new Float32Array(), normals: new Float32Array(), indices: new Uint32Array() });
  for (const name of ['uvs', 'colors'] as const) delete out[name];
  const { counts, arrays } = (await answer) as { counts: unknown; arrays: MeshArrays };
  Object.assign(out, arrays);
  return counts;
}

/** Asks for a new object; a failure is kept for whatever is asked of it. */
function make(name: ClassName, args: readonly unknown[]): { place: Place; made: Promise<unknown> } {
  try {
    const session = currentSession();
    const reference = { vesicle: session.number(), class: name };
    const sent = packed(args);
    const { answer } = session.ask({ type: 'make', as: reference, args: sent.args }, sent);
    return { place: new Place(reference, session), made: answer };
  } catch (error) {
    return { place: new Place({ vesicle: 0, class: name }, undefined, error), made: Promise.reject(error) };
  }
}

type Class = (new (...args: unknown[]) => Remote) & Record<string, unknown>;

/** A class with what the tables say, and nothing else. */
function remoteClass(name: ClassName): Class {
  const named = {
    [name]: class extends Remote {
      constructor(...args: unknown[]) {
        super(args[0] instanceof Place ? args[0] : silently(make(name, args)));
      }
    },
  };
  const made = named[name] as unknown as Class;
  for (const method of Object.keys(STATICS[name])) {
    define(made, method, { value: async (...args: unknown[]) => ask(currentSession(), name, method, args) });
  }
  for (const [member, kind] of Object.entries(MEMBERS[name])) define(made.prototype, member, memberOf(member, kind));
  // Meshes are made by the functions of the class.
  if (name !== 'Mesh') define(made, 'create', { value: creator(made, name) });
  return made;
}

const SPECIAL: Record<string, (remote: Remote, ...args: never[]) => Promise<unknown>> = { run, coverage, copyTo };

function memberOf(name: string, kind: string): PropertyDescriptor {
  const special = Object.hasOwn(SPECIAL, name) ? SPECIAL[name] : undefined;
  const call = async (remote: Remote, args: unknown[]) =>
    special ? special(remote, ...(args as never[])) : ask(sessionOf(remote), remote, name, args);
  if (kind === 'live') return { get: fromThis((remote) => remote.part(name)) };
  if (kind === 'value') return { get: fromThis((remote) => call(remote, [])) };
  return { value: fromThis(call) };
}

/** A method or getter of a function. */
function fromThis<T>(work: (remote: Remote, args: unknown[]) => T): (this: Remote, ...args: unknown[]) => T {
  return function (this: Remote, ...args) {
    return work(this, args);
  };
}

function define(target: object, name: string, what: PropertyDescriptor): void {
  // Like methods and getters that are written in a class.
  const writable = 'value' in what ? { writable: true } : {};
  Object.defineProperty(target, name, { configurable: true, enumerable: false, ...writable, ...what });
}

/** Nobody may wait for it: the failure shows in whatever is asked of the object. */
function silently({ place, made }: ReturnType<typeof make>): Place {
  made.catch(() => undefined);
  return place;
}

function creator(made: Class, name: ClassName): (...args: unknown[]) => Promise<Remote> {
  return async (...args) => {
    const asked = make(name, args);
    const object = new made(asked.place);
    await asked.made;
    return object;
  };
}

const classes = Object.fromEntries(
  Object.keys(MEMBERS).map((name) => [name, remoteClass(name as ClassName)]),
) as Record<ClassName, Class>;

/** The classes of the library, whose objects are in the worker. */
export const remoteClasses = classes as unknown as { readonly [N in ClassName]: RemoteClass<N> };

/** A function of the library that is done in the worker. */
export function remoteFunction<N extends FunctionName>(name: N): RemoteFunction<N> {
  const call = async (...args: unknown[]) => ask(currentSession(), undefined, name, args);
  return call as unknown as RemoteFunction<N>;
}
