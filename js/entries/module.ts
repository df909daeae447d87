// The compiled WebAssembly module of an entry point with one method; takes the place of `../module.js` there.
import type { InitInput } from '../runtime.js';
import { hasSimd } from '../simd.js';

/** Returns the compiled module beside the entry point; an error if the engine lacks SIMD, which it needs. */
export function defaultModule(): InitInput {
  if (!hasSimd()) throw new Error('this engine lacks WebAssembly SIMD: import `vesicle`, which runs without');
  return new URL('./vesicle_bg.wasm', import.meta.url);
}
