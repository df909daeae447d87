/** Computes the meshes of examples that have no mesh file. Used by the worker only. */
import { type Icosphere, Mesh, type MeshTexture } from 'vesicle';
import startReaders, { parseMesh } from 'vesicle/import';
import { withoutCompression } from '../../engine/gltf';
import { drawnMap } from './map';
import type { NamedBytes } from './protocol';

export type ComputedMesh = 'globe' | 'ball';

/** The ball, for `Mesh.icosphere`. */
export const BALL: Icosphere = { center: [0, 0, 0], radius: 1, maxEdge: 0.08 };
/** Number of meridians of the globe's mesh. */
const MERIDIANS = 96;
/** Number of circles of latitude of the globe's mesh, without the poles. */
const CIRCLES = 47;

/** Returns a computed mesh, with its texture if it has one. */
export async function computedMesh(shape: ComputedMesh): Promise<Mesh> {
  if (shape === 'ball') return plainMesh(shape);
  return readMesh(globeAsObj(), { type: 'image/png', bytes: await drawnMap() });
}

/** Returns a computed mesh without its texture; tests use it where no texture can be drawn. */
export async function plainMesh(shape: ComputedMesh): Promise<Mesh> {
  return shape === 'ball' ? Mesh.icosphere(BALL) : readMesh(globeAsObj());
}

/** Reads a mesh from the bytes of a file, with the image of its texture and the files beside it, if these are its own. */
export async function readMesh(bytes: Uint8Array, texture?: MeshTexture, files: NamedBytes[] = []): Promise<Mesh> {
  await startReaders();
  const beside = files.map(({ name, bytes }) => ({ name, bytes }));
  const plain = await withoutCompression(bytes, files);
  const { positions, indices, ...extra } = parseMesh(plain, { ...(texture && { texture }), files: beside });
  return Mesh.fromArrays(positions, indices, extra);
}

/**
 * Returns the globe, a ball of radius 1, as an OBJ file, with y up and texture coordinates by longitude and latitude: u
 * from west to east, v from the south. Only in a file can a vertex on the seam have two texture coordinates.
 */
export function globeAsObj(): Uint8Array {
  const lines: string[] = [];
  const rings = CIRCLES + 1;
  for (let ring = 1; ring < rings; ring++) for (let m = 0; m < MERIDIANS; m++) lines.push(vertexLine(ring, m, rings));
  lines.push('v 0 1 0', 'v 0 -1 0');
  for (let ring = 0; ring <= rings; ring++)
    for (let m = 0; m <= MERIDIANS; m++) lines.push(`vt ${m / MERIDIANS} ${1 - ring / rings}`);
  const north = CIRCLES * MERIDIANS + 1;
  const at = (ring: number, m: number) => `${vertex(ring, m, rings, north)}/${ring * (MERIDIANS + 1) + m + 1}`;
  for (let m = 0; m < MERIDIANS; m++) {
    for (let ring = 0; ring < rings; ring++) {
      const [a, b, c, d] = [at(ring, m), at(ring, m + 1), at(ring + 1, m), at(ring + 1, m + 1)];
      if (ring < rings - 1) lines.push(`f ${a} ${c} ${d}`);
      if (ring > 0) lines.push(`f ${a} ${d} ${b}`);
    }
  }
  return new TextEncoder().encode(`${lines.join('\n')}\n`);
}

function vertexLine(ring: number, m: number, rings: number): string {
  const [colatitude, longitude] = [(Math.PI * ring) / rings, (2 * Math.PI * m) / MERIDIANS];
  const out = Math.sin(colatitude);
  return `v ${-out * Math.cos(longitude)} ${Math.cos(colatitude)} ${out * Math.sin(longitude)}`;
}

function vertex(ring: number, m: number, rings: number, north: number): number {
  if (ring === 0) return north;
  return ring === rings ? north + 1 : (ring - 1) * MERIDIANS + (m % MERIDIANS) + 1;
}
