// Errors of OME-Zarr data and of the stores that it is read from.
import { VesicleError } from '../error.js';
import { shortened } from '../short-text.js';

/** Most characters of a problem in a message: texts of metadata, and of packages that read them, may be in it. */
const MOST_PROBLEM = 1000;

/** Returns the `bad-file` error whose message names the part of the data and its problem; the caller throws it. */
export function badZarr(part: string, problem: string): VesicleError {
  return new VesicleError('bad-file', textOf(part, problem));
}

/** Returns the `too-large` error about a part of the data; the caller throws it. */
export function tooLarge(part: string, problem: string): VesicleError {
  return new VesicleError('too-large', textOf(part, problem));
}

const textOf = (part: string, problem: string) => `OME-Zarr: ${shortened(part)}: ${shortened(problem, MOST_PROBLEM)}`;

/** Formats a value of the metadata for an error message. */
export function shown(value: unknown): string {
  const text = JSON.stringify(value) ?? 'nothing';
  return text.length > 80 ? `${text.slice(0, 77)}…` : text;
}

/** The package that reads Zarr. */
export type Zarrita = typeof import('zarrita');

/** An `unavailable` error of a request that would be refused again. */
export class RefusedError extends VesicleError {}

/**
 * Returns an error of zarrita as the error of this library. Errors of stores have been translated before, so that all
 * others, such as a `TypeError`, come from data that zarrita did not expect.
 */
export function translated(zarrita: Zarrita, part: string, error: unknown): VesicleError {
  if (error instanceof VesicleError) return error;
  if (zarrita.isZarritaError(error, 'NotFoundError')) return badZarr(part, error.message);
  if (zarrita.isZarritaError(error, 'UnknownCodecError')) {
    const known = [...zarrita.registry.keys()].filter((name) => !name.startsWith('numcodecs.'));
    return badZarr(part, `unsupported codec "${shortened(String(error.codec))}"; supported: ${known.join(', ')}`);
  }
  const { message, cause } = Object(error) as Error;
  const reason = cause instanceof Error ? ` (${cause.message})` : '';
  if (zarrita.isZarritaError(error, 'CodecPipelineError')) {
    return badZarr(
      part,
      `truncated, damaged, or not encoded with "${shortened(String(error.codec))}" as the metadata says${reason}`,
    );
  }
  return badZarr(part, `cannot be read: ${message}${reason}`);
}
