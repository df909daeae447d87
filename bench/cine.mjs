// A beating ventricle with papillary muscles, as in cine MR, of the paper's size. The same as in the core's tests
// (`tests/common/cine.rs`), except for the random numbers of its noise.
import { Volume } from '../pkg/index.js';
import { randomNumbers, ricianByte } from './random.mjs';

const DIMS = [156, 192, 25];
const SPACING = [1.67, 1.67, 5];
export const FRAMES = 25;
const FRAME_SECONDS = 0.04;
/** Intensities before noise, and the standard deviation of the noise. */
const [BLOOD, MUSCLE, LUNG, NOISE] = [200, 90, 45, 11];
const MIDDLE = DIMS.map((n, k) => ((n - 1) / 2) * SPACING[k]);

/** A box around the cavity in all frames, in world units. */
export const BOX = {
  min: [-33, -33, -50].map((reach, k) => MIDDLE[k] + reach),
  max: [33, 33, 30].map((reach, k) => MIDDLE[k] + reach),
};

/** Number of layers that a thick slice is averaged over. */
const LAYERS = 5;
/** Edge length of the cubes that measure the true cavity's volume, in mm. */
const CUBE = 1;

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Returns the contraction: 0 in diastole, 1 in systole. */
function contraction(frame) {
  const phase = frame / FRAMES;
  const rise = (x) => 0.5 - 0.5 * Math.cos(Math.PI * clamp(x, 0, 1));
  return rise(phase / 0.35) - 0.92 * rise((phase - 0.35) / 0.3) - 0.08 * rise((phase - 0.65) / 0.35);
}

/** Returns the approximate signed distance to an ellipsoid around the origin. */
function ellipsoid(x, y, z, across, along) {
  const [a, b, c] = [x / across, y / across, z / along];
  const unit = Math.sqrt(a * a + b * b + c * c);
  const gradient = Math.sqrt((a * a + b * b) / (across * across) + (c * c) / (along * along));
  return gradient > 0 ? (unit * (unit - 1)) / gradient : -Math.min(across, along);
}

/** Returns the maximum of two values, smoothed where they are nearly equal. */
function smoothMax(a, b, width) {
  const h = Math.max(width - Math.abs(a - b), 0) / width;
  return Math.max(a, b) + h * h * width * 0.25;
}

/**
 * Returns functions for the approximate signed distances to the cavity and the heart, negative inside. Points are
 * relative to the volume's centre.
 */
function shapes(systole) {
  const [wide, long] = [25 * (1 - 0.34 * systole), 42 * (1 - 0.1 * systole)];
  const base = 20 - 6 * systole;
  const thick = 9 + 4 * systole;
  // Away from the wall except at their base; the gap closes in systole.
  const away = wide - 9 + 4.5 * systole;
  const muscles = [0.7, 3].map((angle) => [away * Math.cos(angle), away * Math.sin(angle)]);
  return {
    cavity(x, y, z) {
      let distance = smoothMax(ellipsoid(x, y, z, wide, long), z - base, 3);
      for (const [u, v] of muscles) distance = smoothMax(distance, -ellipsoid(x - u, y - v, z + 12, 5, 18), 2);
      return distance;
    },
    heart: (x, y, z) => smoothMax(ellipsoid(x, y, z, wide + thick, long + thick - 3 * systole), z - base - 4, 3),
  };
}

/** Returns the intensity at a point before noise; edges are blurred over one pixel. */
function shade(cavity, heart) {
  const share = (distance) => clamp(0.5 - distance / SPACING[0], 0, 1);
  const around = LUNG + (MUSCLE - LUNG) * share(heart);
  return around + (BLOOD - around) * share(cavity);
}

/** Returns the intensity of a voxel before noise. */
function clean({ cavity, heart }, x, y, z) {
  const [inner, outer] = [cavity(x, y, z), heart(x, y, z)];
  if (Math.min(Math.abs(inner), Math.abs(outer)) > SPACING[2]) return shade(inner, outer);
  // Slices are thick, so the intensity is averaged over their height.
  let sum = 0;
  for (let k = 0; k < LAYERS; k++) {
    const height = z + SPACING[2] * ((k + 0.5) / LAYERS - 0.5);
    sum += shade(cavity(x, y, height), heart(x, y, height));
  }
  return sum / LAYERS;
}

/** Returns the volume with all frames and noise. */
export function cine() {
  const random = randomNumbers(17);
  const [nx, ny, nz] = DIMS;
  const data = new Uint8Array(nx * ny * nz * FRAMES);
  for (let at = 0, frame = 0; frame < FRAMES; frame++) {
    const there = shapes(contraction(frame));
    for (let i = 0; i < nx * ny * nz; i++, at++) {
      const place = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
      const [x, y, z] = place.map((n, k) => n * SPACING[k] - MIDDLE[k]);
      data[at] = ricianByte(clean(there, x, y, z), NOISE, random);
    }
  }
  return new Volume({ data, dims: [...DIMS, FRAMES], spacing: SPACING, frameSeconds: FRAME_SECONDS });
}

/** Returns the volume that the cavity encloses in a frame, in mm³. */
function enclosed(frame) {
  const { cavity } = shapes(contraction(frame));
  const [low, high] = [BOX.min, BOX.max].map((corner) => corner.map((value, k) => value - MIDDLE[k]));
  let count = 0;
  for (let z = low[2] + CUBE / 2; z < high[2]; z += CUBE) {
    for (let y = low[1] + CUBE / 2; y < high[1]; y += CUBE) {
      for (let x = low[0] + CUBE / 2; x < high[0]; x += CUBE) count += cavity(x, y, z) < 0 ? 1 : 0;
    }
  }
  return count * CUBE ** 3;
}

/** Returns the true volume of the cavity in each frame, in mm³. */
export const volumes = () => Array.from({ length: FRAMES }, (_, frame) => enclosed(frame));
