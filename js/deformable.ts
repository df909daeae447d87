import {
  checkProperties,
  denseCopy,
  integer,
  invalid,
  number,
  pointArray,
  positive,
  shallowCopy,
  typedArray,
  vec3,
} from './check.js';
import { type Coverage, type CoverageOptions, checkedCoverage } from './coverage.js';
import type { Bytes, DataOptions, LargeVolume, PointArray, Vec3, VoxelArray } from './data.js';
import { NeedsDataError } from './error.js';
import { Mesh, meshHandle, wrapMesh } from './mesh.js';
import { frameOf } from './mesh-file.js';
import { Handle } from './runtime.js';
import { isOfSmall, isSmall, limitOf, MOST_VERTICES_OF_SMALL } from './small-files.js';
import { type SparseBox, type SparseSource, sparseSource, supply } from './sparse.js';
import {
  checkedSlices,
  checkListener,
  checkSignal,
  finishInSlices,
  type RunOptions,
  runInSlices,
  SlicedRunner,
  type SliceOptions,
  type Stepper,
  type StepReport,
} from './stepper.js';
// The module of one method lacks volumes larger than memory.
import * as glue from './vesicle.js';
import { RawDeformable, RawDeformableCreation, RawDeformableOptions, RawStart, type RawVolume } from './vesicle.js';
import { checkedRegion, type Volume, volumeHandle } from './volume.js';
import { ModelWarnings } from './warnings.js';

/** Parameters of the deformable model; `paramSpecs('deformable')` has their ranges, defaults and descriptions. */
export interface DeformableParams {
  /**
   * Iso value, πI: intensity at the surface, in intensity units of the volume; default the middle of the volume's
   * intensity range.
   */
  iso?: number;
  /**
   * Strength of the iso force, αI, which moves the surface along its normal to the iso-surface; negative (default −1)
   * for an object brighter than `iso`, positive for a darker one.
   */
  isoForce?: number;
  /** Strength of the gradient force's normal component, αg; positive values pull towards bright ridges of the image. */
  gradientNormal?: number;
  /**
   * Strength of the gradient force's tangential component, βg; positive values pull vertices along the surface towards
   * bright ridges of the image.
   */
  gradientTangent?: number;
  /**
   * Length to which longer image gradients are shortened in the gradient force, in intensity ranges of the volume per
   * voxel.
   */
  gradientBound?: number;
  /** Resistance of the surface to bending, αc: larger values give a smoother surface. */
  rigidity?: number;
  /** Stiffness of the edges as springs, αe: small values even out the triangles, large ones shrink the surface. */
  stiffness?: number;
  /**
   * Rest length of the edges as springs: 'zero' (the default), 'mean' for the mean edge length, or a length in world
   * units.
   */
  restLength?: 'zero' | 'mean' | number;
  /** Mass of a vertex, m: heavier ones start and stop more slowly. */
  mass?: number;
  /** Damping coefficient, γ: friction that slows the vertices down. */
  damping?: number;
  /**
   * Integrator of the equation of motion: 'implicit' (the default) takes long steps, needs the fewest of them, and is
   * stable for all parameters; 'euler' is that of the paper, and stable for `rigidity` up to 0.4 and `damping` up to 1;
   * 'runge-kutta' evaluates the forces four times a step, and is stable for `rigidity` up to 3.
   */
  integrator?: 'euler' | 'runge-kutta' | 'implicit';
  /** Time step, Δt, of one iteration of 'euler' and 'runge-kutta'; an iteration of 'implicit' covers 16 time steps. */
  timeStep?: number;
  /**
   * Largest displacement of a vertex in one iteration, as a fraction of the sampling distance
   * {@link DeformableModel.delta}.
   */
  maxMove?: number;
  /**
   * ε: a pyramid level converges only when the mean kinetic energy of the vertices along their normals, with speeds in
   * sampling distances δ per unit of time, is below this.
   */
  energyTolerance?: number;
  /**
   * 'adaptive' (the default): edges are split, collapsed and flipped, and the surface may split and merge. 'fixed':
   * only vertices move.
   */
  topology?: 'adaptive' | 'fixed';
  /**
   * Local adaptation of the surface to the image, 0..1; default 1. Any value above 0 preserves walls and gaps that the
   * image shows, however thin, and limits the rigidity; edge lengths vary with the curvature in proportion to the
   * value. At 0, or if `isoForce` is 0, parts of the surface closer than the contact distance are joined, as in the
   * paper.
   */
  adaptivity?: number;
  /**
   * Whether components and cavities that the image of a pyramid level shows but the surface lacks are added to it:
   * 'auto' (the default) in runs that start from the contour, 'on' in all runs, 'off' never.
   * {@link DeformableModel.seed} adds them on demand.
   */
  seeding?: 'auto' | 'on' | 'off';
  /** Separate components and cavities that enclose fewer voxels than this are ignored as noise; default 64. */
  smallestPart?: number;
}

/**
 * A spring that pulls vertices within `radius` of a point towards that point; see
 * {@link DeformableModel.setAttractors}.
 */
export interface Attractor {
  /** Position towards which vertices are pulled, in world space. */
  point: Vec3;
  /** Spring constant of the attractor; negative values push the surface away. */
  strength: number;
  /** Distance from `point` at which the force of the attractor has faded to 0, world units. */
  radius: number;
}

/**
 * The initial surface of a {@link DeformableModel}.
 *
 * - `'contour'`, for real data: the iso-surface of the coarsest level at `iso`, with its cavities, without components
 *   and cavities that enclose fewer voxels than `smallestPart`. If there is none, the model starts empty (components
 *   appear on finer levels, or with another `iso`), or from the enclosing surface if `seeding` is 'off', or if
 *   `adaptivity` or `isoForce` is 0.
 * - `'enclosing'`: a rounded box around everything brighter than `iso` on the coarsest level at construction (around
 *   the whole volume if nothing is, or if `isoForce` is not negative). This, bubbles and seeds are for teaching, and
 *   for objects without a usable iso-surface.
 * - `{ bubbles }`: a grid of n × n × n spheres, which grow and merge.
 * - `{ seeds, radius }`: spheres of this radius, in world units, around packed points in world space.
 * - `{ marchingCubes }`: the iso-surface of the coarsest level at the given intensity.
 * - A closed mesh without self-intersections, in world space; it is copied.
 */
export type DeformableStart =
  | 'contour'
  | 'enclosing'
  | { bubbles: number }
  | { seeds: PointArray; radius: number }
  | { marchingCubes: number }
  | Mesh;

/** Constructor options of a {@link DeformableModel}. */
export interface DeformableOptions {
  /**
   * The volume that the model is fitted to; it may be freed once the model is made, unless
   * {@link DeformableModel.refresh} is called later. Of a {@link LargeVolume}, such as that of `openZarr`, the coarsest
   * level is read whole, and of each finer one what is around the surface; it must not be freed before the model is done.
   */
  volume: Volume | LargeVolume;
  /** Index of the frame of a 4D volume that the model is fitted to; default 0. */
  frame?: number;
  /** Initial surface; default 'contour'. */
  start?: DeformableStart;
  /**
   * Number of pyramid levels above the volume itself, at most {@link DeformableModel.maxLevels}. With 0 (the default)
   * the surface is fitted to the volume itself from the first iteration. The voxels of each level are √3 times larger
   * than those of the next finer one; the surface starts on the coarsest level and is refined on each finer one.
   */
  levels?: number;
  /** Level of a {@link LargeVolume} at which the run ends; default 0. */
  finest?: number;
  /**
   * Box in which the levels of a {@link LargeVolume} are followed down to the finest, world space; default everywhere.
   * Outside of it the surface is that of level `outside`, by default the coarsest.
   */
  box?: { min: Vec3; max: Vec3; outside?: number };
  /**
   * Target edge length at the finest level, world units; default from the voxel size. If voxels are more than twice as
   * long as wide, the shorter sides count. At most 0.28 times the longest side of the volume, or twice the default if
   * that is more, and shorter than the object.
   */
  edge?: number;
  /**
   * Largest number of vertices of the surface; a run that would exceed it fails with `too-large`. By default, and at most,
   * 4 million, or 300,000 by default if the files of the volume have at most 128 KiB, all together: these may come from
   * anyone and unpack to a lattice of any size. Contours that the surface starts from, or is compared
   * with, have at most eight times as many triangles.
   */
  maxVertices?: number;
  /** Initial parameters: any subset; the others have their defaults. */
  params?: DeformableParams;
}

/** Options of {@link DeformableModel.run}. */
export interface DeformableRunOptions extends RunOptions {
  /** Called whenever something of a {@link LargeVolume} that the model waits for has been read. */
  onData?: DataOptions['onData'];
}

const OPTIONS = ['volume', 'frame', 'start', 'levels', 'finest', 'box', 'edge', 'maxVertices', 'params'];
const RUN_OPTIONS = ['signal', 'maxIterations', 'budgetMs', 'onStep', 'onData'];

/**
 * A deformable model: a closed surface that moves onto the object in a volume under image forces and internal forces,
 * and splits and merges on the way, coarse to fine.
 *
 * After Lachaud and Montanvert, "Deformable meshes with automated topology changes for coarse-to-fine 3D surface
 * extraction". The surface is in the volume's world space.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link DeformableModel.free}.
 */
export class DeformableModel implements Stepper {
  readonly #handle: Handle<RawDeformable>;
  readonly #meshHandle: Handle<import('./vesicle.js').RawMesh>;
  readonly #mesh: Mesh;
  readonly #volume: Handle<RawVolume> | undefined;
  readonly #sparse: SparseParts | undefined;
  readonly #runner: SlicedRunner<RawDeformable, Stepped>;
  readonly #warnings: ModelWarnings;
  /** Whether the surface may have few vertices only, as no more has been read of a large volume than a small file has. */
  #isBounded: boolean;

  /**
   * Creates a model with its initial surface, ready to step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter; `not-closed` or `self-intersecting`
   *   for a start mesh that is; `too-large`.
   */
  constructor(given: DeformableOptions) {
    const created = given instanceof Created ? given : undefined;
    const options = created ? created.options : checked(given);
    const source = sparseSource(options.volume);
    if (created) {
      this.#volume = created.volume;
      this.#handle = created.handle;
      this.#sparse = created.sparse;
    } else if (source) {
      const sparse = { source, volume: source.create() };
      this.#sparse = sparse;
      this.#handle = orFreed(sparse, () => {
        const make = onSparse(sparse, options, (...of) => RawDeformable.newSparse(...of));
        return new Handle('DeformableModel', make);
      });
    } else {
      this.#volume = volumeHandle('volume', options.volume as Volume);
      const make = dense(this.#volume, options, (...of) => new RawDeformable(...of));
      this.#handle = new Handle('DeformableModel', make);
    }
    this.#runner = new SlicedRunner(this.#handle, (report) => this.#taken(report));
    this.#isBounded = source !== undefined && options.maxVertices === undefined;
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    const start = options.start instanceof Mesh ? options.start.warnings : [];
    this.#warnings = new ModelWarnings((source ?? (options.volume as Volume)).warnings, start);
    const frame = frameOf(source ? { space: undefined, unit: source.unit } : (options.volume as Volume));
    this.#mesh = wrapMesh(this.#meshHandle, true, () => this.#warnings.of(), frame);
  }

  /**
   * Creates a model as the constructor does, bit for bit, yielding to the event loop between slices of work: the initial
   * surface of a large or noisy volume takes seconds. The volume must not be freed before.
   *
   * @param options - `signal`: aborts the creation; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws As the constructor; `signal.reason` when aborted.
   */
  static async create(given: DeformableOptions, options?: SliceOptions): Promise<DeformableModel> {
    const slices = checkedSlices(options);
    slices.signal?.throwIfAborted();
    const checkedOptions = checked(given);
    const source = sparseSource(checkedOptions.volume);
    const sparse = source && { source, volume: source.create() };
    const volume = source ? undefined : volumeHandle('volume', checkedOptions.volume as Volume);
    const begin = () =>
      sparse
        ? onSparse(sparse, checkedOptions, (...of) => RawDeformableCreation.newSparse(...of))()
        : dense(volume as Handle<RawVolume>, checkedOptions, (...of) => new RawDeformableCreation(...of))();
    try {
      const creation = new Handle('DeformableModel', begin);
      const raw = await finishInSlices(creation, (one) => one.advance(), slices);
      const handle = new Handle('DeformableModel', () => raw);
      return new DeformableModel(new Created(checkedOptions, volume, handle, sparse) as unknown as DeformableOptions);
    } catch (error) {
      sparse?.volume.free();
      throw error;
    }
  }

  /**
   * Returns the largest number of pyramid `levels` above a volume: each has at least two voxels along every axis.
   *
   * @throws {@link VesicleError} `invalid-argument` for anything but a {@link Volume}.
   */
  static maxLevels(volume: Volume): number {
    return volumeHandle('volume', volume).use((raw) => RawDeformable.maxLevels(raw));
  }

  /**
   * The model's surface in world space: the same live {@link Mesh} from start to end. It shows the current state, and
   * is freed with the model.
   */
  get mesh(): Mesh {
    return this.#mesh;
  }

  /** Current pyramid level: 0 is the volume itself, higher levels are coarser. */
  get level(): number {
    return this.#runner.use((raw) => raw.level());
  }

  /**
   * Current sampling distance δ, world units: edge lengths are between δ and 2.5 δ. It is √3 times larger on each
   * coarser level. With anisotropic voxels, both bounds hold on average over all directions; those
   * more than twice as long as wide count as several.
   */
  get delta(): number {
    return this.#runner.use((raw) => raw.delta());
  }

  /** Current values of all parameters; a copy. */
  get params(): Required<DeformableParams> {
    return this.#runner.use((raw) => raw.params() as Required<DeformableParams>);
  }

  /**
   * Replaces all attractors of the model by the given ones; an empty array removes them.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the wrong attractor.
   */
  setAttractors(attractors: Attractor[]): void {
    const packed = denseCopy('attractors', attractors).flatMap((attractor, index) => numbersOf(attractor, index));
    this.#runner.use((raw) => raw.setAttractors(Float64Array.from(packed)));
  }

  /**
   * Runs up to `iterations` iterations, synchronous and deterministic; fewer if the model finishes earlier.
   *
   * @returns The last report, with the events of all iterations.
   * @throws {@link VesicleError} `invalid-argument` while a {@link DeformableModel.run} is in progress;
   *   {@link NeedsDataError} if the first iteration needs parts of a {@link LargeVolume} that have not been read: await
   *   its `load()`, and step again. If a later one does, it and those after it are not made.
   */
  step(iterations = 1): StepReport {
    integer('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Runs to the end, yielding to the event loop between slices of work, also within a step. Whatever is asked of the model
   * or its mesh meanwhile ends a step that is under way first. Parameters and attractors may be changed meanwhile.
   *
   * @returns The last report.
   * @throws `signal.reason` when aborted, and the model is as after the last step that ended, and stays usable; any error
   *   thrown by `onStep` or `onData`;
   *   {@link VesicleError} `invalid-argument` while another run is in progress, `freed` when the model is freed
   *   meanwhile; those of reading a {@link LargeVolume}, such as `unavailable`: the model stays usable, and another run
   *   continues.
   */
  async run(given?: DeformableRunOptions): Promise<StepReport> {
    const { onData, ...run } = checkProperties<DeformableRunOptions>('options', given, RUN_OPTIONS);
    checkListener('onData', onData);
    return this.#runner.run(run, onData);
  }

  #step(iterations: number): StepReport {
    return this.#taken(this.#handle.use((raw) => raw.step(iterations) as Stepped));
  }

  #taken(report: Stepped): StepReport {
    if (!('needs' in report)) return this.#warnings.take(report);
    throw new NeedsDataError((options) => this.#load(report.needs, options));
  }

  async #load(needs: SparseBox[], options: DataOptions | undefined): Promise<void> {
    const checked = checkProperties<DataOptions>('options', options, ['signal', 'onData']);
    checkSignal(checked.signal);
    checkListener('onData', checked.onData);
    const { source, volume } = this.#sparse as SparseParts;
    const insert = ({ level, min, dims }: SparseBox, voxels: VoxelArray) =>
      // Names the model if that was freed.
      this.#handle.use(() =>
        volume.use((raw) => raw.insert(level, Uint32Array.from(min), Uint32Array.from(dims), voxels)),
      );
    await supply(source, needs, insert, checked);
    if (this.#isBounded && !isSmall(source.stored())) {
      this.#handle.use((raw) => raw.setMaxVertices());
      this.#isBounded = false;
    }
  }

  /**
   * Finds components and cavities of the current level's image that the surface lacks and adds them, whatever the value
   * of `seeding`; adds none if `topology` is 'fixed' or `isoForce` is 0. A finished model continues if any were added.
   *
   * @returns A report that counts them in `events.seeds`.
   * @throws {@link VesicleError} `invalid-argument` while a {@link DeformableModel.run} is in progress; `too-large`.
   */
  seed(): StepReport {
    this.#runner.refuseWhileRunning('seed');
    return this.#warnings.take(this.#handle.use((raw) => raw.seed() as StepReport));
  }

  /**
   * Adapts the model to its volume after {@link Volume.write} has changed voxels in a region of its frame, as a brush
   * does. Only the image and the surface there are updated: at level 0 the surface is replaced by the iso-surface,
   * so that components appear, vanish, join and split at once. A finished model continues, near the changed voxels only;
   * `step` or `run` it until it is done again. If no voxel has changed, nothing happens. A run may be in progress.
   *
   * Entry points with one method lack it.
   *
   * @param region - `min`: index of the first voxel along x, y and z; `dims`: numbers of voxels.
   * @throws {@link VesicleError} `invalid-argument`: an empty region or one beyond the volume, and `freed` after
   *   {@link Volume.free}; the model is then unchanged; `too-large`.
   */
  refresh(region: { min: Vec3; dims: Vec3 }): void {
    const [first, sizes] = checkedRegion(region);
    const volume = this.#volume;
    if (!volume) throw invalid('refresh', 'not possible with a volume larger than memory');
    this.#runner.use((raw) => volume.use((voxels) => raw.refresh(voxels, first, sizes)));
  }

  /**
   * Measures how much of the volume's iso-surface the surface covers, both in their present state, and lists the
   * regions it does not cover. Yields to the event loop between slices of work; the model may be stepped meanwhile.
   *
   * @throws `signal.reason` when aborted; any error thrown by `onProgress`; {@link VesicleError} `invalid-argument`
   *   naming the option, `freed` when the model is freed meanwhile, `too-large`.
   */
  async coverage(given?: CoverageOptions): Promise<Coverage> {
    const { signal, onProgress } = checkedCoverage(given);
    signal?.throwIfAborted();
    const survey = this.#runner.use((raw) => new Handle('survey', () => raw.surveyCoverage()));
    let told = 0;
    const advance = () => {
      // The survey has its own copy of the surface, but freeing the model must still end it.
      const [coverage, share] = this.#handle.use(() =>
        survey.use((raw) => [raw.advance() as Coverage | undefined, raw.share()] as const),
      );
      // Before and after triangles are tested, there is work, too.
      if (share > told) onProgress?.(share);
      told = share;
      return coverage;
    };
    try {
      return await runInSlices(advance, signal);
    } finally {
      survey.free();
    }
  }

  /**
   * Changes any subset of the parameters of the live model. All values are validated before any is set.
   *
   * With `start: 'contour'`, a new iso value whose surface is more than four voxels away from a tenth of the vertices begins
   * the run again on the contour of that value: the same settings give the same surface, however they were reached.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter that is misspelled, of the wrong type or out
   *   of range; `too-large`. Nothing has changed then.
   */
  setParams(params: DeformableParams): void {
    const values = shallowCopy('params', params);
    this.#runner.use((raw) => raw.setParams(values));
  }

  /**
   * Returns the speed of each vertex along its outward normal, in the order of `mesh.arrays()`: world units per unit of
   * time, negative inwards. A vertex created by an edit has the speed of the surface there; vertices of new components
   * have 0.
   */
  speeds(): Float32Array {
    return this.#runner.use((raw) => raw.speeds());
  }

  /**
   * Saves the whole state, for {@link DeformableModel.restore} of a model made with the same volume, frame and number
   * of levels. Of a {@link LargeVolume}, what has been read is not saved: the next step asks for it again.
   */
  save(): Bytes {
    return this.#runner.use((raw) => raw.save() as Bytes);
  }

  /**
   * Restores a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are not a saved state of a model with the same volume, frame
   *   and number of levels, or `finest` and `box`; the model then stays unchanged; `invalid-argument` while a run is in progress.
   */
  restore(state: Uint8Array): void {
    typedArray('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#runner.use((raw) => raw.restore(state));
    this.#warnings.forget();
  }

  /** Frees the memory; the model and its live mesh cannot be used afterwards. */
  free(): void {
    this.#meshHandle.free();
    this.#handle.free();
    this.#sparse?.volume.free();
  }

  /** The same as {@link DeformableModel.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

/** A volume larger than memory, and what a model has of it in memory. */
interface SparseParts {
  source: SparseSource;
  volume: ReturnType<SparseSource['create']>;
}

/** The report of a step, or the parts of a large volume that it needs. */
type Stepped = StepReport | { needs: SparseBox[] };

type Options = Partial<DeformableOptions>;

/** Arguments that {@link DeformableModel.create} passes to the constructor. */
class Created {
  constructor(
    readonly options: Options,
    readonly volume: Handle<RawVolume> | undefined,
    readonly handle: Handle<RawDeformable>,
    readonly sparse: SparseParts | undefined,
  ) {}
}

/** Returns a function that makes what needs the arguments of a model of a volume in memory. */
function dense<T>(
  volume: Handle<RawVolume>,
  options: Options,
  make: (...of: ConstructorParameters<typeof RawDeformable>) => T,
): () => T {
  const params = shallowCopy('params', options.params ?? {});
  const { frame = 0, start = 'contour', levels = 0, edge } = options;
  const maxVertices = limitOf(options.maxVertices, isOfSmall(options.volume), MOST_VERTICES_OF_SMALL);
  for (const name of ['finest', 'box'] as const) {
    if (options[name] !== undefined) throw invalid(name, 'only for volumes larger than memory');
  }
  return () =>
    volume.use((raw) => {
      const of = new RawDeformableOptions(raw, rawStart(start), params);
      of.setFrame(frame, levels);
      of.setSize(edge, maxVertices);
      return make(raw, of);
    });
}

/** Returns a function that makes what needs the arguments of a model of a volume larger than memory. */
function onSparse<T>(
  { source, volume }: SparseParts,
  options: Options,
  make: (...of: Parameters<typeof RawDeformable.newSparse>) => T,
): () => T {
  const params = shallowCopy('params', options.params ?? {});
  const { start = 'contour', finest = 0, edge, box } = options;
  const maxVertices = limitOf(options.maxVertices, isSmall(source.stored()), MOST_VERTICES_OF_SMALL);
  for (const name of ['frame', 'levels'] as const) {
    if (options[name] !== undefined) throw invalid(name, 'not for volumes larger than memory');
  }
  const [corners, outside] = box ? checkedBox(box) : [];
  return () =>
    volume.use((raw) => {
      const of = new glue.RawSparseOptions(raw, rawStart(start), params);
      of.setLevels(finest, outside, corners);
      of.setSize(edge, maxVertices);
      return make(raw, of);
    });
}

/** Returns what `work` does; if it throws, the volume of a model that there is not to be is freed. */
function orFreed<T>({ volume }: SparseParts, work: () => T): T {
  try {
    return work();
  } catch (error) {
    volume.free();
    throw error;
  }
}

/** Returns the two corners of a box, and the level outside of it. */
function checkedBox(box: NonNullable<Options['box']>): [Float64Array, number | undefined] {
  const { min, max, outside } = checkProperties('box', shallowCopy('box', box), ['min', 'max', 'outside']);
  if (outside !== undefined) integer('box.outside', outside);
  return [Float64Array.of(...vec3('box.min', min), ...vec3('box.max', max)), outside];
}

function checked(given: DeformableOptions): Options {
  const known = checkProperties('options', given, OPTIONS);
  const { frame, levels, finest, edge, maxVertices } = known;
  if (frame !== undefined) integer('frame', frame);
  if (levels !== undefined) integer('levels', levels);
  if (finest !== undefined) integer('finest', finest);
  if (edge !== undefined) positive('edge', edge);
  if (maxVertices !== undefined) integer('maxVertices', maxVertices, { min: 1 });
  return known;
}

// Created last, when nothing else can fail: the consumer of the raw start frees it.
function rawStart(start: DeformableStart): RawStart {
  if (start === 'contour') return RawStart.contour();
  if (start === 'enclosing') return RawStart.enclosing();
  if (start instanceof Mesh) return meshHandle('start', start).use((raw) => RawStart.mesh(raw));
  if (start === null || typeof start !== 'object') throw unknownStart();
  if ('bubbles' in start) {
    const { bubbles } = checkProperties('start', start, ['bubbles']);
    return RawStart.bubbles(integer('bubbles', bubbles, { min: 1 }));
  }
  if ('marchingCubes' in start) {
    const { marchingCubes } = checkProperties('start', start, ['marchingCubes']);
    return RawStart.marchingCubes(number('marchingCubes', marchingCubes));
  }
  if ('seeds' in start) {
    const { seeds, radius } = checkProperties('start', start, ['seeds', 'radius']);
    return RawStart.seeds(pointArray('seeds', seeds), positive('radius', radius));
  }
  throw unknownStart();
}

function unknownStart(): Error {
  return invalid(
    'start',
    "must be one of 'contour', 'enclosing', { bubbles }, { seeds, radius }, { marchingCubes } or a Mesh",
  );
}

function numbersOf(attractor: Attractor, index: number): number[] {
  const { point, strength, radius } = checkProperties(`attractors[${index}]`, attractor, [
    'point',
    'strength',
    'radius',
  ]);
  return [
    ...vec3(`attractors[${index}].point`, point),
    number(`attractors[${index}].strength`, strength),
    positive(`attractors[${index}].radius`, radius),
  ];
}
