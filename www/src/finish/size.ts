/** The size that edits of a session may give a surface, since a small file may come from anyone. */
import type { Mesh } from 'vesicle';
import { VesicleError } from 'vesicle/channel';
import { callOf } from '../engine/edits';
import type { Edit } from '../engine/protocol';
import { count } from '../kit/format';
import { text } from '../texts';

/** Most vertices that an edit of a session in a small file may give: with more, the page draws for a second after each. */
export const MOST_OF_SMALL = 200_000;

/**
 * Vertices of remeshed triangles on an area, times the product of the bounds of their edges, as measured: a fifth more than
 * of equilateral ones.
 */
const VERTICES_PER_AREA = 1.39;

/** Throws a {@link VesicleError} if an edit would give a mesh more than about `most` vertices. Only remeshing adds many. */
export function checkSize(mesh: Mesh, edit: Edit, most: number): void {
  if (edit.op !== 'remesh' || !(edit.min > 0)) return;
  const vertices = remeshedVertices(mesh, edit);
  if (vertices <= most) return;
  const shown = { edit: callOf(edit), vertices: count(Math.round(vertices)), most: count(most) };
  throw new VesicleError('too-large', text('finish.tooLarge', shown));
}

/** Estimates the vertices of a mesh after it is remeshed, from its area and, as needles have hardly any, the splits of edges. */
function remeshedVertices(mesh: Mesh, { min, max }: { min: number; max: number }): number {
  const { positions, indices } = mesh.arrays({ relative: true });
  const edge = (from: number, to: number) =>
    [0, 1, 2].map((axis) => (positions[3 * to + axis] ?? 0) - (positions[3 * from + axis] ?? 0)) as Vector;
  let [area, splits] = [0, 0];
  for (let k = 0; k < indices.length; k += 3) {
    const [a = 0, b = 0, c = 0] = indices.subarray(k, k + 3);
    const [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)];
    area += Math.hypot(...cross(ab, ca)) / 2;
    // Each edge is of two triangles.
    for (const side of [ab, bc, ca]) splits += Math.floor(Math.hypot(...side) / max) / 2;
  }
  return (VERTICES_PER_AREA * area) / (min * max) + splits;
}

type Vector = [number, number, number];

const cross = ([a, b, c]: Vector, [x, y, z]: Vector): Vector => [b * z - c * y, c * x - a * z, a * y - b * x];
