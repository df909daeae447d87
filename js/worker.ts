/**
 * The same as `vesicle`, off the main thread: the library runs in a worker, and the page stays free.
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
 * **What is the same.** All names, arguments, results and errors of `vesicle`, to the bit. There is no `initSync`: a worker
 * does not start at once.
 *
 * **Promises.** Methods, functions and properties give promises: `await mesh.check()`, `await volume.dims`. What is a volume,
 * mesh or model comes back as an object here that stands for one in the worker. The worker does what it is asked in
 * order, so nothing need be awaited for the sake of order alone: `model.setParams(params); model.step();`. While a run is
 * under way, other things are done between its steps. Live meshes are there without a promise, `model.mesh.arrays()`, and
 * are the same object always.
 *
 * **New objects.** `new Volume(…)` gives an object at once, to be used at once. Where it cannot be made, what is asked of it
 * rejects with the reason. `await Volume.create(…)` gives one that is known to be made, or rejects itself.
 *
 * **Runs.** `run({ signal, onStep })` calls `onStep` here, which hears of steps that are over while the worker goes on. When
 * the signal aborts, or `onStep` throws, the worker stops after the step it is at, so it may be some steps ahead of the
 * last report; the promise then rejects with `signal.reason`, or with what was thrown. `coverage({ signal, onProgress })` works
 * the same way.
 *
 * **Arrays.** Typed arrays are copied, once; {@link transfer} hands them over instead. Those of results are handed over by the
 * worker. `mesh.copyTo(out)` sends the buffers of `out` there and back: `out` has empty arrays until the promise resolves,
 * and then new arrays over the same memory where there was room.
 *
 * **Errors.** A {@link VesicleError} has its code. A {@link VesicleCrash}, or a worker that ended by itself (also a
 * `VesicleCrash`), rejects all that waits and all that comes after, until `init` starts a fresh worker; objects made
 * before are `freed` then. Arguments that cannot be sent are refused with `invalid-argument`, {@link transfer} too where
 * a buffer cannot be handed over.
 *
 * **Memory.** `free()` gives back what an object has in the worker; so does the garbage collection of objects that nobody
 * holds any more, some time. {@link terminate} ends it all. In Node a worker that nobody waits for does not keep the
 * program from ending.
 *
 * **Where the worker comes from.** From `worker-host.js` beside this file, as a module worker; Vite and webpack know the words
 * and bundle it. From another origin it is started by way of a `blob:`, which a content security policy has to allow
 * in `worker-src`. For other bundlers make a worker of `vesicle/worker-host` and give it to `init`. In Node it
 * runs on `node:worker_threads`.
 *
 * @module vesicle/worker
 */
import type * as vesicle from './index.js';
import { remoteClasses, remoteFunction } from './worker-remote.js';
import type * as there from './worker-types.js';

export { VesicleCrash, VesicleError } from './error.js';
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
  FrameFacts,
  ImplicitOptions,
  ImplicitParams,
  InitInput,
  MeshArrays,
  MeshFormat,
  MeshHit,
  MeshInfo,
  MeshReport,
  MeshTexture,
  MultiresParams,
  ParamSpec,
  PointEdits,
  RestructurePass,
  RunOptions,
  Space,
  StepReport,
  SurfaceDistance,
  TextureType,
  TrackingParams,
  UncoveredPart,
  Vec3,
  VolumeInit,
  VoxelArray,
} from './index.js';
export { transfer } from './worker-remote.js';
export type { NodeWorker } from './worker-session.js';
export { init as default, terminate, type WorkerInit } from './worker-start.js';
export type { Remote, Stepper } from './worker-types.js';

/** As in `vesicle`, with objects of the worker. */
export type DeformableOptions = there.There<vesicle.DeformableOptions>;
/** As in `vesicle`, with objects of the worker. */
export type DeformableStart = there.There<vesicle.DeformableStart>;
/** As in `vesicle`, with objects of the worker. */
export type MultiresOptions = there.There<vesicle.MultiresOptions>;
/** As in `vesicle`, with objects of the worker. */
export type TrackingOptions = there.There<vesicle.TrackingOptions>;

export type Volume = there.Volume;
export type Mesh = there.Mesh;
export type DeformableModel = there.DeformableModel;
export type ImplicitSurface = there.ImplicitSurface;
export type SurfaceTracker = there.SurfaceTracker;
export type MultiresolutionModel = there.MultiresolutionModel;

export const { Volume, Mesh, DeformableModel, ImplicitSurface, SurfaceTracker, MultiresolutionModel } = remoteClasses;

/** The version of the library in the worker. */
export const version = remoteFunction('version');
/** The parameters of a method, as in `vesicle`. */
export const paramSpecs = remoteFunction('paramSpecs');
/** Points of a file, as in `vesicle`. */
export const parsePoints = remoteFunction('parsePoints');
/** Meshes one after the other as an animated glb, as in `vesicle`. */
export const animationGlb = remoteFunction('animationGlb');
