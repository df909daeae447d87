/**
 * Finds the paper's boundary in one slice, for previews and figures: 2-means clustering of windows into bright and
 * dark, and the votes of the windows (section 2.1).
 */
import type { GreyImage } from './canny';

/** Share of a window's pixels that each of its two clusters must exceed for the window to contain a boundary. */
const MIN_SHARE = 0.1;
/** Largest number of iterations of 2-means clustering. */
const MAX_ITERATIONS = 10;

/** Result of 2-means clustering of the values of a window. */
export interface Clusters {
  /** Mean of the dark cluster, then of the bright one, in the unit of the values. */
  means: [number, number];
  /** For each value, in their order, 1 if it is in the bright cluster, else 0. */
  bright: Uint8Array;
}

/**
 * Divides values into a dark and a bright cluster by Lloyd's iteration, started from the smallest and the largest
 * value.
 */
export function twoMeans(values: ArrayLike<number>): Clusters {
  let means: [number, number] = [Math.min(...Array.from(values)), Math.max(...Array.from(values))];
  const bright = new Uint8Array(values.length);
  for (let round = 0; round < MAX_ITERATIONS; round++) {
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

/**
 * Tests whether a window contains a boundary: each cluster has more than `MIN_SHARE` of the pixels, and their means
 * differ by more than `threshold`, in the unit of the values.
 */
export function hasBoundary({ means, bright }: Clusters, threshold: number): boolean {
  const share = bright.reduce((sum, one) => sum + one, 0) / bright.length;
  return Math.min(share, 1 - share) > MIN_SHARE && means[1] - means[0] > threshold;
}

/**
 * Returns the boundary votes of the windows of one slice, as in the paper's 2D version: for each face between two
 * pixels that at least one window puts in different clusters, its centre, in pixels, and the share of such windows
 * among those that contain both pixels. Near the image border, where these are fewer, the share is relative to their
 * number elsewhere.
 */
export function sliceVotes(
  { width, height, values }: GreyImage,
  halfWidth: number,
  threshold: number,
): { x: number; y: number; weight: number }[] {
  const [right, below] = [new Float32Array(width * height), new Float32Array(width * height)];
  for (let y = halfWidth; y + halfWidth < height; y++)
    for (let x = halfWidth; x + halfWidth < width; x++)
      voteOf({ width, values }, x, y, halfWidth, threshold, right, below);
  // Number of windows that contain both pixels of a face.
  const most = 2 * halfWidth * (2 * halfWidth + 1);
  const out = [];
  for (let i = 0; i < width * height; i++) {
    const [x, y] = [i % width, Math.floor(i / width)];
    if (right[i]) out.push({ x: x + 1, y: y + 0.5, weight: (right[i] ?? 0) / most });
    if (below[i]) out.push({ x: x + 0.5, y: y + 1, weight: (below[i] ?? 0) / most });
  }
  return out;
}

function voteOf(
  { width, values }: Pick<GreyImage, 'width' | 'values'>,
  x: number,
  y: number,
  halfWidth: number,
  threshold: number,
  right: Float32Array,
  below: Float32Array,
): void {
  const side = 2 * halfWidth + 1;
  const from = (y - halfWidth) * width + x - halfWidth;
  let [smallest, largest] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let j = 0; j < side; j++)
    for (let i = 0; i < side; i++) {
      const value = values[from + j * width + i] ?? 0;
      if (value < smallest) smallest = value;
      if (value > largest) largest = value;
    }
  // Quick test: most windows end here.
  if (largest - smallest <= threshold) return;
  const inside = Array.from({ length: side * side }, (_, k) => from + Math.floor(k / side) * width + (k % side));
  const found = twoMeans(inside.map((at) => values[at] ?? 0));
  if (!hasBoundary(found, threshold)) return;
  for (const [k, at] of inside.entries()) {
    if ((k + 1) % side !== 0 && found.bright[k] !== found.bright[k + 1]) right[at] = (right[at] ?? 0) + 1;
    if (k + side < side * side && found.bright[k] !== found.bright[k + side]) below[at] = (below[at] ?? 0) + 1;
  }
}

/**
 * Returns the indices of the pixels in the window around (x, y), row by row: up to `halfWidth` pixels to each side,
 * clipped at the border.
 */
export function windowAt({ width, height }: GreyImage, x: number, y: number, halfWidth: number): number[] {
  const out: number[] = [];
  for (let j = Math.max(0, y - halfWidth); j <= Math.min(height - 1, y + halfWidth); j++)
    for (let i = Math.max(0, x - halfWidth); i <= Math.min(width - 1, x + halfWidth); i++) out.push(j * width + i);
  return out;
}

/**
 * Returns an image of the boundary votes on pixel faces, as in the paper's figures: each pixel gets the sum of the
 * square roots of the votes on the faces to its left and above, so that slanted edges do not count twice.
 */
export function boundaryImage(
  { width, height }: Pick<GreyImage, 'width' | 'height'>,
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
