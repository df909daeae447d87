// Errors of compressed glTF documents.
import { libraryReason } from '../decoder-source.js';
import { VesicleError } from '../error.js';
import { shortened } from '../short-text.js';

/** Returns the `bad-file` error whose message names the field and its problem; the caller throws it. */
export function badGltf(field: string, problem: string): VesicleError {
  return new VesicleError('bad-file', `glTF: ${shortened(field)}: ${shortened(problem)}`);
}

/** Returns the `too-large` error for data that would decode to that number of bytes. */
export function tooLarge(field: string, bytes: number, limit?: number): VesicleError {
  const most = limit === undefined ? '' : `; files of this size may decode to ${limit}`;
  return new VesicleError(
    'too-large',
    `glTF: ${shortened(field)}: needs ${bytes} bytes, far more than its file${most}`,
  );
}

/** Returns what an error of another library says. */
export function reasonOf(error: unknown): string {
  return libraryReason(error).slice(0, 150);
}
