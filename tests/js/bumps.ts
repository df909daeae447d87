// The implicit surface of 400 points of a bumpy ellipsoid, as a hash of the bits of its positions. The function is
// self-contained, so that it can be sent to a browser.
import type * as Package from '../../pkg/index.js';

/** FNV-1a hash over all positions that the core gives natively (`tests/core/implicit.rs`). */
export const BUMPS_BITS = '374a46a66599111a';

export function bumpsBits({ ImplicitSurface }: typeof Package): string {
  // Evenly distributed in the cube: multiples of three irrational numbers without their whole parts.
  const coordinate = (share: number, k: number) => ((share * k) % 1) * 2 - 1;
  const points: number[] = [];
  for (let k = 1; points.length < 3 * 400; k++) {
    const p = [coordinate(0.819172513, k), coordinate(0.671043607, k), coordinate(0.549700478, k)] as const;
    const length = Math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    if (!(length > 0.5 && length < 1)) continue;
    const [x, y, z] = [p[0] / length, p[1] / length, p[2] / length];
    const radius = 1 + 2 * x * x * y * y * z * z;
    points.push(x * radius, 0.8 * y * radius, 0.7 * z * radius);
  }
  const paper = { delta: 5, lambdaSurface: 0.001, lambdaExterior: 2, sides: 'outside' } as const;
  const surface = new ImplicitSurface({ points: Float32Array.from(points), params: { ...paper, cell: 0.05 } });
  while (!surface.step().done);
  const { positions } = surface.mesh.arrays();
  let hash = 0xcbf29ce484222325n;
  for (const byte of new Uint8Array(positions.buffer, positions.byteOffset, positions.byteLength)) {
    hash = ((hash ^ BigInt(byte)) * 0x100000001b3n) & 0xffffffffffffffffn;
  }
  return hash.toString(16).padStart(16, '0');
}
