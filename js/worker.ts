/**
 * The API of `vesicle` off the main thread: the library runs in a worker, and the page stays responsive.
 *
 * ```js
 * import init, { DeformableModel, Volume } from 'vesicle/worker';
 *
 * await init();
 * const volume = await Volume.parse(new Uint8Array(await file.arrayBuffer()));
 * const model = new DeformableModel({ volume, levels: 1, params: { iso: 95, isoForce: -1 } });
 * const report = await model.run({ onStep: ({ iteration, vertices }) => console.log(iteration, vertices) });
 * const { positions, indices } = await model.mesh.arrays();
 * ```
 *
 * **The same API.** Names, arguments, results and errors are those of `vesicle`, and results are bit-identical. There
 * is no `initSync`: a worker cannot start synchronously.
 *
 * **Promises.** Methods, functions and properties return promises: `await mesh.check()`, `await volume.dims`. Volumes,
 * meshes and models are returned as proxies of objects in the worker. The worker handles requests in order, so nothing
 * need be awaited for the sake of order alone: `model.setParams(params); model.step();`. During a run, other requests
 * are handled between its slices of work. Live meshes, as in `model.mesh.arrays()`, are available without a promise, and are the
 * same object always.
 *
 * **New objects.** `new Volume(…)` returns an object that can be used at once. If it cannot be created, every promise
 * of the object rejects with the reason. `await Volume.create(…)` resolves once the object is created, or rejects
 * itself.
 *
 * **Runs.** `run({ signal, onStep })` calls `onStep` on the page, with reports of finished steps while the worker
 * continues. When the signal aborts, or `onStep` throws, the worker stops after its current slice of work, so it may be some
 * steps ahead of the last report; the promise then rejects with `signal.reason`, or with the error thrown.
 * `coverage({ signal, onProgress })` works the same way, and so do the operations of `mesh.inSlices({ signal })`, which
 * is available without a promise.
 *
 * **Arrays.** Typed arrays are copied, once; {@link transfer} transfers them instead. Those of results are transferred
 * by the worker. `mesh.copyTo(out)` transfers the buffers of `out` there and back: `out` has empty arrays until the
 * promise resolves, and then new arrays over the same memory where it was large enough. So does `mesh.snapshot(reuse)` with
 * those of `reuse`, which is drawn no more.
 *
 * **Errors.** A {@link VesicleError} has its code. After a {@link VesicleCrash}, or if the worker ended by itself (also
 * a `VesicleCrash`), all pending and later promises reject, until `init` starts a new worker; objects created before
 * throw `freed` from then on. Calls with arguments that `postMessage` cannot send, or with buffers that
 * {@link transfer} cannot transfer, reject with `invalid-argument`.
 *
 * **Memory.** `free()` frees an object's memory in the worker; so does garbage collection of unreachable objects, at
 * some later time. {@link terminate} ends the worker. In Node a worker without pending requests does not keep the
 * program from exiting.
 *
 * **Where the worker comes from.** From `worker-host.js` beside this file, as a module worker; Vite and webpack
 * recognise the expression and bundle it. From another origin it is started through a `blob:` URL, which a content
 * security policy has to allow in `worker-src`. For other bundlers create a worker from `vesicle/worker-host` and pass
 * it to `init`. In Node it runs on `node:worker_threads`.
 *
 * @module vesicle/worker
 */
import type * as vesicle from './index.js';
import { remoteClasses, remoteFunction } from './worker-remote.js';
import type * as there from './worker-types.js';

export type { NodeWorker } from './channel.js';
export { NeedsDataError, VesicleCrash, VesicleError } from './error.js';
export type {
  Attractor,
  Camera,
  ControlEllipsoid,
  Coverage,
  CoverageOptions,
  CurvatureKind,
  DeformableParams,
  ErrorCode,
  Fitness,
  FrameStatistics,
  Icosphere,
  ImplicitChoice,
  ImplicitOptions,
  ImplicitParams,
  InitInput,
  LabelParams,
  MeshArrays,
  MeshFormat,
  MeshHit,
  MeshInfo,
  MeshReport,
  MeshSnapshot,
  MeshTexture,
  ModuleOptions,
  MultiresParams,
  NamedFile,
  ParamSpec,
  PointEdits,
  RestructurePass,
  RunOptions,
  SliceOptions,
  Space,
  StepReport,
  SurfaceDistance,
  TextureType,
  TrackingParams,
  UncoveredRegion,
  Vec3,
  VolumeFileOptions,
  VolumeFormat,
  VolumeInit,
  VoxelArray,
  VoxelKind,
} from './index.js';
export { transfer } from './worker-remote.js';
export { init as default, terminate, type WorkerInit } from './worker-start.js';
export type { Remote, Stepper } from './worker-types.js';

/** Constructor options of a {@link DeformableModel} in the worker, as in `vesicle`. */
export type DeformableOptions = there.WithRemotes<vesicle.DeformableOptions>;
/** The initial surface of a {@link DeformableModel} in the worker, as in `vesicle`. */
export type DeformableStart = there.WithRemotes<vesicle.DeformableStart>;
/** Constructor options of {@link LabelSurfaces} in the worker, as in `vesicle`. */
export type LabelOptions = there.WithRemotes<vesicle.LabelOptions>;
/** Constructor options of a {@link MultiresolutionModel} in the worker, as in `vesicle`. */
export type MultiresOptions = there.WithRemotes<vesicle.MultiresOptions>;
/** Constructor options of a {@link SurfaceTracker} in the worker, as in `vesicle`. */
export type TrackingOptions = there.WithRemotes<vesicle.TrackingOptions>;

/** Operations of a {@link Mesh} in the worker in slices of work, as in `vesicle`. */
export type MeshInSlices = there.MeshInSlices;
/** Those of a {@link Volume}. */
export type VolumeInSlices = there.VolumeInSlices;
/** Those of an {@link ImplicitSurface}. */
export type ImplicitInSlices = there.ImplicitInSlices;

export type Volume = there.Volume;
export type Mesh = there.Mesh;
export type DeformableModel = there.DeformableModel;
export type ImplicitSurface = there.ImplicitSurface;
export type SurfaceTracker = there.SurfaceTracker;
export type MultiresolutionModel = there.MultiresolutionModel;
export type LabelSurfaces = there.LabelSurfaces;

export const { Volume, Mesh, DeformableModel, ImplicitSurface, SurfaceTracker, MultiresolutionModel, LabelSurfaces } =
  remoteClasses;

/** Returns the version of the library in the worker. */
export const version = remoteFunction('version');
/** Returns descriptions of a method's parameters, as in `vesicle`. */
export const paramSpecs = remoteFunction('paramSpecs');
/** Parses points from a file, as in `vesicle`. */
export const parsePoints = remoteFunction('parsePoints');
/** Encodes a sequence of meshes as an animated glb, as in `vesicle`. */
export const animationGlb = remoteFunction('animationGlb');
