import {
  checkProperties,
  denseCopy,
  finite,
  integer,
  invalid,
  number,
  positive,
  shallowCopy,
  typedArray,
  vec3,
} from './check.js';
import { type Coverage, type CoverageOptions, checkedCoverage } from './coverage.js';
import type { Vec3 } from './data.js';
import { Mesh, meshHandle, wrapMesh } from './mesh.js';
import { Handle } from './runtime.js';
import { Runner, type RunOptions, runInSlices, type Stepper, type StepReport } from './stepper.js';
import { RawDeformable, RawStart } from './vesicle.js';
import { type Volume, volumeHandle } from './volume.js';

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
  | { seeds: Float32Array; radius: number }
  | { marchingCubes: number }
  | Mesh;

/** Constructor options of a {@link DeformableModel}. */
export interface DeformableOptions {
  /** The volume that the model is fitted to; it may be freed once the model is made. */
  volume: Volume;
  /** Index of the frame of a 4D volume that the model is fitted to; default 0. */
  frame?: number;
  /** Initial surface; default 'contour'. */
  start?: DeformableStart;
  /**
   * Number of pyramid levels above the volume itself. With 0 (the default) the surface is fitted to the volume itself
   * from the first iteration. The voxels of each level are √3 times larger than those of the next finer one; the
   * surface starts on the coarsest level and is refined on each finer one.
   */
  levels?: number;
  /** Target edge length at the finest level, world units; default from the voxel size. */
  edge?: number;
  /** Initial parameters: any subset; the others have their defaults. */
  params?: DeformableParams;
}

/**
 * Number of triangles tested between two checks of the clock during a coverage measurement: some milliseconds of work.
 */
const TRIANGLES_AT_ONCE = 512;

const OPTIONS = ['volume', 'frame', 'start', 'levels', 'edge', 'params'];

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
  readonly #runner = new Runner();

  /**
   * Creates a model with its initial surface, ready to step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter; `not-closed` or `self-intersecting`
   *   for a start mesh that is; `too-large`.
   */
  constructor(given: DeformableOptions) {
    const { volume, frame = 0, start = 'contour', levels = 0, edge, params: some = {} } = checked(given);
    const params = shallowCopy('params', some);
    const image = volumeHandle('volume', volume as Volume);
    this.#handle = new Handle('DeformableModel', () =>
      image.use((raw) => new RawDeformable(raw, frame, rawStart(start), levels, edge, params)),
    );
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    this.#mesh = wrapMesh(this.#meshHandle, true);
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
    return this.#handle.use((raw) => raw.level());
  }

  /**
   * Current sampling distance δ, world units: edge lengths are between δ and 2.5 δ. It is √3 times larger on each
   * coarser level. With anisotropic voxels, both bounds hold on average over all directions.
   */
  get delta(): number {
    return this.#handle.use((raw) => raw.delta());
  }

  /** Current values of all parameters; a copy. */
  get params(): Required<DeformableParams> {
    return this.#handle.use((raw) => raw.params() as Required<DeformableParams>);
  }

  /**
   * Replaces all attractors of the model by the given ones; an empty array removes them.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the wrong attractor.
   */
  setAttractors(attractors: Attractor[]): void {
    const packed = denseCopy('attractors', attractors).flatMap((attractor, index) => numbersOf(attractor, index));
    this.#handle.use((raw) => raw.setAttractors(Float64Array.from(packed)));
  }

  /**
   * Runs up to `iterations` iterations, synchronous and deterministic; fewer if the model finishes earlier.
   *
   * @returns The last report, with the events of all iterations.
   * @throws {@link VesicleError} `invalid-argument` while a {@link DeformableModel.run} is in progress.
   */
  step(iterations = 1): StepReport {
    integer('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Runs to the end, yielding to the event loop between slices of work. Parameters and attractors may be changed
   * meanwhile.
   *
   * @returns The last report.
   * @throws `signal.reason` when aborted, and the model stays usable; any error thrown by `onStep`;
   *   {@link VesicleError} `invalid-argument` while another run is in progress, `freed` when the model is freed
   *   meanwhile.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#step(1), given);
  }

  #step(iterations: number): StepReport {
    return this.#handle.use((raw) => raw.step(iterations) as StepReport);
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
    return this.#handle.use((raw) => raw.seed() as StepReport);
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
    const survey = this.#handle.use((raw) => new Handle('survey', () => raw.surveyCoverage()));
    const advance = () => {
      // The survey has its own copy of the surface, but freeing the model must still end it.
      const share = this.#handle.use(() => survey.use((raw) => raw.advance(TRIANGLES_AT_ONCE)));
      onProgress?.(share);
      return share < 1 ? undefined : survey.use((raw) => raw.finish() as Coverage);
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
   * @throws {@link VesicleError} `invalid-argument` naming the parameter that is misspelled, of the wrong type or out
   *   of range; `too-large`. Nothing has changed then.
   */
  setParams(params: DeformableParams): void {
    const values = shallowCopy('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /**
   * Returns the speed of each vertex along its outward normal, in the order of `mesh.arrays()`: world units per unit of
   * time, negative inwards. A vertex created by an edit has the speed of the surface there; vertices of new components
   * have 0.
   */
  speeds(): Float32Array {
    return this.#handle.use((raw) => raw.speeds());
  }

  /**
   * Saves the whole state, for {@link DeformableModel.restore} of a model made with the same volume, frame and number
   * of levels.
   */
  save(): Uint8Array {
    return this.#handle.use((raw) => raw.save());
  }

  /**
   * Restores a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are not a saved state of a model with the same volume, frame
   *   and number of levels; the model then stays unchanged; `invalid-argument` while a run is in progress.
   */
  restore(state: Uint8Array): void {
    typedArray('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#handle.use((raw) => raw.restore(state));
  }

  /** Frees the memory; the model and its live mesh cannot be used afterwards. */
  free(): void {
    this.#meshHandle.free();
    this.#handle.free();
  }

  /** The same as {@link DeformableModel.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function checked(given: DeformableOptions): Partial<DeformableOptions> {
  const known = checkProperties('options', given, OPTIONS);
  const { frame, levels, edge } = known;
  if (frame !== undefined) integer('frame', frame);
  if (levels !== undefined) integer('levels', levels);
  if (edge !== undefined) positive('edge', edge);
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
    return RawStart.seeds(finite('seeds', seeds, 3), positive('radius', radius));
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
