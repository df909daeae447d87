import { checkProperties } from './check.js';
import { checkListener, checkSignal } from './stepper.js';
import type { Vec3 } from './volume.js';

/**
 * Agreement between the surface of a {@link DeformableModel} and the iso-surface of its volume. The iso-surface is
 * extracted from the volume itself by marching cubes, closed at the border, without components and cavities that
 * enclose fewer voxels than `smallestPart`.
 */
export interface Coverage {
  /** Fraction of the iso-surface's area within one voxel of the surface, 0..1; 1 if there is no iso-surface. */
  recall: number;
  /** Fraction of the surface's area within one voxel of the iso-surface, 0..1; 1 if there is no surface. */
  precision: number;
  /**
   * Connected regions of the iso-surface whose triangles are not completely within one voxel of the surface, largest
   * first.
   */
  uncovered: UncoveredRegion[];
}

/**
 * A connected region of the iso-surface, made of the triangles that are at least in part farther than one voxel from
 * the surface.
 */
export interface UncoveredRegion {
  /** A point of the region near its middle, in world space. */
  position: Vec3;
  /** Area of the region, world units squared. */
  area: number;
  /** 'matter': part of the object lies outside the surface; 'cavity': background lies inside it. */
  kind: 'matter' | 'cavity';
}

/** Options of {@link DeformableModel.coverage}. */
export interface CoverageOptions {
  /** Aborts the measurement, which then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /**
   * Called with the fraction of the work done, up to 1. If it throws, the measurement ends and rejects with that error.
   */
  onProgress?: (share: number) => void;
}

/** Validates the options of a coverage measurement; throws `invalid-argument`. */
export function checkedCoverage(given: CoverageOptions | undefined): CoverageOptions {
  const options = checkProperties<CoverageOptions>('options', given, ['signal', 'onProgress']);
  checkSignal(options.signal);
  checkListener('onProgress', options.onProgress);
  return options;
}
