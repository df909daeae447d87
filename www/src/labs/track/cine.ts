/**
 * A computed phantom: cine MR of a beating ventricle whose true volume and wall are known, to measure the errors of
 * tracking.
 */
import type { Vec3 } from '../../engine/protocol';
import { normal, uniform } from '../../engine/random';

export interface CineSpec {
  dims: Vec3;
  spacing: Vec3;
  frames: number;
  /** Standard deviation of the noise, in intensity units; blood is 110 brighter than muscle. */
  noise: number;
  /**
   * Long half axis, mm, of the ellipsoid that forms the cavity in diastole, before its top is cut off; all other
   * lengths scale with it.
   */
  size: number;
  /** Whether the cavity contains two papillary muscles; the gaps between them and the wall close in systole. */
  papillary: boolean;
}

/** Intensity of blood before noise, 0 to 255. */
const BLOOD = 200;
/** Intensity of muscle before noise, 0 to 255. */
const MUSCLE = 90;
/** Intensity of lung before noise, 0 to 255. */
const LUNG = 45;
/** Value of `size`, mm, for which the other lengths in this file hold; they scale with `size`. */
const REFERENCE_HALF_AXIS = 42;
/** Number of samples through the thickness of a slice, averaged for the partial volume effect. */
const SAMPLES = 3;
/** Edge of the cells that the true volume is integrated over, mm for a heart whose `size` is `REFERENCE_HALF_AXIS`. */
const INTEGRATION_STEP = 1.5;

/** Returns the contraction of the ventricle in a frame: 0 in diastole, 1 in systole. */
export function contraction({ frames }: CineSpec, frame: number): number {
  const phase = (frame / frames) % 1;
  const rise = (x: number) => 0.5 - 0.5 * Math.cos(Math.PI * Math.min(1, Math.max(0, x)));
  return rise(phase / 0.35) - 0.92 * rise((phase - 0.35) / 0.3) - 0.08 * rise((phase - 0.65) / 0.35);
}

/** Returns the centre of the image in world coordinates, mm; the ventricle is placed around it. */
export function centreOf({ dims, spacing }: CineSpec): Vec3 {
  return dims.map((n, k) => ((n - 1) / 2) * (spacing[k] ?? 1)) as Vec3;
}

/**
 * Returns approximate signed distances of a point, mm, to the wall of the cavity and to the surface of the heart, at a
 * contraction of 0 to 1; negative inside.
 */
function distances(spec: CineSpec, at: Vec3, contracted: number): [number, number] {
  const unit = spec.size / REFERENCE_HALF_AXIS;
  const middle = centreOf(spec);
  const p = at.map((x, k) => (x - (middle[k] ?? 0)) / unit) as Vec3;
  const [wide, long] = [25 * (1 - 0.34 * contracted), REFERENCE_HALF_AXIS * (1 - 0.1 * contracted)];
  const base = 20 - 6 * contracted;
  let cavity = smoothMax(ellipsoid(p, [wide, wide, long]), p[2] - base, 3);
  const thick = 9 + 4 * contracted;
  const outside: Vec3 = [wide + thick, wide + thick, long + thick - 3 * contracted];
  const heart = smoothMax(ellipsoid(p, outside), p[2] - base - 4, 3);
  for (const angle of spec.papillary ? [0.7, 3] : []) {
    // The papillary muscles are apart from the wall except at their foot; the gap closes in systole.
    const away = wide - 9 + 4.5 * contracted;
    const from: Vec3 = [p[0] - away * Math.cos(angle), p[1] - away * Math.sin(angle), p[2] + 12];
    cavity = smoothMax(cavity, -ellipsoid(from, [5, 5, 18]), 2);
  }
  return [cavity * unit, heart * unit];
}

function ellipsoid(p: Vec3, axes: Vec3): number {
  const size = Math.hypot(p[0] / axes[0], p[1] / axes[1], p[2] / axes[2]);
  const slope = Math.hypot(p[0] / axes[0] ** 2, p[1] / axes[1] ** 2, p[2] / axes[2] ** 2);
  return slope > 0 ? (size * (size - 1)) / slope : -Math.min(...axes);
}

/** Returns the maximum of two values, rounded where they are closer than `width`. */
function smoothMax(a: number, b: number, width: number): number {
  const near = Math.max(0, width - Math.abs(a - b)) / width;
  return Math.max(a, b) + near * near * width * 0.25;
}

/**
 * Returns the voxels of all frames of the phantom, x fastest. The noise is that of magnitude images (Rician), and the
 * same at every call.
 */
export function cineVoxels(spec: CineSpec): Uint8Array {
  const [nx, ny, nz] = spec.dims;
  const voxels = new Uint8Array(nx * ny * nz * spec.frames);
  const normal = normals(17);
  let target = 0;
  for (let frame = 0; frame < spec.frames; frame++) {
    const contracted = contraction(spec, frame);
    for (let z = 0; z < nz; z++)
      for (let y = 0; y < ny; y++)
        for (let x = 0; x < nx; x++) {
          const clean = intensity(spec, [x, y, z], contracted);
          const noisy = Math.hypot(clean + spec.noise * normal(), spec.noise * normal());
          voxels[target++] = Math.min(255, Math.round(noisy));
        }
  }
  return voxels;
}

/** Returns the intensity of a voxel before noise; near walls it is averaged through the slice. */
function intensity(spec: CineSpec, index: Vec3, contracted: number): number {
  const { spacing } = spec;
  const at = (off: number): Vec3 => [index[0] * spacing[0], index[1] * spacing[1], (index[2] + off) * spacing[2]];
  const blend = ([cavity, heart]: [number, number]) => {
    const coverage = (d: number) => Math.min(1, Math.max(0, 0.5 - d / spacing[0]));
    const around = LUNG + (MUSCLE - LUNG) * coverage(heart);
    return around + (BLOOD - around) * coverage(cavity);
  };
  const middle = distances(spec, at(0), contracted);
  // Far from any wall the whole voxel has one intensity.
  if (Math.min(Math.abs(middle[0]), Math.abs(middle[1])) > Math.max(...spacing)) return blend(middle);
  let sum = 0;
  for (let k = 0; k < SAMPLES; k++) sum += blend(distances(spec, at((k + 0.5) / SAMPLES - 0.5), contracted));
  return sum / SAMPLES;
}

/** Returns the true volume of the phantom's cavity in a frame, mm³. */
export function trueVolume(spec: CineSpec, frame: number): number {
  const contracted = contraction(spec, frame);
  const step = (INTEGRATION_STEP * spec.size) / REFERENCE_HALF_AXIS;
  const middle = centreOf(spec);
  const reach = (mm: number) => Math.ceil((mm * spec.size) / REFERENCE_HALF_AXIS / step);
  const [wide, low, high] = [reach(28), reach(45), reach(24)];
  let cells = 0;
  for (let k = -low; k <= high; k++)
    for (let j = -wide; j <= wide; j++)
      for (let i = -wide; i <= wide; i++) {
        const at: Vec3 = [middle[0] + i * step, middle[1] + j * step, middle[2] + k * step];
        cells += Math.min(1, Math.max(0, 0.5 - distances(spec, at, contracted)[0] / step));
      }
  return cells * step ** 3;
}

/**
 * Returns the distances, mm, of points, packed xyz, from the true wall of the phantom's cavity, in ascending order; a
 * first-order approximation.
 */
export function wallDistances(spec: CineSpec, frame: number, points: Float32Array): Float64Array {
  const contracted = contraction(spec, frame);
  const found = Float64Array.from({ length: points.length / 3 }, (_, i) => {
    const at: Vec3 = [points[3 * i] ?? 0, points[3 * i + 1] ?? 0, points[3 * i + 2] ?? 0];
    return Math.abs(distances(spec, at, contracted)[0]);
  });
  return found.sort();
}

/** Returns a generator of normally distributed numbers of standard deviation 1, reproducible by its seed. */
function normals(seed: number): () => number {
  const random = uniform(seed);
  return () => normal(random);
}
