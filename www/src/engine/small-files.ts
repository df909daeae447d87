/** Which files are small: they may come from anyone, and may not take long. */

import { type TextKey, text } from '../texts';
import type { NamedBytes } from './protocol';

/** Bytes of files that are small, all together. */
export const SMALL = 2 ** 17;

/** Most bytes of the voxels of an image of small files: the page and its worker have some copies of them. */
export const MOST_BYTES_OF_SMALL = 3 * 2 ** 24;

/** Most bytes of decoded chunks that are kept of an image larger than memory: decoding takes several times as many. */
export const CACHE_OF_SMALL = 2 ** 26;

/** Most voxels of a 4D image of small files in Track, with slices between its own. */
export const MOST_VOXELS_OF_SMALL = 2 ** 26;

/** Limits of what the labs make of small data; with more, the page takes over a gigabyte. */
export const EXTRACT_OF_SMALL = { maxVertices: 300_000 };
export const SEGMENT_OF_SMALL = { maxVertices: 200_000 };
export const TRACK_OF_SMALL = { maxVertices: 200_000, maxVoxels: 8_000_000 };

/** Most labels of a label map in small files: each has a row in two lists of the page, and a surface. */
export const MOST_LABELS_OF_SMALL = 400;

/** Returns a text that refuses a label map of small files with more labels than that; undefined for others. */
export function tooManyLabels(labels: number): string | undefined {
  if (labels <= MOST_LABELS_OF_SMALL) return undefined;
  return text('segment.tooManyOfSmall', { labels, most: MOST_LABELS_OF_SMALL, kilobytes: SMALL / 2 ** 10 });
}

/** A session, as far as it says how large its data are. */
interface Sized {
  isSmall?: boolean;
  source: { files: readonly { content?: unknown }[] };
}

/** Returns whether data are in small files, or in a small session, which has them. */
export function isOfSmall(session: Sized | undefined, files: readonly (Blob | NamedBytes)[] | undefined): boolean {
  if (session?.isSmall && session.source.files.every(({ content }) => content)) return true;
  return files !== undefined && areSmall(files);
}

/** Returns a text that refuses data of small files which have `count` pixels or voxels, more than `most`; both are in millions there. */
export function beyondSmall(key: TextKey, count: number, most: number, more: Record<string, number> = {}): string {
  const millions = (count: number) => Math.round(count / 1e6);
  return text(key, { millions: millions(count), kilobytes: SMALL / 2 ** 10, most: millions(most), ...more });
}

/** Returns whether files are small, all together. */
export function areSmall(files: readonly (Blob | NamedBytes)[]): boolean {
  const size = (file: Blob | NamedBytes) => {
    if (file instanceof Blob) return file.size;
    return file.isOfSmall ? 0 : file.bytes.length;
  };
  return files.reduce((sum, file) => sum + size(file), 0) <= SMALL;
}
