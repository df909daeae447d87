/**
 * Gives back the memory of an array that nobody uses any more, which then has no elements. Of large arrays, browsers
 * would keep several before they look for those to give back.
 */
export function release(array: ArrayBufferView | undefined): void {
  // Older browsers cannot do it.
  const buffer = array?.buffer as { transfer?: (bytes: number) => unknown } | undefined;
  buffer?.transfer?.(0);
}
