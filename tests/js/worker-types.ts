// Compiled, never run: the package in a worker has the same members as the package, with promises.
import { Worker as NodeWorker } from 'node:worker_threads';
import type * as built from '../../pkg/index.js';
import * as worker from '../../pkg/worker.js';

/** True if two types are identical. */
type Same<A, B> = (<T>() => T extends A ? 1 : 2) extends <T>() => T extends B ? 1 : 2 ? true : false;

/** Does not compile with `false`. */
const same = <T extends true>(holds: T): T => holds;

// All names, except those that a worker cannot have and those that only a worker has.
same<Same<Exclude<keyof typeof built, 'initSync'>, Exclude<keyof typeof worker, 'terminate' | 'transfer'>>>(true);

same<Same<worker.Volume['dims'], Promise<built.Vec3>>>(true);
same<Same<worker.Mesh['texture'], Promise<built.MeshTexture | undefined>>>(true);
same<Same<worker.ImplicitSurface['warning'], Promise<string | undefined>>>(true);
same<Same<worker.DeformableModel['params'], Promise<Required<built.DeformableParams>>>>(true);
same<Same<worker.DeformableModel['mesh'], worker.Mesh>>(true);
same<Same<worker.MultiresolutionModel['linkMesh'], worker.Mesh>>(true);
same<Same<ReturnType<worker.LabelSurfaces['mesh']>, Promise<worker.Mesh>>>(true);
same<Same<ReturnType<worker.Mesh['arrays']>, Promise<built.MeshArrays>>>(true);
same<Same<ReturnType<worker.Mesh['components']>, Promise<worker.Mesh[]>>>(true);
same<Same<Parameters<worker.MeshInSlices['distanceTo']>, [other: worker.Mesh]>>(true);
same<Same<ReturnType<worker.MeshInSlices['restructure']>, Promise<number>>>(true);
same<Same<ReturnType<worker.Mesh['inSlices']>, worker.MeshInSlices>>(true);
same<Same<ReturnType<worker.VolumeInSlices['enrichSlices']>, Promise<worker.Volume>>>(true);
same<Same<ReturnType<worker.Volume['inSlices']>, worker.VolumeInSlices>>(true);
same<Same<ReturnType<worker.ImplicitInSlices['toVolume']>, Promise<worker.Volume>>>(true);
same<Same<ReturnType<worker.ImplicitSurface['inSlices']>, worker.ImplicitInSlices>>(true);
same<Same<ReturnType<worker.Mesh['toVolume']>, Promise<worker.Volume>>>(true);
same<Same<Parameters<worker.Mesh['toVolume']>[0], worker.Volume>>(true);
same<Same<ReturnType<worker.Mesh['contains']>, Promise<Uint8Array>>>(true);
same<Same<ReturnType<worker.Volume['pyramid']>, Promise<worker.Volume[]>>>(true);
same<Same<ReturnType<worker.DeformableModel['run']>, Promise<built.StepReport>>>(true);
same<Same<ReturnType<worker.DeformableModel['coverage']>, Promise<built.Coverage>>>(true);
same<Same<ReturnType<worker.DeformableModel['seed']>, Promise<built.StepReport>>>(true);
same<Same<ReturnType<worker.DeformableModel['refresh']>, Promise<void>>>(true);
same<Same<ReturnType<worker.Mesh['free']>, void>>(true);
same<Same<ReturnType<typeof worker.Mesh.marchingCubes>, Promise<worker.Mesh>>>(true);
same<Same<ReturnType<typeof worker.DeformableModel.create>, Promise<worker.DeformableModel>>>(true);
same<Same<ReturnType<typeof worker.MultiresolutionModel.create>, Promise<worker.MultiresolutionModel>>>(true);
same<Same<Parameters<worker.Volume['histogram']>['length'], 1 | 2>>(true);
same<Same<Parameters<worker.Mesh['distanceTo']>, [other: worker.Mesh]>>(true);
same<Same<Parameters<typeof worker.paramSpecs>, Parameters<typeof built.paramSpecs>>>(true);
same<Same<Awaited<ReturnType<typeof worker.version>>, string>>(true);

export const stepper = (model: worker.DeformableModel): worker.Stepper => model;
export const steppers = (
  model: worker.ImplicitSurface | worker.SurfaceTracker | worker.MultiresolutionModel,
): worker.Stepper => model;
export const isMesh = (value: unknown): value is worker.Mesh => value instanceof worker.Mesh;
export const newModel = (volume: worker.Volume, start: worker.Mesh) => new worker.DeformableModel({ volume, start });
export const newTracker = (volume: worker.Volume) => new worker.SurfaceTracker({ volume, params: { window: 1 } });
export const joined = (frames: readonly worker.Mesh[]) => worker.animationGlb(frames, { frameSeconds: 1 });
export const inBrowser = (own: Worker) => worker.default({ worker: own });
export const inNode = () => worker.default({ worker: new NodeWorker('vesicle/worker-host') });
export const handed = (data: Uint16Array) => new worker.Volume({ data: worker.transfer(data), dims: [1, 1, 1] });

// Objects of one API are not accepted by the other, and meshes are not constructed by `new`.
// @ts-expect-error
export const mixed = (volume: built.Volume) => new worker.DeformableModel({ volume });
// @ts-expect-error
export const made = () => new worker.Mesh();
// @ts-expect-error
export const misspelled = (mesh: worker.Mesh) => mesh.area;

/** As of the package. */
export const file = async (mesh: worker.Mesh): Promise<Blob> => new Blob([await mesh.toBytes('stl')]);
