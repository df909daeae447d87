/**
 * Computes the example point clouds of the Reconstruct lab from seeded random numbers, so that they are the same on
 * every machine.
 */
import type { Vec3 } from '../../engine/protocol';
import { normal, uniform } from '../../engine/random';

export type PointShape = 'torus' | 'two balls' | 'cube corner' | 'uneven ball';

/**
 * Standard deviation of the noise by which example points are displaced, in the units of their shapes, which are about
 * 1 in size; some shapes use a fraction of it.
 */
const NOISE = 0.02;

const SHAPES: Record<PointShape, { seed: number; count: number; point: (random: () => number) => Vec3 | undefined }> = {
  torus: { seed: 1, count: 3000, point: onTorus },
  'two balls': { seed: 2, count: 1600, point: onTwoBalls },
  'cube corner': { seed: 3, count: 1500, point: onCorner },
  'uneven ball': { seed: 4, count: 1200, point: onUnevenBall },
};

/** Returns the points of a computed example shape, without normals and colours; the same at every call. */
export function computedCloud(shape: PointShape): { points: Float32Array } {
  const { seed, count, point } = SHAPES[shape];
  const random = uniform(seed);
  const points = new Float32Array(3 * count);
  for (let i = 0; i < count; ) {
    const at = point(random);
    if (!at) continue;
    points.set(at, 3 * i);
    i += 1;
  }
  return { points };
}

/**
 * Returns a random point near a torus of radii 1 and 0.35; undefined for samples that are rejected to make the density
 * uniform over the area.
 */
function onTorus(random: () => number): Vec3 | undefined {
  const [around, across] = [2 * Math.PI * random(), 2 * Math.PI * random()];
  const [big, small] = [1, 0.35];
  if (random() > (big + small * Math.cos(across)) / (big + small)) return undefined;
  const thick = small + NOISE * normal(random);
  const out = big + thick * Math.cos(across);
  return [out * Math.cos(around), out * Math.sin(around), thick * Math.sin(across)];
}

/** Returns a random point near one of two disjoint spheres of radius 0.6. */
function onTwoBalls(random: () => number): Vec3 {
  const [x, y, z] = direction(random);
  const radius = 0.6 + 0.5 * NOISE * normal(random);
  return [radius * x + (random() < 0.5 ? -0.8 : 0.8), radius * y, radius * z];
}

/** Returns a random unit vector, uniformly distributed. */
function direction(random: () => number): Vec3 {
  const z = 2 * random() - 1;
  const angle = 2 * Math.PI * random();
  const flat = Math.sqrt(1 - z * z);
  return [flat * Math.cos(angle), flat * Math.sin(angle), z];
}

/**
 * Returns a random point near one of the three faces of a cube that meet at a corner, as a distant scanner in front of
 * that corner sees them: the noise is along its viewing direction.
 */
function onCorner(random: () => number): Vec3 {
  const [u, v, face] = [random(), random(), Math.floor(3 * random())];
  const at: Vec3 = [0, 0, 0];
  at[face] = 1;
  at[(face + 1) % 3] = u;
  at[(face + 2) % 3] = v;
  const along = (NOISE / 2) * normal(random);
  return at.map((x) => x + along / Math.sqrt(3)) as Vec3;
}

/**
 * Returns a random point near a sphere of radius 1, dense at positive x, sparse at negative x, and none where |z| >
 * 0.8; undefined for samples that are rejected to obtain this density.
 */
function onUnevenBall(random: () => number): Vec3 | undefined {
  const [x, y, z] = direction(random);
  if (Math.abs(z) > 0.8 || random() > 0.12 + 0.88 * (0.5 + 0.5 * x) ** 2) return undefined;
  const radius = 1 + 0.3 * NOISE * normal(random);
  return [radius * x, radius * y, radius * z];
}
