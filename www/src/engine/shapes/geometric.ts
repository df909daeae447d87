/** Computed volumes of shapes with known topology: linked rings, a chain and Menger sponges. */
import { type ShapeVoxels, sample } from './sampling';

const RINGS_SIZE = 64;
/** Radius of the centre line of each ring of `linkedRings`, voxels. */
const RING_RADIUS = 15;
/** Radius of the tube of each ring of `linkedRings`, voxels. */
const TUBE_RADIUS = 5.5;
/** Size of the volume of `chain`, radius of the centre line of each of its rings, and radius of its tube; voxels. */
const CHAIN = { size: [61, 45, 45] as [number, number, number], ring: 16, tube: 4.5 };
/** Width of the empty margin on each side of the Menger sponge, voxels. */
const SPONGE_MARGIN = 4;

/** Returns the volume of two linked rings: two components of genus 1. */
export function linkedRings(): ShapeVoxels {
  const middle = (RINGS_SIZE - 1) / 2;
  const shift = RING_RADIUS / 2;
  return sample(RINGS_SIZE, (i, j, k) => {
    const [x, y, z] = [i - middle, j - middle, k - middle];
    const flat = Math.hypot(Math.hypot(x + shift, y) - RING_RADIUS, z);
    const upright = Math.hypot(Math.hypot(x - shift, z) - RING_RADIUS, y);
    // Half grey at the surface, with a transition of one and a half voxels to each side.
    return 127.5 + 85 * (TUBE_RADIUS - Math.min(flat, upright));
  });
}

/**
 * Returns the volume of two linked rings as a potential that decreases linearly with the distance from their centre
 * lines: its maximum, 255, up to half of the tube's radius, half of that at the radius, zero from one and a half radii.
 */
export function chain(): ShapeVoxels {
  const { size, ring, tube } = CHAIN;
  const middle = size.map((n) => (n - 1) / 2) as [number, number, number];
  return sample(size, (i, j, k) => {
    const [x, y, z] = [i - middle[0], j - middle[1], k - middle[2]];
    const flat = Math.hypot(Math.hypot(x + ring / 2, y) - ring, z);
    const upright = Math.hypot(Math.hypot(x - ring / 2, z) - ring, y);
    return 255 * (1.5 - Math.min(flat, upright) / tube);
  });
}

/** Returns the volume of a Menger sponge, a cube of 81³ voxels with square tunnels at `depth` scales. */
export function spongeVoxels(depth: number): ShapeVoxels {
  const side = 81;
  return sample(side + 2 * SPONGE_MARGIN, (i, j, k) => {
    const at = [i - SPONGE_MARGIN, j - SPONGE_MARGIN, k - SPONGE_MARGIN];
    if (at.some((x) => x < 0 || x >= side)) return 0;
    return isPierced(at, side, depth) ? 0 : 255;
  });
}

/**
 * Whether a voxel is inside a tunnel of the Menger sponge: at some scale, in the middle third along two axes or more.
 */
function isPierced(at: number[], side: number, depth: number): boolean {
  for (let level = 1; level <= depth; level++) {
    const third = side / 3 ** level;
    const inMiddle = at.filter((x) => Math.floor(x / third) % 3 === 1);
    if (inMiddle.length >= 2) return true;
  }
  return false;
}
