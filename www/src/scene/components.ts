/**
 * Colours of connected components, distinguishable with the common kinds of colour blindness (Okabe and Ito 2008), as
 * linear rgb.
 */
const PALETTE: [number, number, number][] = [
  [0.902, 0.624, 0],
  [0.337, 0.706, 0.914],
  [0, 0.62, 0.451],
  [0.8, 0.475, 0.655],
  [0.941, 0.894, 0.259],
  [0, 0.447, 0.698],
  [0.835, 0.369, 0],
].map((rgb) => rgb.map((c) => c ** 2.2) as [number, number, number]);

/**
 * Returns for each of the `vertices` vertices of a mesh the smallest vertex index of its connected component. Triangles
 * are given by the first `length` entries of `indices`, three each.
 */
export function componentRoots(indices: Uint32Array, length: number, vertices: number): Uint32Array {
  const parent = Uint32Array.from({ length: vertices }, (_, i) => i);
  const find = (start: number) => {
    let vertex = start;
    while (parent[vertex] !== vertex) {
      const up = parent[vertex] ?? vertex;
      parent[vertex] = parent[up] ?? up;
      vertex = up;
    }
    return vertex;
  };
  for (let i = 0; i < length; i++) {
    const next = i % 3 === 2 ? i - 2 : i + 1;
    const a = find(indices[i] ?? 0);
    const b = find(indices[next] ?? 0);
    if (a < b) parent[b] = a;
    else parent[a] = b;
  }
  return parent.map((_, vertex) => find(vertex));
}

/**
 * Writes a colour per vertex, linear rgb, into `out`: the same for all vertices of a connected component. Components
 * are ranked by number of vertices, so that the largest keeps its colour as it grows; after the seventh, the colours
 * repeat. Triangles are given by the first `length` entries of `indices`.
 */
export function componentColors(indices: Uint32Array, length: number, vertices: number, out: Float32Array): void {
  const roots = componentRoots(indices, length, vertices);
  const sizes = new Map<number, number>();
  for (const root of roots) sizes.set(root, (sizes.get(root) ?? 0) + 1);
  const ranked = [...sizes].sort((a, b) => b[1] - a[1] || a[0] - b[0]);
  const colors = new Map(ranked.map(([root], rank) => [root, PALETTE[rank % PALETTE.length]]));
  roots.forEach((root, vertex) => {
    out.set(colors.get(root) ?? [1, 1, 1], 3 * vertex);
  });
}
