// Decoders that are libraries of others: how they are imported and started, and what their errors say.

/** A decoder: a library of others. */
export interface DecoderSource {
  /** Imports the module of the library that the option is named after. */
  load: () => Promise<unknown>;
  /** Address of the library's `.wasm` file, if it has one; by default where the library looks for it. */
  wasm?: string | URL;
}

/** Returns the source of a module that Node finds; throws where there is none, as in a page. */
export function installed(module: string): DecoderSource {
  const { process } = globalThis as { process?: { versions?: { node?: string } } };
  if (process?.versions?.node === undefined) throw new Error('it was not given');
  // Bundlers leave an import by a variable alone.
  return { load: () => import(/* webpackIgnore: true */ /* @vite-ignore */ module) };
}

/** Starts an imported module that was compiled from C++; it prints nothing. */
export function startedModule<Started>(module: unknown, wasm: DecoderSource['wasm']): Promise<Started> {
  const { default: made } = Object(module) as { default?: unknown };
  // A module of CommonJS, whose export some bundlers put into another `default`.
  const factory = typeof made === 'function' ? made : (Object(made) as { default: unknown }).default;
  const silent = () => {};
  const options = { print: silent, printErr: silent, ...(wasm !== undefined && { locateFile: () => String(wasm) }) };
  return (factory as (options: object) => Promise<Started>)(options);
}

/** Returns what an error of a library says. */
export function libraryReason(error: unknown): string {
  const text = error instanceof Error ? error.message : String(error);
  // Modules of C++ throw addresses.
  return /^\d+$/.test(text) ? 'the decoder failed' : text;
}
