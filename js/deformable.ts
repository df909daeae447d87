import { finite, invalid, knownOnly, list, number, plain, positive, typed, vec3, whole } from './check.js';
import { type Coverage, type CoverageOptions, checkedCoverage } from './coverage.js';
import { Mesh, meshHandle, wrapMesh } from './mesh.js';
import { Handle } from './runtime.js';
import { inSlices, Runner, type RunOptions, type Stepper, type StepReport } from './stepper.js';
import { RawDeformable, RawStart } from './vesicle.js';
import { type Vec3, type Volume, volumeHandle } from './volume.js';

/** Parameters of the deformable model; `paramSpecs('deformable')` has ranges, defaults and a sentence on each. */
export interface DeformableParams {
  /** Intensity of the surface, πI, in intensity units of the volume; default the middle of its range. */
  iso?: number;
  /** Strength of the iso force, αI; negative where the object is brighter than iso. */
  isoForce?: number;
  /** Strength of the gradient force along the normal, αg. */
  gradientNormal?: number;
  /** Strength of the gradient force along the tangent plane, βg. */
  gradientTangent?: number;
  /** Longest gradient that counts. */
  gradientBound?: number;
  /** Resistance against bending, αc. */
  rigidity?: number;
  /** Resistance against stretching, αe. */
  stiffness?: number;
  /** Length at which edges rest: no length, the mean length, or a length in world units. */
  restLength?: 'zero' | 'mean' | number;
  /** Mass of a vertex, m. */
  mass?: number;
  /** Friction, γ. */
  damping?: number;
  /**
   * How the motion is integrated: 'implicit' (the default) takes long steps and needs the fewest; 'euler' is the paper's
   * and needs `rigidity` up to 0.4; 'runge-kutta' evaluates the forces four times and holds up to 3.
   */
  integrator?: 'euler' | 'runge-kutta' | 'implicit';
  /** Time of one iteration, Δt. */
  timeStep?: number;
  /** Fraction of δ a vertex may move in one iteration. */
  maxMove?: number;
  /** Kinetic energy below which a level has converged, ε. */
  energyTolerance?: number;
  /** Whether the surface may split and join. */
  topology?: 'adaptive' | 'fixed';
  /**
   * How far the surface adapts to the image locally, 0..1; default 1: walls and gaps that the image shows are kept, however
   * thin. 0 is the paper: whatever comes nearer than the contact distance is joined.
   */
  adaptivity?: number;
  /**
   * Whether parts and hollows that a level shows and the surface leaves out are added to it: 'auto' (the default) in runs
   * that start from the contour, 'on' in all, 'off' never. {@link DeformableModel.seed} does it on demand.
   */
  seeding?: 'auto' | 'on' | 'off';
  /** Separate parts and hollows that enclose fewer voxels than this are left out as noise; default 64. */
  smallestPart?: number;
}

/** A place that pulls the surface within `radius`. */
export interface Attractor {
  /** World position. */
  point: Vec3;
  /** Spring constant. */
  strength: number;
  /** Reach, world units. */
  radius: number;
}

/**
 * The first surface.
 *
 * - `'contour'`, for real data: the iso-surface of the coarsest level at `iso`, with its hollows, less what encloses fewer
 *   voxels than `smallestPart`. Where there is none: nothing (parts come with finer levels, or with another `iso`), or the
 *   enclosing surface if `seeding` is 'off' or `adaptivity` 0.
 * - `'enclosing'`: around all that is brighter than `iso`, as it is when the model is made (around the whole volume where
 *   nothing is, or where `isoForce` is not negative). This, bubbles and seeds are for teaching, and for objects without a
 *   usable iso-surface.
 * - `{ bubbles }`: n by n by n of them, which grow and join.
 * - `{ seeds, radius }`: spheres at packed world points.
 * - `{ marchingCubes }`: the iso-surface of the volume itself at an intensity.
 * - A closed mesh that does not cross itself, in world space; it is copied.
 */
export type DeformableStart =
  | 'contour'
  | 'enclosing'
  | { bubbles: number }
  | { seeds: Float32Array; radius: number }
  | { marchingCubes: number }
  | Mesh;

/** What a {@link DeformableModel} is made of. */
export interface DeformableOptions {
  /** The image; it may be freed once the model is made. */
  volume: Volume;
  /** Of a 4D volume; default 0. */
  frame?: number;
  /** Default 'contour'. */
  start?: DeformableStart;
  /**
   * Pyramid levels above the volume itself; 0 (the default) = direct: the surface works on the volume from the first
   * iteration. Each level halves the resolution; the surface starts on the coarsest and is refined on the way down.
   */
  levels?: number;
  /** Target edge at the finest level, world units; default from the voxel size. */
  edge?: number;
  /** Any of them; the others have their defaults. */
  params?: DeformableParams;
}

/** Tested between two looks at the clock: some milliseconds of work. */
const TRIANGLES_AT_ONCE = 512;

const OPTIONS = ['volume', 'frame', 'start', 'levels', 'edge', 'params'];

/**
 * A deformable model: a closed surface that moves onto the object in a volume under forces of the image and of its
 * own, and splits and joins on the way, coarse to fine.
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
   * A model at its start shape, ready to step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter; `not-closed` or
   *   `self-intersecting` for a start mesh that is; `too-large`.
   */
  constructor(given: DeformableOptions) {
    const { volume, frame = 0, start = 'contour', levels = 0, edge, params: some = {} } = checked(given);
    const params = plain('params', some);
    const image = volumeHandle('volume', volume as Volume);
    this.#handle = new Handle('DeformableModel', () =>
      image.use((raw) => new RawDeformable(raw, frame, rawStart(start), levels, edge, params)),
    );
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    this.#mesh = wrapMesh(this.#meshHandle, true);
  }

  /** The surface: the same live object from start to end, in world space. It goes when the model is freed. */
  get mesh(): Mesh {
    return this.#mesh;
  }

  /** Pyramid level now; 0 = the volume itself. */
  get level(): number {
    return this.#handle.use((raw) => raw.level());
  }

  /**
   * The sampling distance δ now, world units: edges are between δ and 2.5 δ. Where voxels are not cubes, both hold in the
   * mean of all directions.
   */
  get delta(): number {
    return this.#handle.use((raw) => raw.delta());
  }

  /** All parameters as they are now; a copy. */
  get params(): Required<DeformableParams> {
    return this.#handle.use((raw) => raw.params() as Required<DeformableParams>);
  }

  /**
   * Attachment points the user places, in place of those before.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the entry.
   */
  setAttractors(attractors: Attractor[]): void {
    const packed = list('attractors', attractors).flatMap((attractor, index) => numbersOf(attractor, index));
    this.#handle.use((raw) => raw.setAttractors(Float64Array.from(packed)));
  }

  /**
   * So many iterations at once, synchronous and deterministic; fewer where the end comes first.
   *
   * @returns The report of the last one, with the events of all.
   * @throws {@link VesicleError} `invalid-argument` while a {@link DeformableModel.run} is under way.
   */
  step(iterations = 1): StepReport {
    whole('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * To the end, yielding to the event loop between slices. Parameters and attractors may be changed meanwhile.
   *
   * @returns The last report.
   * @throws `signal.reason` when aborted, and the model stays usable; what `onStep` throws;
   *   {@link VesicleError} `invalid-argument` while another run is under way, `freed` when the model is freed meanwhile.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#step(1), given);
  }

  #step(iterations: number): StepReport {
    return this.#handle.use((raw) => raw.step(iterations) as StepReport);
  }

  /**
   * Searches the current level for parts and hollows that the surface leaves out and adds them, whatever `seeding` says.
   * A model that had reached its end can go on afterwards.
   *
   * @returns A report that counts them in `events.seeds`.
   * @throws {@link VesicleError} `invalid-argument` while a {@link DeformableModel.run} is under way; `too-large`.
   */
  seed(): StepReport {
    this.#runner.refuseWhileRunning('seed');
    return this.#handle.use((raw) => raw.seed() as StepReport);
  }

  /**
   * Measures how much of the volume's iso-surface the surface covers, as both are now, and where it does not. Yields to
   * the event loop between slices; the model may move on meanwhile.
   *
   * @throws `signal.reason` when aborted; what `onProgress` throws; {@link VesicleError} `invalid-argument` naming the
   *   option, `freed` when the model is freed meanwhile, `too-large`.
   */
  async coverage(given?: CoverageOptions): Promise<Coverage> {
    const { signal, onProgress } = checkedCoverage(given);
    signal?.throwIfAborted();
    const survey = this.#handle.use((raw) => new Handle('survey', () => raw.surveyCoverage()));
    const advance = () => {
      // The survey has its own copy of the surface; a model that was freed has to end it all the same.
      const share = this.#handle.use(() => survey.use((raw) => raw.advance(TRIANGLES_AT_ONCE)));
      onProgress?.(share);
      return share < 1 ? undefined : survey.use((raw) => raw.finish() as Coverage);
    };
    try {
      return await inSlices(advance, signal);
    } finally {
      survey.free();
    }
  }

  /**
   * Live parameters: any subset, validated as a whole before any of it is taken.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter that is misspelled, of the wrong type or out
   *   of range; nothing has changed then.
   */
  setParams(params: DeformableParams): void {
    const values = plain('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /**
   * Speed of each vertex along its outward normal, in the order of `mesh.arrays()`: world units per unit of time,
   * negative inwards. A vertex that was just made has the speed of where it was made.
   */
  speeds(): Float32Array {
    return this.#handle.use((raw) => raw.speeds());
  }

  /** The whole state, for {@link DeformableModel.restore} of a model made with the same volume and options. */
  save(): Uint8Array {
    return this.#handle.use((raw) => raw.save());
  }

  /**
   * Back to a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are no state of such a model, which then stays as it was;
   *   `invalid-argument` while a run is under way.
   */
  restore(state: Uint8Array): void {
    typed('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#handle.use((raw) => raw.restore(state));
  }

  /** Gives the memory back; the model and its live mesh cannot be used afterwards. */
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
  const known = knownOnly('options', given, OPTIONS);
  const { frame, levels, edge } = known;
  if (frame !== undefined) whole('frame', frame);
  if (levels !== undefined) whole('levels', levels);
  if (edge !== undefined) positive('edge', edge);
  return known;
}

// Made last, when nothing else can fail: whoever takes it frees it.
function rawStart(start: DeformableStart): RawStart {
  if (start === 'contour') return RawStart.contour();
  if (start === 'enclosing') return RawStart.enclosing();
  if (start instanceof Mesh) return meshHandle('start', start).use((raw) => RawStart.mesh(raw));
  if (start === null || typeof start !== 'object') throw unknownStart();
  if ('bubbles' in start) {
    const { bubbles } = knownOnly('start', start, ['bubbles']);
    return RawStart.bubbles(whole('bubbles', bubbles, { min: 1 }));
  }
  if ('marchingCubes' in start) {
    const { marchingCubes } = knownOnly('start', start, ['marchingCubes']);
    return RawStart.marchingCubes(number('marchingCubes', marchingCubes));
  }
  if ('seeds' in start) {
    const { seeds, radius } = knownOnly('start', start, ['seeds', 'radius']);
    return RawStart.seeds(finite('seeds', seeds, 3), positive('radius', radius));
  }
  throw unknownStart();
}

function unknownStart(): Error {
  return invalid(
    'start',
    "one of 'contour', 'enclosing', { bubbles }, { seeds, radius }, { marchingCubes } or a Mesh is needed",
  );
}

function numbersOf(attractor: Attractor, index: number): number[] {
  const { point, strength, radius } = knownOnly(`attractors[${index}]`, attractor, ['point', 'strength', 'radius']);
  return [
    ...vec3(`attractors[${index}].point`, point),
    number(`attractors[${index}].strength`, strength),
    positive(`attractors[${index}].radius`, radius),
  ];
}
