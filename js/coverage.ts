import { knownOnly } from './check.js';
import { checkListener, checkSignal } from './stepper.js';
import type { Vec3 } from './volume.js';

/**
 * How well the surface and the iso-surface of the volume agree. The iso-surface is that of the volume itself by marching
 * cubes, closed at the border, less the parts and hollows that enclose fewer voxels than `smallestPart`.
 */
export interface Coverage {
  /** Share of the iso-surface's area within one voxel of the surface, 0..1; 1 where there is no iso-surface. */
  recall: number;
  /** Share of the surface's area within one voxel of the iso-surface, 0..1; 1 where there is no surface. */
  precision: number;
  /** Connected parts of the iso-surface that are further away, largest first. */
  uncovered: UncoveredPart[];
}

/** A connected part of the iso-surface that the surface does not cover. */
export interface UncoveredPart {
  /** A point of it near its middle, in world space. */
  position: Vec3;
  /** Square world units. */
  area: number;
  /** 'matter': part of the object is outside the surface; 'hollow': background is inside it. */
  kind: 'matter' | 'hollow';
}

/** How {@link DeformableModel.coverage} works. */
export interface CoverageOptions {
  /** Stops the measurement, which rejects with `signal.reason`. */
  signal?: AbortSignal;
  /** Called with the share done, up to 1. What it throws ends the measurement, which rejects with it. */
  onProgress?: (share: number) => void;
}

/** The options of a measurement, or `invalid-argument`. */
export function checkedCoverage(given: CoverageOptions | undefined): CoverageOptions {
  const options = knownOnly<CoverageOptions>('options', given, ['signal', 'onProgress']);
  checkSignal(options.signal);
  checkListener('onProgress', options.onProgress);
  return options;
}
