/**
 * The messages between page and worker in the Reconstruct lab. Both sides import this file and nothing else of each other.
 *
 * As in the Extract lab: exactly one reply to each request, events of the worker's own, and a stop is no error.
 */
import type { Fitness } from 'vesicle';
import type {
  Failure,
  FailureEvent,
  Measures,
  MeshFormat,
  NamedBytes,
  ParamSpec,
  ParamValues,
  StateEvent,
  StepReport,
  Surface,
  Vec3,
} from '../protocol';
import type { PointShape } from './clouds';

export type { Failure, Fitness, MeshFormat, NamedBytes, ParamSpec, ParamValues, StepReport, Surface, Vec3 };

/** Points, packed xyz, and what is known of each. */
export interface Cloud {
  points: Float32Array;
  normals?: Float32Array;
  /** rgb, 0..1. */
  colors?: Float32Array;
}

/** A camera the points were made from, with its picture where there is one. */
export interface CameraView {
  /** 3 × 4, world to pixel, row-major. */
  projection: number[];
  width: number;
  height: number;
  image?: Uint8ClampedArray;
}

/** Where points come from: a file, or code. */
export type CloudSource = { file: NamedBytes } | { shape: PointShape };

/** What was changed by hand. */
export interface Edits {
  added: Vec3[];
  /** Indices of points as they were loaded. */
  removed: number[];
  /** Points known to be outside. */
  outside: Vec3[];
}

/** How a model is made. */
export interface Setup {
  /** What differs from the defaults. */
  params: ParamValues;
  /** A subsample is taken above this. */
  maxPoints: number | undefined;
  /** The largest clusters that are kept; all where undefined. */
  keepComponents: number | undefined;
  edits: Edits;
}

/** A model before its first step. */
export interface Ready {
  params: ParamValues;
}

export interface Loaded extends Ready {
  cloud: Cloud;
}

/** What the colours of the surface tell that has to be computed; the names are shown. */
export type PointShade = 'mean curvature' | 'distance';

/** Facts about points and fit that no mesh tells. */
export interface Fit {
  fitness?: Fitness;
  surfaceConstraints: number;
  exteriorConstraints: number;
  /** Edge of an extraction cell, in the points' units; 0 until it is known. */
  cell: number;
  /** In units of the box. */
  spacing: number;
  duplicates: number;
  strays: number;
  residual: number;
  warning?: string;
}

/** One solve of the timing curve. */
export interface Timing {
  kernel: string;
  constraints: number;
  milliseconds: number;
}

export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** When it fails, the former points and model stay. Removed points that there are not are passed over. */
  load: { body: { source: CloudSource; cameras: CameraView[]; setup: Setup }; reply: Loaded };
  /** A new model of the same points. When it fails, the former model stays. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  setParams: { body: ParamValues; reply: ParamValues };
  /** Live, in place of all edits before: a run goes on with them. When they are refused, all stays. */
  setEdits: { body: Edits; reply: undefined };
  export: { body: { format: MeshFormat }; reply: Uint8Array };
  /** f on a grid with so many voxels along the longest side, as NIfTI, and the value that the surface is taken at. */
  volume: { body: { size: number }; reply: { bytes: Uint8Array; level: number } };
  shade: { body: PointShade | undefined; reply: undefined };
  /** Solves the present points for growing numbers of them; undefined when cancelled. */
  timing: { body: { sizes: number[]; kernels: string[] }; reply: Timing[] | undefined };
  cancelTiming: { body: undefined; reply: undefined };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
/** The surface last sent is on the screen; has no reply. */
export interface ShownMessage {
  kind: 'shown';
}
export type ToWorker = RequestMessage | ShownMessage;

/** Steps since the last such event. */
export interface ProgressEvent {
  event: 'progress';
  reports: StepReport[];
}
/** A surface: complete, or as far as it has been followed. */
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
/** The points that take part, and the exterior ones, packed. */
export interface ConstraintsEvent {
  event: 'constraints';
  surface: Float32Array;
  exterior: Float32Array;
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
