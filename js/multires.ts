import { invalid, knownOnly, list, plain, typed, vec3, whole } from './check.js';
import { type Mesh, meshHandle, wrapMesh } from './mesh.js';
import { Handle } from './runtime.js';
import { Runner, type RunOptions, type Stepper, type StepReport } from './stepper.js';
import { RawMultires, TrianglesOf } from './vesicle.js';
import type { Vec3 } from './volume.js';

/** A solid ellipsoid that the skin is spanned over. */
export interface ControlEllipsoid {
  /** Its middle. */
  center: Vec3;
  /** Three orthogonal semi-axes as vectors. Detail turns with them, so give them in the same order every time. */
  axes: [Vec3, Vec3, Vec3];
}

/** Parameters of the multiresolution model; `paramSpecs('multires')` has ranges, defaults and a sentence on each. */
export interface MultiresParams {
  /** ε_min: shorter edges are drawn together, in the mesh's units; by default such that the base has some 10,000 triangles. */
  edgeMin?: number;
  /** ε_max: longer edges are split; more than twice `edgeMin`. */
  edgeMax?: number;
  /** Levels of the solver above the target resolution. */
  levels?: number;
  /** q: from level to level, bounds of edges shrink by this factor. */
  refineFactor?: number;
  /** Umbrella iterations a level. */
  smoothing?: number;
  /** Applications of the operator D a step. */
  distribute?: number;
  /** How often edges of the base are halved for the detail, at the most: where it is finer than the base, or stretched. */
  supersample?: number;
  /** What the skin makes least: its area, or its bending. */
  energy?: 'membrane' | 'thin-plate';
  /** What becomes of a neck that is a thread, and of parts in contact. */
  topology?: 'never' | 'split' | 'split-and-join';
}

/** What a {@link MultiresolutionModel} is made of. Everything is copied. */
export interface MultiresOptions {
  /** The detailed surface, closed; left out: a bare membrane (lava lamp). */
  detail?: Mesh;
  /** Its low-frequency approximation, closed and without crossings; default: made by smoothing and coarsening. */
  base?: Mesh;
  /** At least one; one of them has to touch the base. */
  ellipsoids: ControlEllipsoid[];
  /** Any of them; the others have their defaults. */
  params?: MultiresParams;
}

/** What there is to tell beside the contract. */
interface Facts {
  bands: number;
  folded: number;
  missed: number;
  held: number;
}

const OPTIONS = ['detail', 'base', 'ellipsoids', 'params'];

/**
 * A detailed surface that is deformed, as far as you like, by ellipsoids under a skin that remeshes itself.
 *
 * After Kobbelt, Bareuther and Seidel, "Multiresolution shape deformations for meshes with dynamic vertex connectivity". A
 * step is one frame: the ellipsoids go on towards where they are to be, by as much as the skin can follow, the skin is
 * solved for, and the detail put back. It is done when they are there and the skin is at rest.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link MultiresolutionModel.free}.
 */
export class MultiresolutionModel implements Stepper {
  readonly #handle: Handle<RawMultires>;
  readonly #meshHandles: Handle<import('./vesicle.js').RawMesh>[];
  readonly #meshes: Mesh[];
  readonly #runner = new Runner();

  /**
   * A model before its first step: its surface is the base with the detail.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter: no ellipsoid, none that touches the base,
   *   axes that are not orthogonal or have no length, `edgeMax` not more than twice `edgeMin`, a detail that no base can be made
   *   of; `not-closed` for a detail or base that is open or not manifold; `self-intersecting` for a base that crosses itself;
   *   `too-large` for edges so short that the surface would have more than 200,000 vertices.
   */
  constructor(given: MultiresOptions) {
    const known = knownOnly('options', given, OPTIONS) as MultiresOptions;
    const packed = packedEllipsoids(known.ellipsoids);
    const params = plain('params', known.params ?? {});
    this.#handle = new Handle('MultiresolutionModel', () => {
      const [detail, base] = [triangles('detail', known.detail), triangles('base', known.base)];
      return new RawMultires(detail, base, packed, params);
    });
    this.#meshHandles = [0, 1, 2].map((which) => new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh(which))));
    this.#meshes = this.#meshHandles.map((handle) => wrapMesh(handle, true));
  }

  /** The surface with its detail, and texture coordinates where the finest surface has them: the same live object always. */
  get mesh(): Mesh {
    return this.#meshes[0] as Mesh;
  }

  /** The deformed low-frequency surface; live. */
  get baseMesh(): Mesh {
    return this.#meshes[1] as Mesh;
  }

  /** The map T: the vertices of {@link MultiresolutionModel.baseMesh} where they lie on the undeformed base; live. It may fold. */
  get linkMesh(): Mesh {
    return this.#meshes[2] as Mesh;
  }

  /** All parameters as they are now; a copy. */
  get params(): Required<MultiresParams> {
    return this.#handle.use((raw) => raw.params() as Required<MultiresParams>);
  }

  /** The ellipsoids where they are now, on their way; a copy. Some more may be vanishing. */
  get ellipsoids(): ControlEllipsoid[] {
    return unpackedEllipsoids(this.#handle.use((raw) => raw.ellipsoids()));
  }

  /** The ellipsoids where they are to be; a copy. */
  get goals(): ControlEllipsoid[] {
    return unpackedEllipsoids(this.#handle.use((raw) => raw.goals()));
  }

  /** Surfaces of the decomposition from the base to the detail, both among them. */
  get bands(): number {
    return this.#facts().bands;
  }

  /** Triangles of the base whose image under T is turned over. */
  get folded(): number {
    return this.#facts().folded;
  }

  /** Vertices of the mesh whose normal on the base did not meet the detail: the nearest point stands in. */
  get missed(): number {
    return this.#facts().missed;
  }

  /** Vertices of the mesh whose detail was held back, so that nothing crosses. */
  get held(): number {
    return this.#facts().held;
  }

  #facts(): Facts {
    return this.#handle.use((raw) => raw.facts() as Facts);
  }

  /**
   * Sends the ellipsoids to new places, each by its index; a step takes them half a semi-axis on their way. Those beyond the
   * ones before grow from nothing, or come out of the nearest one where their place is outside of the surface; those left out
   * shrink and vanish.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the ellipsoid; nothing has changed then.
   */
  setEllipsoids(ellipsoids: ControlEllipsoid[]): void {
    const packed = packedEllipsoids(ellipsoids);
    this.#handle.use((raw) => raw.setEllipsoids(packed));
  }

  /**
   * So many frames at once, synchronous and deterministic; fewer where all is at rest before.
   *
   * @returns The report of the last, with the events of all.
   * @throws {@link VesicleError} `too-large` where the surface would have too many vertices, and then stays as it was;
   *   `invalid-argument` while a {@link MultiresolutionModel.run} is under way.
   */
  step(iterations = 1): StepReport {
    whole('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Until all is at rest, yielding to the event loop between frames. Ellipsoids and parameters may be changed meanwhile.
   *
   * @returns The last report.
   * @throws As {@link MultiresolutionModel.step}; `signal.reason` when aborted, and the model stays usable; what `onStep` throws.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#step(1), given);
  }

  #step(iterations: number): StepReport {
    return this.#handle.use((raw) => raw.step(iterations) as StepReport);
  }

  /**
   * How much T distorts, per vertex of {@link MultiresolutionModel.baseMesh}: `area` is the area on the undeformed base over
   * that on the deformed one, 1 where it is kept; `angle` the longest over the shortest stretch of directions, 1 where angles are.
   */
  distortion(): { area: Float32Array; angle: Float32Array } {
    return this.#handle.use((raw) => ({ area: raw.distortion(0), angle: raw.distortion(1) }));
  }

  /** The meshes that the skin is solved on for the ellipsoids as they are, from coarse to fine; copies. */
  levelMeshes(): Mesh[] {
    const levels = this.#handle.use((raw) => raw.levelMeshes());
    return levels.map((level) => wrapMesh(new Handle('Mesh', () => level)));
  }

  /**
   * Live parameters: any subset, validated as a whole before any of it is taken.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter, `too-large`; nothing has changed then.
   */
  setParams(params: MultiresParams): void {
    const values = plain('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /** The whole state, for {@link MultiresolutionModel.restore} of a model made of the same meshes and first ellipsoids. */
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

  /** Gives the memory back; the model and its live meshes cannot be used afterwards. */
  free(): void {
    for (const handle of this.#meshHandles) handle.free();
    this.#handle.free();
  }

  /** The same as {@link MultiresolutionModel.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function triangles(parameter: string, mesh: Mesh | undefined): TrianglesOf | undefined {
  return mesh === undefined ? undefined : meshHandle(parameter, mesh).use((raw) => new TrianglesOf(raw));
}

function packedEllipsoids(ellipsoids: readonly ControlEllipsoid[]): Float64Array<ArrayBuffer> {
  const numbers = list('ellipsoids', ellipsoids).flatMap((ellipsoid, index) => {
    const at = `ellipsoids[${index}]`;
    const { center, axes } = knownOnly(at, ellipsoid, ['center', 'axes']);
    const vectors = [center, ...list(`${at}.axes`, axes ?? [])];
    if (vectors.length !== 4) throw invalid(`${at}.axes`, `${vectors.length - 1} given; three are needed`);
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
