/**
 * Messages between the page and the worker of the Track lab. Both sides import this file.
 *
 * As in the other labs: each request gets exactly one reply, the worker sends events of its own accord, and a
 * cancellation is not an error.
 */
import type { FrameStatistics } from 'vesicle';
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
  VolumeView,
} from '../protocol';
import type { CineSpec } from './cine';

export type {
  CineSpec,
  Failure,
  FrameStatistics,
  Measures,
  MeshFormat,
  NamedBytes,
  ParamSpec,
  ParamValues,
  StepReport,
  Surface,
  Vec3,
  VolumeView,
};

/**
 * Source of a 4D image: one file, several files that are its frames in the order of their names, or a computed phantom.
 */
export type ImageSource = { files: NamedBytes[] } | { cine: CineSpec };

/** Method of inserting slices between slices: none, linear interpolation, or interpolation along the optical flow. */
export type Enrichment = 'none' | 'linear' | 'flow';

/** Preparation of the image before tracking. */
export interface Preparation {
  /** Binning factor within slices: this many pixels are averaged along both sides. */
  binning: 1 | 2;
  enrichment: Enrichment;
  /** Factor by which the number of slices grows; 0 chooses the one that makes voxels most nearly cubic. */
  factor: number;
}

/** A region of interest: opposite corners, in world coordinates, of a box along the voxel axes. */
export interface Box {
  min: Vec3;
  max: Vec3;
}

/** All that a tracker is built from, besides the image. */
export interface Setup {
  preparation: Preparation;
  /** Region of interest; the whole image if undefined. */
  box: Box | undefined;
  /** The tracked surface is the one nearest to this point; the largest if undefined. */
  at: Vec3 | undefined;
  /** Parameters that differ from the method's own choice. */
  params: ParamValues;
}

/** Distance of a surface from the true one, in world units. */
export interface SurfaceError {
  mean: number;
  /** 95th percentile of the distances of the vertices. */
  p95: number;
}

/** Reply about a newly built tracker, before its first step. */
export interface Ready {
  params: ParamValues;
  /** The tracker's default for the edge threshold τ, from the noise and the range of intensities. */
  suggested: number;
  /** Standard deviation of the noise, in intensity units. */
  noise: number;
  /** The image as prepared, with the voxels of all frames; undefined if unchanged. */
  volume: VolumeView | undefined;
}

export interface OpenedImage extends Ready {
  volume: VolumeView;
  /** Dimensions of the image before its preparation. */
  dims: Vec3;
  spacing: Vec3;
  /** The true volume of each frame, if the image is computed. */
  truth: number[] | undefined;
  /** Milliseconds spent opening and preparing the image. */
  openingMs: number;
}

/** A saved run, from which the worker can restore it; kept by the page for undo. */
export interface SavedTrack {
  state: Uint8Array;
  setup: Setup;
  iteration: number;
  done: boolean;
}

/**
 * Boundary votes of a frame: the points, packed xyz, between two voxels, and the share of windows that separate the
 * two.
 */
export interface BoundaryVotes {
  frame: number;
  points: Float32Array;
  weights: Float32Array;
}

/** A measured slice, its neighbours, and its interpolations from these; greys as in the volume's view. */
export interface InterpolatedSlice {
  width: number;
  height: number;
  before: Uint8Array;
  flow: Uint8Array;
  measured: Uint8Array;
  linear: Uint8Array;
  after: Uint8Array;
  /** Root mean square difference of each interpolation from the measured slice, in intensity units. */
  rmsError: { linear: number; flow: number };
}

/** The choice that a comparison changes: switches the prediction, or takes another enrichment. */
export type Alternative = 'prediction' | Enrichment;

/** Result of a run through all frames, for comparison. */
export interface ComparedTrack {
  facts: FrameStatistics[];
  closing: number | undefined;
  /** Mean over all frames, if the true surface is known. */
  error: SurfaceError | undefined;
  /** Milliseconds, preparation included. */
  duration: number;
  selfIntersections: number;
}

export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** Opens an image and builds a tracker of it. On failure, the previous image and tracker stay. */
  open: { body: { name: string; source: ImageSource; setup: Setup }; reply: OpenedImage };
  /** Builds a new tracker of the same image. On failure, the previous one stays. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  /** Changes parameters; replies with all parameters and with the iteration that the run was set back to. */
  setParams: { body: ParamValues; reply: { params: ParamValues; iteration: number } };
  votes: { body: { frame: number }; reply: BoundaryVotes };
  between: { body: { frame: number; slice: number; window: [number, number] }; reply: InterpolatedSlice };
  save: { body: undefined; reply: SavedTrack };
  /** Restores a saved run of the same image; the state is sent only in reply to `sendState`. */
  restore: { body: SavedTrack; reply: Ready };
  /** The image as it is prepared at present. */
  view: { body: undefined; reply: VolumeView };
  /** Makes the worker send a state event. */
  sendState: { body: undefined; reply: undefined };
  export: { body: { frame: number; format: MeshFormat }; reply: Uint8Array };
  /** All tracked frames as one animated GLB. */
  animation: { body: undefined; reply: Uint8Array };
  /** Runs the whole tracking with another setup; undefined if cancelled. */
  compare: { body: { setup: Setup }; reply: ComparedTrack | undefined };
  cancelCompare: { body: undefined; reply: undefined };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
export type ToWorker = RequestMessage;

/** The surface of a frame, with its facts and measures. */
export interface TrackedFrame {
  surface: Surface;
  facts: FrameStatistics;
  measures: Measures;
  error: SurfaceError | undefined;
}

/** Progress of the preparation, in words for the status line. */
export interface PreparingEvent {
  event: 'preparing';
  what: string;
}
/** A step was done; `frame` is the surface of frame `index` if the step completed one. */
export interface StepEvent {
  event: 'step';
  report: StepReport;
  index: number | undefined;
  frame: TrackedFrame | undefined;
  closing: number | undefined;
}
/** Progress of a comparison: its share, 0 to 1, and its phase. */
export interface ComparisonProgressEvent {
  event: 'comparing';
  part: number;
  phase: string;
}
export type WorkerEvent = PreparingEvent | StepEvent | ComparisonProgressEvent | StateEvent | FailureEvent;
