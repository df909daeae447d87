// Compiled, never run: the package satisfies the contract, and its data types equal those of the contract.
import * as built from '../../pkg/index.js';
import type * as contract from './contract.js';

/** True if two types are identical. */
type Same<A, B> = (<T>() => T extends A ? 1 : 2) extends <T>() => T extends B ? 1 : 2 ? true : false;

/** Does not compile with `false`. */
const same = <T extends true>(holds: T): T => holds;

same<Same<built.InitInput, contract.InitInput>>(true);
same<Same<built.VesicleError['code'], contract.VesicleError['code']>>(true);
same<Same<built.Vec3, contract.Vec3>>(true);
same<Same<built.VoxelArray, contract.VoxelArray>>(true);
same<Same<Omit<built.VolumeInit, 'unit' | 'warnings'>, contract.VolumeInit>>(true);
same<Same<built.VolumeFormat, contract.VolumeFormat>>(true);
same<Same<built.MeshArrays, contract.MeshArrays>>(true);
same<Same<built.MeshInfo, contract.MeshInfo>>(true);
same<Same<Omit<built.MeshReport, 'hasMore'>, contract.MeshReport>>(true);
same<Same<built.MeshFormat, contract.MeshFormat>>(true);
// The codes of warnings are more with each version.
same<Same<Omit<built.StepReport, 'warnings'>, contract.StepReport>>(true);
export const warnings = ({ warnings }: built.StepReport): contract.Warning[] => warnings;
same<Same<Omit<built.RunOptions, 'onStep'>, Omit<contract.RunOptions, 'onStep'>>>(true);
same<Same<built.ParamSpec, contract.ParamSpec>>(true);
same<Same<built.DeformableParams, contract.DeformableParams>>(true);
same<Same<built.Coverage, contract.Coverage>>(true);
same<Same<built.UncoveredRegion, contract.UncoveredRegion>>(true);
same<Same<built.CoverageOptions, contract.CoverageOptions>>(true);
same<Same<built.Attractor, contract.Attractor>>(true);
same<Same<built.Camera, contract.Camera>>(true);
same<Same<built.ImplicitParams, contract.ImplicitParams>>(true);
same<Same<built.TrackingParams, contract.TrackingParams>>(true);
same<Same<built.FrameStatistics, contract.FrameStatistics>>(true);
same<Same<built.ControlEllipsoid, contract.ControlEllipsoid>>(true);
same<Same<built.MultiresParams, contract.MultiresParams>>(true);

/** The static members of a class, without its constructor. */
type Statics<C> = Omit<C, 'prototype'>;

export const init: typeof contract.default = built.default;
export const initSync: typeof contract.initSync = built.initSync;
export const version: typeof contract.version = built.version;
export const paramSpecs: typeof contract.paramSpecs = built.paramSpecs;

export const error = (error: built.VesicleError): contract.VesicleError => error;
export const volume = (volume: built.Volume): contract.Volume => volume;
export const mesh = (mesh: built.Mesh): contract.Mesh => mesh;
export const stepper = (stepper: built.Stepper): contract.Stepper => stepper;
export const model = (model: built.DeformableModel): contract.DeformableModel & built.Stepper => model;

export const parsePoints: typeof contract.parsePoints = built.parsePoints;
export const implicit = (surface: built.ImplicitSurface): contract.ImplicitSurface & built.Stepper => surface;

export const Volume: Statics<typeof contract.Volume> = built.Volume;
export const Mesh: Statics<typeof contract.Mesh> = built.Mesh;

// Arguments: the package accepts whatever the contract accepts.
export const newVolume = (init: contract.VolumeInit) => new built.Volume(init);

type ModelOptions = ConstructorParameters<typeof contract.DeformableModel>[0];
/** The same options with the package's own classes, which structurally similar types cannot replace. */
type Own<T> = { [K in keyof T]: Swap<T[K]> };
type Swap<T> = T extends contract.Volume ? built.Volume : T extends contract.Mesh ? built.Mesh : T;
export const newModel = (options: Own<ModelOptions>) => new built.DeformableModel(options);

type SurfaceOptions = ConstructorParameters<typeof contract.ImplicitSurface>[0];
export const newSurface = (options: SurfaceOptions) => new built.ImplicitSurface(options);

export const tracker = (tracker: built.SurfaceTracker): contract.SurfaceTracker & built.Stepper => tracker;
export const newTracker = (options: Own<contract.TrackingOptions>) => new built.SurfaceTracker(options);

export const multires = (model: built.MultiresolutionModel): contract.MultiresolutionModel & built.Stepper => model;

type MultiresOptions = ConstructorParameters<typeof contract.MultiresolutionModel>[0];
export const newMultires = (options: Own<MultiresOptions>) => new built.MultiresolutionModel(options);

/** Files of the browser from all that is written, in strict TypeScript. */
export const files = (mesh: built.Mesh, volume: built.Volume, model: built.DeformableModel): Blob =>
  new Blob([mesh.toBytes('stl'), volume.toNifti(), volume.toBytes('nrrd'), model.save(), built.animationGlb([mesh])]);
