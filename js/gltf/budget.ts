// How much the parts of a document may decode to.
import { tooLarge } from './error.js';

/** Number of bytes that any document may decode to, as of scenes that the reader of meshes accepts. */
const LIMIT = 1 << 27;

/** Number of decoded bytes for each byte of the file that may always be made: few meshes are compressed so well. */
const GROWTH = 64;

/** Returns a function that counts bytes before they are made; it throws `too-large` where all are far more than the file. */
export function budgetOf(fileBytes: number): (bytes: number, field: string) => void {
  const limit = Math.max(LIMIT, fileBytes * GROWTH);
  let used = 0;
  return (bytes, field) => {
    used += bytes;
    if (used > limit) throw tooLarge(field, used);
  };
}

export type Budget = ReturnType<typeof budgetOf>;
