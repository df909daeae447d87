/** Memory that is given back before the browser collects garbage, which it does late. */

/**
 * Gives back the memory of an array that nobody uses any more, and which is empty then; of one that came in a message,
 * only later.
 */
export function release({ buffer }: ArrayBufferView): void {
  // Not all browsers can.
  (buffer as { transfer?: (length: number) => ArrayBuffer }).transfer?.(0);
}
