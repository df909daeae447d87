import { checkProperties, choice, denseCopy, integer, invalid, shallowCopy, typedArray, vec3 } from './check.js';
import type { Bytes, Vec3 } from './data.js';
import { type Mesh, meshHandle, wrapMesh } from './mesh.js';
import { frameOf, type MeshFrame } from './mesh-file.js';
import { Handle } from './runtime.js';
import {
  checkedSlices,
  finishInSlices,
  type RunOptions,
  SlicedRunner,
  type SliceOptions,
  type Stepper,
  type StepReport,
} from './stepper.js';
import { RawMultires, RawMultiresCreation, TriangleCopy } from './vesicle.js';
import { ModelWarnings } from './warnings.js';

/**
 * A solid ellipsoid that supports the low-frequency surface of a {@link MultiresolutionModel} and drives its
 * deformation.
 */
export interface ControlEllipsoid {
  /** Centre of the ellipsoid, in the mesh's units. */
  center: Vec3;
  /** Three orthogonal semi-axes as vectors. Detail rotates with them, so keep their order from call to call. */
  axes: [Vec3, Vec3, Vec3];
}

/** Parameters of the multiresolution model; `paramSpecs('multires')` has their ranges, defaults and descriptions. */
export interface MultiresParams {
  /**
   * ε_min: edges shorter than this are collapsed, in the mesh's units; by default derived from `edgeMax`, or, without
   * it, such that the base has some 10,000 triangles.
   */
  edgeMin?: number;
  /**
   * ε_max: edges longer than this are split, in the mesh's units; more than twice `edgeMin`, from which it is derived
   * by default.
   */
  edgeMax?: number;
  /** Largest number of levels of the multi-level solver that are coarser than the target resolution. */
  levels?: number;
  /**
   * q: factor, below 1, by which the edge bounds shrink from one level of the multi-level solver to the next finer one.
   */
  refineFactor?: number;
  /**
   * Largest number of smoothing iterations, with the umbrella operator, per level of the multi-level solver; finer
   * levels may need fewer.
   */
  smoothing?: number;
  /**
   * Number of times per solve of the base that the operator D evens out the map T from the deformed base to the
   * undeformed one (see {@link MultiresolutionModel.linkMesh}).
   */
  distribute?: number;
  /**
   * Largest number of times that an edge of the base is halved for the detail, where the detail is finer than the base,
   * or stretched. The base itself does not change.
   */
  supersample?: number;
  /**
   * Energy that the low-frequency surface minimises between the ellipsoids: area (membrane) or bending (thin plate).
   */
  energy?: 'membrane' | 'thin-plate';
  /** Topology changes: none, only cuts of thin necks, or also joins of parts in contact. */
  topology?: 'never' | 'split' | 'split-and-join';
}

/** Constructor options of a {@link MultiresolutionModel}. Everything is copied. */
export interface MultiresOptions {
  /** The detailed surface, closed; without it the model is a bare membrane (lava lamp). */
  detail?: Mesh;
  /**
   * Low-frequency approximation of the detailed surface, closed and without self-intersections; by default made from
   * `detail` by smoothing and coarsening, or around the ellipsoids.
   */
  base?: Mesh;
  /**
   * Initial control ellipsoids. With `support: 'surface'` they leave the surface unchanged where they are; if there are none,
   * balls inside it are proposed, see {@link MultiresolutionModel.ellipsoids}. With `'membrane'` there must be at least one,
   * of which one has to touch the base.
   */
  ellipsoids?: ControlEllipsoid[];
  /**
   * The support of the surface. `'surface'`, the default for a `detail` without `base`: `detail` holds itself; whatever
   * closed surface it is, it stays exactly as given, except where ellipsoids are moved, turned or stretched. What one does
   * fades with the distance along the surface, and leaves about half of its area as it is. An ellipsoid stops where the
   * surface would fold up, and becomes its own target there (warning `handle-stopped`). Components that intersect as given
   * may go on to (warning `self-intersecting`). Of the parameters, only `edgeMin` and `edgeMax` have an effect.
   * `'membrane'`, the default otherwise: a membrane over the ellipsoids, as in the paper.
   */
  support?: 'membrane' | 'surface';
  /** Initial parameters: any subset; the others have their defaults. */
  params?: MultiresParams;
}

/**
 * Counts of a {@link MultiresolutionModel} that are not part of the {@link StepReport}, as the WebAssembly module
 * returns them.
 */
interface Counts {
  bandCount: number;
  folded: number;
  unmatchedVertices: number;
  heldVertices: number;
}

const OPTIONS = ['detail', 'base', 'ellipsoids', 'support', 'params'];
const NAME = 'MultiresolutionModel';

const SUPPORTS = ['membrane', 'surface'] as const;

/**
 * A detailed surface deformed, however far, by ellipsoids that support a low-frequency surface, whose connectivity
 * changes as it is deformed.
 *
 * After Kobbelt, Bareuther and Seidel, "Multiresolution shape deformations for meshes with dynamic vertex
 * connectivity". A step is one frame: the ellipsoids move towards their targets as far as the low-frequency surface can
 * follow, that surface is solved for, and the detail is reconstructed on it. The model is done when the ellipsoids have
 * reached their targets and the surface has settled, or has not done so in 100 frames, as where components that must not
 * join press on each other; the report's `residual` is then above its `tolerance`.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link MultiresolutionModel.free}.
 */
export class MultiresolutionModel implements Stepper {
  readonly #handle: Handle<RawMultires>;
  readonly #meshHandles: Handle<import('./vesicle.js').RawMesh>[];
  readonly #meshes: Mesh[];
  readonly #runner: SlicedRunner<RawMultires, StepReport>;
  readonly #warnings: ModelWarnings;
  readonly #frame: MeshFrame;

  /**
   * Creates a model whose surface is the base with the detail.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter: no ellipsoid, none that touches the
   *   base, axes that are not orthogonal or have no length, `edgeMax` not more than twice `edgeMin`, a detail that no
   *   base can be made from; `not-closed` for a detail or base that is open or not manifold; `self-intersecting` for a
   *   base with self-intersections; `too-large` for edges so short that the surface would have more than 200,000
   *   vertices.
   */
  constructor(given: MultiresOptions) {
    const created = given instanceof Created ? given : begun(given, (...of) => new RawMultires(...of));
    this.#handle = created.handle;
    this.#meshHandles = [0, 1, 2].map((which) => new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh(which))));
    this.#warnings = created.warnings;
    this.#runner = new SlicedRunner(this.#handle, (report) => this.#warnings.take(report));
    this.#frame = created.frame;
    this.#meshes = this.#meshHandles.map((handle) => wrapMesh(handle, true, () => this.#warnings.of(), this.#frame));
  }

  /**
   * Creates a model as the constructor does, bit for bit, yielding to the event loop between slices of work: that of a
   * large detail takes seconds. The meshes may be freed meanwhile.
   *
   * @param options - `signal`: aborts the creation; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws As the constructor; `signal.reason` when aborted.
   */
  static async create(given: MultiresOptions, options?: SliceOptions): Promise<MultiresolutionModel> {
    const slices = checkedSlices(options);
    slices.signal?.throwIfAborted();
    const creation = begun(given, (...of) => new RawMultiresCreation(...of));
    const raw = await finishInSlices(creation.handle, (one) => one.advance(), slices);
    const created = new Created(new Handle(NAME, () => raw), creation.warnings, creation.frame);
    return new MultiresolutionModel(created as unknown as MultiresOptions);
  }

  /**
   * The surface with its detail, and with texture coordinates if `detail` has them: the same live {@link Mesh} from
   * start to end, which shows the current state.
   */
  get mesh(): Mesh {
    return this.#meshes[0] as Mesh;
  }

  /** The deformed low-frequency surface without the detail, as a live mesh that shows the current state. */
  get baseMesh(): Mesh {
    return this.#meshes[1] as Mesh;
  }

  /**
   * The map T from the deformed to the undeformed base, as a live mesh: the vertices of
   * {@link MultiresolutionModel.baseMesh} at their corresponding positions on the undeformed base. It may fold over.
   */
  get linkMesh(): Mesh {
    return this.#meshes[2] as Mesh;
  }

  /** Current values of all parameters; a copy. */
  get params(): Required<MultiresParams> {
    return this.#runner.use((raw) => raw.params() as Required<MultiresParams>);
  }

  /**
   * Copy of the current control ellipsoids, between their previous positions and their targets. Removed ones that are
   * still shrinking come last.
   */
  get ellipsoids(): ControlEllipsoid[] {
    return unpackedEllipsoids(this.#runner.use((raw) => raw.ellipsoids()));
  }

  /** Copy of the targets of the control ellipsoids, as set by {@link MultiresolutionModel.setEllipsoids}. */
  get targets(): ControlEllipsoid[] {
    return unpackedEllipsoids(this.#runner.use((raw) => raw.targets()));
  }

  /** Number of surfaces in the multiresolution decomposition, from the base to the detail, both included. */
  get bandCount(): number {
    return this.#counts().bandCount;
  }

  /**
   * Number of triangles of {@link MultiresolutionModel.baseMesh} that are flipped or have no area in
   * {@link MultiresolutionModel.linkMesh}.
   */
  get folded(): number {
    return this.#counts().folded;
  }

  /**
   * Number of vertices of the mesh whose normal on the base, or on a surface between base and detail, did not hit the
   * next finer surface; its closest point is used instead.
   */
  get unmatchedVertices(): number {
    return this.#counts().unmatchedVertices;
  }

  /**
   * Number of vertices of the mesh whose detail was reduced to avoid self-intersections, summed over the surfaces of
   * the decomposition above the base. With `support: 'surface'`, the vertices that are not where the ellipsoids move them, for
   * the same reason: where they are depends on the way of the ellipsoids.
   */
  get heldVertices(): number {
    return this.#counts().heldVertices;
  }

  #counts(): Counts {
    return this.#runner.use((raw) => raw.counts() as Counts);
  }

  /**
   * Sets new targets for the control ellipsoids, matched by index; each step moves, rotates and resizes them by a
   * limited amount, with `'membrane'` their centres by at most half of their shortest semi-axis (or of their target's, if
   * longer).
   * Additional ellipsoids grow from a fraction of their size, or out of the nearest existing one if they lie outside
   * the surface; those omitted shrink and vanish.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the ellipsoid: none at all, axes that are not orthogonal or
   *   have no length, or tips too sharp for `edgeMax`; nothing has changed then.
   */
  setEllipsoids(ellipsoids: ControlEllipsoid[]): void {
    const packed = packedEllipsoids(ellipsoids);
    this.#runner.use((raw) => raw.setEllipsoids(packed));
  }

  /**
   * Runs up to `iterations` frames, synchronous and deterministic; fewer if the model finishes earlier.
   *
   * @returns The last report, with the events of all frames.
   * @throws {@link VesicleError} `too-large` where the surface would have too many vertices, and then stays unchanged;
   *   `invalid-argument` while a {@link MultiresolutionModel.run} is in progress.
   */
  step(iterations = 1): StepReport {
    integer('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Runs until the surface has settled, yielding to the event loop between slices of work, with `support: 'surface'` also
   * within a frame. Whatever is asked of the model or its meshes meanwhile ends a frame that is under way first. Ellipsoids
   * and parameters may be changed meanwhile.
   *
   * @returns The last report.
   * @throws As {@link MultiresolutionModel.step}; `signal.reason` when aborted, and the model is as after the last frame that
   *   ended, and stays usable; any error
   *   thrown by `onStep`.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(given);
  }

  #step(iterations: number): StepReport {
    return this.#warnings.take(this.#runner.use((raw) => raw.step(iterations) as StepReport));
  }

  /**
   * Computes the distortion of the map T per vertex of {@link MultiresolutionModel.baseMesh}: `area` is the area on the
   * undeformed base divided by that on the deformed one, 1 where areas are preserved; `angle` the ratio of the largest
   * to the smallest stretch over all directions, at most 1000, 1 where angles are preserved.
   */
  distortion(): { area: Float32Array; angle: Float32Array } {
    return this.#runner.use((raw) => ({ area: raw.distortion(0), angle: raw.distortion(1) }));
  }

  /**
   * Solves a copy of the low-frequency surface for the current ellipsoids, and returns its mesh on each level of the
   * multi-level solver, from coarse to fine, to show how it works.
   */
  levelMeshes(): Mesh[] {
    const levels = this.#runner.use((raw) => raw.levelMeshes());
    const warnings = this.#warnings.of();
    return levels.map((level) => wrapMesh(new Handle('Mesh', () => level), false, () => warnings, this.#frame));
  }

  /**
   * Changes any subset of the parameters of the live model. All values are validated before any is set.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter, `too-large`; nothing has changed then.
   */
  setParams(params: MultiresParams): void {
    const values = shallowCopy('params', params);
    this.#runner.use((raw) => raw.setParams(values));
  }

  /**
   * Saves the whole state, for {@link MultiresolutionModel.restore} of a model made of the same meshes and initial
   * ellipsoids.
   */
  save(): Bytes {
    return this.#runner.use((raw) => raw.save() as Bytes);
  }

  /**
   * Restores a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are not a saved state of a model made of the same meshes, with the
   *   same `support`; the model then stays unchanged; `invalid-argument` while a run is in progress.
   */
  restore(state: Uint8Array): void {
    typedArray('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#runner.use((raw) => raw.restore(state));
    this.#warnings.forget();
  }

  /** Frees the memory; the model and its live meshes cannot be used afterwards. */
  free(): void {
    for (const handle of this.#meshHandles) handle.free();
    this.#handle.free();
  }

  /** The same as {@link MultiresolutionModel.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

/** A model, or its creation, that {@link MultiresolutionModel.create} passes to the constructor. */
class Created<Raw extends { free(): void }> {
  constructor(
    readonly handle: Handle<Raw>,
    readonly warnings: ModelWarnings,
    readonly frame: MeshFrame,
  ) {}
}

/** Makes what needs the arguments of a model by `make`. */
function begun<Raw extends { free(): void }>(
  given: MultiresOptions,
  make: (...of: ConstructorParameters<typeof RawMultires>) => Raw,
): Created<Raw> {
  const known = checkProperties('options', given, OPTIONS) as MultiresOptions;
  const usual = known.detail && !known.base ? 'surface' : 'membrane';
  const holdsItself = choice('support', known.support ?? usual, SUPPORTS) === 'surface';
  const packed = packedEllipsoids(known.ellipsoids ?? []);
  const params = shallowCopy('params', known.params ?? {});
  const handle = new Handle(NAME, () => {
    const [detail, base] = [triangles('detail', known.detail), triangles('base', known.base)];
    return make(detail, base, packed, params, holdsItself);
  });
  const warnings = new ModelWarnings(known.detail?.warnings, known.base?.warnings);
  return new Created(handle, warnings, frameOf(known.detail ?? known.base));
}

function triangles(parameter: string, mesh: Mesh | undefined): TriangleCopy | undefined {
  return mesh === undefined ? undefined : meshHandle(parameter, mesh).use((raw) => new TriangleCopy(raw));
}

function packedEllipsoids(ellipsoids: readonly ControlEllipsoid[]): Float64Array<ArrayBuffer> {
  const numbers = denseCopy('ellipsoids', ellipsoids).flatMap((ellipsoid, index) => {
    const at = `ellipsoids[${index}]`;
    const { center, axes } = checkProperties(at, ellipsoid, ['center', 'axes']);
    const vectors = [center, ...denseCopy(`${at}.axes`, axes ?? [])];
    if (vectors.length !== 4) throw invalid(`${at}.axes`, `must be three vectors, got ${vectors.length - 1}`);
    return vectors.flatMap((vector, k) => [...vec3(k === 0 ? `${at}.center` : `${at}.axes[${k - 1}]`, vector)]);
  });
  return Float64Array.from(numbers);
}

function unpackedEllipsoids(packed: Float64Array): ControlEllipsoid[] {
  const vector = (at: number): Vec3 => [packed[at] as number, packed[at + 1] as number, packed[at + 2] as number];
  return Array.from({ length: packed.length / 12 }, (_, index) => {
    const at = 12 * index;
    return { center: vector(at), axes: [vector(at + 3), vector(at + 6), vector(at + 9)] };
  });
}
