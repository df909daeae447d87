/**
 * Vesicle fits closed triangle meshes to 3D data; the meshes split, merge and refine themselves on the way.
 *
 * Points are packed xyz in a `Float32Array`, triangles packed abc in a `Uint32Array`, counter-clockwise seen from
 * outside. "World" is the volume's world space, in mm if the file says mm.
 *
 * @module vesicle
 */
import { call } from './runtime.js';
import { version as rawVersion } from './vesicle.js';

export { animationGlb } from './animation.js';
export type { Coverage, CoverageOptions, UncoveredRegion } from './coverage.js';
export {
  type Attractor,
  DeformableModel,
  type DeformableOptions,
  type DeformableParams,
  type DeformableStart,
} from './deformable.js';
export { type ErrorCode, VesicleCrash, VesicleError } from './error.js';
export {
  type Camera,
  type Fitness,
  type ImplicitOptions,
  type ImplicitParams,
  ImplicitSurface,
  type PointEdits,
  parsePoints,
} from './implicit.js';
export {
  type CurvatureKind,
  Mesh,
  type MeshArrays,
  type MeshFormat,
  type MeshHit,
  type MeshInfo,
  type MeshReport,
  type MeshTexture,
  type RestructurePass,
  type SurfaceDistance,
  type TextureType,
} from './mesh.js';
export {
  type ControlEllipsoid,
  type MultiresOptions,
  MultiresolutionModel,
  type MultiresParams,
} from './multires.js';
export { type ParamSpec, paramSpecs } from './params.js';
export { type InitInput, init as default, initSync } from './runtime.js';
export type { RunOptions, Stepper, StepReport } from './stepper.js';
export {
  type FrameStatistics,
  SurfaceTracker,
  type TrackingOptions,
  type TrackingParams,
} from './tracking.js';
export { type Space, type Vec3, Volume, type VolumeInit, type VoxelArray } from './volume.js';

/** Returns the version of the package. */
export function version(): string {
  return call(rawVersion);
}
