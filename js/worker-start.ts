// How the worker is started, wherever the page and the package are, and how it ends.
import { knownOnly } from './check.js';
import { VesicleError } from './error.js';
import type { InitInput } from './runtime.js';
import type { Task } from './worker-protocol.js';
import { type NodeWorker, Session } from './worker-session.js';

/** What the worker is started with. */
export interface WorkerInit {
  /** The module, its bytes or its address, as in `vesicle`. Left out, the worker takes the `.wasm` beside itself. */
  module_or_path?: InitInput | Promise<InitInput>;
  /**
   * A new worker that runs `vesicle/worker-host`, where this library cannot make one: for bundlers that do not know
   * `new Worker(new URL(…, import.meta.url), { type: 'module' })`. It belongs to the library from then on, and each start
   * needs another.
   */
  worker?: Worker | NodeWorker;
}

let session: Session | undefined;
let starting: Promise<void> | undefined;
// Counts starts, so that one which was called off meanwhile is known.
let turn = 0;

/**
 * Starts the worker and the module in it; everything else needs it. Idempotent: later calls give the same promise. After a
 * `VesicleCrash` or {@link terminate} it starts a fresh worker.
 *
 * @throws An `Error` where the worker's script cannot be loaded; whatever fetching or compiling the module threw. A later
 *   call tries again.
 */
export function init(given: WorkerInit = {}): Promise<void> {
  if (session?.ended) {
    session = undefined;
    starting = undefined;
  }
  starting ??= begin(given);
  return starting;
}

/**
 * Ends the worker at once, and with it every volume, mesh and model in it. What waits rejects with a `VesicleError`
 * `aborted`. {@link init} starts a fresh one.
 */
export function terminate(): void {
  turn += 1;
  starting = undefined;
  session?.end(terminated());
}

/** The worker there is. */
export function currentSession(): Session {
  if (session) return session;
  throw new VesicleError('invalid-argument', 'init: call `await init()` before anything else');
}

const terminated = () => new VesicleError('aborted', 'the worker was terminated; call init() to start another');

async function begin(given: WorkerInit): Promise<void> {
  turn += 1;
  const mine = turn;
  try {
    await start(given, mine);
  } catch (error) {
    if (mine === turn) giveUp(error);
    throw error;
  }
}

async function start(given: WorkerInit, mine: number): Promise<void> {
  const { module_or_path, worker } = knownOnly('options', given, ['module_or_path', 'worker']);
  const module = await sendable(await module_or_path);
  const made = new Session(worker ?? (globalThis.Worker ? browserWorker() : await nodeWorker()));
  if (mine === turn) session = made;
  else made.end(terminated());
  await made.ask({ type: 'init', module }).answer;
}

/** Nothing came of it; a later call tries again. */
function giveUp(error: unknown): void {
  starting = undefined;
  session?.end(error instanceof Error ? error : new Error(String(error)));
  session = undefined;
}

/** What can be sent of where the module comes from; a relative address is one of the page. */
async function sendable(source: InitInput | undefined): Promise<Extract<Task, { type: 'init' }>['module']> {
  if (source === undefined || source instanceof WebAssembly.Module) return source;
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return source;
  if (source instanceof URL) return source.href;
  if (typeof source === 'string')
    return new URL(source, globalThis.document?.baseURI ?? globalThis.location?.href).href;
  const response = source instanceof Response ? source : await fetch(source);
  if (!response.ok) throw new Error(`${response.url}: ${response.status} ${response.statusText}`);
  return response.arrayBuffer();
}

function browserWorker(): Worker {
  const here = import.meta.url;
  if (isForeign(here)) return foreignWorker(new URL('./worker-host.js', here));
  // Bundlers know these very words, and make a script of its own out of what they name.
  return new Worker(new URL('./worker-host.js', import.meta.url), { type: 'module' });
}

const isForeign = (address: string) =>
  /^https?:/.test(address) && new URL(address).origin !== globalThis.location?.origin;

/** Browsers start no worker from another origin, but let one of this origin import a module from there. */
function foreignWorker(address: URL): Worker {
  const script = new Blob([`import ${JSON.stringify(address.href)};`], { type: 'text/javascript' });
  const local = URL.createObjectURL(script);
  const worker = new Worker(local, { type: 'module' });
  const forget = () => URL.revokeObjectURL(local);
  worker.addEventListener('message', forget, { once: true });
  worker.addEventListener('error', forget, { once: true });
  return worker;
}

async function nodeWorker(): Promise<NodeWorker> {
  // Out of the bundlers' sight: a page never gets here.
  const threads = 'node:worker_threads';
  const { Worker } = await import(/* @vite-ignore */ /* webpackIgnore: true */ threads);
  const here = import.meta.url;
  // Some of the options that the program itself was started with are refused in a worker.
  return new Worker(new URL('./worker-host.js', here), { execArgv: [] });
}
