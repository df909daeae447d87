/**
 * Reads stacks of TIFF images: TIFF, BigTIFF, OME-TIFF and the stacks of ImageJ, in Node, pages and workers.
 *
 * Files that are compressed by JPEG or Zstandard need the package `geotiff`, 3.0 or newer, which is imported for these;
 * others need no other package.
 *
 * @module vesicle/tiff
 */
import { checkProperties } from '../check.js';
import type { VolumeInit } from '../data.js';
import type { InputFiles } from '../input-file.js';
import { withPause } from '../pause.js';
import { checkSignal } from '../stepper.js';
import { sizeOf } from './format.js';
import { openStack } from './open.js';
import { sourcesOf } from './source.js';
import { checkedOptions, type TiffOptions, TiffStack } from './stack.js';

export type { InputFile, InputFiles } from '../input-file.js';
export { type TiffChannel, type TiffOptions, TiffStack } from './stack.js';

/**
 * Opens a stack: reads the directories of its files, but no voxels.
 *
 * Slices are where the description of the files says: `TiffData` and `DimensionOrder` of OME-TIFF, whose data sets may
 * have several files; `channels`, `slices` and `frames` of ImageJ, also if only the first slice has a directory; the
 * axes of tifffile. Without a description, all pages of full size are slices. Several files that are not of one OME
 * data set have one or several slices each, in the order of the numbers in their names.
 *
 * Voxel sizes and times are those of OME and ImageJ, in one unit of length. x, y and z grow with column, row and slice.
 *
 * @param files - One or several files; of a `File` or `Blob` only parts are in memory at a time.
 * @param options - `signal`: aborts the opening.
 * @throws `VesicleError` `bad-file`: truncated, inconsistent or not supported; `invalid-argument` naming the option.
 *   `signal.reason` when aborted.
 */
export async function openTiff(files: InputFiles, options?: { signal?: AbortSignal }): Promise<TiffStack> {
  const { signal } = checkProperties('options', options, ['signal']);
  checkSignal(signal);
  const sources = sourcesOf(files);
  return withPause(signal, async (pause) => {
    const layout = await openStack(sources, pause);
    const readable = layout.channels.find(({ missing }) => !missing) ?? layout.channels[0];
    // Throws what is missing, if none can be read.
    const { page } = readable?.planeAt(0, 0) ?? {};
    const { width, height } = page ? await sizeOf(page) : { width: 0, height: 0 };
    return new TiffStack(layout, [width, height], sources);
  });
}

/**
 * Reads one channel of a stack, as options of a `Volume`: `new Volume(await readTiff(file))`.
 *
 * Stored values are given as they are: 0 is white in some files, and palettes are not applied. Colours become their
 * luminance, samples of less than 8 bits bytes, floats of 16 bits those of 32, and 64-bit integers 32-bit ones, or
 * doubles if these are exact. `slope` and `intercept` are those of ImageJ. All that was assumed or left out is in
 * `warnings`.
 *
 * @param files - As for {@link openTiff}.
 * @throws As {@link openTiff} and {@link TiffStack.read}.
 */
export async function readTiff(files: InputFiles, given?: TiffOptions): Promise<VolumeInit> {
  const options = checkedOptions(given);
  const stack = await openTiff(files, { ...(options.signal && { signal: options.signal }) });
  return stack.read(options);
}
