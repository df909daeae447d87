// Which compiled module a package without further word is made of.
import type { InitInput } from './runtime.js';

/** A module with one function that uses vectors: what an engine says of it, it says of ours. */
const USES_VECTORS = Uint8Array.of(
  ...[0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0, 1, 5, 1, 0x60, 0, 1, 0x7b, 3, 2, 1, 0],
  ...[0x0a, 0x0a, 1, 8, 0, 0x41, 0, 0xfd, 0x0f, 0xfd, 0x62, 0x0b],
);

/** The module beside this file: the plain one for the few engines that have no vectors. Both give the same bits. */
export function ownModule(): InitInput | Promise<InitInput> {
  return WebAssembly.validate(USES_VECTORS)
    ? new URL('./vesicle_bg.wasm', import.meta.url)
    : new URL('./vesicle_plain_bg.wasm', import.meta.url);
}
