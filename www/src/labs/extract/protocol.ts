/**
 * Messages between the page and the worker of the Extract lab. Both sides import this file, and neither imports the
 * other's code.
 *
 * Each request of the page gets exactly one reply; the worker also sends events of its own accord.
 * Stopping a run is a request with an ordinary reply: a cancellation is not an error.
 */
import type {
  Attractor,
  CodeRequests,
  Coverage,
  ExportRequest,
  FailureEvent,
  LevelView,
  Measures,
  MeshInfo,
  ParamSpec,
  ParamValues,
  Plane,
  PointArray,
  StateEvent,
  StepReport,
  Surface,
  Vec3,
  VertexQuantity,
  VolumeSource,
  VolumeView,
} from '../../engine/protocol';
import type { RunLog } from '../../engine/run-log';

/** Initial surface of the deformable model. Lengths and positions are in world coordinates. */
export type StartShape =
  | { kind: 'contour' }
  | { kind: 'enclosing' }
  | { kind: 'bubbles'; count: number }
  | { kind: 'sphere'; center: Vec3; radius: number }
  | { kind: 'isosurface' };

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

/** A saved run, from which the worker can restore it; kept by the page for undo. */
export interface SavedRun {
  state: Uint8Array;
  levels: number;
  iteration: number;
  done: boolean;
  /** Log of the run up to this state; undefined if its beginning is not known. */
  log: RunLog<Setup> | undefined;
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

/** Message that returns to the worker a surface that the page no longer draws, to use its arrays again; has no reply. */
export interface ReturnMessage {
  kind: 'return';
  drawn: Surface;
}

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
