/** Which files are small: they may come from anyone, and may not take long. */
import type { NamedBytes } from './protocol';

/** Bytes of files that are small, all together. */
export const SMALL = 2 ** 17;

/** Returns whether files are small, all together. */
export function areSmall(files: readonly (Blob | NamedBytes)[]): boolean {
  return files.reduce((sum, file) => sum + (file instanceof Blob ? file.size : file.bytes.length), 0) <= SMALL;
}
