/** Films of the Sculpt lab: poses of the ellipsoids at each frame, by keyframes or by a formula. */
import type { ControlEllipsoid } from 'vesicle';
import { ball, between, lengthsOf } from './ellipsoids';

/**
 * A film: poses as keyframes, with `between` frames from each to the next, or a computed motion. If it is a loop, it
 * returns to the first pose and repeats.
 */
export type Film = { keys: ControlEllipsoid[][]; between: number; loop: boolean } | { motion: 'lava'; loop: boolean };

/** Number of frames in one period of the lava lamp's motion. */
const LAVA_FRAMES = 300;

/**
 * Returns the number of the last frame of a film; the first is 0. In a loop the last frame shows the same pose as the
 * first.
 */
export function lastFrame(film: Film): number {
  if ('motion' in film) return LAVA_FRAMES;
  return film.between * (film.loop ? film.keys.length : film.keys.length - 1);
}

/** Returns the pose of all ellipsoids at a frame of a film, from 0 to {@link lastFrame}. */
export function poseAt(film: Film, frame: number): ControlEllipsoid[] {
  return 'motion' in film ? lavaAt(frame) : keyedAt(film.keys, film.between, frame);
}

function keyedAt(keys: ControlEllipsoid[][], step: number, frame: number): ControlEllipsoid[] {
  const at = Math.floor(frame / step);
  const [from, to] = [keys[at % keys.length] ?? [], keys[(at + 1) % keys.length] ?? []];
  const t = (frame - at * step) / step;
  if (t === 0) return from;
  const eased = t * t * (3 - 2 * t);
  return to.map((ellipsoid, k) => between(from[k] ?? ellipsoid, ellipsoid, eased));
}

/**
 * Largest displacement of an ellipsoid's centre per frame of a glide, the motion to a requested pose, as a share of its
 * shortest semi-axis, unless `MAX_GLIDE_FRAMES` limits the number of frames. Steps of the model itself are longer.
 */
const GLIDE_STEP = 0.4;
/**
 * Largest number of frames of a glide, the motion to a requested pose: one small ellipsoid that moves far should not
 * delay all others.
 */
const MAX_GLIDE_FRAMES = 40;

/**
 * Returns the poses, frame by frame, of a glide from one pose to another, the last of which is `to`: all ellipsoids
 * arrive together, so that the surface moves as a whole. Moved by the model alone, large ellipsoids run ahead of small
 * ones and strain the membrane between them.
 */
export function glide(from: ControlEllipsoid[], to: ControlEllipsoid[]): ControlEllipsoid[][] {
  const distances = to.map((one, k) => {
    const { center } = from[k] ?? one;
    return Math.hypot(...one.center.map((x, i) => x - (center[i] ?? 0))) / Math.min(...lengthsOf(from[k] ?? one));
  });
  const frames = Math.min(MAX_GLIDE_FRAMES, Math.max(1, Math.ceil(Math.max(0, ...distances) / GLIDE_STEP)));
  return Array.from({ length: frames }, (_, i) => to.map((one, k) => between(from[k] ?? one, one, (i + 1) / frames)));
}

/**
 * Blobs of the lava lamp, which rise and sink past each other: rises per period, initial phase in radians, sideways
 * offset and radius.
 */
const BLOBS = [
  { rounds: 1, phase: 0, aside: -0.35, radius: 0.62 },
  { rounds: 2, phase: 1.9, aside: 0.4, radius: 0.42 },
  { rounds: 1, phase: 3.4, aside: 0.12, radius: 0.5 },
  { rounds: 3, phase: 4.6, aside: -0.1, radius: 0.34 },
];

/**
 * Returns the pose of the lava lamp at a frame: a pool at the foot, and blobs that separate from it and rejoin,
 * stretched while they are fast.
 */
function lavaAt(frame: number): ControlEllipsoid[] {
  const turn = (2 * Math.PI * frame) / LAVA_FRAMES;
  const pool = ball(0, -1.35, 0, 1);
  const [x, y, z] = pool.axes;
  pool.axes = [x, [0, 0.45 * y[1], 0], z];
  return [pool, ...BLOBS.map((blob) => blobAt(blob, turn))];
}

function blobAt({ rounds, phase, aside, radius }: (typeof BLOBS)[number], turn: number): ControlEllipsoid {
  const angle = rounds * turn + phase;
  const blob = ball(
    aside + 0.12 * Math.sin(2 * turn + phase),
    0.1 - 1.45 * Math.cos(angle),
    0.25 * Math.sin(turn + phase),
    radius,
  );
  const tall = 1 + 0.25 * Math.sin(angle) ** 2;
  const wide = 1 / Math.sqrt(tall);
  blob.axes = [
    [radius * wide, 0, 0],
    [0, radius * tall, 0],
    [0, 0, radius * wide],
  ];
  return blob;
}
