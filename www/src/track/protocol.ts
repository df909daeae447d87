/**
 * The messages between page and worker in the Track lab. Both sides import this file and nothing else of each other.
 *
 * As in the other labs: exactly one reply to each request, events of the worker's own, and a stop is no error.
 */
import type { FrameFacts } from 'vesicle';
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
  FrameFacts,
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

/** A 4D image: one file, several that are its frames in the order of their names, or one to compute. */
export type FilmSource = { files: NamedBytes[] } | { cine: CineSpec };

/** In-between slices: none, means of their neighbours, or along the optical flow from one to the other. */
export type Enrichment = 'none' | 'linear' | 'flow';

/** What is done to the image before anything is tracked. */
export interface Preparation {
  /** So many pixels of a slice become one, along both its sides. */
  binning: 1 | 2;
  enrichment: Enrichment;
  /** So many slices for one; 0: as many as bring the voxels nearest to cubes. */
  factor: number;
}

/** Opposite corners of a box along the axes of the voxels, in the world. */
export interface Box {
  min: Vec3;
  max: Vec3;
}

/** How a tracker is made. */
export interface Setup {
  preparation: Preparation;
  /** All of the image where there is none. */
  box: Box | undefined;
  /** The surface nearest to this point is followed; the largest where there is none. */
  at: Vec3 | undefined;
  /** What differs from what the method chooses. */
  params: ParamValues;
}

/** How far a surface is from the true one, world units. */
export interface SurfaceError {
  mean: number;
  /** 95 % of the vertices are nearer. */
  most: number;
}

/** A tracker before its first step. */
export interface Ready {
  params: ParamValues;
  /** The step height that the noise suggests. */
  suggested: number;
  /** Standard deviation, intensity units. */
  noise: number;
  /** The image as it was prepared, with the pictures of all frames; left out where it is the one before. */
  volume: VolumeView | undefined;
}

export interface Opened extends Ready {
  volume: VolumeView;
  /** Of the image as it was opened. */
  dims: Vec3;
  spacing: Vec3;
  /** The true volumes, where the image is computed. */
  truth: number[] | undefined;
  /** Milliseconds that preparing it took. */
  prepared: number;
}

/** Everything a run has, to come back to it. */
export interface SavedTrack {
  state: Uint8Array;
  setup: Setup;
  iteration: number;
  done: boolean;
}

/** Boundary of a frame: places, and the share of the windows that separate the two voxels there. */
export interface Votes {
  frame: number;
  points: Float32Array;
  weights: Float32Array;
}

/** A slice with its neighbours, and what would be made of these two in its place; greys as in the volume's view. */
export interface Between {
  width: number;
  height: number;
  before: Uint8Array;
  flow: Uint8Array;
  measured: Uint8Array;
  linear: Uint8Array;
  after: Uint8Array;
  /** How far each is off the measured slice, root of the mean square, intensity units. */
  off: { linear: number; flow: number };
}

/** What a comparison leaves out or takes in. */
export type Alternative = 'prediction' | Enrichment;

/** What came of a run through all frames. */
export interface ComparedTrack {
  facts: FrameFacts[];
  closing: number | undefined;
  /** Mean of all frames, where the truth is known. */
  error: SurfaceError | undefined;
  /** Milliseconds, preparation included. */
  took: number;
  crossings: number;
}

export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** When it fails, the former image and tracker stay. */
  open: { body: { name: string; source: FilmSource; setup: Setup }; reply: Opened };
  /** A new tracker of the same image. When it fails, the former stays. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  /** Replies with all parameters, and from where on everything begins again. */
  setParams: { body: ParamValues; reply: { params: ParamValues; iteration: number } };
  votes: { body: { frame: number }; reply: Votes };
  between: { body: { frame: number; slice: number; window: [number, number] }; reply: Between };
  save: { body: undefined; reply: SavedTrack };
  /** Back to a saved run of the same image; its state is told when it is asked for. */
  restore: { body: SavedTrack; reply: Ready };
  /** The image as it is prepared now. */
  view: { body: undefined; reply: VolumeView };
  /** Tells the state by an event. */
  tell: { body: undefined; reply: undefined };
  export: { body: { frame: number; format: MeshFormat }; reply: Uint8Array };
  /** All frames as one animated GLB. */
  animation: { body: undefined; reply: Uint8Array };
  /** The whole run once more with something else; nothing when it was cancelled. */
  compare: { body: { setup: Setup }; reply: ComparedTrack | undefined };
  cancelCompare: { body: undefined; reply: undefined };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
export type ToWorker = RequestMessage;

/** The surface of a frame, with what happened in it. */
export interface TrackedFrame {
  surface: Surface;
  facts: FrameFacts;
  measures: Measures;
  error: SurfaceError | undefined;
}

/** What the image is being prepared by, in words. */
export interface PreparingEvent {
  event: 'preparing';
  what: string;
}
/** A step is done; with it the surface of one more frame, where it was one for that. */
export interface StepEvent {
  event: 'step';
  report: StepReport;
  index: number | undefined;
  frame: TrackedFrame | undefined;
  closing: number | undefined;
}
/** How far a comparison is, 0 to 1. */
export interface ComparingEvent {
  event: 'comparing';
  part: number;
  phase: string;
}
export type WorkerEvent = PreparingEvent | StepEvent | ComparingEvent | StateEvent | FailureEvent;
