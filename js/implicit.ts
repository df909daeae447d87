import { finite, knownOnly, list, numbers, plain, typed, whole } from './check.js';
import { type Mesh, wrapMesh } from './mesh.js';
import { call, Handle } from './runtime.js';
import { Runner, type RunOptions, type Stepper, type StepReport } from './stepper.js';
import { RawCameras, RawImplicit, RawPoints } from './vesicle.js';
import { type Vec3, type Volume, wrapVolume } from './volume.js';

/** Parameters of the implicit surface; `paramSpecs('implicit')` has ranges, defaults and a sentence on each. Lengths but `cell` are in units of the box, in which the longest side of the points' bounds is 2. */
export interface ImplicitParams {
  /** The radial function, φ: the paper's, or one to compare it with: |r|³, −|r|, exp(−r²/2σ²). */
  kernel?: 'multi-order' | 'thin-plate' | 'biharmonic' | 'gaussian';
  /** First-order smoothness, δ: more of it, a tighter surface. */
  delta?: number;
  /** Third-order smoothness, τ: more of it, less detail. */
  tau?: number;
  /** Width of the Gaussian, σ. */
  sigma?: number;
  /** λ of surface constraints; 0 interpolates. With more than 3,000 points it counts n/3,000 times. */
  lambdaSurface?: number;
  /** λ of exterior constraints. */
  lambdaExterior?: number;
  /** Relative residual of the solve. */
  tolerance?: number;
  /** Edge of an extraction cell in the points' units; 0, the default, takes it from their spacing. */
  cell?: number;
  /** The value of f that the surface is taken at: 0, or the mean of f over the surface constraints. */
  level?: 'zero' | 'mean';
}

/** A camera that the points were made from. */
export interface Camera {
  /**
   * 3x4 world to pixel, row-major: (x s, y s, s) = P (p, 1). x to the right, y down, the centre of the first pixel at
   * (0, 0).
   */
  projection: ArrayLike<number>;
  /** Pixels of a row. */
  width: number;
  /** Rows. */
  height: number;
  /** rgba8, row by row from the top, for colouring the mesh; alpha 0 leaves a pixel out. */
  image?: Uint8ClampedArray;
}

/** What an {@link ImplicitSurface} is made of. Everything is copied. */
export interface ImplicitOptions {
  /** Packed xyz: near an unknown closed surface, at least four, not in one plane. */
  points: Float32Array;
  /** Of each point, packed, outwards; of any length. */
  normals?: Float32Array;
  /** Of each point, above 0 and at most 1: λ is divided by it, so that unsure points bind less. */
  confidence?: Float32Array;
  /** Of each point, packed rgb, 0..1: colours the mesh where no camera saw it. */
  colors?: Float32Array;
  /** Points known to be outside, packed. Else made from cameras, normals, or the points alone. */
  exterior?: Float32Array;
  /** The cameras that the points were made from. */
  cameras?: Camera[];
  /** Poisson-disc subsample above this; 4 to 100,000, default 20,000. */
  maxPoints?: number;
  /** Outliers: keep the n largest connected clusters; default all. */
  keepComponents?: number;
  /** Any of them; the others have their defaults. */
  params?: ImplicitParams;
}

/** What differs from the points as they were given. */
export interface PointEdits {
  /** More points near the surface, packed. */
  added?: Float32Array;
  /** Points to leave out, by their index in those given. */
  removed?: Uint32Array;
  /** More points known to be outside, packed. */
  outside?: Float32Array;
}

/** How well a surface fits its points, in their units. */
export interface Fitness {
  /** Mean distance of all the original points from the surface. */
  mean: number;
  /** Root of the mean squared distance. */
  rms: number;
  /** The largest distance. */
  max: number;
  /** Mean of |H| over the vertices, per unit. */
  meanCurvature: number;
}

/** What there is to tell beside the contract. */
interface Facts {
  cell: number;
  spacing: number;
  duplicates: number;
  strays: number;
  warning?: string;
}

const OPTIONS = [
  ...['points', 'normals', 'confidence', 'colors', 'exterior', 'cameras'],
  ...['maxPoints', 'keepComponents', 'params'],
];

/**
 * Points of a file: PLY, OBJ, XYZ, PTS or CSV, detected from the bytes. Colours are rgb, 0..1.
 *
 * @throws {@link VesicleError} `bad-file` naming the format and the field or line.
 */
export function parsePoints(bytes: Uint8Array): {
  points: Float32Array;
  normals?: Float32Array;
  colors?: Float32Array;
} {
  typed('bytes', bytes, Uint8Array);
  return call(() => {
    const raw = RawPoints.parse(bytes);
    const [points, normals, colors] = [raw.points(), raw.normals(), raw.colors()];
    raw.free();
    return { points, ...(normals && { normals }), ...(colors && { colors }) };
  });
}

/**
 * A smooth closed surface through sparse, noisy, uneven points with gaps: where a sum of radial functions is 0.
 *
 * After Dinh, Turk and Slabaugh, "Reconstructing surfaces by volumetric regularization using radial basis functions". Its
 * stages are the phases of the reports: subsample, constraints, solve, extract, colour; a step is a slice of some ten
 * milliseconds of one of them. The mesh is empty until the first surface is complete, and stays until the next one is.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link ImplicitSurface.free}.
 */
export class ImplicitSurface implements Stepper {
  readonly #handle: Handle<RawImplicit>;
  readonly #meshHandle: Handle<import('./vesicle.js').RawMesh>;
  readonly #mesh: Mesh;
  readonly #runner = new Runner();

  /**
   * A surface before its first step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter: fewer than four different points, all
   *   in one plane, not finite, arrays of different lengths, values out of range.
   */
  constructor(given: ImplicitOptions) {
    const known = checked(given);
    this.#handle = new Handle('ImplicitSurface', () => rawSurface(known));
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    this.#mesh = wrapMesh(this.#meshHandle, true);
  }

  /** The surface: the same live object from start to end, in the points' units. It goes when the model is freed. */
  get mesh(): Mesh {
    return this.#mesh;
  }

  /** All parameters as they are now; a copy. */
  get params(): Required<ImplicitParams> {
    return this.#handle.use((raw) => raw.params() as Required<ImplicitParams>);
  }

  /** Edge of an extraction cell in the points' units; 0 until it is taken from their spacing. */
  get cell(): number {
    return this.#facts().cell;
  }

  /** Mean distance from a point that takes part to the nearest other, in units of the box; 0 until they are chosen. */
  get spacing(): number {
    return this.#facts().spacing;
  }

  /** How many points were equal to others, and left out. */
  get duplicates(): number {
    return this.#facts().duplicates;
  }

  /** How many pieces of the last surface no point is near. */
  get strays(): number {
    return this.#facts().strays;
  }

  /** What may go wrong with the parameters as they are, though they are accepted; `undefined` where nothing is known. */
  get warning(): string | undefined {
    return this.#facts().warning;
  }

  #facts(): Facts {
    return this.#handle.use((raw) => raw.facts() as Facts);
  }

  /**
   * So many slices of work at once, synchronous and deterministic; fewer where the end comes first.
   *
   * @returns The report of the last one.
   * @throws {@link VesicleError} `singular-system` naming the likely cause; `too-large`; `invalid-argument` while a
   *   {@link ImplicitSurface.run} is under way. The last surface stays, and other parameters may be set.
   */
  step(iterations = 1): StepReport {
    whole('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * To the end, yielding to the event loop between slices. Parameters may be changed meanwhile.
   *
   * @returns The last report.
   * @throws As {@link ImplicitSurface.step}; `signal.reason` when aborted, and the model stays usable; what `onStep` throws.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#step(1), given);
  }

  #step(iterations: number): StepReport {
    return this.#handle.use((raw) => raw.step(iterations) as StepReport);
  }

  /**
   * Live parameters: any subset, validated as a whole before any of it is taken. What does not depend on them is not done
   * again: for `cell` and `level` the extraction alone, for the others the solve and what follows.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter; nothing has changed then.
   */
  setParams(params: ImplicitParams): void {
    const values = plain('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /** Points by hand as they are now; a copy. */
  get edits(): Required<PointEdits> {
    return this.#handle.use((raw) => ({
      added: raw.added(),
      removed: raw.removed(),
      outside: raw.outside(),
    }));
  }

  /**
   * Takes points in and leaves some out, in place of all edits before; `{}` takes all back. Live: the surface stays until
   * the new one is there. Up to some 250 of each change the system that was solved last, whose matrix and solution
   * serve again; more are solved from the start. Where not all points take part, none takes the place of one left out.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the list: not finite, farther from the others than their own
   *   size, no such index, too few points left, on the surface and outside at once; nothing has changed then.
   */
  setEdits(edits: PointEdits): void {
    const known = knownOnly('edits', edits, ['added', 'removed', 'outside']) as PointEdits;
    const { added = new Float32Array(), removed = new Uint32Array(), outside = new Float32Array() } = known;
    finite('added', added, 3);
    finite('outside', outside, 3);
    typed('removed', removed, Uint32Array);
    this.#handle.use((raw) => raw.setEdits(added, removed, outside));
  }

  /**
   * f at packed points: above 0 inside, 0 on the surface, below 0 outside. Summed term by term: some 3 ns for each pair of
   * a point and a constraint.
   *
   * @throws {@link VesicleError} `invalid-argument` before the system is solved.
   */
  evaluate(points: Float32Array): Float32Array {
    finite('points', points, 3);
    return this.#handle.use((raw) => raw.evaluate(points));
  }

  /** ∇f at packed points, packed, per unit of theirs; it points inwards. Throws as {@link ImplicitSurface.evaluate}. */
  gradient(points: Float32Array): Float32Array {
    finite('points', points, 3);
    return this.#handle.use((raw) => raw.gradient(points));
  }

  /** The points that take part, and the exterior ones, packed; empty until they are chosen. */
  constraints(): { surface: Float32Array; exterior: Float32Array } {
    return this.#handle.use((raw) => ({ surface: raw.constraints(0), exterior: raw.constraints(1) }));
  }

  /**
   * Distances of all points, with edits, from the surface, and its curvature.
   *
   * @throws {@link VesicleError} `invalid-argument` before there is a surface.
   */
  fitness(): Fitness {
    return this.#handle.use((raw) => raw.fitness() as Fitness);
  }

  /** The surface that is being extracted, as far as it was followed: open where it goes on; empty in other phases. */
  preview(): Mesh {
    return wrapMesh(new Handle('Mesh', () => this.#handle.use((raw) => raw.preview())));
  }

  /**
   * f sampled on a grid around the points and the surface, so that the deformable model can take over with iso 0.
   *
   * @throws {@link VesicleError} `invalid-argument` before the system is solved, or below 2 voxels along an axis;
   *   `too-large`.
   */
  toVolume(dims: Vec3): Volume {
    const sizes = Uint32Array.from(numbers('dims', dims, 3), (size) => whole('dims', size, { min: 2, max: 4096 }));
    return wrapVolume(() => this.#handle.use((raw) => raw.toVolume(sizes)));
  }

  /**
   * Colours the mesh from photographs: of the cameras that see a vertex the mean colour, weighted by the cosine between normal
   * and viewing direction; unseen vertices take their neighbours'.
   *
   * @throws {@link VesicleError} `invalid-argument` before there is a surface, or where no camera has an image.
   */
  colorize(cameras: Camera[]): void {
    const given = checkedCameras(cameras);
    this.#handle.use((raw) => raw.colorize(rawCameras(given)));
  }

  /** The whole state, for {@link ImplicitSurface.restore} of a surface made with the same points and options. */
  save(): Uint8Array {
    return this.#handle.use((raw) => raw.save());
  }

  /**
   * Back to a saved state, bit for bit. Takes as long as choosing the points and the phase then under way had taken; while
   * colouring, as long as the extraction, too.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are no state of such a surface, which then stays as it was;
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

  /** The same as {@link ImplicitSurface.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function checked(given: ImplicitOptions): ImplicitOptions {
  const known = knownOnly('options', given, OPTIONS) as ImplicitOptions;
  finite('points', known.points, 3);
  if (known.normals !== undefined) finite('normals', known.normals, 3);
  if (known.confidence !== undefined) finite('confidence', known.confidence, 1);
  if (known.colors !== undefined) finite('colors', known.colors, 3);
  if (known.exterior !== undefined) finite('exterior', known.exterior, 3);
  if (known.maxPoints !== undefined) whole('maxPoints', known.maxPoints);
  if (known.keepComponents !== undefined) whole('keepComponents', known.keepComponents, { min: 1 });
  return { ...known, cameras: checkedCameras(known.cameras ?? []), params: plain('params', known.params ?? {}) };
}

function checkedCameras(cameras: readonly Camera[]): Camera[] {
  return list('cameras', cameras).map((camera, index) => {
    const at = `cameras[${index}]`;
    const { projection, width, height, image } = knownOnly(at, camera, ['projection', 'width', 'height', 'image']);
    if (image !== undefined) typed(`${at}.image`, image, Uint8ClampedArray);
    return {
      projection: numbers(`${at}.projection`, projection, 12),
      width: whole(`${at}.width`, width, { min: 1 }),
      height: whole(`${at}.height`, height, { min: 1 }),
      ...(image && { image }),
    };
  });
}

// Made last, when nothing else can fail: whoever takes it frees it.
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
  const { points, normals, confidence, colors, exterior, cameras = [], maxPoints, keepComponents, params } = given;
  return new RawImplicit(
    points,
    normals,
    confidence,
    colors,
    exterior,
    rawCameras(cameras),
    maxPoints,
    keepComponents,
    params,
  );
}
