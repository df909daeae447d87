// Errors of TIFF files, and the package that decodes some of them.
import { invalid } from '../check.js';
import { VesicleError } from '../error.js';
import { shortened } from '../short-text.js';

/** Most characters of the name of a part, with the number of a page, and of what a message says of it. */
const [LONGEST_PART, LONGEST_PROBLEM] = [250, 1000];

const message = (part: string, problem: string) =>
  `TIFF: ${shortened(part, LONGEST_PART)}: ${shortened(problem, LONGEST_PROBLEM)}`;

/**
 * Returns the `bad-file` error whose message names the file, or the page in it, and its problem; the caller throws it.
 */
export function badTiff(part: string, problem: string): VesicleError {
  return new VesicleError('bad-file', message(part, problem));
}

/** Returns the `too-large` error about a part of a file; the caller throws it. */
export function tooLarge(part: string, problem: string): VesicleError {
  return new VesicleError('too-large', message(part, problem));
}

/** The package that decodes JPEG and Zstandard. */
export type Geotiff = Pick<typeof import('geotiff'), 'getDecoder' | 'ImageFileDirectory'>;

/** Imports geotiff; throws `invalid-argument` if it is missing or too old. */
export async function importGeotiff(compression: string): Promise<Geotiff> {
  let geotiff: Geotiff;
  try {
    geotiff = await import('geotiff');
  } catch {
    throw invalid(
      'geotiff',
      `this package, 3.0 or newer, is needed to read TIFF compressed by ${compression}: npm install geotiff`,
    );
  }
  // New in 3.0.
  if (typeof geotiff.ImageFileDirectory === 'function') return geotiff;
  throw invalid('geotiff', `version 3.0 or newer is needed to read TIFF compressed by ${compression}`);
}
