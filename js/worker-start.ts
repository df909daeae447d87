// Starts and terminates the worker, for any origin of page and package.
import { Channel, type NodeWorker } from './channel.js';
import { checkProperties } from './check.js';
import { VesicleCrash, VesicleError } from './error.js';
import type { InitInput, ModuleOptions } from './runtime.js';
import type { Connection, Requests } from './worker-protocol.js';

/** Options of {@link init} of `vesicle/worker`. */
export interface WorkerInit extends ModuleOptions {
  /**
   * A new worker that runs `vesicle/worker-host`, where this library cannot create one: for bundlers that do not
   * recognise `new Worker(new URL(…, import.meta.url), { type: 'module' })`. The library takes ownership, and each
   * start needs another one.
   */
  worker?: Worker | NodeWorker;
}

let connection: Connection | undefined;
let starting: Promise<void> | undefined;
// Number of starts, to recognise one that was cancelled meanwhile.
let startCount = 0;

/**
 * Starts the worker and loads the module in it; required before anything else. Idempotent: later calls return the same
 * promise. After a `VesicleCrash` or {@link terminate} it starts a new worker.
 *
 * @throws An `Error` where the worker's script cannot be loaded; any error of fetching or compiling the module. A later
 *   call tries again.
 */
export function init(given: WorkerInit = {}): Promise<void> {
  if (connection?.ended) {
    connection = undefined;
    starting = undefined;
  }
  starting ??= startOnce(given);
  return starting;
}

/**
 * Terminates the worker at once, and with it all volumes, meshes and models in it. Pending promises reject with a
 * `VesicleError` `aborted`. {@link init} starts a new worker.
 */
export function terminate(): void {
  startCount += 1;
  starting = undefined;
  connection?.end(terminated());
}

/** Returns the connection to the current worker; throws `invalid-argument` before {@link init}. */
export function currentConnection(): Connection {
  if (connection) return connection;
  throw new VesicleError('invalid-argument', 'init: call `await init()` before anything else');
}

const terminated = () => new VesicleError('aborted', 'the worker was terminated; call init() to start another');

async function startOnce(given: WorkerInit): Promise<void> {
  startCount += 1;
  const own = startCount;
  try {
    await start(given, own);
  } catch (error) {
    if (own === startCount) resetAfterFailure(error);
    throw error;
  }
}

async function start(given: WorkerInit, own: number): Promise<void> {
  const {
    module: one,
    module_or_path,
    worker,
  } = checkProperties('options', given, ['module', 'module_or_path', 'worker']);
  const module = await sendable(await (one ?? module_or_path));
  const started: Connection = new Channel(worker ?? (globalThis.Worker ? browserWorker() : await nodeWorker()), {
    errorOfEnd,
  });
  if (own === startCount) connection = started;
  else started.end(terminated());
  await started.request('init', module);
}

const errorOfEnd = (what: string, hasStarted: boolean) =>
  hasStarted
    ? new VesicleCrash(`The worker ended: ${what}`)
    : new Error(`init: the worker could not be started: ${what}`);

/** Ends the connection to the worker after a failed start; a later call of `init` tries again. */
function resetAfterFailure(error: unknown): void {
  starting = undefined;
  connection?.end(error instanceof Error ? error : new Error(String(error)));
  connection = undefined;
}

/**
 * Converts the source of the WebAssembly module into a form that can be posted to the worker; relative addresses are
 * resolved against the page.
 */
async function sendable(source: InitInput | undefined): Promise<Requests['init']['body']> {
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
  // Bundlers recognise exactly this expression, and bundle the script it names.
  return new Worker(new URL('./worker-host.js', import.meta.url), { type: 'module' });
}

const isForeign = (address: string) =>
  /^https?:/.test(address) && new URL(address).origin !== globalThis.location?.origin;

/**
 * Starts a worker whose script has another origin: browsers refuse such a script, but a script of this origin may
 * import a module from there.
 */
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
  // Hidden from bundlers: a page never gets here.
  const threads = 'node:worker_threads';
  const { Worker } = await import(/* @vite-ignore */ /* webpackIgnore: true */ threads);
  const here = import.meta.url;
  // `execArgv` is cleared because some options of the main program are refused in a worker.
  return new Worker(new URL('./worker-host.js', here), { execArgv: [] });
}
