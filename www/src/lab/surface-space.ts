/** The space and unit of a volume, which are those of its surfaces. */

import type { ExportRequest, Unit, VolumeView } from '../engine/protocol';

/** Statements about positions in files of a surface: the directions of the axes, and the length of a unit. */
export type SurfaceSpace = Pick<ExportRequest, 'space' | 'unit'>;

/** Returns the unit of lengths that a volume's file states; empty if it states none. */
export function unitOf({ unit }: Pick<VolumeView, 'unit'>): Unit {
  return unit === 'um' ? 'µm' : (unit ?? '');
}

/** Returns what files state of surfaces of a volume, whose unit is `unit`. */
export function spaceOf({ space }: Pick<VolumeView, 'space'>, unit: Unit): SurfaceSpace {
  const known = unit === 'µm' ? 'um' : unit;
  return { space, ...(known && { unit: known }) };
}
