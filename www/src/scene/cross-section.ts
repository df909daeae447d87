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
  const [x, y, z] = origin.map((value, axis) => value - (from[axis] ?? 0)) as Vec3;
  const offset = normal[0] * x + normal[1] * y + normal[2] * z;
  let below = 0;
  for (let i = 0; i < vertices; i++) {
    const height =
      normal[0] * (positions[3 * i] ?? 0) +
      normal[1] * (positions[3 * i + 1] ?? 0) +
      normal[2] * (positions[3 * i + 2] ?? 0) -
      offset;
    // A vertex in the plane counts as above it, so that each triangle is cut twice or not at all.
    heights[i] = height === 0 ? 1e-12 : height;
    if (height < 0) below += 1;
  }
  if (below === 0 || below === vertices) return new Float32Array();
  const out: number[] = [];
  for (let i = 0; i < 3 * triangles; i += 3) {
    for (let side = 0; side < 3; side++) {
      const [a, b] = [indices[i + side] ?? 0, indices[i + ((side + 1) % 3)] ?? 0];
      const [here, there] = [heights[a] ?? 0, heights[b] ?? 0];
      if (here > 0 === there > 0) continue;
      const part = here / (here - there);
      for (let k = 0; k < 3; k++) {
        const [x, y] = [positions[3 * a + k] ?? 0, positions[3 * b + k] ?? 0];
        out.push(x + part * (y - x));
      }
    }
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
