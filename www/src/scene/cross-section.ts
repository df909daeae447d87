/** Intersects a surface with a plane, and the resulting segments with a row of an image, to draw outlines on slices. */
import { inWorld } from '../engine/placing';
import type { Plane, PointArray, Surface, Vec3 } from '../engine/protocol';

/**
 * Returns the cross-section of a surface with a plane, as segments: pairs of points in world coordinates, packed xyz.
 */
export function crossSection(
  { positions, indices, vertices, triangles, origin: from }: Surface,
  { origin, normal }: Plane,
): PointArray {
  const heights = new Float32Array(vertices);
  const above = new Uint8Array(vertices);
  const [nx, ny, nz] = normal;
  const [x, y, z] = origin.map((value, axis) => value - (from[axis] ?? 0)) as Vec3;
  const offset = nx * x + ny * y + nz * z;
  let count = 0;
  for (let v = 0, i = 0; v < vertices; v++, i += 3) {
    const height =
      nx * (positions[i] as number) + ny * (positions[i + 1] as number) + nz * (positions[i + 2] as number);
    heights[v] = height - offset;
    // A vertex in the plane counts as above it, so that each triangle is cut twice or not at all.
    if (height < offset) continue;
    above[v] = 1;
    count += 1;
  }
  if (count === 0 || count === vertices) return new Float32Array();
  const out: number[] = [];
  const cut = (a: number, b: number) => {
    if (above[a] === above[b]) return;
    const here = heights[a] as number;
    const part = here / (here - (heights[b] as number));
    for (let k = 0; k < 3; k++) {
      const first = positions[3 * a + k] as number;
      out.push(first + part * ((positions[3 * b + k] as number) - first));
    }
  };
  for (let i = 0; i < 3 * triangles; i += 3) {
    const [a, b, c] = [indices[i] as number, indices[i + 1] as number, indices[i + 2] as number];
    const corners = (above[a] as number) + (above[b] as number) + (above[c] as number);
    if (corners === 0 || corners === 3) continue;
    cut(a, b);
    cut(b, c);
    cut(c, a);
  }
  return inWorld(Float32Array.from(out), from);
}

/**
 * Returns the x coordinates, sorted, at which segments in an image (x y x y each, in pixels) cross the row y =
 * `height`.
 */
export function intersectionsWithRow(segments: Float32Array, height: number): number[] {
  const out: number[] = [];
  for (let i = 0; i + 3 < segments.length; i += 4) {
    const [x1 = 0, y1 = 0, x2 = 0, y2 = 0] = segments.subarray(i, i + 4);
    if (y1 > height === y2 > height) continue;
    out.push(x1 + ((height - y1) / (y2 - y1)) * (x2 - x1));
  }
  return out.sort((a, b) => a - b);
}
