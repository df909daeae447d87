/**
 * Vesicle fits closed triangle meshes to 3D data; the meshes split, merge and refine themselves on the way.
 *
 * Points are packed xyz in a `Float32Array`, triangles packed abc in a `Uint32Array`, counter-clockwise seen from
 * outside. "World" is the volume's world space, in mm if the file says mm.
 *
 * @module vesicle
 */
import { type ParamSpec, paramSpecsOf } from './params.js';
import {
  deformableParamSpecs,
  implicitParamSpecs,
  labelParamSpecs,
  multiresParamSpecs,
  trackingParamSpecs,
} from './vesicle.js';

export { animationGlb } from './animation.js';
export * from './common.js';
export { default } from './common.js';
export type { Coverage, CoverageOptions, UncoveredRegion } from './coverage.js';
export type { PointData } from './data.js';
export * from './deformable.js';
export * from './implicit.js';
export * from './label-surfaces.js';
export * from './multires.js';
export * from './points.js';
export * from './tracking.js';

const specsOf = paramSpecsOf({
  deformable: deformableParamSpecs,
  implicit: implicitParamSpecs,
  tracking: trackingParamSpecs,
  multires: multiresParamSpecs,
  labels: labelParamSpecs,
});

/**
 * Returns descriptions of the parameters of a method, in their recommended order of display.
 *
 * @throws {@link VesicleError} `invalid-argument`: no such method.
 */
export function paramSpecs(method: 'deformable' | 'implicit' | 'tracking' | 'multires' | 'labels'): ParamSpec[] {
  return specsOf(method);
}
