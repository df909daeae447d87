/**
 * Messages between the page and the worker of the Extract lab. Both sides import this file, and neither imports the
 * other's code.
 *
 * Each request of the page gets exactly one reply; the worker also sends events of its own accord.
 * Stopping a run is a request with an ordinary reply: a cancellation is not an error.
 */
import type {
  Attractor,
  Coverage,
  MeshFormat,
  MeshInfo,
  MeshReport,
  ParamSpec,
  StepReport,
  UncoveredRegion,
  Vec3,
} from 'vesicle';

import type { Shape } from './shapes';

export type { Attractor, Coverage, MeshFormat, MeshInfo, MeshReport, ParamSpec, StepReport, UncoveredRegion, Vec3 };

export type ParamValues = Record<string, unknown>;

export interface NamedBytes {
  name: string;
  bytes: Uint8Array;
}

/** Start shape of the surface. Lengths and positions are in world coordinates. */
export type StartShape =
  | { kind: 'contour' }
  | { kind: 'enclosing' }
  | { kind: 'bubbles'; count: number }
  | { kind: 'sphere'; center: Vec3; radius: number }
  | { kind: 'isosurface' };

/** Source of a volume: its files (one, a header and its data, or a DICOM or TIFF series), or a computed shape. */
export type VolumeSource = { files: NamedBytes[] } | { shape: Shape };

/** All that a model is built from, besides the volume. */
export interface Setup {
  start: StartShape;
  /** Number of coarser pyramid levels that the run starts with, besides the volume itself. */
  levels: number;
  /** Target edge length on the finest level, in world units; if undefined, the model derives it from the voxel size. */
  edge: number | undefined;
  /** Parameters that differ from the defaults; without `iso` the worker chooses an iso value from the histogram. */
  params: ParamValues;
  attractors: Attractor[];
}

/** One coarser level of the volume's pyramid, reduced to 8 bits for display like the volume itself. */
export interface LevelView {
  dims: Vec3;
  voxels: Uint8Array;
}

/** A quantity computed at each vertex to colour the surface by; the names appear in the interface. */
export type VertexQuantity = 'speed' | 'mean curvature' | 'gaussian curvature';

/** A saved run, from which the worker can restore it; kept by the page for undo. */
export interface SavedRun {
  state: Uint8Array;
  levels: number;
  iteration: number;
  done: boolean;
}

/** Description of a volume for the page, with its voxels reduced to 8 bits for display. */
export interface VolumeView {
  name: string;
  dims: Vec3;
  frames: number;
  spacing: Vec3;
  /** 4 × 4 affine matrix from voxel indices to world coordinates, column-major. */
  affine: Float64Array;
  space: 'RAS' | 'LPS';
  /** Smallest and largest intensity. */
  range: [number, number];
  histogram: Uint32Array;
  /** The intensities displayed as black and as white. */
  window: [number, number];
  /**
   * Grey values, x fastest: 0 = black, 255 = white. Frame after frame if all frames were requested, else only the
   * first.
   */
  voxels: Uint8Array;
}

export interface Plane {
  origin: Vec3;
  normal: Vec3;
}

/**
 * Arrays of a surface that are transferred to the page and, in the Extract lab, back, so that none is allocated for
 * each surface sent. They may be longer than the part in use.
 */
export interface SurfaceBuffers {
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
}

/** A surface to draw. */
export interface Surface extends SurfaceBuffers {
  /** Number of vertices in use; the buffers may be longer. */
  vertices: number;
  /** Number of triangles in use. */
  triangles: number;
  /** One value per vertex to colour the surface by, if a quantity was requested. */
  values?: Float32Array;
  /** Colours of the vertices, rgb in 0..1, if the mesh has them. */
  colors?: Float32Array;
  /** Texture coordinates of the vertices, if a textured surface was requested. */
  uvs?: Float32Array;
}

/**
 * Measures of a surface. `report`, the result of the mesh checks, takes time: while the Extract lab's model is running,
 * it is left out.
 */
export interface Measures {
  info: MeshInfo;
  report?: MeshReport;
}

/** Reply about a newly built model, before its first step. */
export interface Ready {
  params: ParamValues;
  /** Sampling distance δ of the model, in world units: edges are between δ and 2.5 δ long. */
  delta: number;
}

/** How much of the iso-surface the surface covers, and the iteration at which it was measured. */
export interface MeasuredCoverage extends Coverage {
  iteration: number;
}

/** Result and cost of one of the two runs of a comparison, direct or coarse to fine. */
export interface ExtractionRun {
  levels: number;
  /** Number of iterations, and total milliseconds of each part of a step, for each level; the coarsest first. */
  byLevel: { level: number; iterations: number; times: Record<string, number> }[];
  /** Report of the last iteration. */
  report: StepReport;
  info: MeshInfo;
}

export interface Loaded extends Ready {
  volume: VolumeView;
}

/** Requests of the page: the body of each and its reply. */
export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** Opens a volume and builds a model of it. On failure, the previous volume and model stay. */
  load: { body: { name: string; source: VolumeSource; setup: Setup }; reply: Loaded };
  /** Builds a new model of the same volume. On failure, the previous model stays. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  /** Changes the given parameters of the live model; replies with all parameters in force. */
  setParams: { body: ParamValues; reply: ParamValues };
  /** Sets the planes whose cross-sections with the surface are sent from now on. */
  planes: { body: Plane[]; reply: undefined };
  export: { body: { format: MeshFormat }; reply: Uint8Array };
  /** Replies with `levels` coarser levels of the volume's pyramid, the finest first. */
  pyramid: { body: { levels: number }; reply: LevelView[] };
  setAttractors: { body: Attractor[]; reply: undefined };
  /** Sets the quantity whose values at the vertices are sent with the surface from now on; none if undefined. */
  quantity: { body: VertexQuantity | undefined; reply: undefined };
  /** Saves the present state of the run, also while it is running. */
  save: { body: undefined; reply: SavedRun };
  /** Restores a saved run of the same volume. */
  restore: { body: SavedRun; reply: Ready };
  /** Runs the same extraction twice, direct and coarse to fine; undefined if cancelled. */
  compare: { body: Setup; reply: { direct: ExtractionRun; coarseToFine: ExtractionRun } | undefined };
  cancelCompare: { body: undefined; reply: undefined };
  /** Measures how much of the iso-surface the surface covers, also during a run; undefined if cancelled. */
  coverage: { body: undefined; reply: MeasuredCoverage | undefined };
  cancelCoverage: { body: undefined; reply: undefined };
  /** Adds the components and cavities of the object that the surface misses; replies with their number. */
  seed: { body: undefined; reply: number };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
/** Returns buffers to the worker when the page no longer draws them; has no reply. */
export interface ReturnMessage {
  kind: 'return';
  buffers: SurfaceBuffers;
}
export type ToWorker = RequestMessage | ReturnMessage;

export interface Failure {
  /**
   * Code of a VesicleError; 'internal' if the engine broke and has to be restarted, 'page' for an error of the page
   * itself.
   */
  code: string;
  message: string;
}
export type ReplyMessage = { id: number; ok: true; body: unknown } | { id: number; ok: false; failure: Failure };

export interface SnapshotEvent {
  event: 'snapshot';
  surface: Surface;
  /** Pyramid level of the model at present; 0 is the finest. */
  level: number;
  /** Cross-sections of the surface with the requested planes, each as segments: pairs of world points, packed xyz. */
  sections: Float32Array[];
  /** One report per step since the last snapshot or progress event. */
  reports: StepReport[];
  measures?: Measures;
}
/** Reports of steps without a snapshot, sent in batches when steps come faster than the page draws. */
export interface ProgressEvent {
  event: 'progress';
  reports: StepReport[];
}
export interface SectionsEvent {
  event: 'sections';
  sections: Float32Array[];
}
/**
 * State of the run: sent when a run starts and, after its last results, when it is done or was stopped; also after
 * single steps, in the Extract lab after seeding or restoring, and in the Track lab on request.
 */
export interface StateEvent {
  event: 'state';
  state: 'running' | 'paused' | 'done';
}
export interface FailureEvent {
  event: 'failure';
  failure: Failure;
}
/** Progress of a comparison: the report of a step of one of its runs. Not sent for each step. */
export interface ComparisonProgressEvent {
  event: 'comparing';
  run: 'direct' | 'coarseToFine';
  report: StepReport;
}
/** Progress of a coverage measurement, from 0 to 1. */
export interface CoverageProgressEvent {
  event: 'covering';
  share: number;
}
export type WorkerEvent =
  | SnapshotEvent
  | ProgressEvent
  | SectionsEvent
  | StateEvent
  | FailureEvent
  | ComparisonProgressEvent
  | CoverageProgressEvent;
export type FromWorker = ReplyMessage | WorkerEvent;
