/** Returns the area of the triangle whose corners are `indices[at]` and the two after it. */
export function triangleArea(positions: ArrayLike<number>, indices: ArrayLike<number>, at: number): number {
  const coordinate = (corner: number, axis: number) => positions[3 * (indices[at + corner] ?? 0) + axis] ?? 0;
  const side = (end: number, axis: number) => coordinate(end, axis) - coordinate(0, axis);
  const [ax, ay, az] = [side(1, 0), side(1, 1), side(1, 2)];
  const [bx, by, bz] = [side(2, 0), side(2, 1), side(2, 2)];
  return Math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx) / 2;
}
