import { typedArray } from './check.js';
import type { PointArray, PointData } from './data.js';
import { call } from './runtime.js';
import { RawPoints } from './vesicle.js';
import type { Warning } from './warning.js';

/**
 * Parses points from a file: PLY, OBJ, XYZ, PTS or CSV, detected from the bytes. Returns packed arrays, as in
 * {@link ImplicitOptions}; colours are rgb, 0..1.
 *
 * @throws {@link VesicleError} `bad-file` naming the format and the field or line.
 */
export function parsePoints(bytes: Uint8Array): PointData {
  typedArray('bytes', bytes, Uint8Array);
  return call(() => {
    const raw = RawPoints.parse(bytes);
    const [points, normals, colors] = [raw.points() as PointArray, raw.normals(), raw.colors()];
    const warnings = raw.warnings() as Warning[];
    raw.free();
    return {
      points,
      ...(normals && { normals }),
      ...(colors && { colors }),
      ...(warnings.length > 0 && { warnings }),
    };
  });
}
