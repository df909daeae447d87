/** The paper's boundary on one slice: windows sorted into bright and dark, and what they vote for (section 2.1). */
import type { Picture } from './canny';

/** Each of the two must hold more than this share of a window. */
const LEAST_SHARE = 0.1;
const MOST_ROUNDS = 10;

export interface Clusters {
  /** Mean of the dark, and of the bright. */
  means: [number, number];
  /** 1 where a value is bright. */
  bright: Uint8Array;
}

/** Lloyd's iteration from the smallest and the largest value. */
export function twoMeans(values: ArrayLike<number>): Clusters {
  let means: [number, number] = [Math.min(...Array.from(values)), Math.max(...Array.from(values))];
  const bright = new Uint8Array(values.length);
  for (let round = 0; round < MOST_ROUNDS; round++) {
    const [sums, counts] = [
      [0, 0],
      [0, 0],
    ];
    for (let i = 0; i < values.length; i++) {
      const value = values[i] ?? 0;
      const side = value - means[0] > means[1] - value ? 1 : 0;
      bright[i] = side;
      sums[side] = (sums[side] ?? 0) + value;
      counts[side] = (counts[side] ?? 0) + 1;
    }
    const next = means.map((mean, side) => (counts[side] ? (sums[side] ?? 0) / (counts[side] ?? 1) : mean));
    if (next[0] === means[0] && next[1] === means[1]) break;
    means = [next[0] ?? means[0], next[1] ?? means[1]];
  }
  return { means, bright };
}

/** Whether a window holds a boundary: both kinds, and far enough apart. */
export function isSplit({ means, bright }: Clusters, threshold: number): boolean {
  const share = bright.reduce((sum, one) => sum + one, 0) / bright.length;
  return Math.min(share, 1 - share) > LEAST_SHARE && means[1] - means[0] > threshold;
}

/** The pixels of the window around a place, row by row; less of them at the border. */
export function windowAt({ width, height }: Picture, x: number, y: number, reach: number): number[] {
  const out: number[] = [];
  for (let j = Math.max(0, y - reach); j <= Math.min(height - 1, y + reach); j++)
    for (let i = Math.max(0, x - reach); i <= Math.min(width - 1, x + reach); i++) out.push(j * width + i);
  return out;
}

/**
 * Votes on the faces of pixels, brought together on the pixels as the paper shows them: of each pixel the square roots of the
 * two shares to its right and below, so that slanted edges do not count twice.
 */
export function boundaryPicture(
  { width, height }: Pick<Picture, 'width' | 'height'>,
  faces: Iterable<{ x: number; y: number; weight: number }>,
): Float32Array {
  const out = new Float32Array(width * height);
  for (const { x, y, weight } of faces) {
    const [i, j] = [Math.floor(x), Math.floor(y)];
    if (i < 0 || j < 0 || i >= width || j >= height) continue;
    out[j * width + i] = (out[j * width + i] ?? 0) + Math.sqrt(Math.max(0, weight));
  }
  return out;
}
