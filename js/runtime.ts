// The WebAssembly instance: loading, translation of errors, and handles of objects inside it.
import { type ErrorCode, VesicleCrash, VesicleError } from './error.js';
import { defaultModule } from './module.js';
import load, { initSync as loadSync, __wbg_reset_state as reset } from './vesicle.js';

/**
 * Source from which {@link init} loads the WebAssembly module: its address, a response, its bytes, or the compiled
 * module.
 */
export type InitInput = RequestInfo | URL | Response | BufferSource | WebAssembly.Module;

/** The module that {@link init} loads, by the name of the option and by its former one. */
export interface ModuleOptions {
  /** The compiled module, its bytes or its address. */
  module?: InitInput | Promise<InitInput>;
  /** @deprecated The former name of `module`. */
  module_or_path?: InitInput | Promise<InitInput>;
}

let starting: Promise<unknown> | undefined;
let instance: unknown;
let crash: VesicleCrash | undefined;
// Number of instances so far, to recognise objects of a lost one.
let generation = 0;

/**
 * Loads the WebAssembly module; required before anything else. Idempotent: later calls return the same promise. After a
 * {@link VesicleCrash} it starts a new instance.
 *
 * @param options - `module`: the module, its bytes or its address. By default, the `.wasm` beside this file is fetched
 *   (in a browser) or read (in Node); in `vesicle/inline` it is embedded in the file itself. `module_or_path` is its
 *   former name, deprecated.
 * @throws Any error of fetching or compiling; a later call tries again.
 */
export function init(options: ModuleOptions = {}): Promise<unknown> {
  if (crash) restart();
  starting ??= begin(options.module ?? options.module_or_path).catch((error: unknown) => {
    starting = undefined;
    throw error;
  });
  return starting;
}

/**
 * Loads the WebAssembly module like {@link init}, but synchronously, from its bytes or the compiled module in `module`.
 * Browsers refuse to compile large modules on the main thread: use it in workers and in Node.
 */
export function initSync(options: { module: BufferSource | WebAssembly.Module }): unknown {
  if (crash) restart();
  instance ??= loadSync(options);
  return instance;
}

async function begin(source: InitInput | Promise<InitInput> | undefined): Promise<unknown> {
  const module = await compile((await source) ?? (await defaultModule()));
  instance ??= await load({ module_or_path: module });
  return instance;
}

async function compile(source: InitInput): Promise<WebAssembly.Module> {
  if (source instanceof WebAssembly.Module) return source;
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return WebAssembly.compile(source);
  if (source instanceof URL && source.protocol === 'file:') return WebAssembly.compile(await readFile(source));
  const response = source instanceof Response ? source : await fetch(source);
  if (!response.ok) throw new Error(`${response.url}: ${response.status} ${response.statusText}`);
  // Streaming requires the right media type, which not every server sends.
  const streams = response.headers.get('Content-Type') === 'application/wasm';
  return streams ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

async function readFile(path: URL): Promise<BufferSource> {
  // The name is assembled at run time so that bundlers do not resolve it: a page never gets here.
  const files = ['node', 'fs/promises'].join(':');
  const { readFile } = await import(/* @vite-ignore */ /* webpackIgnore: true */ files);
  return readFile(path);
}

/**
 * Replaces the instance by a new one: objects of the old one are lost, its memory can be collected, and a crash is
 * forgotten.
 */
export function restart(): void {
  if (instance) reset();
  generation += 1;
  crash = undefined;
}

/**
 * Calls `work`, which calls into the WebAssembly module, and translates the errors of the module into those of the
 * library.
 */
export function call<T>(work: () => T): T {
  if (crash) throw crash;
  if (!instance) throw new VesicleError('invalid-argument', 'init: call `await init()` before anything else');
  try {
    return work();
  } catch (error) {
    throw translate(error);
  }
}

function translate(error: unknown): unknown {
  if (error instanceof Error) return isFatal(error) ? crashed(error.message, error) : error;
  const { code, message } = error as { code: ErrorCode | 'panic'; message: string };
  return code === 'panic' ? crashed(message, error) : new VesicleError(code, withExponents(message));
}

/** Returns a message in which numbers of very many digits, which the module writes out, are as JavaScript has them. */
function withExponents(message: string): string {
  // Names have quotation marks around them, and identifiers have dots.
  const long = /(^|[\s([])(-?(?:\d{22,}|0\.0{6,}\d+))(?=[\s,;)\]]|$)/g;
  return message.replace(long, (_, before: string, digits: string) => before + Number(digits));
}

// Traps and stack overflows leave the instance's memory in an undefined state.
function isFatal(error: Error): boolean {
  return error instanceof WebAssembly.RuntimeError || /call stack|recursion/i.test(error.message);
}

function crashed(what: string, cause: unknown): VesicleCrash {
  crash = new VesicleCrash(what, { cause });
  return crash;
}

/** Owner of an object inside the WebAssembly module, until it is freed. */
export class Handle<Raw extends { free(): void }> {
  #raw: Raw | undefined;
  readonly #name: string;
  readonly #generation = generation;

  constructor(name: string, make: () => Raw) {
    this.#name = name;
    this.#raw = call(make);
  }

  /**
   * Calls `work` with the owned WebAssembly object and returns its result. Throws `freed` if the object was freed, or
   * lost in a crash.
   */
  use<T>(work: (raw: Raw) => T): T {
    const raw = this.#raw;
    if (!raw) throw new VesicleError('freed', `this ${this.#name} was freed and can no longer be used`);
    if (crash === undefined && this.#generation !== generation) {
      throw new VesicleError('freed', `this ${this.#name} was lost when the library crashed; make a new one`);
    }
    return call(() => work(raw));
  }

  /** Whether the object was freed. */
  get isFreed(): boolean {
    return this.#raw === undefined;
  }

  /** Frees the object's memory in the WebAssembly module; further calls have no effect. */
  free(): void {
    const raw = this.#raw;
    this.#raw = undefined;
    if (raw && !crash && this.#generation === generation) call(() => raw.free());
  }
}
