/** Data far from the origin of world space, as surveys have them, for tests. */
import type { Vec3 } from '../../www/src/engine/protocol';

/** Metres in a zone of the Universal Transverse Mercator: between two of these, single precision is half a metre. */
export const FAR: Vec3 = [500_000.123, 5_405_590.456, 350.789];

/** Returns points on a ball, packed xyz, at even distances, with three decimals. */
export function ballPoints([x, y, z]: Vec3, radius: number, spacing: number): Float64Array {
  const count = Math.round((4 * Math.PI * radius ** 2) / spacing ** 2);
  const points = new Float64Array(3 * count);
  for (let i = 0; i < count; i++) {
    const height = 1 - (2 * i + 1) / count;
    const [flat, turn] = [Math.sqrt(1 - height ** 2), Math.PI * (1 + Math.sqrt(5)) * i];
    const at = [x + radius * flat * Math.cos(turn), y + radius * flat * Math.sin(turn), z + radius * height];
    for (const [axis, value] of at.entries()) points[3 * i + axis] = Number(value.toFixed(3));
  }
  return points;
}

/** Returns points as text, three coordinates a line. */
export function asText(points: Float64Array): Uint8Array {
  const lines = Array.from({ length: points.length / 3 }, (_, i) => points.subarray(3 * i, 3 * i + 3).join(' '));
  return new TextEncoder().encode(`${lines.join('\n')}\n`);
}

/** Returns how far points, packed xyz, are at most from the surface of a ball. */
export function offBall(points: ArrayLike<number>, [x, y, z]: Vec3, radius: number): number {
  let most = 0;
  for (let i = 0; i < points.length; i += 3) {
    const [a = 0, b = 0, c = 0] = [points[i], points[i + 1], points[i + 2]];
    most = Math.max(most, Math.abs(Math.hypot(a - x, b - y, c - z) - radius));
  }
  return most;
}
