// How much files may unpack to: a few kilobytes can stand for gigabytes of equal voxels, and methods take many times that.

/** Bytes of files that are small, all together, and the most bytes that they may unpack to. */
export const SMALL = 2 ** 17;
const MOST_OF_SMALL = 2 ** 25;

/** Most bytes that a byte of larger files may unpack to. */
const RATIO = 5000;

/** Returns whether files are small that have `stored` bytes, all together. */
export const isSmall = (stored: number): boolean => stored <= SMALL;

/** Returns the most bytes that files of `stored` bytes, all together, may unpack to. */
export function mostUnpacked(stored: number): number {
  return isSmall(stored) ? MOST_OF_SMALL : RATIO * stored;
}

/** Advice about small files of compressed images. */
export const STORE_PLAIN = 'store the images uncompressed';

/**
 * Returns why files of `stored` bytes may not unpack to `bytes`, undefined if they may.
 *
 * @param help - Advice about small files, as an order.
 */
export function unpackingProblem(bytes: number, stored: number, help = STORE_PLAIN): string | undefined {
  if (bytes <= mostUnpacked(stored)) return undefined;
  if (!isSmall(stored)) return `${bytes} bytes of voxels are more than ${stored} bytes of files can hold`;
  return `would unpack to ${mebibytes(bytes)} MiB of voxels; ${limitOfSmall(help)}`;
}

/** Returns the limit of small files in words, with what helps. */
export function limitOfSmall(help = STORE_PLAIN): string {
  return `files of up to ${SMALL / 2 ** 10} KiB may unpack to ${MOST_OF_SMALL / 2 ** 20} MiB: ${help}`;
}

/**
 * Most vertices of a surface in an image of small files, unless its maker allows more: a run and a measurement of its
 * coverage then take about half a gigabyte.
 */
export const MOST_VERTICES_OF_SMALL = 300_000;

/** Most triangles of an iso-surface of such an image, unless its maker allows more. */
export const MOST_TRIANGLES_OF_SMALL = 1_200_000;

/** Most vertices of the surfaces of a label map in small files, unless their maker allows more. */
export const MOST_LABEL_VERTICES_OF_SMALL = 1_000_000;

/** Most bytes that slices between those of an image of small files may take, with the work on them. */
export const MOST_ENRICHED_OF_SMALL = 384 * 2 ** 20;

/** Most bytes of intensities that an image of small files may be written as, if it has others than its voxels. */
export const MOST_WRITTEN_OF_SMALL = 2 ** 28;

/** The same, if they are compressed: repeated voxels are compressed fast, their intensities may not be. */
export const MOST_COMPRESSED_OF_SMALL = 3 * 2 ** 23;

/** Most voxels that an image of small files may be resampled to, all levels together: more would take longer than a few seconds. */
export const MOST_RESAMPLED_OF_SMALL = 50_000_000;

/** Most vertices of a tracked surface in an image of small files, unless its maker allows more, for the same reason. */
export const MOST_TRACKED_OF_SMALL = 200_000;

/**
 * Most voxels of the box that a surface is tracked in, in an image of small files, unless its maker allows more: finding
 * what is bright in it takes about half a gigabyte.
 */
export const MOST_VOXELS_OF_SMALL = 8_000_000;

/** Property of voxels and volumes that come from small files; the same in all entry points. */
const OF_SMALL = Symbol.for('vesicle of small files');

/** Notes whether voxels, or a volume, come from small files, of `stored` bytes, all together; returns them. */
export function noted<T extends object>(unpacked: T, stored: number): T {
  return isSmall(stored) ? Object.defineProperty(unpacked, OF_SMALL, { value: true }) : unpacked;
}

/** Returns whether voxels, or a volume, come from small files, as {@link noted}. */
export const isOfSmall = (unpacked: unknown): boolean => OF_SMALL in Object(unpacked);

/** Returns the limit that a caller gives, else `most` for what is small; undefined for the limit of the core. */
export function limitOf(given: number | undefined, small: boolean, most: number): number | undefined {
  return given ?? (small ? most : undefined);
}

/** Notes that what is made of voxels, or of a volume, comes from small files if they do; returns it. */
export function notedLike<T extends object>(unpacked: unknown, made: T): T {
  return isOfSmall(unpacked) ? noted(made, 0) : made;
}

/** Returns a number of bytes in MiB, rounded up to a tenth. */
const mebibytes = (bytes: number) => Math.ceil((bytes / 2 ** 20) * 10) / 10;
