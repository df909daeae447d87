// Helpers of the package's tests. Importing this module starts the library.
import init, { VesicleError, Volume } from '../../pkg/index.js';

await init();

/** Returns a volume of a bright ball (200) in darkness (0), `size` voxels of side 1, centred at the world's origin. */
export function ball(size: number, radius: number): Volume {
  const middle = (size - 1) / 2;
  const data = new Uint8Array(size ** 3);
  for (let z = 0, at = 0; z < size; z++) {
    for (let y = 0; y < size; y++) {
      for (let x = 0; x < size; x++, at++) {
        // A ramp of one voxel, so that the surface is exactly at the radius.
        const inside = radius + 0.5 - Math.hypot(x - middle, y - middle, z - middle);
        data[at] = 200 * Math.min(1, Math.max(0, inside));
      }
    }
  }
  return new Volume({ data, dims: [size, size, size], origin: [-middle, -middle, -middle] });
}

/** Parameters of the paper's deformable model: uniform sampling, and explicit Euler steps. */
export const PAPER = { adaptivity: 0, integrator: 'euler' } as const;

/** Returns a volume of noise, which is much work, with `bits` random bits in each voxel. */
export function noise(size: number, bits: number): Volume {
  let state = 7;
  const data = Uint8Array.from({ length: size ** 3 }, () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state >>> (32 - bits);
  });
  return new Volume({ data, dims: [size, size, size] });
}

/**
 * Returns a volume of 48³ voxels: a bright ball of radius 14 with a concentric hollow of radius 6 and, apart from it, a
 * plate two voxels thick.
 */
export function ballWithHollowAndPlate(): Volume {
  const size = 48;
  const data = new Uint8Array(size ** 3);
  for (let z = 0, at = 0; z < size; z++) {
    for (let y = 0; y < size; y++) {
      for (let x = 0; x < size; x++, at++) {
        const r = Math.hypot(x - 22, y - 24, z - 24);
        const inBall = Math.min(14.5 - r, r - 5.5);
        const inPlate = Math.min(1.5 - Math.abs(x - 42.5), 12.5 - Math.abs(y - 24), 12.5 - Math.abs(z - 24));
        data[at] = 200 * Math.min(1, Math.max(0, inBall, inPlate));
      }
    }
  }
  return new Volume({ data, dims: [size, size, size] });
}

/** Returns the VesicleError that a function throws; fails the test if it throws none, or another error. */
export function failure(work: () => unknown): VesicleError {
  try {
    work();
  } catch (error) {
    if (error instanceof VesicleError) return error;
    throw error;
  }
  throw new Error('nothing was thrown');
}

/** Returns the VesicleError that a promise rejects with. */
export async function rejection(promise: Promise<unknown>): Promise<VesicleError> {
  const error: unknown = await promise.then(
    () => new Error('nothing was thrown'),
    (reason) => reason,
  );
  if (error instanceof VesicleError) return error;
  throw error;
}

/** Hides the type of deliberately invalid arguments from the type checker. */
// biome-ignore lint/suspicious/noExplicitAny: what a caller without types may pass
export const wrong = (value: unknown): any => value;

/** Result of `check()` for a valid mesh. */
export const HEALTHY = {
  closed: true,
  oriented: true,
  nonManifoldEdges: 0,
  nonManifoldVertices: 0,
  degenerateTriangles: 0,
  selfIntersections: 0,
};
