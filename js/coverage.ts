import { checkProperties } from './check.js';
import type { Vec3 } from './data.js';
import { checkListener, checkSignal } from './stepper.js';

/**
 * Agreement between the surface of a {@link DeformableModel} and the iso-surface of its volume, as measured by
 * {@link DeformableModel.coverage}. The iso-surface is extracted from the volume itself by marching cubes, closed at
 * the border, without components and cavities that enclose fewer voxels than `smallestPart`.
 */
export interface Coverage {
  /**
   * Fraction of the area of the volume's iso-surface that is within one voxel of the model's surface, 0..1; 1 if there
   * is no iso-surface.
   */
  recall: number;
  /**
   * Fraction of the area of the model's surface that is within one voxel of the volume's iso-surface, 0..1; 1 if the
   * model's surface is empty.
   */
  precision: number;
  /**
   * Connected regions of the volume's iso-surface whose triangles are not completely within one voxel of the model's
   * surface, largest first.
   */
  uncovered: UncoveredRegion[];
}

/**
 * A connected region of a volume's iso-surface that the surface of a {@link DeformableModel} does not cover: each of
 * its triangles is at least in part farther than one voxel from that surface.
 */
export interface UncoveredRegion {
  /** A point on the uncovered region near its middle, in world space, at which a view can mark the region. */
  position: Vec3;
  /** Area of the uncovered region, world units squared. */
  area: number;
  /**
   * Kind of error of the model's surface at the region: 'matter' if part of the object is outside the surface, 'cavity'
   * if background is inside.
   */
  kind: 'matter' | 'cavity';
}

/** Options of {@link DeformableModel.coverage}. */
export interface CoverageOptions {
  /** Aborts the coverage measurement, which then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /**
   * Called repeatedly with the fraction of the coverage measurement that is done, up to 1. If it throws, the
   * measurement ends and rejects with that error.
   */
  onProgress?: (share: number) => void;
}

/**
 * Returns the options of a coverage measurement once they are checked; throws `invalid-argument` for an unknown or
 * wrong one.
 */
export function checkedCoverage(given: CoverageOptions | undefined): CoverageOptions {
  const options = checkProperties<CoverageOptions>('options', given, ['signal', 'onProgress']);
  checkSignal(options.signal);
  checkListener('onProgress', options.onProgress);
  return options;
}
