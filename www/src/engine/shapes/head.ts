/**
 * A computed volume of a head, similar to a CT: skin around soft tissue, and in it a skull with openings around a
 * brain.
 */
import { noise, type ShapeVoxels, sample, smoothStep } from './sampling';

const SIZE = 112;
const MIDDLE = (SIZE - 1) / 2;
/** Semi-axes of the ellipsoid bounded by the head's skin, voxels. */
const SKIN = [43, 50, 48] as const;
/** Semi-axes of the ellipsoid bounded by the skull's outer surface, voxels. */
const SKULL = [35, 42, 40] as const;
/** Thickness of the skull, voxels. */
const THICKNESS = 9;
const SOFT_TISSUE = 75;
const BONE = 220;
const NOISE = 6;

/**
 * Openings of the skull as cylinders from its centre outwards, by unit direction and radius in voxels: orbits, nose,
 * spinal cord, ears.
 */
const OPENINGS: { direction: readonly [number, number, number]; radius: number }[] = [
  { direction: [0.42, 0.88, 0.22], radius: 7 },
  { direction: [-0.42, 0.88, 0.22], radius: 7 },
  { direction: [0, 0.95, -0.31], radius: 6 },
  { direction: [0, -0.25, -0.968], radius: 9 },
  { direction: [0.97, -0.12, -0.21], radius: 5 },
  { direction: [-0.97, -0.12, -0.21], radius: 5 },
];

export function headPhantom(): ShapeVoxels {
  const grain = noise(15, NOISE);
  return sample(SIZE, (i, j, k) => {
    const at = [i - MIDDLE, j - MIDDLE, k - MIDDLE] as const;
    const skin = depthInEllipsoid(at, SKIN);
    const outside = depthInEllipsoid(at, SKULL);
    const bone = Math.min(outside, THICKNESS - outside, -depthInOpenings(at));
    return SOFT_TISSUE * smoothStep(skin) + (BONE - SOFT_TISSUE) * smoothStep(bone) + grain();
  });
}

/**
 * Returns the approximate depth of a point below the surface of an ellipsoid at the origin, voxels; negative outside.
 * First-order accurate near the surface.
 */
function depthInEllipsoid([x, y, z]: readonly [number, number, number], [a, b, c]: readonly [number, number, number]) {
  const level = Math.hypot(x / a, y / b, z / c);
  const slope = Math.hypot(x / (a * a), y / (b * b), z / (c * c)) / (level || 1);
  return slope > 0 ? (1 - level) / slope : a;
}

/**
 * Returns the largest depth of a point inside any opening of the skull, voxels; negative outside all of them, −∞ behind
 * all.
 */
function depthInOpenings(at: readonly [number, number, number]): number {
  return OPENINGS.reduce((deepest, { direction, radius }) => {
    const along = at[0] * direction[0] + at[1] * direction[1] + at[2] * direction[2];
    if (along < 0) return deepest;
    const off = Math.hypot(...at.map((x, axis) => x - along * (direction[axis] ?? 0)));
    return Math.max(deepest, radius - off);
  }, Number.NEGATIVE_INFINITY);
}
