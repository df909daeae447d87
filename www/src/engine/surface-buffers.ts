/** Arrays with spare capacity in which a worker sends meshes to the page. */
import type { Mesh } from 'vesicle';
import { inWorld } from './placing';
import type { Plane, PointArray, Surface } from './protocol';
import { buffersOf } from './serving';

/**
 * Ratio of consecutive capacities of the arrays of a mesh. A smaller one needs new buffers more often, a larger one
 * leaves more memory unused.
 */
const CAPACITY_RATIO = 1.25;

/**
 * Rounds a number of vertices or triangles up to the next capacity of a geometric sequence, so that the buffers of a
 * growing surface fit for a while, here and on the GPU.
 */
export function capacityFor(count: number): number {
  return Math.ceil(CAPACITY_RATIO ** Math.ceil(Math.log(Math.max(1, count)) / Math.log(CAPACITY_RATIO)));
}

export type Arrays = Pick<Surface, 'positions' | 'normals' | 'indices' | 'uvs' | 'colors'>;

export function emptyArrays(): Arrays {
  return { positions: new Float32Array(0), normals: new Float32Array(0), indices: new Uint32Array(0) };
}

/**
 * Copies a mesh into arrays with spare capacity, which are transferred to the page and uploaded to the GPU unchanged.
 * Reuses given arrays whose length is the required capacity.
 */
export function copySurface({ positions, normals, indices }: Arrays, mesh: Mesh): Surface {
  const [numbers, corners] = [3 * capacityFor(mesh.vertexCount), 3 * capacityFor(mesh.triangleCount)];
  const arrays: Arrays = {
    positions: positions.length === numbers ? positions : new Float32Array(numbers),
    normals: normals.length === numbers ? normals : new Float32Array(numbers),
    indices: indices.length === corners ? indices : new Uint32Array(corners),
  };
  const counts = mesh.copyTo(arrays, { relative: true });
  return { ...arrays, ...counts, origin: mesh.origin };
}

/** Returns the cross-section of a mesh with a plane, as segments: pairs of points in world space, packed xyz. */
export function sectionOf(mesh: Mesh, { origin, normal }: Plane): PointArray {
  return inWorld(mesh.crossSection(origin, normal, { relative: true }), mesh.origin);
}

/** Copies a mesh into new arrays with spare capacity, with its texture coordinates if it has any. */
export function texturedSurface(mesh: Mesh): Surface {
  const capacity = capacityFor(mesh.vertexCount);
  const surface = copySurface(emptyArrays(), mesh);
  if (!surface.uvs) return surface;
  const uvs = new Float32Array(2 * capacity);
  uvs.set(surface.uvs);
  return { ...surface, uvs };
}

/** Returns all buffers of a surface, to be transferred to the page instead of copied. */
export function transferOf({ positions, normals, indices, values, colors, uvs }: Surface): Transferable[] {
  return buffersOf([positions, normals, indices, values, colors, uvs].filter((array) => array !== undefined));
}
