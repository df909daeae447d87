/**
 * Simplified surface on the same vertices, drawn while the view is rotated without a GPU: by vertex clustering
 * (Rossignac and Borrel 1993).
 */

/** Number of edges sampled to estimate the mean edge length; up to twice as many if they do not divide evenly. */
const SAMPLES = 1000;
/**
 * Sets the size of the grid cells in which vertices are merged: the area of a cell's side is this factor times the
 * squared mean edge length, times the ratio of the present number of triangles to the target; about the target then
 * remains.
 */
const TRIANGLES_PER_CELL = 1.5;
/** Ratio of the remaining number of triangles to the target above which larger cells are tried. */
const MOST_EXCESS = 1.5;

export interface FineMesh {
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
  vertices: number;
  /** Number of `indices` in use, three per triangle. */
  corners: number;
}

/**
 * Returns a simplified mesh of about `triangles` triangles as vertex indices, three per triangle. The vertices in a
 * grid cell are merged into one of them, separately for the six main directions of their normals, so that the two sides
 * of a thin sheet stay apart.
 */
export function simplifiedIndices(fine: FineMesh, triangles: number): Uint32Array {
  const cell = meanEdge(fine) * Math.sqrt((TRIANGLES_PER_CELL * fine.corners) / 3 / triangles);
  const list = clusteredIndices(fine, cell);
  // Thin sheets and small components keep more triangles, because each has cells of its own.
  const excess = list.length / 3 / triangles;
  return excess > MOST_EXCESS ? clusteredIndices(fine, cell * Math.sqrt(excess)) : list;
}

function clusteredIndices(fine: FineMesh, cell: number): Uint32Array {
  const { indices, corners } = fine;
  const representatives = clusterRepresentatives(fine, cell);
  const out = new Uint32Array(corners);
  let length = 0;
  for (let i = 0; i < corners; i += 3) {
    const a = representatives[indices[i] ?? 0] ?? 0;
    const b = representatives[indices[i + 1] ?? 0] ?? 0;
    const c = representatives[indices[i + 2] ?? 0] ?? 0;
    if (a === b || b === c || c === a) continue;
    out[length++] = a;
    out[length++] = b;
    out[length++] = c;
  }
  return out.slice(0, length);
}

function meanEdge({ positions, indices, corners }: FineMesh): number {
  const stride = 3 * Math.max(1, Math.floor(corners / 3 / SAMPLES));
  let [sum, count] = [0, 0];
  for (let i = 0; i + 1 < corners; i += stride) {
    const [a, b] = [3 * (indices[i] ?? 0), 3 * (indices[i + 1] ?? 0)];
    const along = (axis: number) => (positions[a + axis] ?? 0) - (positions[b + axis] ?? 0);
    sum += Math.hypot(along(0), along(1), along(2));
    count += 1;
  }
  return sum / Math.max(1, count) || 1;
}

/**
 * Returns for each vertex the one it is merged into: the first vertex in its grid cell whose normal has the same main
 * direction. `cell` is the side of a cell, in mesh units.
 */
function clusterRepresentatives({ positions, normals, vertices }: FineMesh, cell: number): Uint32Array {
  const [low, wide] = extent(positions, vertices);
  const side = Math.floor(wide / cell) + 1;
  const at = (i: number, axis: number) => Math.floor(((positions[i + axis] ?? 0) - (low[axis] ?? 0)) / cell);
  const first = new Map<number, number>();
  const representatives = new Uint32Array(vertices);
  for (let vertex = 0; vertex < vertices; vertex++) {
    const i = 3 * vertex;
    const key = 6 * ((at(i, 0) * side + at(i, 1)) * side + at(i, 2)) + dominantFace(normals, i);
    const representative = first.get(key);
    if (representative === undefined) first.set(key, vertex);
    representatives[vertex] = representative ?? vertex;
  }
  return representatives;
}

/** Returns the lowest corner and the longest side of the bounding box of the first `vertices` points, packed xyz. */
function extent(positions: Float32Array, vertices: number): [number[], number] {
  const [low, high] = [Array(3).fill(Number.POSITIVE_INFINITY), Array(3).fill(Number.NEGATIVE_INFINITY)];
  for (let i = 0; i < 3 * vertices; i++) {
    const value = positions[i] ?? 0;
    if (value < low[i % 3]) low[i % 3] = value;
    if (value > high[i % 3]) high[i % 3] = value;
  }
  return [low, Math.max(0, ...low.map((value, axis) => high[axis] - value))];
}

/**
 * Returns the main direction of the normal at index `i` of `normals`, the face of a cube around the origin that it
 * intersects: 0 to 5 for −x, x, −y, y, −z, z.
 */
function dominantFace(normals: Float32Array, i: number): number {
  const [x, y, z] = [normals[i] ?? 0, normals[i + 1] ?? 0, normals[i + 2] ?? 0];
  const [ax, ay, az] = [Math.abs(x), Math.abs(y), Math.abs(z)];
  if (ax >= ay && ax >= az) return x < 0 ? 0 : 1;
  if (ay >= az) return y < 0 ? 2 : 3;
  return z < 0 ? 4 : 5;
}
