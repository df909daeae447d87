/**
 * Messages between the page and the worker of the Track lab. Both sides import this file.
 *
 * As in the other labs: each request gets exactly one reply, the worker sends events of its own accord, and a
 * cancellation is not an error.
 */
import type { FrameStatistics } from 'vesicle';
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
  VolumeView,
} from '../../engine/protocol';
import type { RunLog } from '../../engine/run-log';
import type { Warning } from '../../engine/warnings';
import type { CineSpec } from './cine';

export type {
  CineSpec,
  Failure,
  FrameStatistics,
  Measures,
  NamedBytes,
  ParamSpec,
  ParamValues,
  PointArray,
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

/** Preparation of the image before tracking: binning, and in-between slices. */
export interface Preparation {
  /** Binning factor within slices: blocks of this many pixels along both in-plane axes are averaged. */
  binning: 1 | 2;
  enrichment: Enrichment;
  /**
   * Factor by which inserted slices divide the distance between slices; 0 chooses the smallest that brings slices to
   * about twice as far apart as pixels, at most 3.
   */
  factor: number;
}

/** A region of interest: opposite corners, in world coordinates, of a box along the voxel axes. */
export interface Box {
  min: Vec3;
  max: Vec3;
}

/** The inside of the surface: with `closed` also muscles within a chamber of a heart, with `open` only what is bright. */
export type Cavity = 'closed' | 'open';

/** Settings that a tracker is built with, besides the image. */
export interface Setup {
  preparation: Preparation;
  /** Region of interest, to which tracking is limited; the whole image if undefined. */
  box: Box | undefined;
  /**
   * Point in world coordinates that selects the tracked surface: the component that encloses it or is nearest to it. If
   * undefined, the largest component.
   */
  at: Vec3 | undefined;
  /** If undefined, `open`: links, sessions and examples from before there was a choice are. */
  cavity?: Cavity | undefined;
  /** Parameters set by the user; the others have the tracker's defaults, some of which it derives from the image. */
  params: ParamValues;
}

/**
 * An object to propose settings for: at a point in a frame, or the one that moves most in a box, or else in the whole image;
 * positions in world coordinates.
 */
export type ObjectQuery = { point: Vec3; frame: number } | { box: Box } | Record<string, never>;

/** Settings proposed for an object. */
export interface Proposal {
  box: Box;
  /** A point in the object, in the first frame that has it. */
  at: Vec3;
  cavity: Cavity;
  /** Edge threshold τ, in intensity units. */
  threshold: number;
}

/**
 * Distances of a tracked surface's vertices from the true surface, which is known for computed images, in world units.
 */
export interface SurfaceError {
  mean: number;
  /** 95th percentile of the distances. */
  p95: number;
}

/** Data of a newly built or restored tracker: the reply to `rebuild` and `restore`, and part of that to `open`. */
export interface Ready {
  params: ParamValues;
  /**
   * The tracker's default for the edge threshold τ, in intensity units, from the noise and the range of intensities.
   */
  suggested: number;
  /** Estimated standard deviation of the image's noise, in intensity units. */
  noise: number;
  /**
   * The image as prepared, with the voxels of all frames; undefined if its preparation is unchanged, and in the reply
   * to `restore`.
   */
  volume: VolumeView | undefined;
}

export interface OpenedImage extends Ready {
  volume: VolumeView;
  /** Dimensions, in voxels, of the image before its preparation. */
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
  /** Log of the run up to this state; undefined if its beginning is not known. */
  log?: RunLog<Setup> | undefined;
}

/**
 * Boundary votes of a frame, to be drawn: positions of the faces between two voxels in world coordinates, packed xyz,
 * and for each the fraction of windows that separate its two voxels. Includes the faces between a voxel and the same
 * voxel in the next frame.
 */
export interface BoundaryVotes {
  frame: number;
  points: PointArray;
  weights: Float32Array;
}

/**
 * A measured slice, its two neighbours, and its interpolations from these, as 8-bit greys with the volume view's
 * contrast.
 */
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

/** The one setting that a comparison run changes: toggles the prediction, or inserts slices by another method. */
export type Alternative = 'prediction' | Enrichment;

/** Result of a comparison run through all frames. */
export interface ComparedTrack {
  facts: FrameStatistics[];
  closing: number | undefined;
  /**
   * Mean and 95th percentile of the surface's errors, averaged over all frames; undefined if the true surface is not
   * known.
   */
  error: SurfaceError | undefined;
  /** Duration of the run in milliseconds, preparation of the image included. */
  duration: number;
  selfIntersections: number;
}

export interface Requests extends CodeRequests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /**
   * Opens an image and builds a tracker of it, or with `saved` restores a run of it. On failure, the previous image and
   * tracker stay in use.
   */
  open: {
    body: {
      name: string;
      source: ImageSource;
      setup: Setup;
      saved?: SavedTrack | undefined;
      /** Whether the image is in small files, or in a small session. */
      isSmall: boolean;
    };
    reply: OpenedImage;
  };
  /** Builds a new tracker of the same image. On failure, the previous one stays in use. */
  rebuild: { body: Setup; reply: Ready };
  /** Pauses the run and proposes settings for an object; replies with undefined if cancelled. */
  propose: { body: ObjectQuery; reply: Proposal | undefined };
  cancelProposal: { body: undefined; reply: undefined };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  /**
   * Changes parameters, which may set the run back; replies with all parameters and the iteration that the run is at
   * then.
   */
  setParams: { body: ParamValues; reply: { params: ParamValues; iteration: number } };
  votes: { body: { frame: number }; reply: BoundaryVotes };
  between: { body: { frame: number; slice: number; window: [number, number] }; reply: InterpolatedSlice };
  save: { body: undefined; reply: SavedTrack };
  /** Restores a saved run of the same image, for undo. Sends no state event; the page requests one by `sendState`. */
  restore: { body: SavedTrack; reply: Ready };
  /** Replies with the prepared image, with the voxels of all frames. */
  view: { body: undefined; reply: VolumeView };
  /** Makes the worker send a state event, `done` or `paused`, to the page. */
  sendState: { body: undefined; reply: undefined };
  export: { body: ExportRequest & { frame: number }; reply: Uint8Array };
  /** Replies with the warnings about each tracked frame, among them what is also true of others. */
  frameWarnings: { body: undefined; reply: Warning[][] };
  /** Replies with all tracked frames as one animated GLB. */
  animation: { body: Pick<ExportRequest, 'space' | 'unit'>; reply: Uint8Array };
  /** Tracks all frames with another setup, for comparison; replies with undefined if cancelled. */
  compare: { body: { setup: Setup }; reply: ComparedTrack | undefined };
  cancelCompare: { body: undefined; reply: undefined };
}

/** The tracked surface of a frame, with its facts and measures. */
export interface TrackedFrame {
  surface: Surface;
  facts: FrameStatistics;
  measures: Measures;
  error: SurfaceError | undefined;
}

/** Event sent when a step of preparing the image begins; `what` names the step in words for the status line. */
export interface PreparingEvent {
  event: 'preparing';
  what: string;
}
/**
 * Event sent after each step of the tracker; `frame` is the surface of the frame with number `index`, from 0, if the
 * step completed one, else both are undefined.
 */
export interface StepEvent {
  event: 'step';
  report: StepReport;
  index: number | undefined;
  frame: TrackedFrame | undefined;
  closing: number | undefined;
}
/** Event with the progress of a comparison run: the share that is done, 0 to 1, and the present phase in words. */
export interface ComparisonProgressEvent {
  event: 'comparing';
  part: number;
  phase: string;
}
export type WorkerEvent = PreparingEvent | StepEvent | ComparisonProgressEvent | StateEvent | FailureEvent;
