/** Editing points by clicks in the Reconstruct lab's view. */
import { pointsAt } from '../../engine/placing';
import type { PointArray, Vec3 } from '../../engine/protocol';
import type { EditTool } from './panels/edit-tools';
import type { Edits } from './protocol';
import type { Hit } from './scene';

export const NO_EDITS: Edits = { added: [], removed: [], outside: [] };

/**
 * Returns the manual edits of the points after a click with a tool; undefined if the click changes nothing. `distance`,
 * in world units, is the offset of a new point, or of a point marked as outside, along the outward normal of the
 * surface; if the click missed the surface, the point is not offset. Its magnitude is the radius for removal.
 */
export function applyClick(
  tool: EditTool,
  { point, normal }: Hit,
  distance: number,
  edits: Edits,
  points: PointArray,
): Edits | undefined {
  const position = normal ? (point.map((x, axis) => x + distance * (normal[axis] ?? 0)) as Vec3) : point;
  switch (tool) {
    case 'add':
      return { ...edits, added: [...edits.added, position] };
    case 'outside':
      return { ...edits, outside: [...edits.outside, position] };
    case 'remove':
      return removeNear(point, Math.abs(distance), edits, points);
    default:
      return undefined;
  }
}

/**
 * Returns the manual edits with all points within `radius` (world units) of the position `place` removed, including
 * those added by hand; undefined if there are no such points.
 */
function removeNear(place: Vec3, radius: number, edits: Edits, points: PointArray): Edits | undefined {
  const near = (x = 0, y = 0, z = 0) => Math.hypot(x - place[0], y - place[1], z - place[2]) <= radius;
  const gone = new Set(edits.removed);
  const found: number[] = [];
  for (let i = 0; i < points.length / 3; i++) {
    if (!gone.has(i) && near(points[3 * i], points[3 * i + 1], points[3 * i + 2])) found.push(i);
  }
  const added = edits.added.filter((point) => !near(...point));
  if (found.length === 0 && added.length === edits.added.length) return undefined;
  return { ...edits, added, removed: [...edits.removed, ...found] };
}

/**
 * Returns the positions or colours of points, packed triples, without those of the points with the indices `removed`.
 */
export function withoutRemoved<Points extends PointArray>(values: Points, removed: readonly number[]): Points {
  if (removed.length === 0) return values;
  const gone = new Set(removed);
  const indices = Uint32Array.from({ length: values.length / 3 }, (_, i) => i);
  return pointsAt(
    values,
    indices.filter((i) => !gone.has(i)),
  );
}
