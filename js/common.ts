// Exports that all entry points of the package share: volumes, meshes, files and errors.
import { call } from './runtime.js';
import { version as rawVersion } from './vesicle.js';

export type {
  Bytes,
  DataOptions,
  DataReport,
  LargeVolume,
  LengthUnit,
  MeshExtra,
  MeshFileOptions,
  MeshTexture,
  NamedFile,
  PointArray,
  Space,
  SpaceOptions,
  TextureType,
  Vec3,
  VolumeFileOptions,
  VolumeInit,
  VoxelArray,
} from './data.js';
export { type ErrorCode, NeedsDataError, VesicleCrash, VesicleError } from './error.js';
export {
  type CurvatureKind,
  type Icosphere,
  Mesh,
  type MeshArrays,
  type MeshFormat,
  type MeshHit,
  type MeshInfo,
  type MeshInSlices,
  type MeshReport,
  type MeshSnapshot,
  type PositionOptions,
  type RestructurePass,
  type SurfaceDistance,
  type VoxelKind,
} from './mesh.js';
export type { ParamSpec } from './params.js';
export { type InitInput, init as default, initSync, type ModuleOptions } from './runtime.js';
export type { RunOptions, SliceOptions, Stepper, StepReport } from './stepper.js';
export { Volume, type VolumeFormat, type VolumeInSlices } from './volume.js';
export type { Warning, WarningCode } from './warning.js';

/** Returns the version of the package. */
export function version(): string {
  return call(rawVersion);
}
