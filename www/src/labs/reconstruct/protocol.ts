/**
 * Messages between the page and the worker of the Reconstruct lab. Both sides import this file, and neither imports the
 * other's code.
 *
 * As in the Extract lab: each request gets exactly one reply, the worker sends events of its own accord, and a
 * cancellation is not an error.
 */
import type { Fitness, ImplicitChoice } from 'vesicle';
import type {
  CodeRequests,
  ExportRequest,
  Failure,
  FailureEvent,
  Measures,
  NamedBytes,
  ParamSpec,
  ParamValues,
  PointArray,
  StateEvent,
  StepReport,
  Surface,
  Vec3,
  Warning,
} from '../../engine/protocol';
import type { RunLog } from '../../engine/run-log';
import type { VolumeBytes } from '../../engine/volumes';
import type { PointShape } from './clouds';

export type { Failure, Fitness, NamedBytes, ParamSpec, ParamValues, PointArray, StepReport, Surface, Vec3 };

/** A point cloud: positions, packed xyz, with normals and colours if known. */
export interface Cloud {
  points: PointArray;
  normals?: Float32Array;
  /** Colours of the points, rgb in 0..1. */
  colors?: Float32Array;
  /** Warnings about the points. */
  warnings?: readonly Warning[];
}

/** The camera of a photograph that the points were computed from, with the photograph if there is one. */
export interface CameraView {
  /** 3 × 4 projection from world to pixel coordinates, row-major. */
  projection: number[];
  width: number;
  height: number;
  image?: Uint8ClampedArray;
}

/** Source of a point cloud: the bytes of a file, or a computed shape. */
export type CloudSource = { file: NamedBytes } | { shape: PointShape };

/** The user's manual changes of the loaded points. */
export interface Edits {
  added: Vec3[];
  /** Indices, from 0, of removed points in the cloud as loaded. */
  removed: number[];
  /** Points added outside the object; they become exterior constraints. */
  outside: Vec3[];
}

/** Settings that a model is built with, besides its points and cameras. */
export interface Setup {
  /** Parameters of the method that differ from the defaults. */
  params: ParamValues;
  /** Largest number of points used; larger clouds are subsampled. Undefined: the library's default. */
  maxPoints: number | undefined;
  /** Number of clusters of points to keep, the largest ones; all if undefined. */
  keepComponents: number | undefined;
  edits: Edits;
}

/**
 * Reply to `rebuild`, and part of the reply to `load`: the parameters of the newly built model, before its first step.
 */
export interface Ready {
  params: ParamValues;
}

/** A saved run, from which the worker can restore it. */
export interface SavedSurface {
  state: Uint8Array;
  setup: Setup;
  /** Report of the last step; undefined before the first. */
  last: StepReport | undefined;
  /** Log of the run up to this state; undefined if its beginning is not known. */
  log?: RunLog<Setup> | undefined;
}

export interface Loaded extends Ready {
  cloud: Cloud;
}

/** A quantity computed at each vertex of the surface to colour it by; the names appear in the interface. */
export type PointQuantity = 'mean curvature' | 'distance';

/** Parameters that the method may choose from the points. */
export type ChosenParams = Pick<ImplicitChoice, 'delta' | 'lambdaSurface' | 'lambdaExterior'>;

/** Facts about the points and the fitted function that the page displays besides the measures of the mesh. */
export interface Fit {
  fitness?: Fitness;
  surfaceConstraints: number;
  exteriorConstraints: number;
  interiorConstraints: number;
  /** Measures of the points, and the values chosen by them for automatic parameters; undefined until they are. */
  choice?: ImplicitChoice;
  /** Values in force of the parameters that may be automatic: those given, or else those chosen. */
  inForce: Partial<ChosenParams>;
  /**
   * Edge length of the cells of the lattice on which the surface is extracted, in the points' units; 0 until it is
   * known.
   */
  cell: number;
  /**
   * Mean distance from a surface constraint to the nearest other one, in units of the normalised box, which is 2 long;
   * 0 until the constraints are chosen.
   */
  spacing: number;
  duplicates: number;
  /** Number of points that were discarded as outliers. */
  outliers: number;
  spuriousComponents: number;
  residual: number;
  warning?: string;
}

/** Duration of one solve, for the plot of solve time against number of constraints. */
export interface Timing {
  kernel: string;
  constraints: number;
  milliseconds: number;
}

export interface Requests extends CodeRequests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /**
   * Opens points and builds a model of them, or with `saved` restores one. On failure, the previous points and model stay in use. Indices of removed
   * points that are out of range are ignored.
   */
  load: {
    body: { source: CloudSource; cameras: CameraView[]; setup: Setup; saved?: SavedSurface | undefined };
    reply: Loaded;
  };
  /** Builds a new model of the loaded points. On failure, the previous model stays in use. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  setParams: { body: ParamValues; reply: ParamValues };
  /**
   * Replaces all manual point edits of the present model; a run in progress continues with them. If the model rejects
   * them, nothing changes.
   */
  setEdits: { body: Edits; reply: undefined };
  save: { body: undefined; reply: SavedSurface };
  export: { body: ExportRequest; reply: Uint8Array };
  /**
   * Replies with the fitted function f sampled on a grid around the points, `size` voxels along the longest side, as
   * a file, and with the level of f at which the surface is extracted.
   */
  volume: { body: { size: number }; reply: VolumeBytes & { level: number } };
  quantity: { body: PointQuantity | undefined; reply: undefined };
  /**
   * Times solves with subsamples of the loaded points, without edits, for each of the `sizes` (numbers of points) and
   * `kernels`; replies with undefined if cancelled.
   */
  timing: { body: { sizes: number[]; kernels: string[] }; reply: Timing[] | undefined };
  cancelTiming: { body: undefined; reply: undefined };
}

/**
 * Tells the worker that the surface it sent last is on the screen, so that it may send another preview; has no reply.
 */
export interface ShownMessage {
  kind: 'shown';
}

/** Event with the reports of the steps since the last progress event. */
export interface ProgressEvent {
  event: 'progress';
  reports: StepReport[];
}
/** Event with a surface to draw: the complete one or, during its extraction, a preview of the part extracted so far. */
export interface SurfaceEvent {
  event: 'surface';
  surface: Surface;
  preview: boolean;
}
export interface MeasuredEvent {
  event: 'measured';
  measures?: Measures;
  fit: Fit;
}
/**
 * Event with positions to draw: the surface constraints, which are the points in use, and the exterior constraints;
 * both packed xyz.
 */
export interface ConstraintsEvent {
  event: 'constraints';
  surface: PointArray;
  exterior: PointArray;
}
export interface TimedEvent {
  event: 'timed';
  timing: Timing;
}
export type WorkerEvent =
  | ProgressEvent
  | SurfaceEvent
  | MeasuredEvent
  | ConstraintsEvent
  | TimedEvent
  | StateEvent
  | FailureEvent;
