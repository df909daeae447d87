// A lava lamp whose two balls separate and join again, as a hash of the bits of its positions. The function is
// self-contained, so that it can be sent to a browser.
import type * as Package from '../../pkg/index.js';

/** FNV-1a hash over all positions that the core gives natively (`tests/core/multires.rs`). */
export const LAMP_BITS = '82280a25d547c21c';

export function lampBits({ MultiresolutionModel }: typeof Package): string {
  const ball = (x: number, radius: number): Package.ControlEllipsoid => ({
    center: [x, 0, 0],
    axes: [
      [radius, 0, 0],
      [0, radius, 0],
      [0, 0, radius],
    ],
  });
  const model = new MultiresolutionModel({
    ellipsoids: [ball(-0.75, 0.75), ball(0.5, 0.75)],
    params: { edgeMin: 0.125, edgeMax: 0.28125, topology: 'split-and-join' },
  });
  for (let frame = 1; frame <= 16; frame++) {
    const x = frame <= 10 ? 0.5 + 0.125 * frame : 1.75 - 0.125 * (frame - 10);
    model.setEllipsoids([ball(-0.75, 0.75), ball(x, 0.75)]);
    model.step();
  }
  const { positions } = model.mesh.arrays();
  model.free();
  let hash = 0xcbf29ce484222325n;
  for (const byte of new Uint8Array(positions.buffer, positions.byteOffset, positions.byteLength)) {
    hash = ((hash ^ BigInt(byte)) * 0x100000001b3n) & 0xffffffffffffffffn;
  }
  return hash.toString(16).padStart(16, '0');
}
