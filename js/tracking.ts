import { invalid, knownOnly, plain, typed, vec3, whole } from './check.js';
import { type Mesh, meshHandle, wrapMesh } from './mesh.js';
import { Handle } from './runtime.js';
import { Runner, type RunOptions, type Stepper, type StepReport } from './stepper.js';
import { RawTracker, TrianglesOf } from './vesicle.js';
import { type Vec3, type Volume, volumeHandle } from './volume.js';

/** Parameters of the tracker; `paramSpecs('tracking')` has ranges, defaults and a sentence on each. */
export interface TrackingParams {
  /** τ: the smallest step between the two cluster means, intensity units; by default, or where 0, above the noise. */
  threshold?: number;
  /** k: a window is 2k + 1 voxels wide along each axis. */
  window?: number;
  /** Frames to either side that a window holds; 0 looks at each frame by itself. */
  windowFrames?: number;
  /** Support of the weight θ, world units: 2h. */
  radius?: number;
  /** c: world units per frame. */
  timeScale?: number;
  /** β: each step of a projection goes by so much less far than the one before. */
  damping?: number;
  /** c_min: shorter edges are drawn together, in the first frame's mean edge. */
  edgeMin?: number;
  /** c_max: longer edges are split, in the same; more than twice `edgeMin`. */
  edgeMax?: number;
  /** Whether a frame begins where the surface is going from the one before; else where it was. */
  prediction?: boolean;
  /** Whether the last frame is followed by the first. */
  cyclic?: boolean;
}

/** What a {@link SurfaceTracker} is made of. Everything is copied. */
export interface TrackingOptions {
  /** Two frames or more, voxel axes at right angles. */
  volume: Volume;
  /**
   * The part that is looked at, corners in the world; default all of it. What is bright where it ends is closed there. Of a
   * volume whose axes are not those of the world, the box along its axes around this one is taken.
   */
  box?: { min: Vec3; max: Vec3 };
  /** The same by the first and the last voxel; instead of `box`. */
  voxels?: { min: Vec3; max: Vec3 };
  /** The surface of interest: the largest of the first frame (the default), or the one around a point of the world, or nearest to it. */
  component?: 'largest' | Vec3;
  /** The surface in the first frame, closed and without crossings, in the world; instead of finding it. */
  start?: Mesh;
  /** Any of them; the others are taken from the volume. */
  params?: TrackingParams;
}

/** What happened in one frame, and what came out. */
export interface FrameFacts {
  /** What the surface encloses, cubed world units. */
  volume: number;
  /** Squared world units. */
  area: number;
  triangles: number;
  /** Triangles that face away from their three neighbours. */
  folded: number;
  /** Projections that led nowhere or too far; the vertices went along with their neighbours. */
  rejected: number;
  /** Moves that were held back, so that nothing crosses. */
  held: number;
  /** Vertices that had no boundary: drawn together where a crevice has closed, grown where one has opened, else smoothed. */
  retracted: number;
  /** Steps of a vertex's projections, onto space-time and onto the frame, in the mean. */
  steps: number;
  /** How far the last projection moved the vertices, in the mean, world units. */
  correction: number;
}

interface Facts {
  noise: number;
  closing?: number;
  frames: FrameFacts[];
}

const OPTIONS = ['volume', 'box', 'voxels', 'component', 'start', 'params'];

/** Seconds a frame is shown for in an animation, where the volume does not say. */
const FRAME_SECONDS = 0.1;

/**
 * A surface that is followed through the frames of a 4D image.
 *
 * After "Dynamic surfaces from 4D cardiac MRI": windows vote for the faces between bright and dark voxels, the votes are
 * weighted points in space-time, and the surface is projected onto what fits them, frame by frame. A step finds the boundary in
 * one more frame; when all have theirs, it takes the surface into one more frame. The surface is in the volume's world space;
 * it stays closed and never crosses itself.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link SurfaceTracker.free}.
 */
export class SurfaceTracker implements Stepper {
  readonly #handle: Handle<RawTracker>;
  readonly #meshHandle: Handle<import('./vesicle.js').RawMesh>;
  readonly #mesh: Mesh;
  readonly #runner = new Runner();
  readonly #frameSeconds: number;

  /**
   * A tracker before its first step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option or parameter: a volume of one frame, of too few voxels,
   *   without contrast or with slanted axes, a box outside of it, a start that is empty, inside out, outside the box or much finer than its voxels; `not-closed`, `self-intersecting` for a start
   *   that is.
   */
  constructor(given: TrackingOptions) {
    const known = knownOnly('options', given, OPTIONS) as TrackingOptions;
    const image = volumeHandle('volume', known.volume);
    const [box, voxels, nearest] = [corners(known.box), ends(known.voxels), point(known.component)];
    if (box && voxels) throw invalid('voxels', 'box cannot be given together with it: it says the same');
    const params = plain('params', known.params ?? {});
    this.#frameSeconds = image.use((raw) => raw.frameSeconds()) || FRAME_SECONDS;
    this.#handle = new Handle('SurfaceTracker', () =>
      image.use((raw) => new RawTracker(raw, box, voxels, nearest, triangles(known.start), params)),
    );
    this.#meshHandle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh()));
    this.#mesh = wrapMesh(this.#meshHandle, true);
  }

  /** The surface of the current frame: the same live object always. Before the first frame is done it is the start, or has no triangles. */
  get mesh(): Mesh {
    return this.#mesh;
  }

  /** The frame that {@link SurfaceTracker.mesh} is of, from 0. */
  get frame(): number {
    return this.#handle.use((raw) => raw.frame());
  }

  /** Frames of the volume. */
  get frames(): number {
    return this.#counts()[0];
  }

  /** The standard deviation of the noise in the box, intensity units: τ below 2.5 times as much marks noise. */
  get noise(): number {
    return this.#facts().noise;
  }

  /**
   * Of a cyclic sequence, when all is done: how far the last frame's surface, taken on to the first frame, is from the first
   * frame's in the mean, world units.
   */
  get closing(): number | undefined {
    return this.#facts().closing;
  }

  /** What happened in the frames so far, in order. */
  get facts(): FrameFacts[] {
    return this.#facts().frames;
  }

  /** All parameters as they are now; a copy. */
  get params(): Required<TrackingParams> {
    return this.#handle.use((raw) => raw.params() as Required<TrackingParams>);
  }

  #facts(): Facts {
    return this.#handle.use((raw) => raw.facts() as Facts);
  }

  #counts(): [number, number, number] {
    return [...this.#handle.use((raw) => raw.counts())] as [number, number, number];
  }

  /**
   * So many frames at once, first of the boundary and then of the surface, synchronous and deterministic; fewer where the end
   * comes first.
   *
   * @returns The report of the last, with the events of all.
   * @throws {@link VesicleError} `invalid-argument`: `threshold` where there is no boundary, with the largest step there is;
   *   `box` where no surface is in the first frame; while a {@link SurfaceTracker.run} is under way. `too-large`.
   */
  step(iterations = 1): StepReport {
    whole('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * To the last frame, yielding to the event loop between frames.
   *
   * @returns The last report.
   * @throws As {@link SurfaceTracker.step}; `signal.reason` when aborted, and the tracker stays usable; what `onStep` throws.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#step(1), given);
  }

  #step(iterations: number): StepReport {
    return this.#handle.use((raw) => raw.step(iterations) as StepReport);
  }

  /**
   * Live parameters: any subset, validated as a whole before any of it is taken. `threshold`, `window`, `windowFrames` and
   * `cyclic` begin everything again, the others hold from the next frame on.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter; nothing has changed then.
   */
  setParams(params: TrackingParams): void {
    const values = plain('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /**
   * Boundary votes as weighted space-time points, five numbers each: x, y, z in the world, t in frames, and w, the share of the
   * windows that separate the two voxels of a face. Faces between two frames lie half a frame later.
   *
   * @param frame - Default the newest with a boundary; one whose boundary is not found yet has no points.
   * @throws {@link VesicleError} `invalid-argument`: no such frame.
   */
  boundary(frame?: number): Float32Array {
    const [frames, bounded] = this.#counts();
    const at = frame === undefined ? Math.max(bounded - 1, 0) : whole('frame', frame, { max: frames - 1 });
    return this.#handle.use((raw) => raw.boundary(at));
  }

  /**
   * The surface of a frame, a copy.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such frame, or it is not done.
   */
  meshAt(frame: number): Mesh {
    const [frames, , done] = this.#counts();
    if (whole('frame', frame, { max: frames - 1 }) >= done) {
      throw invalid('frame', `${frame} is not done; ${done} of ${frames} frames have their surface`);
    }
    return wrapMesh(
      new Handle('Mesh', () => this.#handle.use((raw) => raw.meshAt(frame) as import('./vesicle.js').RawMesh)),
    );
  }

  /** Enclosed volume of the frames that are done, world units cubed. */
  volumes(): Float64Array {
    return this.#handle.use((raw) => raw.volumes());
  }

  /**
   * The frames that are done, as an animated glb: one node per frame, shown in turn, each as long as the volume says or 0.1 s.
   *
   * @throws {@link VesicleError} `invalid-argument` where none is done; `too-large`.
   */
  toGlb(): Uint8Array {
    const seconds = Math.min(Math.max(this.#frameSeconds, 0.001), 1000);
    return this.#handle.use((raw) => raw.toGlb(seconds));
  }

  /** The whole state but the image, for {@link SurfaceTracker.restore} of a tracker of the same volume, box, component and start. */
  save(): Uint8Array {
    return this.#handle.use((raw) => raw.save());
  }

  /**
   * Back to a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are no state of such a tracker, which then stays as it was;
   *   `invalid-argument` while a run is under way.
   */
  restore(state: Uint8Array): void {
    typed('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#handle.use((raw) => raw.restore(state));
  }

  /** Gives the memory back; the tracker and its live mesh cannot be used afterwards. */
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
  const { min, max } = knownOnly('box', box, ['min', 'max']);
  return Float64Array.of(...vec3('box.min', min), ...vec3('box.max', max));
}

function ends(voxels: TrackingOptions['voxels']): Uint32Array | undefined {
  if (voxels === undefined) return undefined;
  const { min, max } = knownOnly('voxels', voxels, ['min', 'max']);
  const indices = [...vec3('voxels.min', min), ...vec3('voxels.max', max)];
  return Uint32Array.from(indices, (index) => whole('voxels', index));
}

function point(component: TrackingOptions['component']): Float64Array | undefined {
  if (component === undefined || component === 'largest') return undefined;
  if (typeof component === 'string') throw invalid('component', `'${component}'; 'largest' or a point is needed`);
  return vec3('component', component);
}

function triangles(mesh: Mesh | undefined): TrianglesOf | undefined {
  return mesh === undefined ? undefined : meshHandle('start', mesh).use((raw) => new TrianglesOf(raw));
}
