// A pulsating ball as a 4D volume with noise, and its true measures.
import { randomNumbers } from '../../bench/random.mjs';
import { type Vec3, Volume, type VolumeInit } from '../../pkg/index.js';

export const FRAMES = 8;
export const SECONDS = 0.05;
/** Voxels along each axis, and their size in world units. */
const [SIZE, SIDE] = [20, 1.5];
/** Centre of the ball in world units. */
export const MIDDLE: Vec3 = [40, -20, 10];
const ORIGIN = MIDDLE.map((x) => x - ((SIZE - 1) / 2) * SIDE) as Vec3;
/** Bounds of the whole volume in world units. */
export const REACH = { min: ORIGIN, max: MIDDLE.map((x) => x + ((SIZE - 1) / 2) * SIDE) as Vec3 };

/** Intensities inside and outside, and the largest noise. */
const [BRIGHT, DARK, NOISE] = [160, 40, 10];

/** Returns the radius in voxels: largest in the first frame, smallest in the middle one. */
const radius = (frame: number) => 6 - 0.75 * (1 - Math.cos((2 * Math.PI * frame) / FRAMES));

/** Returns the true volume of the ball in a frame, in world units cubed. */
export const truth = (frame: number) => (4 / 3) * Math.PI * (SIDE * radius(frame)) ** 3;

/** Returns the intensities of one ball, with a ramp of one voxel at its surface. */
function paint(size: number, middle: Vec3, radius: number, random: () => number): number[] {
  return Array.from({ length: size ** 3 }, (_, i) => {
    const place = [i % size, Math.floor(i / size) % size, Math.floor(i / size ** 2)];
    const away = Math.hypot(...place.map((x, k) => x - (middle[k] as number)));
    const inside = Math.min(1, Math.max(0, radius + 0.5 - away));
    return DARK + (BRIGHT - DARK) * inside + NOISE * (random() + random() - 1);
  });
}

/** Returns the voxels of some frames of the beat, x fastest. */
export function beats({ frames = FRAMES, seed = 7 } = {}): Uint8Array {
  const random = randomNumbers(seed);
  const middle = [0, 0, 0].map(() => (SIZE - 1) / 2) as Vec3;
  return Uint8Array.from(
    Array.from({ length: frames }, (_, frame) => paint(SIZE, middle, radius(frame), random)).flat(),
  );
}

/** Returns some frames of the beat as a volume. */
export function beating(shape: { frames?: number; seed?: number } = {}, more: Partial<VolumeInit> = {}): Volume {
  const dims: VolumeInit['dims'] = [SIZE, SIZE, SIZE, shape.frames ?? FRAMES];
  const place = more.affine ? {} : { spacing: [SIDE, SIDE, SIDE] as Vec3, origin: ORIGIN };
  return new Volume({ data: beats(shape), dims, ...place, frameSeconds: SECONDS, ...more });
}

/** A large ball and a small one that do not move, in two frames; voxels of side 1, with the origin at the first. */
export const LARGE = { at: [8, 12, 12] as Vec3, radius: 5 };
export const SMALL = { at: [19, 12, 12] as Vec3, radius: 3 };
export function pair(): Volume {
  const random = randomNumbers(3);
  const size = 24;
  const frame = () => {
    const [large, small] = [LARGE, SMALL].map(({ at, radius }) => paint(size, at, radius, random));
    return (large as number[]).map((value, i) => Math.max(value, (small as number[])[i] as number));
  };
  return new Volume({ data: Uint8Array.from([...frame(), ...frame()]), dims: [size, size, size, 2] });
}

/** Returns two frames of a ball with a dark pillar through it, along the third axis; voxels of side 1. */
export function pierced(): Volume {
  const random = randomNumbers(5);
  const size = 24;
  const frame = (radius: number) =>
    paint(size, [12, 12, 12], radius, random).map((value, i) => {
      const [x, y] = [i % size, Math.floor(i / size) % size];
      return Math.hypot(x - 14, y - 12) < 2.2 ? Math.min(value, DARK + 2) : value;
    });
  return new Volume({ data: Uint8Array.from([...frame(9), ...frame(8)]), dims: [size, size, size, 2] });
}
