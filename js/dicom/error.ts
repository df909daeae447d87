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

/** Beginning of messages of dicom-parser: the name of a function. */
const PARSER = /^(?:dicomParser|\w+ByteArrayParser)[.:][\w.]+:? (?:- )?/;

/** Returns what an error of another library says; of dicom-parser, in our words. */
export function reasonOf(error: unknown): string {
  const { exception } = Object(error) as { exception?: unknown };
  if (exception !== undefined) return reasonOf(exception);
  if (error instanceof RangeError && /call stack/.test(error.message)) return 'sequences are nested too deeply';
  const reason = libraryReason(error);
  return (PARSER.test(reason) ? parserReason(reason) : reason).slice(0, 200);
}

function parserReason(reason: string): string {
  const [, at] = /not found at offset (\d+)/.exec(reason) ?? [];
  if (at !== undefined) return `it is damaged at byte ${at}: an item of a sequence has to begin there`;
  if (/overrun|overread|past end of buffer/.test(reason)) return 'it is cut off, or states a length beyond its end';
  if (/missing required|not found/.test(reason)) return `it is damaged: ${reason.replace(PARSER, '')}`;
  return 'it is damaged';
}
