// Selects the compiled WebAssembly module that is loaded by default.
import type { InitInput } from './runtime.js';

/** A minimal WebAssembly module with one function that uses SIMD, to detect whether the engine supports SIMD. */
const SIMD_PROBE = Uint8Array.of(
  ...[0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0, 1, 5, 1, 0x60, 0, 1, 0x7b, 3, 2, 1, 0],
  ...[0x0a, 0x0a, 1, 8, 0, 0x41, 0, 0xfd, 0x0f, 0xfd, 0x62, 0x0b],
);

/**
 * Returns the address of the compiled WebAssembly module beside this file: the one with SIMD, or the plain one for the
 * few engines without SIMD. Both compute identical bits.
 */
export function defaultModule(): InitInput | Promise<InitInput> {
  return WebAssembly.validate(SIMD_PROBE)
    ? new URL('./vesicle_bg.wasm', import.meta.url)
    : new URL('./vesicle_plain_bg.wasm', import.meta.url);
}
