/**
 * The public surface that users, adapters and the app rely on: names, argument shapes, units and errors stay as
 * written here; anything beyond them may be added. `types.ts` checks that the package keeps to it.
 */

// ── start ───────────────────────────────────────────────────────────────────────────────────────
export type InitInput = RequestInfo | URL | Response | BufferSource | WebAssembly.Module;
/** Idempotent. With no argument, fetches the .wasm beside the module (browser) or reads it (Node). */
export default function init(options?: {
  module?: InitInput | Promise<InitInput>;
  /** Deprecated. */
  module_or_path?: InitInput | Promise<InitInput>;
}): Promise<unknown>;
export function initSync(options: { module: BufferSource | WebAssembly.Module }): unknown;
export function version(): string;

/** Every failure the library can foresee. `message` says what was wrong and what is accepted. */
export class VesicleError extends Error {
  readonly code:
    | 'invalid-argument' // a parameter out of range, NaN, wrong length; names the parameter
    | 'bad-file' // truncated, inconsistent or unsupported file; names the format and the field
    | 'not-closed' // a mesh with boundary or non-manifold edges where a closed one is needed
    | 'self-intersecting' // a start mesh that intersects itself where an embedded one is needed
    | 'singular-system' // the linear system has no usable solution; names the likely cause
    | 'needs-data' // a step that needs parts of a large volume that have not been read
    | 'unavailable' // data of a store that could not be fetched; the call may be made again
    | 'precision' // single precision is too coarse for positions so far away; says what can be done
    | 'no-progress' // work that stopped, since a round changed nothing for the better
    | 'too-large' // needs more memory than wasm32 has; says how much
    | 'aborted'
    | 'freed' // use after free()
    | 'crash'; // a fault of the library itself
}

export type Vec3 = [number, number, number];
/** Points in world space; in double precision where single is too coarse. */
export type PointArray = Float32Array | Float64Array;
export type VoxelArray =
  | Uint8Array
  | Int8Array
  | Uint16Array
  | Int16Array
  | Uint32Array
  | Int32Array
  | Float32Array
  | Float64Array;

// ── volumes ─────────────────────────────────────────────────────────────────────────────────────
export interface VolumeInit {
  /** x fastest, then y, z, t. Copied once. */
  data: VoxelArray;
  dims: Vec3 | [number, number, number, number];
  /** 16 numbers, column-major, voxel index -> world. Else spacing and origin. */
  affine?: ArrayLike<number>;
  spacing?: Vec3;
  origin?: Vec3;
  slope?: number; // stored value * slope + intercept = intensity
  intercept?: number;
  frameSeconds?: number; // 4D only
  space?: 'RAS' | 'LPS'; // default RAS; meshes come back in the same space
}
export type VolumeFormat = 'nifti' | 'nrrd' | 'mha';
export class Volume {
  constructor(init: VolumeInit);
  /**
   * NIfTI-1/2 (.nii, .nii.gz), Analyze 7.5, NRRD (.nrrd; .nhdr + data), MetaImage (.mha; .mhd + data), detected from the
   * bytes. gzip is handled. A detached header takes its payload as `data`, or the files beside it; `space` is for files
   * that name none.
   */
  static parse(
    bytes: Uint8Array,
    options?: {
      data?: Uint8Array;
      files?: readonly { name: string; bytes: Uint8Array }[];
      space?: 'RAS' | 'LPS';
    },
  ): Volume;
  /** Volumes of one grid, in order, as the frames of a 4D one; of those that are 4D, all frames. */
  static fromFrames(frames: Volume[], options?: { frameSeconds?: number }): Volume;
  /** NIfTI-1 bytes, for saving what was computed. */
  toNifti(): Uint8Array;
  /** .nii or .nii.gz, .nrrd, .mha; the last two hold intensities if slope or intercept are not 1 and 0. */
  toBytes(format: VolumeFormat, options?: { gzip?: boolean }): Uint8Array;
  readonly dims: Vec3;
  readonly frames: number;
  /** 0 if the volume has no time axis. */
  readonly frameSeconds: number;
  readonly spacing: Vec3;
  readonly affine: Float64Array;
  readonly space: 'RAS' | 'LPS';
  /** Undefined if it is not known. */
  readonly unit: 'm' | 'mm' | 'um' | undefined;
  /** Smallest and largest intensity, after slope and intercept. */
  readonly range: [number, number];
  histogram(bins: number, frame?: number): Uint32Array;
  /** Trilinear intensity at a world point; outside the volume the border is replicated. */
  sample(world: Vec3, frame?: number): number;
  /** One slice, row-major, as intensities. axis 0 = sagittal (x), 1 = y, 2 = z. */
  slice(axis: 0 | 1 | 2, index: number, frame?: number): Float32Array;
  /** All intensities of one frame, for upload as a 3D texture; NaN stays NaN. */
  intensities(frame?: number): Float32Array;
  /** One volume per level, [0] = this one; smoothed before it is thinned. */
  pyramid(levels: number, options?: { factor?: number }): Volume[];
  /** Means of blocks of the given numbers of voxels along x, y and z, in all frames. */
  binned(factors: Vec3): Volume;
  /** In-between slices by symmetric optical flow, so that spacing becomes close to isotropic. */
  enrichSlices(options?: { factor?: number; method?: 'flow' | 'linear' }): Volume;
  /** Intensities other than 0, ascending; integer types and at most 65,536 labels. */
  labels(frame?: number): { value: number; voxels: number }[];
  /** 0/1 mask of one label or several. */
  label(value: number | number[]): Volume;
  /** 0/1 mask; both bounds are included and may be infinite. */
  threshold(low: number, high: number): Volume;
  /** Of one label, or of all voxels that are not 0; 1 if there are none. */
  dice(other: Volume, options?: { label?: number }): number;
  /** Index space, max excluded. */
  crop(box: { min: Vec3; max: Vec3 }): Volume;
  /** In the same field of view, or on another volume's grid with 0 outside this one. */
  resample(grid: { dims: Vec3 } | { spacing: Vec3 } | { like: Volume }, how?: 'linear' | 'nearest'): Volume;
  frame(index: number): Volume;
  /** In place; data in the type of the voxels, x fastest. */
  write(region: { min: Vec3; dims: Vec3; data: VoxelArray }, frame?: number): void;
  free(): void;
  [Symbol.dispose](): void;
}

// ── the dynamic mesh ────────────────────────────────────────────────────────────────────────────
export interface MeshArrays {
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
  uvs?: Float32Array;
  /** rgb, 0..1 */
  colors?: Float32Array;
  /** The point that positions are relative to, if that was asked for. */
  origin?: Vec3;
}
export interface MeshInfo {
  vertices: number;
  triangles: number;
  components: number;
  euler: number;
  /** Sum over components; closed orientable, so euler = 2 * components - 2 * genus. */
  genus: number;
  area: number;
  volume: number;
  centroid: Vec3;
  /** Second moments about the centroid of the enclosed solid, row-major 3x3. */
  inertia: number[];
  edge: { min: number; mean: number; max: number };
  minAngleDegrees: number;
  bounds: { min: Vec3; max: Vec3 };
}
/** Result of an independent check of the mesh; a healthy one is closed, oriented and has all counts at 0. */
export interface MeshReport {
  closed: boolean;
  oriented: boolean;
  nonManifoldEdges: number;
  nonManifoldVertices: number;
  degenerateTriangles: number;
  selfIntersections: number;
}
export type MeshFormat = 'glb' | 'ply' | 'stl' | 'obj' | 'vtp' | 'mz3';
export class Mesh {
  static icosphere(center: Vec3, radius: number, maxEdge: number): Mesh;
  static fromArrays(positions: PointArray, indices: Uint32Array, extra?: { uvs?: Float32Array }): Mesh;
  /** glb, ply, stl, obj: detected from the bytes. Duplicate positions are welded. */
  static parse(bytes: Uint8Array): Mesh;
  /** Iso-surface of a volume, closed at the volume's border; topologically consistent. */
  static marchingCubes(volume: Volume, iso: number, options?: { frame?: number }): Mesh;
  readonly vertexCount: number;
  readonly triangleCount: number;
  /** Increases when connectivity changes / when any vertex moves. */
  readonly topologyVersion: number;
  readonly geometryVersion: number;
  /** The point that positions are kept relative to; 0 unless the mesh is far away for its size. */
  readonly origin: Vec3;
  arrays(options?: { relative?: boolean }): MeshArrays;
  /** Copies into the caller's buffers, which are replaced only when too small; returns the counts written. */
  copyTo(out: MeshArrays, options?: { relative?: boolean }): { vertices: number; triangles: number };
  info(): MeshInfo;
  check(): MeshReport;
  components(): Mesh[];
  /** One sqrt(3) refinement pass. */
  refine(): void;
  /** Edge lengths into [min, max], valences towards 6, by collapse, split and flip; shape kept. */
  remesh(edge: { min: number; max: number }): void;
  /** Quadric decimation that keeps the mesh closed and its topology unchanged. */
  decimate(targetTriangles: number): void;
  /** Taubin smoothing; no new self-intersections; enclosed volume kept by default. */
  smooth(options: { iterations: number; keepVolume?: boolean }): void;
  /** 4x4 column-major affine; singular and non-finite ones are refused; a reflection flips the triangles. */
  transform(matrix: Float64Array): void;
  /** World xyz; 1 inside, 0 outside; exact. */
  contains(points: PointArray): Uint8Array;
  /** On the grid of `like`: exact mask of voxel centres, coverage 0..1, or signed distance (negative inside). */
  toVolume(like: Volume, options?: { kind?: 'mask' | 'coverage' | 'distance'; value?: number }): Volume;
  /** Per vertex. */
  curvature(kind: 'mean' | 'gaussian'): Float32Array;
  geodesic(fromVertex: number): Float32Array;
  /** Unsigned distance from each of this mesh's vertices to the other's surface, and both-way summaries. */
  distanceTo(other: Mesh): { perVertex: Float32Array; mean: number; rms: number; p95: number; hausdorff: number };
  pick(
    origin: Vec3,
    direction: Vec3,
  ): { triangle: number; barycentric: Vec3; point: Vec3; distance: number } | undefined;
  /** Line segments (pairs of points) where a plane cuts the surface. */
  crossSection(origin: Vec3, normal: Vec3, options?: { relative?: boolean }): Float32Array;
  toBytes(format: MeshFormat, options?: { recentre?: boolean }): Uint8Array;
  clone(): Mesh;
  free(): void;
  [Symbol.dispose](): void;
}

// ── one stepping contract for every method ──────────────────────────────────────────────────────
/** Carried by volumes and reports, as `warnings`; a result without one is right. */
export interface Warning {
  code: string;
  text: string;
  where?: { frame: number } | { label: number } | { point: Vec3 };
}
export interface StepReport {
  iteration: number;
  done: boolean;
  /** The current phase of the method: 'level 2', 'solve', 'extract', 'frame 7' ... */
  phase: string;
  /** 0..1 where it can be known, else NaN. */
  progress: number;
  /** The method's own measure of convergence, and the tolerance that it is compared with. */
  residual: number;
  tolerance: number;
  vertices: number;
  triangles: number;
  components: number;
  euler: number;
  /** Counted since the last report. axial: joins (or splits) by contact; annular: cuts of a neck. */
  events: {
    creations: number;
    deletions: number;
    inversions: number;
    axial: number;
    annular: number;
    vanished: number;
    seeds: number; // parts added where the image shows what the surface leaves out
  };
  /** Milliseconds of the last step by part: forces, motion, normals, topology, and so on. */
  times: Record<string, number>;
}
export interface RunOptions {
  signal?: AbortSignal; // rejects with signal.reason, the model stays usable
  maxIterations?: number;
  budgetMs?: number; // work per slice before yielding; default 12
  onStep?: (report: StepReport) => void;
}
export interface Stepper {
  readonly mesh: Mesh; // the same live object from start to end
  step(iterations?: number): StepReport; // synchronous and deterministic
  run(options?: RunOptions): Promise<StepReport>; // to the end, yielding between slices
  /** Live parameters: any subset, validated as a whole before any of it is taken. */
  setParams(params: Record<string, unknown>): void;
  readonly params: Record<string, unknown>;
  /** Bit-exact: restore(save()) then step() equals step(). */
  save(): Uint8Array;
  restore(state: Uint8Array): void;
  free(): void;
}
export interface ParamSpec {
  name: string;
  label: string;
  help: string; // one sentence a student understands
  symbol?: string; // as in the paper: 'αc', 'πI', 'δ', 'τ'
  type: 'number' | 'integer' | 'boolean' | 'choice';
  default: unknown;
  min?: number;
  max?: number;
  step?: number;
  scale?: 'linear' | 'log';
  unit?: string;
  choices?: string[];
}
export function paramSpecs(method: 'deformable' | 'implicit' | 'tracking' | 'multires'): ParamSpec[];

// ── 1. deformable model with automatic topology changes ──────────────────
export interface DeformableParams {
  iso?: number; // πI, in intensity units of the volume
  isoForce?: number; // αI; negative where the object is brighter than iso
  gradientNormal?: number; // αg, along the normal
  gradientTangent?: number; // βg, along the tangent plane
  gradientBound?: number;
  rigidity?: number; // αc
  stiffness?: number; // αe
  restLength?: 'zero' | 'mean' | number;
  mass?: number;
  damping?: number;
  integrator?: 'euler' | 'runge-kutta' | 'implicit';
  timeStep?: number;
  maxMove?: number; // fraction of δ a vertex may move in one iteration
  energyTolerance?: number; // ε
  topology?: 'adaptive' | 'fixed';
  adaptivity?: number; // 0..1; 0 = the paper: one δ, contact by distance alone
  seeding?: 'auto' | 'on' | 'off'; // parts that a level shows and the surface leaves out; auto: with start 'contour'
  smallestPart?: number; // voxels; components that enclose less are left out
}
/**
 * Coverage of the volume's iso-surface, without components that enclose fewer voxels than smallestPart; within one
 * voxel.
 */
export interface Coverage {
  recall: number; // fraction of the iso-surface's area that the surface covers
  precision: number; // fraction of the surface's area that the iso-surface covers
  uncovered: UncoveredRegion[]; // largest first
}
export interface UncoveredRegion {
  position: Vec3; // world
  area: number; // square world units
  kind: 'matter' | 'cavity';
}
export interface CoverageOptions {
  signal?: AbortSignal; // rejects with signal.reason
  onProgress?: (share: number) => void; // 0..1
}
export interface Attractor {
  point: Vec3;
  strength: number;
  radius: number;
}
export class DeformableModel implements Stepper {
  constructor(options: {
    volume: Volume;
    frame?: number;
    /** iso-surface of the coarsest level (default) | enclosing icosahedron | a grid of n^3 bubbles | spheres at points | iso-surface | your own closed mesh */
    start?:
      | 'contour'
      | 'enclosing'
      | { bubbles: number }
      | { seeds: PointArray; radius: number }
      | { marchingCubes: number }
      | Mesh;
    levels?: number; // pyramid levels above the volume itself; 0 = direct
    edge?: number; // target edge at the finest level, world units; default from the voxel size
    params?: DeformableParams;
  });
  readonly level: number;
  readonly delta: number; // current δ
  /** Attachment points the user places; pull the surface within radius. */
  setAttractors(list: Attractor[]): void;
  readonly mesh: Mesh;
  readonly params: Required<DeformableParams>;
  step(iterations?: number): StepReport;
  run(options?: RunOptions): Promise<StepReport>;
  /** Seeds components of this level that the surface leaves out; counted in events.seeds. */
  seed(): StepReport;
  /** The volume has changed there: wakes, adds what is new, removes what has gone. */
  refresh(region: { min: Vec3; dims: Vec3 }): void;
  /** Yields between slices. */
  coverage(options?: CoverageOptions): Promise<Coverage>;
  setParams(params: DeformableParams): void;
  save(): Uint8Array;
  restore(state: Uint8Array): void;
  free(): void;
  [Symbol.dispose](): void;
}

// ── 2. implicit surface from points ──────────────────────────────────────
export interface Camera {
  /** 3x4 world -> pixel, row-major. */
  projection: ArrayLike<number>;
  width: number;
  height: number;
  /** rgba8, for colouring the mesh; may be left out. */
  image?: Uint8ClampedArray;
}
/** ply, obj, xyz, pts, csv: detected from the bytes. Colours are rgb, 0..1. */
export function parsePoints(bytes: Uint8Array): { points: PointArray; normals?: Float32Array; colors?: Float32Array };
export interface ImplicitParams {
  kernel?: 'multi-order' | 'thin-plate' | 'biharmonic' | 'gaussian';
  delta?: number | 'auto'; // δ first-order smoothness, in the 2x2x2 box
  tau?: number; // τ third-order smoothness
  sigma?: number; // gaussian width
  lambdaSurface?: number | 'auto';
  lambdaExterior?: number | 'auto';
  tolerance?: number; // relative residual of the solve
  cell?: number; // edge of an extraction cell, in points' units; default from the sampling
  level?: 'zero' | 'mean';
  sides?: 'auto' | 'both' | 'outside';
}
export class ImplicitSurface implements Stepper {
  constructor(options: {
    points: PointArray;
    normals?: Float32Array;
    /** Per point; scales lambda: unsure points bind less. */
    confidence?: Float32Array;
    /** Points known to be outside. Else made from cameras, normals or the bounding sphere. */
    exterior?: PointArray;
    cameras?: Camera[];
    maxPoints?: number; // Poisson-disc subsample above this
    keepComponents?: number; // outliers: keep the n largest connected clusters; default all
    params?: ImplicitParams;
  });
  /** Steps: subsample, constraints, solve, extract, colour. */
  step(iterations?: number): StepReport;
  run(options?: RunOptions): Promise<StepReport>;
  readonly mesh: Mesh;
  readonly params: Required<ImplicitParams>;
  setParams(params: ImplicitParams): void;
  /** f > 0 inside, 0 on the surface, < 0 outside. */
  evaluate(points: PointArray): Float32Array;
  gradient(points: PointArray): Float32Array;
  /** The points that are used, and the exterior ones, for display. */
  constraints(): { surface: PointArray; exterior: PointArray };
  /** Distances from all the original points to the surface. */
  fitness(): { mean: number; rms: number; max: number; meanCurvature: number };
  /** f sampled on a grid around the object, so that the deformable model can take over. */
  toVolume(dims: Vec3): Volume;
  colorize(cameras: Camera[]): void;
  save(): Uint8Array;
  restore(state: Uint8Array): void;
  free(): void;
  [Symbol.dispose](): void;
}

// ── 3. dynamic surface through a 4D image ────────────────────────────────
export interface TrackingParams {
  threshold?: number; // τ, smallest step between the two cluster means, intensity units
  window?: number; // k: a window is 2k+1 voxels wide
  windowFrames?: number; // and this many frames to either side
  radius?: number; // support of the weight θ, world units
  timeScale?: number; // c, world units per frame
  damping?: number; // β
  edgeMin?: number; // c_min, of the first frame's mean edge
  edgeMax?: number; // c_max
  prediction?: boolean;
  cyclic?: boolean;
}
export interface TrackingOptions {
  volume: Volume; // 4D
  box?: { min: Vec3; max: Vec3 };
  component?: 'largest' | Vec3; // the surface to track: the largest, or the one nearest to a point
  start?: Mesh; // instead of meshing the first frame
  params?: TrackingParams;
}
export interface FrameStatistics {
  volume: number;
  area: number;
  triangles: number;
  folded: number;
  rejected: number;
  heldMoves: number;
  withoutBoundary: number;
  steps: number;
  meanFinalCorrection: number;
}
export class SurfaceTracker implements Stepper {
  constructor(options: TrackingOptions);
  step(iterations?: number): StepReport; // one frame: first the boundaries of all frames, then their surfaces
  run(options?: RunOptions): Promise<StepReport>;
  readonly mesh: Mesh; // of the current frame
  readonly frame: number;
  readonly frames: number;
  readonly origin: Vec3; // of surfaces and boundary points in world space; 0 unless the volume is far from it
  readonly noise: number; // standard deviation, intensity units
  readonly cycleClosureError: number | undefined; // for cyclic sequences with a surface in the first and the last frame: distance of the closed cycle from its first surface, world units
  readonly statistics: FrameStatistics[];
  readonly params: Required<TrackingParams>;
  setParams(params: TrackingParams): void;
  /** Boundary votes as weighted space-time points: x, y, z, t, w. */
  boundary(frame?: number): Float32Array;
  meshAt(frame: number): Mesh;
  /** Enclosed volume per frame, world units cubed. */
  volumes(): Float64Array;
  /** Animated: one node per frame, shown in turn. */
  toGlb(): Uint8Array;
  save(): Uint8Array;
  restore(state: Uint8Array): void;
  free(): void;
  [Symbol.dispose](): void;
}

// ── 4. multiresolution deformation ───────────────────────────────────────
export interface ControlEllipsoid {
  center: Vec3;
  /** Three orthogonal semi-axes as vectors. */
  axes: [Vec3, Vec3, Vec3];
}
export interface MultiresParams {
  edgeMin?: number; // ε_min, target resolution
  edgeMax?: number; // ε_max, more than twice ε_min
  levels?: number; // of the multi-level solver
  refineFactor?: number; // q
  smoothing?: number; // umbrella iterations per level
  distribute?: number; // applications of the D operator per level
  supersample?: number; // halvings of edges for the detail
  energy?: 'membrane' | 'thin-plate';
  topology?: 'never' | 'split' | 'split-and-join';
}
export class MultiresolutionModel implements Stepper {
  constructor(options: {
    /** The detailed surface; left out: a bare membrane (lava lamp). */
    detail?: Mesh;
    /** Its low-frequency approximation; default: made by smoothing and coarsening. */
    base?: Mesh;
    ellipsoids: ControlEllipsoid[];
    params?: MultiresParams;
  });
  setEllipsoids(list: ControlEllipsoid[]): void;
  step(iterations?: number): StepReport; // one animation frame towards the ellipsoids
  run(options?: RunOptions): Promise<StepReport>;
  readonly mesh: Mesh; // with detail (and uvs where the detail has them)
  readonly baseMesh: Mesh; // the deformed low-frequency surface
  readonly linkMesh: Mesh; // same connectivity, on the undeformed base: the map T
  /** Ratio of areas and angles across T, for showing distortion. */
  distortion(): { area: Float32Array; angle: Float32Array };
  readonly params: Required<MultiresParams>;
  setParams(params: MultiresParams): void;
  save(): Uint8Array;
  restore(state: Uint8Array): void;
  free(): void;
  [Symbol.dispose](): void;
}
