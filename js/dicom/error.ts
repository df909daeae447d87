// Errors of DICOM files, and lists in messages.
import { libraryReason } from '../decoder-source.js';
import { VesicleError } from '../error.js';
import { shortened } from '../short-text.js';

/** Most characters of what a message says of its part. */
const LONGEST_PROBLEM = 1000;

/** Returns the `bad-file` error whose message names the part of the data and its problem; the caller throws it. */
export function badDicom(part: string, problem: string): VesicleError {
  return new VesicleError('bad-file', `DICOM: ${shortened(part)}: ${shortened(problem, LONGEST_PROBLEM)}`);
}

/** Returns the first three of a list, and how many more there are. */
export function listed(items: readonly string[], between = ', '): string {
  const first = items.slice(0, 3).map((item) => shortened(item));
  return first.join(between) + (items.length > 3 ? ` and ${items.length - 3} more` : '');
}

/** Returns what an error of another library says. */
export function reasonOf(error: unknown): string {
  const { exception } = Object(error) as { exception?: unknown };
  if (exception !== undefined) return reasonOf(exception);
  if (error instanceof RangeError && /call stack/.test(error.message)) return 'sequences are nested too deeply';
  // Messages of dicom-parser begin with the name of the function.
  return libraryReason(error)
    .replace(/^dicomParser\.\w+: /, '')
    .slice(0, 200);
}
