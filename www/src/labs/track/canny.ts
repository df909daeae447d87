/**
 * Canny's edge detector (1986), with which the paper on tracking compares its boundary: Gaussian smoothing, gradient,
 * non-maximum suppression, hysteresis thresholding.
 */

export interface CannySettings {
  /** Standard deviation of the Gaussian that smooths the image, in pixels. */
  deviation: number;
  /**
   * Lower hysteresis threshold of the gradient magnitude, in intensity per pixel: local maxima from `low` on that are
   * connected to an edge are edges, too.
   */
  low: number;
  /**
   * Upper hysteresis threshold, in intensity per pixel: local maxima of the gradient magnitude from `high` on are
   * edges.
   */
  high: number;
}

/** A greyscale image, row by row, in which edges are detected. */
export interface GreyImage {
  width: number;
  height: number;
  values: ArrayLike<number>;
}

/** Returns the edge map of a greyscale image: 1 for each edge pixel, else 0. */
export function canny(picture: GreyImage, { deviation, low, high }: CannySettings): Uint8Array {
  const { width, height } = picture;
  const smooth = smoothed(picture, deviation);
  const at = (x: number, y: number) => smooth[clamp(y, height) * width + clamp(x, width)] ?? 0;
  const slopes = new Float32Array(width * height);
  const ridge = new Uint8Array(width * height);
  const slope = (x: number, y: number) =>
    [(at(x + 1, y) - at(x - 1, y)) / 2, (at(x, y + 1) - at(x, y - 1)) / 2] as const;
  for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) slopes[y * width + x] = Math.hypot(...slope(x, y));
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      const [dx, dy] = slope(x, y);
      const here = slopes[y * width + x] ?? 0;
      const [ahead, behind] = [1, -1].map((direction) => along(slopes, width, height, x, y, dx, dy, direction));
      // Strict on one side only, so that one of two equal neighbours is kept.
      if (here > (ahead ?? 0) && here >= (behind ?? 0)) ridge[y * width + x] = 1;
    }
  return connected(width, height, ridge, slopes, low, high);
}

/**
 * Returns the gradient magnitude at a neighbour ahead (`direction` 1) or behind (−1) along the gradient (dx, dy),
 * bilinearly interpolated: one pixel away along the gradient's larger component.
 */
function along(
  slopes: Float32Array,
  width: number,
  height: number,
  x: number,
  y: number,
  dx: number,
  dy: number,
  direction: number,
): number {
  const size = Math.max(Math.abs(dx), Math.abs(dy)) || 1;
  const [toX, toY] = [x + (direction * dx) / size, y + (direction * dy) / size];
  const [x0, y0] = [Math.floor(toX), Math.floor(toY)];
  const [u, v] = [toX - x0, toY - y0];
  const at = (i: number, j: number) => slopes[clamp(j, height) * width + clamp(i, width)] ?? 0;
  return (
    (1 - v) * ((1 - u) * at(x0, y0) + u * at(x0 + 1, y0)) + v * ((1 - u) * at(x0, y0 + 1) + u * at(x0 + 1, y0 + 1))
  );
}

/**
 * Hysteresis: returns the edge map of the local maxima from `high` on, and of those from `low` on that are connected to
 * them.
 */
function connected(
  width: number,
  height: number,
  ridge: Uint8Array,
  slopes: Float32Array,
  low: number,
  high: number,
): Uint8Array {
  const edges = new Uint8Array(width * height);
  const stack: number[] = [];
  const push = (i: number, least: number) => {
    if (!ridge[i] || edges[i] || (slopes[i] ?? 0) < least) return;
    edges[i] = 1;
    stack.push(i);
  };
  for (let i = 0; i < edges.length; i++) {
    push(i, high);
    for (let from = stack.pop(); from !== undefined; from = stack.pop()) {
      const [x, y] = [from % width, Math.floor(from / width)];
      for (let j = Math.max(0, y - 1); j <= Math.min(height - 1, y + 1); j++)
        for (let k = Math.max(0, x - 1); k <= Math.min(width - 1, x + 1); k++) push(j * width + k, low);
    }
  }
  return edges;
}

/**
 * Convolves an image with a Gaussian, first along rows, then along columns; the border is padded with the nearest
 * values.
 */
function smoothed({ width, height, values }: GreyImage, deviation: number): Float32Array {
  const radius = Math.ceil(3 * deviation);
  const kernel = Array.from({ length: 2 * radius + 1 }, (_, i) =>
    Math.exp(-((i - radius) ** 2) / (2 * deviation ** 2 || 1)),
  );
  const sum = kernel.reduce((a, b) => a + b, 0);
  const pass = (from: ArrayLike<number>, stepX: number, stepY: number) => {
    const out = new Float32Array(width * height);
    for (let y = 0; y < height; y++)
      for (let x = 0; x < width; x++) {
        let total = 0;
        for (const [i, weight] of kernel.entries()) {
          const [atX, atY] = [clamp(x + (i - radius) * stepX, width), clamp(y + (i - radius) * stepY, height)];
          total += weight * (from[atY * width + atX] ?? 0);
        }
        out[y * width + x] = total / sum;
      }
    return out;
  };
  return pass(pass(values, 1, 0), 0, 1);
}

function clamp(i: number, length: number): number {
  return Math.min(length - 1, Math.max(0, i));
}
