/** Arrays for a mesh on its way to the page. */
import type { Mesh } from 'vesicle';
import type { Surface } from '../protocol';
import { buffersOf } from './serving';

/** From one length to the next. Shorter steps need new buffers more often, longer ones leave more of them empty. */
const STEP = 1.25;

/** The next of a few lengths, so that the buffers of a surface that grows fit for a while, here and on the GPU. */
export function roomFor(count: number): number {
  return Math.ceil(STEP ** Math.ceil(Math.log(Math.max(1, count)) / Math.log(STEP)));
}

export type Arrays = Pick<Surface, 'positions' | 'normals' | 'indices' | 'uvs' | 'colors'>;

export function noArrays(): Arrays {
  return { positions: new Float32Array(0), normals: new Float32Array(0), indices: new Uint32Array(0) };
}

/**
 * A mesh in arrays with some room to spare, which go to the page as they are, and from there to the GPU. In the arrays
 * given where they are as long as new ones would be.
 */
export function surfaceIn({ positions, normals, indices }: Arrays, mesh: Mesh): Surface {
  const [numbers, corners] = [3 * roomFor(mesh.vertexCount), 3 * roomFor(mesh.triangleCount)];
  const arrays: Arrays = {
    positions: positions.length === numbers ? positions : new Float32Array(numbers),
    normals: normals.length === numbers ? normals : new Float32Array(numbers),
    indices: indices.length === corners ? indices : new Uint32Array(corners),
  };
  const counts = mesh.copyTo(arrays);
  return { ...arrays, ...counts };
}

/** With places in a picture, which have as much room. */
export function texturedSurface(mesh: Mesh): Surface {
  const room = roomFor(mesh.vertexCount);
  const surface = surfaceIn(noArrays(), mesh);
  if (!surface.uvs) return surface;
  const uvs = new Float32Array(2 * room);
  uvs.set(surface.uvs);
  return { ...surface, uvs };
}

/** What of a surface is handed over instead of copied. */
export function transferOf({ positions, normals, indices, values, colors, uvs }: Surface): Transferable[] {
  return buffersOf([positions, normals, indices, values, colors, uvs].filter((array) => array !== undefined));
}
