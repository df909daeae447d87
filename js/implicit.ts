import { checkProperties, denseCopy, finite, integer, numbers, pointArray, shallowCopy, typedArray } from './check.js';
import type { Bytes, PointArray, Vec3 } from './data.js';
import { type Mesh, wrapMesh } from './mesh.js';
import { Handle } from './runtime.js';
import {
  checkedSlices,
  finishInSlices,
  Runner,
  type RunOptions,
  type SliceOptions,
  type Stepper,
  type StepReport,
} from './stepper.js';
import { RawCameras, RawImplicit } from './vesicle.js';
import { type Volume, withWarnings, wrapVolume } from './volume.js';
import type { Warning } from './warning.js';
import { checkedWarnings, ModelWarnings } from './warnings.js';

/** Long operations of an implicit surface in slices of work, as returned by {@link ImplicitSurface.inSlices}. */
export interface ImplicitInSlices {
  /** As {@link ImplicitSurface.toVolume}. */
  toVolume(dims: Vec3): Promise<Volume>;
  /** As {@link ImplicitSurface.colorize}; rejects with `invalid-argument` if the surface has changed meanwhile. */
  colorize(cameras: Camera[]): Promise<void>;
}

/**
 * Parameters of the implicit surface; `paramSpecs('implicit')` has their ranges, defaults and descriptions. The unit of
 * length of all but `cell` is that of the normalised box, in which the longest side of the points' bounds is 2.
 */
export interface ImplicitParams {
  /**
   * Radial basis function φ: the paper's multi-order function, or for comparison thin-plate |r|³, biharmonic −|r| or
   * Gaussian exp(−r²/2σ²).
   */
  kernel?: 'multi-order' | 'thin-plate' | 'biharmonic' | 'gaussian';
  /**
   * First-order smoothness of the multi-order kernel, δ, per unit of length of the normalised box (longest side 2):
   * larger values give a tighter surface. `'auto'`, the default, chooses it by the density of the points; 5 is the paper's.
   */
  delta?: number | 'auto';
  /**
   * Third-order smoothness of the multi-order kernel, τ, a length in the normalised box (longest side 2): larger values
   * give less detail.
   */
  tau?: number;
  /** Width of the Gaussian kernel, σ, a length in the normalised box (longest side 2). */
  sigma?: number;
  /**
   * Regularisation λ of surface constraints (points where the implicit function f is to be 0): how much each may be
   * missed; 0 interpolates. With n > 3,000 points it is multiplied by n/3,000. `'auto'`, the default, chooses it by the
   * density and the noise of the points; 0.001 is the paper's.
   */
  lambdaSurface?: number | 'auto';
  /**
   * Regularisation λ of constraints off the surface (points where the implicit function f is to be −1 or 1): how much each
   * may be missed. `'auto'`, the default, chooses it by density and noise; 2 is the paper's.
   */
  lambdaExterior?: number | 'auto';
  /** Relative residual at which the iterative solver of the linear system for f stops. */
  tolerance?: number;
  /**
   * Edge of a cell of the grid on which the surface is extracted, in the points' units; 0, the default, derives it from
   * the points' spacing.
   */
  cell?: number;
  /**
   * Value of f, the sum of radial basis functions, at which the surface is extracted: 0, or the mean of f over the
   * surface constraints.
   */
  level?: 'zero' | 'mean';
  /**
   * Sides of the surface with constraints: `'both'`, −1 outside and 1 inside, so that noise does not shrink the surface, and
   * parts that no point supports are left out; or `'outside'`, the paper's. `'auto'`, the default, is both, unless the points
   * do not tell the sides apart (warning `thin-parts`), and are nearer to a coarse surface with constraints outside only; the
   * choice takes about as long as the run itself. Where cameras or exterior points are given, these say which side is
   * outside.
   */
  sides?: 'auto' | 'both' | 'outside';
}

/** Measures of points, and the values that an implicit surface chose by them, in units of the normalised box. */
export interface ImplicitChoice {
  /** Noise of the points: their standard deviation from the surface along its normal; 0 for fewer than 100 points. */
  noise: number;
  /** Number of points on a unit of area. */
  density: number;
  /** The value of `lambdaSurface` if that is `'auto'`; given as a number, it has the same effect. */
  lambdaSurface: number;
  /** That of `lambdaExterior`. */
  lambdaExterior: number;
  /** That of `delta`. */
  delta: number;
  /** The value of `sides` in force; absent until it is known. */
  sides?: 'both' | 'outside';
}

/** A camera from which the points were reconstructed, or with which the mesh is coloured. */
export interface Camera {
  /**
   * Projection matrix, 3x4 world to pixel, row-major: (x s, y s, s) = P (p, 1). x to the right, y down, the centre of
   * the first pixel at (0, 0).
   */
  projection: ArrayLike<number>;
  /** Width of the camera's image, pixels. */
  width: number;
  /** Height of the camera's image, pixels. */
  height: number;
  /** Image for colouring the mesh, rgba8, row by row from the top; pixels with alpha 0 are ignored. */
  image?: Uint8ClampedArray;
}

/** Constructor options of an {@link ImplicitSurface}. Everything is copied. */
export interface ImplicitOptions {
  /** Packed xyz of noisy points near the closed surface: at least four, not in one plane. */
  points: PointArray;
  /** Packed outward normals of the points; they need not have unit length. */
  normals?: Float32Array;
  /**
   * Confidence of each point, above 0 and at most 1: the regularisation λ of its constraint is divided by it, so that
   * uncertain points constrain less.
   */
  confidence?: Float32Array;
  /** Packed rgb of each point, 0..1: colours the mesh if no camera image shows any of it. */
  colors?: Float32Array;
  /**
   * Packed points known to be outside the surface. By default they are made from the given points, by an offset towards
   * the cameras, or without cameras along the normals, given or estimated. Points on a sphere around all points are
   * always added.
   */
  exterior?: PointArray;
  /**
   * The cameras from which the points were reconstructed: exterior points are made towards them, and their images
   * colour the mesh.
   */
  cameras?: Camera[];
  /** Largest number of points used; more are reduced to a Poisson-disc subsample. 4 to 100,000, default 20,000. */
  maxPoints?: number;
  /**
   * Removes outliers: keeps only the n largest connected clusters of points; default all. If these are less than half as long
   * as all points, the normalised box is theirs.
   */
  keepComponents?: number;
  /**
   * Largest number of vertices of the surface, about; by default 350,000, or 24 for each point if these are more, which cells of
   * the default size do not reach. Beyond it, steps throw `too-large`.
   */
  maxVertices?: number;
  /** Initial parameters: any subset; the others have their defaults. */
  params?: ImplicitParams;
  /** Findings of the points' reader, for the `warnings` of the mesh; kinds of its own have the code `reader`. */
  warnings?: readonly Warning[];
}

/** Manual edits of the points of an {@link ImplicitSurface}, for {@link ImplicitSurface.setEdits}. */
export interface PointEdits {
  /** Packed points near the surface that are used in addition to the original ones. */
  added?: PointArray;
  /**
   * Points to leave out, by their zero-based index in the original points; others at the same positions are left out,
   * too.
   */
  removed?: Uint32Array;
  /** Packed points known to be outside the surface, used in addition to the other exterior points. */
  exterior?: PointArray;
}

/**
 * Distances of the points of an {@link ImplicitSurface} from its surface, and the curvature of that surface; returned
 * by {@link ImplicitSurface.fitness}.
 */
export interface Fitness {
  /** Mean distance of the points, as edited and without outliers, from the surface, in the points' units. */
  mean: number;
  /** Root mean square distance of these points from the surface, in the points' units. */
  rms: number;
  /** Largest distance of one of these points from the surface, in the points' units. */
  max: number;
  /** Mean of the absolute mean curvature |H| over the vertices of the surface, per unit of length of the points. */
  meanCurvature: number;
}

/**
 * Results of an {@link ImplicitSurface} that are not part of the {@link StepReport}, as the WebAssembly module returns
 * them.
 */
interface Statistics {
  cell: number;
  spacing: number;
  duplicates: number;
  outliers: number;
  spuriousComponents: number;
  choice?: ImplicitChoice;
  warning?: string;
}

const OPTIONS = [
  ...['points', 'normals', 'confidence', 'colors', 'exterior', 'cameras'],
  ...['maxPoints', 'keepComponents', 'maxVertices', 'params', 'warnings'],
];

/**
 * A smooth closed surface through sparse, noisy, uneven points with gaps: the zero set of a sum of radial basis
 * functions.
 *
 * After Dinh, Turk and Slabaugh, "Reconstructing surfaces by volumetric regularization using radial basis functions".
 * The stages, named by `phase` in the reports, are subsample, constraints, solve, extract and colour; a step is some
 * ten milliseconds of work on one of them. The mesh is empty until the first surface is complete, and then stays until
 * the next one is complete.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link ImplicitSurface.free}.
 */
export class ImplicitSurface implements Stepper {
  readonly #handle: Handle<RawImplicit>;
  readonly #meshHandle: Handle<import('./vesicle.js').RawMesh>;
  readonly #mesh: Mesh;
  readonly #runner = new Runner();
  readonly #warnings: ModelWarnings;

  /**
   * Creates a surface from points; the work begins with the first step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter: fewer than four different points,
   *   all in one plane, not finite, arrays of different lengths, values out of range.
   */
  constructor(given: ImplicitOptions) {
    const known = checked(given);
    this.#handle = new Handle('ImplicitSurface', () => rawSurface(known));
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    this.#warnings = new ModelWarnings(known.warnings);
    this.#mesh = wrapMesh(this.#meshHandle, true, () => this.#warnings.of());
  }

  /**
   * The model's surface in the points' units: the same live {@link Mesh} from start to end. It shows the last complete
   * surface, and is freed with the model.
   */
  get mesh(): Mesh {
    return this.#mesh;
  }

  /** Current values of all parameters; a copy. */
  get params(): Required<ImplicitParams> {
    return this.#handle.use((raw) => raw.params() as Required<ImplicitParams>);
  }

  /**
   * Edge of a cell of the grid on which the surface is extracted, in the points' units; 0 until it is derived from
   * their spacing.
   */
  get cell(): number {
    return this.#statistics().cell;
  }

  /**
   * Mean distance from a surface constraint to the nearest other one, in units of the normalised box; 0 until the
   * constraints are chosen.
   */
  get spacing(): number {
    return this.#statistics().spacing;
  }

  /**
   * Measures of the surface constraints, and the values chosen by them for parameters that are `'auto'`; `undefined` until
   * the constraints are selected.
   */
  get choice(): ImplicitChoice | undefined {
    return this.#statistics().choice;
  }

  /** Number of input points left out as duplicates of others. */
  get duplicates(): number {
    return this.#statistics().duplicates;
  }

  /** Number of different points in none of the clusters that `keepComponents` keeps; 0 until the constraints are chosen. */
  get outliers(): number {
    return this.#statistics().outliers;
  }

  /** Number of spurious components of the last surface: connected components with no surface constraint near. */
  get spuriousComponents(): number {
    return this.#statistics().spuriousComponents;
  }

  /**
   * Warning about a likely problem with the current parameters, though they are accepted; `undefined` if none is known.
   */
  get warning(): string | undefined {
    return this.#statistics().warning;
  }

  #statistics(): Statistics {
    return this.#handle.use((raw) => raw.statistics() as Statistics);
  }

  /**
   * Runs up to `iterations` slices of work, synchronous and deterministic; fewer if the surface is finished earlier.
   *
   * @returns The last report.
   * @throws {@link VesicleError} `singular-system` naming the likely cause; `too-large`; `invalid-argument`, naming the
   *   parameter, where too few points are left, or `cell` does not suit them, and while a {@link ImplicitSurface.run}
   *   is in progress. After an error the last surface stays, and other parameters may be set.
   */
  step(iterations = 1): StepReport {
    integer('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Runs to the end, yielding to the event loop between slices of work. Parameters may be changed meanwhile.
   *
   * @returns The last report.
   * @throws As {@link ImplicitSurface.step}; `signal.reason` when aborted, and the model stays usable; any error thrown
   *   by `onStep`.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#step(1), given);
  }

  #step(iterations: number): StepReport {
    return this.#warnings.take(this.#handle.use((raw) => raw.step(iterations) as StepReport));
  }

  /**
   * Changes any subset of the parameters of the live model. All values are validated before any is set. Only dependent
   * stages run again: for `cell` and `level` the extraction alone, for the others the solve and what follows.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter, `too-large`; nothing has changed then.
   */
  setParams(params: ImplicitParams): void {
    const values = shallowCopy('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /** Current manual edits of the points; a copy. */
  get edits(): Required<PointEdits> {
    return this.#handle.use((raw) => ({
      added: raw.added() as PointArray,
      removed: raw.removed(),
      exterior: raw.exterior() as PointArray,
    }));
  }

  /**
   * Replaces all manual edits of the points: some are added, some left out; `{}` discards all edits. Live: the surface
   * stays until the new one is complete, which depends on these edits, and not on those before or on when they are made. Up to
   * some 250 edits of each kind revise the system without edits, reusing its matrix and solution; more are solved from the
   * start. If only a subsample is used, a removed point is not replaced
   * by another.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the list that is wrong: a number that is not finite, a point
   *   farther than 1.5 times the longest side of the points' bounding box from its centre along an axis, an index that
   *   no point has, too few points left, all points in one plane, or a point both on the surface and outside; nothing
   *   has changed then.
   */
  setEdits(edits: PointEdits): void {
    const known = checkProperties('edits', edits, ['added', 'removed', 'exterior']) as PointEdits;
    const { added = new Float32Array(), removed = new Uint32Array(), exterior = new Float32Array() } = known;
    pointArray('added', added);
    pointArray('exterior', exterior);
    typedArray('removed', removed, Uint32Array);
    this.#handle.use((raw) => raw.setEdits(added, removed, exterior));
  }

  /**
   * Evaluates f minus its value at the surface (see `level`) at packed points: above 0 inside, 0 on the surface, below
   * 0 outside. Direct summation: some 4 ns for each pair of a point and a constraint. Each point by itself: of very many, a
   * part at a time gives the same bits.
   *
   * @throws {@link VesicleError} `invalid-argument` before the system is solved.
   */
  evaluate(points: PointArray): Float32Array {
    pointArray('points', points);
    return this.#handle.use((raw) => raw.evaluate(points));
  }

  /**
   * Evaluates the gradient of f, ∇f, at packed points, as packed vectors per unit of length of the points; on the
   * surface they point inwards. Takes half as long again as {@link ImplicitSurface.evaluate}, in parts likewise, and throws
   * the same.
   */
  gradient(points: PointArray): Float32Array {
    pointArray('points', points);
    return this.#handle.use((raw) => raw.gradient(points));
  }

  /**
   * Returns the surface constraints (the points used), the exterior constraints and those inside, of which there are only
   * with `sides: 'both'`, packed; empty until they are chosen. In double precision where the points need it.
   */
  constraints(): { surface: PointArray; exterior: PointArray; interior: PointArray } {
    const [surface, exterior, interior] = this.#handle.use((raw) => [0, 1, 2].map((kind) => raw.constraints(kind)));
    return {
      surface: surface as PointArray,
      exterior: exterior as PointArray,
      interior: interior as PointArray,
    };
  }

  /**
   * Measures distances of all points, with edits, from the surface, and the curvature of the surface.
   *
   * @throws {@link VesicleError} `invalid-argument` before there is a surface.
   */
  fitness(): Fitness {
    return this.#handle.use((raw) => raw.fitness() as Fitness);
  }

  /**
   * Returns the new surface before it is complete, for display: during extraction the part extracted so far, open where
   * the extraction continues, and during colouring all of it; empty in other phases.
   */
  preview(): Mesh {
    const warnings = this.#warnings.of();
    return wrapMesh(new Handle('Mesh', () => this.#handle.use((raw) => raw.preview())), false, () => warnings);
  }

  /**
   * Samples f minus its value at the surface (above 0 inside) on a grid of `dims` voxels around the points and the
   * surface, so that the deformable model can continue from it with `iso` 0.
   *
   * @throws {@link VesicleError} `invalid-argument` before the system is solved, or a number of voxels along an axis
   *   not from 2 to 4096; `too-large`.
   */
  toVolume(dims: Vec3): Volume {
    const sizes = gridSizes(dims);
    const warnings = this.#warnings.of();
    return wrapVolume(() => this.#handle.use((raw) => withWarnings(raw.toVolume(sizes), warnings)));
  }

  /**
   * Returns long operations that yield to the event loop between slices of work and can be aborted. Results and errors are
   * those of the methods of the same name, bit for bit; while a volume is sampled, the surface may change.
   *
   * @param options - `signal`: aborts operations, which reject with `signal.reason`; `budgetMs`: duration of a slice of
   *   work, milliseconds, default 12.
   * @throws {@link VesicleError} `invalid-argument`.
   */
  inSlices(options?: SliceOptions): ImplicitInSlices {
    const slices = checkedSlices(options);
    // Throws if the surface was freed.
    this.#handle.use(() => undefined);
    return {
      toVolume: async (dims) => {
        const sizes = gridSizes(dims);
        slices.signal?.throwIfAborted();
        const warnings = this.#warnings.of();
        const work = new Handle('ImplicitSurface', () => this.#handle.use((raw) => raw.toVolumeInSlices(sizes)));
        const raw = await finishInSlices(work, (one) => one.advance(), slices);
        return wrapVolume(() => withWarnings(raw, warnings));
      },
      colorize: async (cameras) => {
        const given = checkedCameras(cameras);
        slices.signal?.throwIfAborted();
        const begin = () => this.#handle.use((raw) => raw.colorizeInSlices(rawCameras(given)));
        const work = new Handle('ImplicitSurface', begin);
        await finishInSlices(work, (one) => this.#handle.use((raw) => (one.advance(raw) ? {} : undefined)), slices);
      },
    };
  }

  /**
   * Colours the mesh from photographs: each vertex gets the mean colour of the cameras that see it, weighted by alpha,
   * by the cosine between normal and viewing direction, and less at silhouettes; unseen vertices take their neighbours'
   * colours. Colours stay unchanged if no camera sees any of the mesh.
   *
   * @throws {@link VesicleError} `invalid-argument` before there is a surface, or where no camera has an image.
   */
  colorize(cameras: Camera[]): void {
    const given = checkedCameras(cameras);
    this.#handle.use((raw) => raw.colorize(rawCameras(given)));
  }

  /** Saves the whole state, for {@link ImplicitSurface.restore} of a surface made with the same points and options. */
  save(): Bytes {
    return this.#handle.use((raw) => raw.save() as Bytes);
  }

  /**
   * Restores a saved state, bit for bit. Takes as long as the choice of points and the phase in progress at the time of
   * saving took; for a state saved while colouring, as long as the extraction, too.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are not a saved state of a surface with the same points and
   *   options; the surface then stays unchanged; `invalid-argument` while a run is in progress.
   */
  restore(state: Uint8Array): void {
    typedArray('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#handle.use((raw) => raw.restore(state));
    this.#warnings.forget();
  }

  /** Frees the memory; the model and its live mesh cannot be used afterwards. */
  free(): void {
    this.#meshHandle.free();
    this.#handle.free();
  }

  /** The same as {@link ImplicitSurface.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function checked(given: ImplicitOptions): ImplicitOptions {
  const known = checkProperties('options', given, OPTIONS) as ImplicitOptions;
  pointArray('points', known.points);
  if (known.normals !== undefined) finite('normals', known.normals, 3);
  if (known.confidence !== undefined) finite('confidence', known.confidence, 1);
  if (known.colors !== undefined) finite('colors', known.colors, 3);
  if (known.exterior !== undefined) pointArray('exterior', known.exterior);
  if (known.maxPoints !== undefined) integer('maxPoints', known.maxPoints);
  if (known.keepComponents !== undefined) integer('keepComponents', known.keepComponents, { min: 1 });
  if (known.maxVertices !== undefined) integer('maxVertices', known.maxVertices, { min: 1 });
  const warnings = checkedWarnings('warnings', known.warnings);
  const [cameras, params] = [checkedCameras(known.cameras ?? []), shallowCopy('params', known.params ?? {})];
  return { ...known, cameras, params, warnings };
}

function checkedCameras(cameras: readonly Camera[]): Camera[] {
  return denseCopy('cameras', cameras).map((camera, index) => {
    const at = `cameras[${index}]`;
    const { projection, width, height, image } = checkProperties(at, camera, [
      'projection',
      'width',
      'height',
      'image',
    ]);
    if (image !== undefined) typedArray(`${at}.image`, image, Uint8ClampedArray);
    return {
      projection: numbers(`${at}.projection`, projection, 12),
      width: integer(`${at}.width`, width, { min: 1 }),
      height: integer(`${at}.height`, height, { min: 1 }),
      ...(image && { image }),
    };
  });
}

// Created last, when nothing else can fail: the consumer of the raw cameras frees them.
function rawCameras(cameras: readonly Camera[]): RawCameras {
  const raw = new RawCameras();
  try {
    for (const { projection, width, height, image } of cameras) {
      const bytes = image && new Uint8Array(image.buffer, image.byteOffset, image.byteLength);
      raw.push(Float64Array.from(projection), width, height, bytes);
    }
    return raw;
  } catch (error) {
    raw.free();
    throw error;
  }
}

function rawSurface(given: ImplicitOptions): RawImplicit {
  const { points, normals, confidence, colors, exterior, cameras = [], ...rest } = given;
  const { maxPoints, keepComponents, maxVertices, params } = rest;
  return new RawImplicit(
    points,
    normals,
    confidence,
    colors,
    exterior,
    rawCameras(cameras),
    maxPoints,
    keepComponents,
    maxVertices,
    params,
  );
}

function gridSizes(dims: Vec3): Uint32Array {
  return Uint32Array.from(numbers('dims', dims, 3), (size) => integer('dims', size, { min: 2, max: 4096 }));
}
