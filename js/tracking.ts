import { checkProperties, integer, invalid, shallowCopy, typedArray, vec3 } from './check.js';
import type { Bytes, SpaceOptions, Vec3 } from './data.js';
import { type Mesh, meshHandle, wrapMesh } from './mesh.js';
import { checkedSpaceOptions, frameOf, type MeshFrame, SPACE_OPTIONS } from './mesh-file.js';
import { Handle } from './runtime.js';
import { isOfSmall, limitOf, MOST_TRACKED_OF_SMALL, MOST_VOXELS_OF_SMALL } from './small-files.js';
import {
  checkedSlices,
  finishInSlices,
  type RunOptions,
  SlicedRunner,
  type SliceOptions,
  type Stepper,
  type StepReport,
} from './stepper.js';
import { RawProposal, RawTracker, RawTrackerCreation, RawTrackingOptions, TriangleCopy } from './vesicle.js';
import { type Volume, volumeHandle } from './volume.js';
import type { Warning } from './warning.js';
import { ModelWarnings, notesOf } from './warnings.js';

/** Parameters of the tracker; `paramSpecs('tracking')` has their ranges, defaults and descriptions. */
export interface TrackingParams {
  /**
   * Edge threshold τ: the mean intensities of the two clusters (bright and dark voxels) of a window must differ by more
   * than this for a boundary, intensity units; by default, or if 0, derived from the noise and the intensity range.
   */
  threshold?: number;
  /** k: the window in which voxels are clustered into bright and dark ones is 2k + 1 voxels wide along each axis. */
  window?: number;
  /**
   * Number of frames before and after its own that a window of clustered voxels covers; 0 treats each frame separately.
   */
  windowFrames?: number;
  /**
   * Radius around a position beyond which boundary points have no weight θ in the plane fitted there, world units: 2h;
   * by default, or if 0, derived from the voxel size: 2.4 times the shortest side, or 1.2 times the longest if that is
   * more. From 1 to 15 times the shortest side.
   */
  radius?: number;
  /** Time scale c: the distance that one frame counts as, world units; by default, or if 0, derived from the radius. */
  timeScale?: number;
  /**
   * Damping β: each step of the projection of a vertex onto the boundary is scaled by this factor relative to the one
   * before, down to 0.2 of the first.
   */
  damping?: number;
  /** c_min: edges shorter than this are collapsed, in units of the first frame's mean edge. */
  edgeMin?: number;
  /** c_max: edges longer than this are split, in units of the first frame's mean edge; more than twice `edgeMin`. */
  edgeMax?: number;
  /**
   * Whether tracking in each frame starts from a prediction, by the surface's motion in the frame before; else it
   * starts from the previous frame's surface.
   */
  prediction?: boolean;
  /**
   * Whether the sequence is periodic: the first frame follows the last. The last step then tracks the surface on into
   * the first frame, for {@link SurfaceTracker.cycleClosureError}.
   */
  cyclic?: boolean;
}

/** Constructor options of a {@link SurfaceTracker}. Everything is copied. */
export interface TrackingOptions {
  /** 4D volume with at least two frames and orthogonal voxel axes. */
  volume: Volume;
  /**
   * Region to process, corners in world space; default the whole volume. Bright objects that extend beyond it are
   * closed at its faces. If the volume's axes are rotated against those of the world, the region is the bounding box of
   * `box` along the volume's axes.
   */
  box?: { min: Vec3; max: Vec3 };
  /** Region to process as in `box`, but given by its first and last voxel along x, y and z, both inclusive. */
  voxels?: { min: Vec3; max: Vec3 };
  /**
   * Connected component of the surface to track: the largest in the first frame (the default), or the one that encloses
   * a point in world space, the outermost if there are several, or has the vertex nearest to it.
   */
  component?: 'largest' | Vec3;
  /**
   * Initial surface in the first frame, closed and without self-intersections, in world space; by default it is
   * extracted from the image.
   */
  start?: Mesh;
  /**
   * The inside of the surface: with `'open'` (the default) only what is bright, as in the paper; with `'closed'`
   * also dark structures within a cavity, such as papillary muscles and trabeculae, as in clinical measurements. States
   * saved before there was a choice are `'open'`.
   */
  cavity?: 'closed' | 'open';
  /**
   * Largest number of vertices of the surface; a run that would exceed it fails with `too-large`. By default, and at most,
   * 4 million, or 200,000 by default if the files of the volume have at most 128 KiB, all together: these may come from
   * anyone and unpack to a lattice of any size. The contour of all objects in the box, which the surface is chosen from,
   * has at most eight times as many triangles.
   */
  maxVertices?: number;
  /**
   * Largest number of voxels of the box in one frame, with two more on every side; steps in a larger one fail with
   * `too-large`. All frames together have at most eight times as many, and their boundary as many points. By default as many as fit into memory, or
   * 8 million if the files of the volume have at most 128 KiB, all together.
   */
  maxVoxels?: number;
  /** Initial parameters: any subset; the others have their defaults, some of which are derived from the volume. */
  params?: TrackingParams;
}

/** An object, for {@link SurfaceTracker.propose}: given by `point` or `box`, or by neither, as the one that moves most. */
export interface ObjectQuery {
  /** A point in the object, world space. */
  point?: Vec3;
  /** The frame in which the point is in the object; default the first. */
  frame?: number;
  /** A box with the object, corners in world space: what moves most in it; the proposed box lies within it. */
  box?: { min: Vec3; max: Vec3 };
}

/** Options proposed by {@link SurfaceTracker.propose}. */
export interface TrackingProposal {
  /** For the constructor of a tracker, together with the volume. */
  options: {
    /** Box around the object in all frames, with a margin: first and last voxel along x, y and z. */
    voxels: { min: Vec3; max: Vec3 };
    /** Point in the middle of the object in the first frame that has it, world space. */
    component: Vec3;
    /** Muscles within a chamber of a heart count as blood. */
    cavity: 'closed';
    params: {
      /** Edge threshold, intensity units. */
      threshold: number;
    };
  };
  /** The first frame that has the object. */
  frame: number;
}

/** Statistics of the surface in one tracked frame, as listed by {@link SurfaceTracker.statistics}. */
export interface FrameStatistics {
  /** Volume enclosed by the surface, world units cubed; 0 in a frame without the object, as are all other numbers. */
  volume: number;
  /** Surface area, world units squared. */
  area: number;
  triangles: number;
  /** Number of triangles that stay folded: they face away from the sum of the normals of their three neighbours. */
  folded: number;
  /**
   * Number of rejected projections of vertices onto the boundary, which found too few boundary points or only a plane
   * nearly parallel to the frame, or moved too far; these vertices follow their neighbours.
   */
  rejected: number;
  /** Number of vertex displacements reduced to avoid self-intersections. */
  heldMoves: number;
  /**
   * Number of vertices without boundary points nearby: collapsed where a narrow gap has closed, grown where one has
   * opened, else smoothed.
   */
  withoutBoundary: number;
  /**
   * Mean number of projection steps per vertex, in the projections onto the boundary in space-time and in the frame
   * together.
   */
  steps: number;
  /** Mean displacement of the vertices by the last projection onto the boundary, world units. */
  meanFinalCorrection: number;
}

interface Statistics {
  noise: number;
  cycleClosureError?: number;
  frames: FrameStatistics[];
}

const OPTIONS = ['volume', 'box', 'voxels', 'component', 'start', 'cavity', 'maxVertices', 'maxVoxels', 'params'];

/** Duration of a frame in {@link SurfaceTracker.toGlb}, seconds, for volumes that do not define it. */
const FRAME_SECONDS = 0.1;

/**
 * Tracks a surface through the frames of a 4D image. Slices far apart should have others inserted between them before, by
 * {@link Volume.enrichSlices}: the tracker does not do that.
 *
 * After "Dynamic surfaces from 4D cardiac MRI": local clustering in windows votes for the faces between bright and dark
 * voxels, the votes are weighted points in space-time, and the surface is projected onto the surface they define, frame
 * by frame. Each step finds the boundary in one more frame; once all are found, each step tracks the surface into one
 * more frame. The surface is in the volume's world space; it stays closed and free of self-intersections.
 *
 * In frames in which the image has no object where the surface was, the surface is empty; it begins again where an
 * object appears. {@link StepReport.warnings} names these frames (`ends-in-frame`, `begins-in-frame`), those in which the
 * object is too small or thin for the radius of plane fits or the thickness of slices (`small-object`), and those whose
 * intensities at the surface differ too much from other frames (`uneven-brightness`); further, those that the box cuts
 * (`touches-box`), that have handles (`handles`), with hardly a boundary (`no-boundary`), and whose volume jumps
 * (`volume-jump`). Voxels that are NaN or negative infinity are outside.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link SurfaceTracker.free}.
 */
export class SurfaceTracker implements Stepper {
  readonly #handle: Handle<RawTracker>;
  readonly #meshHandle: Handle<import('./vesicle.js').RawMesh>;
  readonly #mesh: Mesh;
  readonly #runner: SlicedRunner<RawTracker, StepReport>;
  readonly #warnings: ModelWarnings;
  readonly #frame: MeshFrame;
  readonly #frameSeconds: number;

  /**
   * Creates a tracker; the work begins with the first step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter: a volume of one frame, without
   *   contrast or with slanted axes, one or a box with fewer than 5 voxels along two axes, or along the third fewer than
   *   2 or less than three times the shortest side of a voxel, such as a single slice, slices more than 12.5 pixels apart
   *   without a given `radius`, a box outside of it, a start that is empty, inside out, outside the box or with a mean edge
   *   below a tenth of a voxel; `not-closed`, `self-intersecting` for a start that is;
   *   `too-large`, also for a start with more than `maxVertices`.
   */
  constructor(given: TrackingOptions) {
    const created = given instanceof Created ? given : undefined;
    const known = created ? created.options : checked(given);
    this.#frameSeconds = volumeHandle('volume', known.volume).use((raw) => raw.frameSeconds()) || FRAME_SECONDS;
    const make = () => beginning(known, (of) => new RawTracker(of));
    this.#handle = created ? created.handle : new Handle('SurfaceTracker', make());
    this.#runner = new SlicedRunner(this.#handle, (report) => this.#warnings.take(report));
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    this.#warnings = new ModelWarnings(known.volume.warnings, known.start?.warnings);
    this.#frame = frameOf(known.volume);
    this.#mesh = wrapMesh(this.#meshHandle, true, () => this.#warningsAt(this.frame), this.#frame);
  }

  /**
   * Creates a tracker as the constructor does, bit for bit, yielding to the event loop between slices of work: reading a long
   * sequence takes seconds. The volume must not be freed before.
   *
   * @param options - `signal`: aborts the creation; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws As the constructor; `signal.reason` when aborted.
   */
  static async create(given: TrackingOptions, options?: SliceOptions): Promise<SurfaceTracker> {
    const slices = checkedSlices(options);
    slices.signal?.throwIfAborted();
    const known = checked(given);
    const creation = new Handle(
      'SurfaceTracker',
      beginning(known, (of) => new RawTrackerCreation(of)),
    );
    const raw = await finishInSlices(creation, (one) => one.advance(), slices);
    const handle = new Handle('SurfaceTracker', () => raw);
    return new SurfaceTracker(new Created(known, handle) as unknown as TrackingOptions);
  }

  /**
   * Proposes options of a tracker from a point in a bright object, such as one click, from a box, or from nothing but the
   * sequence, yielding to the event loop between slices of work: `new SurfaceTracker({ volume, ...proposal.options })`. Slices
   * far apart should have others inserted between them before, by {@link Volume.enrichSlices}.
   *
   * @param query - A point of the object or a box around it; by default the object that moves most.
   * @param options - `signal`: aborts the work; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws {@link VesicleError} `invalid-argument` with the reason why there is no proposal: naming `point` if there is no
   *   bright object with darker surroundings, `frame`, or `box` or `volume` if nothing moves there, or there is one frame;
   *   `too-large`; `signal.reason` when aborted.
   */
  static async propose(volume: Volume, query?: ObjectQuery, options?: SliceOptions): Promise<TrackingProposal> {
    const slices = checkedSlices(options);
    slices.signal?.throwIfAborted();
    const image = volumeHandle('volume', volume);
    const known = checkProperties<ObjectQuery>('query', query, ['point', 'frame', 'box']);
    const [at, box] = [known.point && vec3('point', known.point), corners(known.box)];
    if (at && box) throw invalid('box', 'give either point or box, not both');
    const frame = integer('frame', known.frame ?? 0);
    const proposal = new Handle('SurfaceTracker', () => image.use((raw) => new RawProposal(raw, at, frame, box)));
    return finishInSlices(proposal, (one) => one.advance() as TrackingProposal | undefined, slices);
  }

  /**
   * The surface of the current frame: the same live {@link Mesh} from start to end. Before the first frame is done it
   * is the initial surface given as `start`, or empty.
   */
  get mesh(): Mesh {
    return this.#mesh;
  }

  /** Index of the frame shown by {@link SurfaceTracker.mesh}, from 0; also 0 before the first frame is done. */
  get frame(): number {
    return this.#runner.use((raw) => raw.frame());
  }

  /**
   * Origin of the surfaces and boundary points in world space, to which their coordinates are relative: 0 unless the
   * volume is far from the world's origin for its size, where single precision would be too coarse.
   */
  get origin(): Vec3 {
    return this.#handle.use((raw) => [...raw.origin()] as unknown as Vec3);
  }

  /** Number of frames of the volume. */
  get frames(): number {
    return this.#counts()[0];
  }

  /**
   * Standard deviation of the noise in the box, intensity units. With τ below 2.5 times this, noise is detected as
   * boundary.
   */
  get noise(): number {
    return this.#statistics().noise;
  }

  /**
   * Cycle closure error of a cyclic sequence, undefined until all frames are done, and if the surface is empty in the
   * first or the last: the mean distance between the last frame's surface, tracked on into the first frame, and the first
   * frame's surface, world units.
   */
  get cycleClosureError(): number | undefined {
    return this.#statistics().cycleClosureError;
  }

  /** Statistics of the frames tracked so far, in order. */
  get statistics(): FrameStatistics[] {
    return this.#statistics().frames;
  }

  /** Current values of all parameters; a copy. */
  get params(): Required<TrackingParams> {
    return this.#runner.use((raw) => raw.params() as Required<TrackingParams>);
  }

  #statistics(): Statistics {
    return this.#runner.use((raw) => raw.statistics() as Statistics);
  }

  #counts(): [number, number, number] {
    return [...this.#runner.use((raw) => raw.counts())] as [number, number, number];
  }

  /**
   * Runs up to `iterations` steps of one frame each, first to find the boundaries and then to track the surface,
   * synchronous and deterministic; fewer if the tracker finishes earlier.
   *
   * @returns The last report, with the events of all steps.
   * @throws {@link VesicleError} `invalid-argument`: naming `threshold`, and the value that it must be below, if no
   *   boundary is found; naming `box` if there is no surface in any frame; while a {@link SurfaceTracker.run} is
   *   in progress. `too-large`.
   */
  step(iterations = 1): StepReport {
    integer('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Tracks the surface to the last frame, yielding to the event loop between slices of work, also within a step. Whatever is
   * asked of the tracker meanwhile ends a step that is under way first.
   *
   * @returns The last report.
   * @throws As {@link SurfaceTracker.step}; `signal.reason` when aborted, and the tracker is as after the last step that ended,
   *   and stays usable; any error thrown by `onStep`.
   */
  async run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(given);
  }

  #step(iterations: number): StepReport {
    return this.#warnings.take(this.#handle.use((raw) => raw.step(iterations) as StepReport));
  }

  /**
   * Changes any subset of the parameters of the live tracker. All values are validated before any is set. `threshold`,
   * `window`, `windowFrames` and `cyclic` restart from the first step, the others apply from the next frame on.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter; nothing has changed then.
   */
  setParams(params: TrackingParams): void {
    const values = shallowCopy('params', params);
    this.#runner.use((raw) => raw.setParams(values));
  }

  /**
   * Returns the boundary votes as weighted space-time points, five numbers each: x, y, z relative to
   * {@link SurfaceTracker.origin}, t in frames, and the weight w, the fraction of windows that separate the two voxels of a face. A face between a voxel in this
   * frame and the same voxel in the next has t half a frame later.
   *
   * @param frame - Index of the frame; default the newest with a boundary. A frame whose boundary is not found yet has
   *   no points.
   * @throws {@link VesicleError} `invalid-argument`: no such frame.
   */
  boundary(frame?: number): Float32Array {
    const [frames, bounded] = this.#counts();
    const at = frame === undefined ? Math.max(bounded - 1, 0) : integer('frame', frame, { max: frames - 1 });
    return this.#runner.use((raw) => raw.boundary(at));
  }

  /**
   * Returns a copy of the surface in a frame; without triangles where the image has no object.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such frame, or one that is not tracked yet.
   */
  meshAt(frame: number): Mesh {
    const [frames, , done] = this.#counts();
    if (integer('frame', frame, { max: frames - 1 }) >= done) {
      throw invalid('frame', `${frame} is not tracked yet; ${done} of ${frames} frames are`);
    }
    const warnings = this.#warningsAt(frame);
    return wrapMesh(
      new Handle('Mesh', () => this.#runner.use((raw) => raw.meshAt(frame) as import('./vesicle.js').RawMesh)),
      false,
      () => warnings,
      this.#frame,
    );
  }

  /** Returns what concerns a frame, also if it concerns others. */
  #warningsAt(frame: number): Warning[] {
    return this.#warnings.of(
      { frame },
      this.#runner.use((raw) => raw.warningsAt(frame) as Warning[]),
    );
  }

  /** Returns the enclosed volume of each frame tracked so far, world units cubed; 0 for those without the object. */
  volumes(): Float64Array {
    return this.#runner.use((raw) => raw.volumes());
  }

  /**
   * Encodes the frames tracked so far as an animated glb: one node per frame, shown in turn, each for the frame time of
   * the volume or 0.1 s. Nothing is shown in frames without the object. Warnings are written as by {@link Mesh.toBytes}.
   *
   * @param options - `space`, `as` and `unit`: what to state, as in {@link Mesh.toBytes}.
   * @throws {@link VesicleError} `invalid-argument` if no frame tracked so far has a surface; `too-large`.
   */
  toGlb(options?: SpaceOptions): Bytes {
    const frame = checkedSpaceOptions(checkProperties('options', options, SPACE_OPTIONS), this.#frame, true);
    const seconds = Math.min(Math.max(this.#frameSeconds, 0.001), 1000);
    return this.#runner.use((raw) => raw.toGlb(seconds, notesOf(this.#warnings.of()), ...frame) as Bytes);
  }

  /**
   * Saves the whole state except the image, for {@link SurfaceTracker.restore} of a tracker with the same volume, box,
   * component, cavity and start.
   */
  save(): Bytes {
    return this.#runner.use((raw) => raw.save() as Bytes);
  }

  /**
   * Restores a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are not a saved state of a tracker with the same volume,
   *   box, component, cavity and start; the tracker then stays unchanged; `invalid-argument` while a run is in progress.
   */
  restore(state: Uint8Array): void {
    typedArray('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#runner.use((raw) => raw.restore(state));
    this.#warnings.forget();
  }

  /** Frees the memory; the tracker and its live mesh cannot be used afterwards. */
  free(): void {
    this.#meshHandle.free();
    this.#handle.free();
  }

  /** The same as {@link SurfaceTracker.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function corners(box: TrackingOptions['box']): Float64Array | undefined {
  if (box === undefined) return undefined;
  const { min, max } = checkProperties('box', box, ['min', 'max']);
  return Float64Array.of(...vec3('box.min', min), ...vec3('box.max', max));
}

function ends(voxels: TrackingOptions['voxels']): Uint32Array | undefined {
  if (voxels === undefined) return undefined;
  const { min, max } = checkProperties('voxels', voxels, ['min', 'max']);
  const indices = [...vec3('voxels.min', min), ...vec3('voxels.max', max)];
  return Uint32Array.from(indices, (index) => integer('voxels', index));
}

/** Arguments that {@link SurfaceTracker.create} passes to the constructor. */
class Created {
  constructor(
    readonly options: TrackingOptions,
    readonly handle: Handle<RawTracker>,
  ) {}
}

function checked(given: TrackingOptions): TrackingOptions {
  const known = checkProperties('options', given, OPTIONS) as TrackingOptions;
  for (const name of ['maxVertices', 'maxVoxels'] as const) {
    if (known[name] !== undefined) integer(name, known[name], { min: 1 });
  }
  return known;
}

/** Returns a function that makes what needs the arguments of a tracker. */
function beginning<T>(options: TrackingOptions, make: (of: RawTrackingOptions) => T): () => T {
  const image = volumeHandle('volume', options.volume);
  const [box, voxels, nearest] = [corners(options.box), ends(options.voxels), point(options.component)];
  if (box && voxels) throw invalid('voxels', 'give either box or voxels, not both');
  const params = shallowCopy('params', options.params ?? {});
  const isClosed = isClosedCavity(options.cavity);
  const ofSmall = isOfSmall(options.volume);
  const maxVertices = limitOf(options.maxVertices, ofSmall, MOST_TRACKED_OF_SMALL);
  const maxVoxels = limitOf(options.maxVoxels, ofSmall, MOST_VOXELS_OF_SMALL);
  return () =>
    image.use((raw) => {
      const of = new RawTrackingOptions(raw, box, voxels, nearest, triangles(options.start), isClosed, params);
      of.setLimits(maxVertices, maxVoxels);
      return make(of);
    });
}

function isClosedCavity(cavity: TrackingOptions['cavity']): boolean {
  if (cavity !== undefined && cavity !== 'closed' && cavity !== 'open') {
    throw invalid('cavity', `must be 'closed' or 'open', got '${String(cavity)}'`);
  }
  return cavity === 'closed';
}

function point(component: TrackingOptions['component']): Float64Array | undefined {
  if (component === undefined || component === 'largest') return undefined;
  if (typeof component === 'string') throw invalid('component', `must be 'largest' or a point, got '${component}'`);
  return vec3('component', component);
}

function triangles(mesh: Mesh | undefined): TriangleCopy | undefined {
  return mesh === undefined ? undefined : meshHandle('start', mesh).use((raw) => new TriangleCopy(raw));
}
