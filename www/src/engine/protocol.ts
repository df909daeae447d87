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
  LengthUnit,
  MeshFormat,
  MeshInfo,
  MeshReport,
  ParamSpec,
  PointArray,
  Space,
  StepReport,
  UncoveredRegion,
  Vec3,
  Warning,
} from 'vesicle';

import type { RunLog } from './run-log';
import type { Shape } from './shapes';

export type {
  Attractor,
  Coverage,
  MeshFormat,
  MeshInfo,
  MeshReport,
  ParamSpec,
  PointArray,
  Space,
  StepReport,
  UncoveredRegion,
  Vec3,
  Warning,
};

export type ParamValues = Record<string, unknown>;

/** Facts about a file that its format cannot hold, since it was written from one of another program. */
export interface FileNotes {
  warnings: readonly Warning[];
  /** Further statements of the other file, in words. */
  remarks?: readonly string[];
  /** Space that positions are to be in; the file's own by default. */
  space?: 'LPS';
  /** Whether small intensities are to be shown bright. */
  inverted?: boolean;
}

export interface NamedBytes {
  name: string;
  bytes: Uint8Array;
  notes?: FileNotes;
  /** Whether it was written from files of another program that are small, all together, however large it is itself. */
  isOfSmall?: boolean;
}

/** Initial surface of the deformable model. Lengths and positions are in world coordinates. */
export type StartShape =
  | { kind: 'contour' }
  | { kind: 'enclosing' }
  | { kind: 'bubbles'; count: number }
  | { kind: 'sphere'; center: Vec3; radius: number }
  | { kind: 'isosurface' };

/** Source of a volume: its files (one, a header and its data, or a DICOM or TIFF series), or a computed shape. */
export type VolumeSource = { files: NamedBytes[] } | { shape: Shape };

/** An OME-Zarr image, larger than memory: its address, its folder, or a ZIP. */
export interface LargeSource {
  zarr: string | Blob | FileSystemDirectoryHandle;
}

/** Any source that the Extract lab opens. */
export type ImageSource = VolumeSource | LargeSource;

/** All that the worker builds a deformable model from, besides the volume. */
export interface Setup {
  start: StartShape;
  /** Number of pyramid levels coarser than the volume; the run starts on the coarsest and ends on the volume itself. */
  levels: number;
  /**
   * Target edge length of the surface on the finest pyramid level, in world units; if undefined, the model derives it
   * from the voxel size.
   */
  edge: number | undefined;
  /** Parameters that differ from the defaults; without `iso` the worker chooses an iso value from the histogram. */
  params: ParamValues;
  attractors: Attractor[];
  /** Box in world coordinates in which a volume larger than memory is followed to its finer levels; else everywhere. */
  box?: { min: Vec3; max: Vec3 };
}

/** Intensities of voxels, in the narrowest of these types that holds all of them exactly. */
export type Intensities = Uint8Array | Uint16Array | Int16Array | Float32Array;

/** Voxels of a volume, of one coarser level of its pyramid or, in the Track lab, of one frame, for display. */
export interface LevelView {
  dims: Vec3;
  /** Intensities of the voxels, x fastest. */
  voxels: Intensities;
  /** Intensities that are displayed as black and as white, until the user chooses others. */
  window: [number, number];
  /** Whether small intensities are displayed bright instead. */
  inverted?: boolean;
  /** Slope and intercept of the map from `voxels` to intensities; without them, these are the same. */
  scale?: readonly [slope: number, intercept: number];
}

/** A quantity computed at each vertex to colour the surface by; the names appear in the interface. */
export type VertexQuantity = 'speed' | 'mean curvature' | 'gaussian curvature';

/** A saved run, from which the worker can restore it; kept by the page for undo. */
export interface SavedRun {
  state: Uint8Array;
  levels: number;
  iteration: number;
  done: boolean;
  /** Log of the run up to this state; undefined if its beginning is not known. */
  log: RunLog<Setup> | undefined;
}

/**
 * Description of a volume for the page, with its voxels: frame after frame if all frames were requested, else only the
 * first.
 */
export interface VolumeView extends LevelView {
  name: string;
  frames: number;
  spacing: Vec3;
  /** 4 × 4 affine matrix from voxel indices to world coordinates, column-major. */
  affine: Float64Array;
  space: 'RAS' | 'LPS';
  /** Unit of lengths in world space, if the volume's file states it. */
  unit?: LengthUnit;
  /** Smallest and largest intensity of the volume. */
  range: [number, number];
  histogram: Uint32Array;
  /** Warnings about the volume. */
  warnings: readonly Warning[];
  /** Further statements of its file, in words. */
  remarks?: readonly string[];
  /**
   * If the volume is the coarsest level of one larger than memory: the numbers of voxels of all its levels, finest first,
   * and the bytes of all.
   */
  large?: { levels: readonly Vec3[]; bytes: number };
}

export interface Plane {
  origin: Vec3;
  normal: Vec3;
}

/**
 * Arrays of a surface that the worker transfers to the page and, in the Extract lab, the page transfers back for reuse,
 * so that none is allocated for each surface sent. They may be longer than the part in use.
 */
export interface SurfaceBuffers {
  /** Relative to the origin of the surface. */
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
}

/** A triangle mesh that a lab's worker sends to the page for drawing. */
export interface Surface extends SurfaceBuffers {
  /** The origin in world space that the positions are relative to. */
  origin: Vec3;
  /** Number of vertices in use; the buffers may be longer. */
  vertices: number;
  /** Number of triangles in use; `indices` may be longer. */
  triangles: number;
  /** One value per vertex to colour the surface by, if a quantity was requested. */
  values?: Float32Array;
  /** Colours of the vertices, rgb in 0..1, if the mesh has them. */
  colors?: Float32Array;
  /** Texture coordinates of the vertices, packed uv, if a textured surface was requested. */
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

/** Reply of the worker when it has built or restored a model. */
export interface Ready {
  params: ParamValues;
  /**
   * Sampling distance δ of the model on its present pyramid level, in world units: unless the model adapts them
   * locally, edges are between δ and 2.5 δ long.
   */
  delta: number;
}

/** How much of the iso-surface the extracted surface covers, and the iteration at which it was measured. */
export interface MeasuredCoverage extends Coverage {
  iteration: number;
}

/** Result and cost of one of the two runs of a comparison, direct or coarse to fine. */
export interface ExtractionRun {
  levels: number;
  /** Number of iterations, and total milliseconds of each part of a step, on each pyramid level; the coarsest first. */
  byLevel: { level: number; iterations: number; times: Record<string, number> }[];
  /** Report of the run's last iteration. */
  report: StepReport;
  info: MeshInfo;
}

export interface Loaded extends Ready {
  volume: VolumeView;
  /** Number of pyramid levels of the model: those asked for, or as many as the volume allows. */
  levels: number;
  /** Number of labels, if the volume looks like a label map; else 0. */
  labels?: number;
}

export interface CodeRequest {
  /** Name, without an ending, of the file that the lab saves for the code. */
  stem: string;
  /** Edits of the finished surface, which follow the run. */
  edits: readonly Edit[];
  /** Index of the frame whose surface is the result, in the Track lab. */
  frame?: number;
}

/** JavaScript that repeats a run. */
export interface RunCode {
  code: string;
  /** Data that its function takes: files that were opened, or one that the lab saves for it, or a folder. */
  needs: 'files' | 'saved' | 'folder' | 'nothing';
  /** Names of the files, or of the folder. */
  name: string;
  /** Part of the run that the code lacks, in a sentence. */
  note?: string | undefined;
}

/** A surface as a file. */
export interface ExportRequest {
  format: MeshFormat;
  /** Whether the surface is moved to the origin. */
  recentre?: boolean;
  /** Warnings that the file is to have in comments, besides those of the mesh. */
  warnings?: readonly Warning[];
  /** Directions of the axes of the surface, and of those in the file, if they are to be others. */
  space?: Space;
  as?: Space;
  /** Length of a unit of its positions. */
  unit?: LengthUnit;
}

/** Requests of the page to the workers of all labs whose model runs. */
export interface CodeRequests {
  code: { body: CodeRequest; reply: RunCode };
  /** Replies with the data as a file that the code reads. */
  data: { body: undefined; reply: { extension: string; bytes: Uint8Array } };
}

/** Requests of the page to the Extract lab's worker: the body of each and its reply. */
export interface Requests extends CodeRequests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /**
   * Opens a frame of a volume, the first is 0, and builds a model of it, or with `saved` restores a run of it. On failure, the previous volume and
   * model stay.
   */
  load: {
    body: {
      name: string;
      source: ImageSource;
      setup: Setup;
      frame: number;
      saved?: SavedRun | undefined;
      /** Whether the page shows the voxels already, which are then not sent. */
      isShown?: boolean;
      /** Whether the image is in small files, or in a small session. */
      isSmall?: boolean;
    };
    reply: Loaded;
  };
  /** Ends the opening of a volume larger than memory, if one is being opened, since another is to be opened. */
  cancelLoad: { body: undefined; reply: undefined };
  /** Builds a new model of the open volume. On failure, the previous model stays. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  /** Changes the given parameters of the present model, also during a run; replies with all parameters in force. */
  setParams: { body: ParamValues; reply: ParamValues };
  /** Sets the planes whose cross-sections with the surface are sent from now on, for the outlines on the slices. */
  planes: { body: Plane[]; reply: undefined };
  /** Replies with the surface as a file, with its own `warnings` and those given. */
  export: { body: ExportRequest; reply: Uint8Array };
  /** Replies with `levels` coarser levels of the volume's pyramid for display, the finest first. */
  pyramid: { body: { levels: number }; reply: LevelView[] };
  setAttractors: { body: Attractor[]; reply: undefined };
  /**
   * Sets the quantity whose values at the vertices are sent with the surface from now on, to colour it; none if
   * undefined.
   */
  quantity: { body: VertexQuantity | undefined; reply: undefined };
  /** Saves the present state of the run, also while it is running. */
  save: { body: undefined; reply: SavedRun };
  /** Restores a saved run of the same volume. */
  restore: { body: SavedRun; reply: Ready };
  /**
   * Runs the same extraction twice, direct and coarse to fine, to compare results and times; replies with undefined if
   * cancelled.
   */
  compare: { body: Setup; reply: { direct: ExtractionRun; coarseToFine: ExtractionRun } | undefined };
  cancelCompare: { body: undefined; reply: undefined };
  /**
   * Measures how much of the iso-surface the surface covers, also during a run; replies with undefined if cancelled.
   */
  coverage: { body: undefined; reply: MeasuredCoverage | undefined };
  cancelCoverage: { body: undefined; reply: undefined };
  /** Adds to the surface the components and cavities of the object that it misses; replies with their number. */
  seed: { body: undefined; reply: number };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
/**
 * Message that returns to the worker, for reuse, the arrays of a surface that the page no longer draws; has no reply.
 */
export interface ReturnMessage {
  kind: 'return';
  buffers: SurfaceBuffers;
}
export type ToWorker = RequestMessage | ReturnMessage;

export interface Failure {
  /**
   * Code of a VesicleError; 'internal' if the engine (the worker's WebAssembly module) broke and has to be restarted,
   * 'page' for an error of the page itself.
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
  /**
   * Cross-sections of the surface with the planes set by the request `planes`, each as segments: pairs of world points,
   * packed xyz.
   */
  sections: PointArray[];
  /** One report per step since the last snapshot or progress event. */
  reports: StepReport[];
  measures?: Measures;
}
/**
 * Event with the reports of steps for which no snapshot was sent, in batches, when steps come faster than the page
 * draws.
 */
export interface ProgressEvent {
  event: 'progress';
  reports: StepReport[];
}
export interface SectionsEvent {
  event: 'sections';
  sections: PointArray[];
}
/**
 * Event with the state of a lab's run: sent when a run starts and, after its last results, when it is done or was
 * stopped; also after single steps, in the Extract lab after seeding or restoring, and in the Track lab on request.
 */
export interface StateEvent {
  event: 'state';
  state: 'running' | 'paused' | 'done';
}
export interface FailureEvent {
  event: 'failure';
  failure: Failure;
}
/**
 * Progress of the comparison of a direct with a coarse-to-fine run: the report of a step of one of the two runs. Sent
 * for some steps only.
 */
export interface ComparisonProgressEvent {
  event: 'comparing';
  run: 'direct' | 'coarseToFine';
  report: StepReport;
}
/** Progress of a coverage measurement: `share` is from 0 to 1. */
export interface CoverageProgressEvent {
  event: 'covering';
  share: number;
}
/** Event while a model waits for parts of a volume larger than memory. */
export interface DataEvent {
  event: 'data';
  /** Bytes and chunks that have been read since the volume was opened. */
  bytes: number;
  chunks: number;
  /** Number of parts that the model waits for. */
  waiting: number;
}
export type WorkerEvent =
  | DataEvent
  | SnapshotEvent
  | ProgressEvent
  | SectionsEvent
  | StateEvent
  | FailureEvent
  | ComparisonProgressEvent
  | CoverageProgressEvent;
export type FromWorker = ReplyMessage | WorkerEvent;

/** Unit of lengths in world space; empty if the file does not state one. */
export type Unit = 'm' | 'mm' | 'µm' | '';

/** One edit of a surface: the name of a method of `Mesh`, and its arguments by name. */
export type Edit =
  | { op: 'remesh'; min: number; max: number }
  | { op: 'decimate'; targetTriangles: number }
  | { op: 'decimateWithin'; maxDistance: number }
  | { op: 'smooth'; iterations: number; keepVolume: boolean }
  | { op: 'keepComponents'; indices: number[] }
  | { op: 'removeCavities' }
  | { op: 'cut'; origin: Vec3; normal: Vec3 };

/** A point on the surface, by the index of its triangle. */
export interface SurfacePoint {
  triangle: number;
  point: Vec3;
}
