// Selects the compiled WebAssembly module that is loaded by default.
import type { InitInput } from './runtime.js';
import { hasSimd } from './simd.js';

/**
 * Returns the compiled module beside this file: the one with SIMD, or the plain one for the few engines without. Both
 * compute identical bits.
 */
export function defaultModule(): InitInput | Promise<InitInput> {
  return hasSimd()
    ? new URL('./vesicle_bg.wasm', import.meta.url)
    : new URL('./vesicle_plain_bg.wasm', import.meta.url);
}
