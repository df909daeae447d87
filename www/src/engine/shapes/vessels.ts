/** A computed volume of a tree of bright vessels on a dark background, similar to an angiography. */
import { uniform } from '../random';
import { distance, noise, type ShapeVoxels, sample, smoothStep } from './sampling';

type Point = [number, number, number];

interface Segment {
  from: Point;
  to: Point;
  radius: number;
}

const SIZE = 112;
const GENERATIONS = 6;
/** Radius of the trunk of the vessel tree, voxels. */
const TRUNK = 4;
/** Ratio of the radius of a vessel to that of its parent, by conservation of flow (Murray's law). */
const THINNER = 0.5 ** (1 / 3);
const SHORTER = 0.8;
/** Mean angle between a vessel and its parent, radians. */
const TURN = 0.62;
/** Vessel segments that are not connected to the vessel tree. */
const ISLANDS: Segment[] = [
  { from: [16, 88, 30], to: [24, 96, 34], radius: 1 },
  { from: [94, 20, 84], to: [97, 12, 92], radius: 1 },
  { from: [92, 96, 24], to: [98, 88, 20], radius: 1 },
];
const NOISE = 2;

export function vesselTree(): ShapeVoxels {
  const strength = new Float32Array(SIZE ** 3);
  for (const segment of [...tree(), ...ISLANDS]) draw(segment, strength);
  const grain = noise(20, NOISE);
  return sample(SIZE, (i, j, k) => 250 * (strength[i + SIZE * (j + SIZE * k)] ?? 0) + grain());
}

/** Generates the segments of a vessel tree: a trunk that grows upwards from the floor and bifurcates repeatedly. */
function tree(): Segment[] {
  const next = uniform(1999);
  const segments: Segment[] = [];
  const grow = (from: Point, direction: Point, length: number, radius: number, left: number) => {
    const to = from.map((x, axis) => x + length * (direction[axis] ?? 0)) as Point;
    segments.push({ from, to, radius });
    if (left === 0) return;
    const side = across(direction, 2 * Math.PI * next());
    for (const sign of [1, -1]) {
      const turn = sign * TURN * (0.75 + 0.5 * next());
      const turned = direction.map((x, axis) => Math.cos(turn) * x + Math.sin(turn) * (side[axis] ?? 0)) as Point;
      grow(to, turned, length * SHORTER * (0.85 + 0.3 * next()), radius * THINNER, left - 1);
    }
  };
  grow([SIZE / 2, SIZE / 2, 8], [0, 0, 1], 26, TRUNK, GENERATIONS - 1);
  return segments;
}

/** Returns a unit vector perpendicular to the given unit vector, turned by `angle` (radians) around it. */
function across([x, y, z]: Point, angle: number): Point {
  const other: Point = Math.abs(x) < 0.7 ? [1, 0, 0] : [0, 1, 0];
  const u = unit([y * other[2] - z * other[1], z * other[0] - x * other[2], x * other[1] - y * other[0]]);
  const v: Point = [y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0]];
  return u.map((part, axis) => Math.cos(angle) * part + Math.sin(angle) * (v[axis] ?? 0)) as Point;
}

function unit(v: Point): Point {
  const length = Math.hypot(...v);
  return v.map((x) => x / length) as Point;
}

/**
 * Draws a vessel segment with round ends into the volume: each value of `strength`, one per voxel, 0 to 1, is raised to
 * that of the segment. Visits only the voxels around the segment.
 */
function draw({ from, to, radius }: Segment, strength: Float32Array): void {
  const reach = radius + 2;
  const length = distance(from, to) ** 2;
  const [low, high] = [0, 1, 2].reduce<[Point, Point]>(
    ([a, b], axis) => {
      const ends = [from[axis] ?? 0, to[axis] ?? 0];
      a[axis] = Math.max(0, Math.floor(Math.min(...ends) - reach));
      b[axis] = Math.min(SIZE - 1, Math.ceil(Math.max(...ends) + reach));
      return [a, b];
    },
    [
      [0, 0, 0],
      [0, 0, 0],
    ],
  );
  for (let k = low[2]; k <= high[2]; k++) {
    for (let j = low[1]; j <= high[1]; j++) {
      for (let i = low[0]; i <= high[0]; i++) {
        const along =
          (i - from[0]) * (to[0] - from[0]) + (j - from[1]) * (to[1] - from[1]) + (k - from[2]) * (to[2] - from[2]);
        const t = Math.min(1, Math.max(0, along / length));
        const nearest = from.map((x, axis) => x + t * ((to[axis] ?? 0) - x)) as Point;
        const at = i + SIZE * (j + SIZE * k);
        strength[at] = Math.max(strength[at] ?? 0, smoothStep(radius - distance([i, j, k], nearest)));
      }
    }
  }
}
