/**
 * Messages between the page and the worker of the Sculpt lab. Both sides import this file, and neither imports the
 * other's code.
 *
 * As in the other labs: each request gets exactly one reply, the worker sends events of its own accord, and a
 * cancellation is not an error. A pose has no reply: during a drag only the newest counts, and each frame reports the
 * pose that it follows.
 */
import type { ControlEllipsoid, MeshTexture } from 'vesicle';
import type {
  CodeRequests,
  ExportRequest,
  Failure,
  FailureEvent,
  Measures,
  NamedBytes,
  ParamSpec,
  ParamValues,
  StateEvent,
  StepReport,
  Surface,
  Vec3,
  Warning,
} from '../../engine/protocol';
import type { RunLog } from '../../engine/run-log';
import type { Film } from './film';
import type { ComputedMesh } from './shapes';

export type { ControlEllipsoid, Failure, MeshTexture, NamedBytes, ParamSpec, ParamValues, StepReport, Surface, Vec3 };

/** All control ellipsoids of a model, in a fixed order. */
export type Pose = ControlEllipsoid[];

/** Support of a surface: itself, or a membrane over the ellipsoids as in the paper. */
export type Support = 'surface' | 'membrane';

/** Source of a mesh: a file with its texture, if any, or a computed shape. */
export type MeshSource = { file: NamedBytes; texture?: MeshTexture; beside?: NamedBytes[] } | { shape: ComputedMesh };

/** Meshes that a model is built from; with neither detail nor base it is a membrane over the ellipsoids alone. */
export interface SceneSource {
  detail?: MeshSource;
  base?: MeshSource;
}

/** Settings that a model is built with, besides its meshes. */
export interface Setup {
  support: Support;
  /**
   * The control ellipsoids before the first step. If undefined, the request `open` proposes those of a surface that holds
   * itself, fits those of a membrane to the mesh (a unit ball if there is none), and `rebuild` keeps those of the previous
   * model, if that has the same support.
   */
  start: Pose | undefined;
  /** Parameters of the method that differ from the defaults. */
  params: ParamValues;
  /** Target pose of the ellipsoids, to which they move from the start; if undefined, they stay. */
  pose: Pose | undefined;
}

/**
 * Parameters and poses of a newly built or restored model: the reply to `rebuild` and `restore`, and part of that to
 * `open`.
 */
export interface Ready {
  params: ParamValues;
  /** The ellipsoids with which the model was built. */
  start: Pose;
  /** Target pose, which the ellipsoids move to. */
  pose: Pose;
}

export interface OpenedScene extends Ready {
  box: { min: Vec3; max: Vec3 };
  /** Number of triangles of the detailed surface; undefined if there is none. */
  detail: number | undefined;
  bands: number;
  support: Support;
  /** Whether the surface can have either support: it is a detail without a base. */
  hasChoice: boolean;
  /** The texture of the surface; undefined if it has none. */
  texture: MeshTexture | undefined;
  /** Warnings about the meshes. */
  warnings: readonly Warning[];
  /** Milliseconds spent building the model, most of them for its base. */
  buildMs: number;
}

/**
 * The meshes displayed: the result (the deformed surface with its detail), the deformed base, both of them, a row with
 * all stages of figure 1, the meshes of the membrane's solver from coarse to fine, or stages of restructuring.
 */
export type Layout = 'result' | 'base' | 'pair' | 'row' | 'levels' | 'stages';

/** Series of restructuring stages to display: as a whole (figure 3), or pass by pass (figure 6). */
export type StageKind = 'restructuring' | 'passes';

/** A mesh with its caption, one of several displayed in a row. */
export interface Stage {
  caption: string;
  surface: Surface;
}

/** A quantity computed at each vertex of the surface to colour it by; the names appear in the interface. */
export type SculptQuantity = 'area distortion' | 'angle distortion' | 'mean curvature';

/** Selects the data that the worker sends to the page with each {@link FrameEvent}. */
export interface FrameContents {
  layout: Layout;
  quantity: SculptQuantity | undefined;
  /** Whether the result is sent with texture coordinates; it then has no values of `quantity`. */
  textured: boolean;
}

/** A saved model, from which the worker can restore it; kept by the page for undo. */
export interface SavedPose {
  state: Uint8Array;
  /** Support of the surface; a membrane if undefined, as in sessions of earlier versions. */
  support?: Support | undefined;
  /** The ellipsoids with which the model was built. */
  start: Pose;
  iteration: number;
  /** Frame of the film, from 0, at which the model was saved. */
  frame: number;
  /** Key of the log up to this state, which the worker keeps: a log of many drags is long. */
  log?: string;
}

/** Log of a model: what it was built from, and all calls since. */
export type PoseLog = RunLog<{ start: Pose; params: ParamValues; support?: Support | undefined }>;

/**
 * Facts that the page displays besides the measures of the mesh: about the detail and the map T, which takes the
 * deformed base to the undeformed one.
 */
export interface Facts {
  bands: number;
  folded: number;
  missed: number;
  held: number;
  /**
   * Area distortion of the map T (area on the undeformed base over that on the deformed base): 5th percentile over the
   * vertices.
   */
  areaLow: number;
  /**
   * Area distortion of the map T (area on the undeformed base over that on the deformed base): 95th percentile over the
   * vertices.
   */
  areaHigh: number;
  /** Angle distortion of the map T (largest over smallest stretch): 95th percentile over the vertices. */
  angleHigh: number;
}

export interface Requests extends CodeRequests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** Opens meshes and builds a model of them, or with `saved` restores one. On failure, the previous model stays in use. */
  open: {
    body: { source: SceneSource; setup: Setup; saved?: SavedPose | undefined; log?: PoseLog | undefined };
    reply: OpenedScene;
  };
  /** Builds a new model of the same meshes. On failure, the previous model stays in use. */
  rebuild: { body: Setup; reply: Ready };
  /** Loads a film and goes to one of its frames, at most the last, without playing it; undefined removes the film. */
  film: { body: { film: Film | undefined; frame: number }; reply: undefined };
  /**
   * Plays the film from its present frame, or from the start if it is at its end; without a film, runs until the model
   * has converged.
   */
  play: { body: undefined; reply: undefined };
  /** Runs until the model has converged, without playing the film. */
  settle: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  setParams: { body: ParamValues; reply: ParamValues };
  show: { body: FrameContents; reply: undefined };
  /** Replies with the undeformed base and, if there is one, the detailed surface as loaded. */
  originals: { body: undefined; reply: { base: Surface; detail: Surface | undefined } };
  /** Saves the present state of the model, also while it is running. */
  save: { body: undefined; reply: SavedPose };
  /** Replies with the log of the present model, for a session; undefined if its beginning is not known. */
  log: { body: undefined; reply: PoseLog | undefined };
  /** Restores a saved model of the same meshes. */
  restore: { body: SavedPose; reply: Ready };
  stages: { body: StageKind; reply: Stage[] };
  /**
   * Records the film from its first frame as an animated GLB with `frameSeconds` per frame; replies with undefined if
   * cancelled.
   */
  record: { body: { frameSeconds: number }; reply: Uint8Array | undefined };
  cancelRecord: { body: undefined; reply: undefined };
  export: { body: ExportRequest; reply: Uint8Array };
}

/** Tells the worker that a frame is on the screen, so that it may send another; has no reply. */
export interface ShownMessage {
  kind: 'shown';
  /** The frame's `serial`. */
  serial: number;
}
/** Sets the target pose of the ellipsoids: at once during a drag, else by a glide of several frames; has no reply. */
export interface PoseMessage {
  kind: 'pose';
  pose: Pose;
  /** Number of the pose; each {@link FrameEvent} reports the number of the last pose that it follows. */
  poseId: number;
  /** Whether the pose is part of a drag that continues. */
  dragging: boolean;
}

/**
 * Event with the model's surfaces and ellipsoids, sent after a step or after a change of the data requested with each
 * frame.
 */
export interface FrameEvent {
  event: 'frame';
  /** Counts the frames, from 1; the page sends it back when the frame is on the screen. */
  serial: number;
  result: Surface;
  /** The deformed base; omitted in the layout `result`. */
  base?: Surface;
  /**
   * The map T as a surface: the triangles of the base, with its vertices at their positions on the undeformed base.
   * Sent in the layout `row`.
   */
  link?: Surface;
  /** The meshes of the membrane's solver from coarse to fine; sent in the layout `levels`. */
  levels?: Stage[];
  reports: StepReport[];
  /** The model's ellipsoids at present; removed ones that are still shrinking follow at the end. */
  ellipsoids: Pose;
  /** Target pose of the ellipsoids; during a glide of several frames, the pose at its end. */
  pose: Pose;
  /** Number (`poseId`) of the last pose that the worker received before this frame. */
  poseId: number;
  /** Present frame of the film, from 0. */
  frame: number;
  /** Duration of the model's last step in milliseconds. */
  durationMs: number;
  /**
   * Whether the frame is a preview: its detail is reduced and, after a slow step of a drag, its edges are twice as long
   * as set.
   */
  preview: boolean;
}
/**
 * Event with the measures of the mesh, and facts about the map T and the detail; sent when the model has converged or
 * was stopped, and after single steps.
 */
export interface MeasuredEvent {
  event: 'measured';
  measures: Measures;
  facts: Facts;
}
/**
 * Event that reports that the model rejected a pose sent by the page; the ellipsoids keep their previous target,
 * `pose`.
 */
export interface RefusedEvent {
  event: 'refused';
  failure: Failure;
  pose: Pose;
}
/** Event with the progress of a recording of the film, 0 to 1. */
export interface RecordingProgressEvent {
  event: 'recorded';
  progress: number;
}
export type WorkerEvent =
  | RecordingProgressEvent
  | FrameEvent
  | MeasuredEvent
  | RefusedEvent
  | StateEvent
  | FailureEvent;
