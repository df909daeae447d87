/** Surfaces as workers send them to the page. */
import type { Mesh, MeshSnapshot } from 'vesicle';
import { inWorld } from './placing';
import type { Plane, PointArray, Surface } from './protocol';
import { buffersOf } from './serving';

/** Returns a mesh for drawing, with positions relative to its origin; `reuse` is a surface that is drawn no more. */
export function snapshotOf(mesh: Mesh, reuse?: MeshSnapshot): Surface {
  return mesh.snapshot(reuse, { relative: true });
}

/** Returns the cross-section of a mesh with a plane, as segments: pairs of points in world space, packed xyz. */
export function sectionOf(mesh: Mesh, { origin, normal }: Plane): PointArray {
  return inWorld(mesh.crossSection(origin, normal, { relative: true }), mesh.origin);
}

/** Returns all buffers of a surface, to be transferred to the page instead of copied. */
export function transferOf({ positions, normals, indices, values, colors, uvs }: Surface): Transferable[] {
  return buffersOf([positions, normals, indices, values, colors, uvs].filter((array) => array !== undefined));
}
