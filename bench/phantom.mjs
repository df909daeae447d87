// A head of the same size as the paper's CT: two nested shells six voxels thick, with holes through them, in noise. The
// same as in the core's tests (`tests/common/scenes.rs`), except for the random numbers of its noise.
import { Volume } from '../pkg/index.js';
import { randomNumbers } from './random.mjs';

const DIMS = [256, 256, 68];
const MIDDLE = DIMS.map((n) => (n - 1) / 2);
/** Semi-axes of the shells, and half of their thickness, in voxels. */
const SHELLS = [
  [112, 120, 29],
  [84, 92, 14.5],
];
const HALF_THICKNESS = 3;
/** Position and radius of the vertical holes. */
const HOLES = [
  [40, 20, 9],
  [-50, -30, 7],
  [10, -60, 12],
];
const NOISE = 0.02;
/** Iso value, between the intensities 0 and 1. */
export const ISO = 0.5;

/** Returns the approximate distance to an ellipsoid. */
function toEllipsoid(place, axes) {
  const level = Math.hypot(...place.map((x, k) => x / axes[k]));
  const slope = Math.hypot(...place.map((x, k) => x / axes[k] ** 2));
  return (level * (level - 1)) / Math.max(slope, 1e-6);
}

/** Returns the approximate signed distance to the shells, negative inside. */
function toHead(place) {
  const [x, y, z] = place;
  const shells = SHELLS.map((axes) => Math.abs(toEllipsoid(place, axes)) - HALF_THICKNESS);
  const holes = z > 0 ? HOLES.map(([u, v, radius]) => Math.hypot(x - u, y - v) - radius) : [];
  return Math.max(Math.min(...shells), -Math.min(...holes));
}

/** Returns a head of 256 × 256 × 68 voxels of side 1. */
export function headPhantom() {
  const random = randomNumbers(1);
  const [nx, ny, nz] = DIMS;
  const data = new Float32Array(nx * ny * nz);
  for (let i = 0; i < data.length; i++) {
    const place = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))].map((n, k) => n - MIDDLE[k]);
    // The sum of twelve uniform numbers has variance 1 and is nearly normal.
    let noise = -6;
    for (let k = 0; k < 12; k++) noise += random();
    data[i] = Math.min(Math.max(0.5 - 0.25 * toHead(place), 0), 1) + NOISE * noise;
  }
  return new Volume({ data, dims: DIMS });
}
