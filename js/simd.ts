// Feature detection.

/** A minimal module with one function that uses SIMD. */
const PROBE = Uint8Array.of(
  ...[0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0, 1, 5, 1, 0x60, 0, 1, 0x7b, 3, 2, 1, 0],
  ...[0x0a, 0x0a, 1, 8, 0, 0x41, 0, 0xfd, 0x0f, 0xfd, 0x62, 0x0b],
);

/** Returns whether the engine has SIMD instructions in WebAssembly, as all browsers since March 2023. */
export function hasSimd(): boolean {
  return WebAssembly.validate(PROBE);
}
