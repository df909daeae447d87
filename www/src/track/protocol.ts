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
 * Source of a 4D image: files (a single one, one for each frame in the order of their names, headers with their data,
 * or a DICOM or TIFF series), or a computed phantom.
 */
export type ImageSource = { files: NamedBytes[] } | { cine: CineSpec };

/**
 * Method of inserting slices between the measured ones: none, linear interpolation, or interpolation along the optical
 * flow.
 */
export type Enrichment = 'none' | 'linear' | 'flow';

/** Preparation of the image before tracking. */
export interface Preparation {
  /** Binning factor within slices: blocks of this many pixels along both in-plane axes are averaged. */
  binning: 1 | 2;
  enrichment: Enrichment;
  /**
   * Factor by which inserted slices divide the distance between slices; 0 chooses the integer that makes voxels most
   * nearly cubic.
   */
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
  /**
   * Point that selects the tracked surface: the component that encloses it or is nearest to it. If undefined, the
   * largest.
   */
  at: Vec3 | undefined;
  /** Parameters set by the user; the others have the tracker's defaults, some of which it derives from the image. */
  params: ParamValues;
}

/** Distances of a surface's vertices from the true surface, in world units. */
export interface SurfaceError {
  mean: number;
  /** 95th percentile of the distances. */
  p95: number;
}

/** Reply about a newly built tracker, before its first step. */
export interface Ready {
  params: ParamValues;
  /** The tracker's default for the edge threshold τ, from the noise and the range of intensities. */
  suggested: number;
  /** Estimated standard deviation of the noise, in intensity units. */
  noise: number;
  /** The image as prepared, with the voxels of all frames; undefined if unchanged, and in the reply to `restore`. */
  volume: VolumeView | undefined;
}

export interface OpenedImage extends Ready {
  volume: VolumeView;
  /** Dimensions of the image before its preparation. */
  dims: Vec3;
  spacing: Vec3;
  /** The true volume of the cavity in each frame, mm³, if the image is computed. */
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
 * Boundary votes of a frame: positions of the faces between two voxels in world coordinates, packed xyz, and for each
 * the fraction of windows that separate its two voxels. Includes the faces between a voxel and itself in the next
 * frame.
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

/** The change that a comparison makes to the setup: toggles the prediction, or inserts slices by another method. */
export type Alternative = 'prediction' | Enrichment;

/** Result of a run through all frames, for comparison. */
export interface ComparedTrack {
  facts: FrameStatistics[];
  closing: number | undefined;
  /** Errors averaged over all frames, if the true surface is known. */
  error: SurfaceError | undefined;
  /** Duration of the run in milliseconds, preparation of the image included. */
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
  /** Changes parameters, which may set the run back; replies with all parameters and the iteration it is at now. */
  setParams: { body: ParamValues; reply: { params: ParamValues; iteration: number } };
  votes: { body: { frame: number }; reply: BoundaryVotes };
  between: { body: { frame: number; slice: number; window: [number, number] }; reply: InterpolatedSlice };
  save: { body: undefined; reply: SavedTrack };
  /** Restores a saved run of the same image; the state event is sent only in reply to `sendState`. */
  restore: { body: SavedTrack; reply: Ready };
  /** Replies with the image as prepared at present, with all frames. */
  view: { body: undefined; reply: VolumeView };
  /** Makes the worker send a state event, `done` or `paused`. */
  sendState: { body: undefined; reply: undefined };
  export: { body: { frame: number; format: MeshFormat }; reply: Uint8Array };
  /** Replies with all tracked frames as one animated GLB. */
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

/** Sent when a step of preparing the image begins; `what` names the step in words for the status line. */
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
