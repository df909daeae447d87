/**
 * The messages between page and worker in the Sculpt lab. Both sides import this file and nothing else of each other.
 *
 * As in the other labs: exactly one reply to each request, events of the worker's own, and a stop is no error. A pose
 * has no reply: while a hand drags, only the newest counts, and the frame that follows says which one it shows.
 */
import type { ControlEllipsoid, MeshTexture } from 'vesicle';
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
import type { Film } from './film';
import type { ComputedMesh } from './shapes';

export type {
  ControlEllipsoid,
  Failure,
  MeshFormat,
  MeshTexture,
  NamedBytes,
  ParamSpec,
  ParamValues,
  StepReport,
  Surface,
  Vec3,
};

export type Pose = ControlEllipsoid[];

/** Where a mesh comes from: a file, or code. */
export type MeshSource = { file: NamedBytes; texture?: MeshTexture } | { shape: ComputedMesh };

/** What a model is made of; neither detail nor base: a bare skin. */
export interface SceneSource {
  detail?: MeshSource;
  base?: MeshSource;
}

/** How a model is made. */
export interface Setup {
  /** The ellipsoids before the first step; without, some that fit the mesh. */
  start: Pose | undefined;
  /** What differs from the defaults. */
  params: ParamValues;
  /** Where the ellipsoids go from there. */
  pose: Pose | undefined;
}

/** A model before its first step. */
export interface Ready {
  params: ParamValues;
  /** What it started with, and where they go. */
  start: Pose;
  pose: Pose;
}

export interface Opened extends Ready {
  box: { min: Vec3; max: Vec3 };
  /** Triangles of the detailed surface; nothing for a bare skin. */
  detail: number | undefined;
  bands: number;
  /** The picture on the surface, where it has one. */
  texture: MeshTexture | undefined;
  /** Milliseconds that making it took, most of them for the base. */
  made: number;
}

/** Which meshes are shown beside each other. */
export type Layout = 'result' | 'base' | 'pair' | 'row' | 'levels' | 'stages';

/** Pictures of how a mesh is restructured: as a whole (figure 3), or pass by pass (figure 6). */
export type StageKind = 'restructuring' | 'passes';

/** One of several meshes beside each other. */
export interface Stage {
  caption: string;
  surface: Surface;
}

/** What the colours of the surface tell that has to be computed; the names are shown. */
export type SculptShade = 'area distortion' | 'angle distortion' | 'mean curvature';

/** What the page needs of each frame. */
export interface Shown {
  layout: Layout;
  shade: SculptShade | undefined;
  /** The surface is wanted with its places in the picture. */
  textured: boolean;
}

/** Everything a run has, to come back to it. */
export interface SavedPose {
  state: Uint8Array;
  iteration: number;
  /** Of the film. */
  frame: number;
}

/** Facts that no mesh tells. */
export interface Facts {
  bands: number;
  folded: number;
  missed: number;
  held: number;
  /** 5th and 95th percentile of the area on the base over that on the deformed one. */
  areaLow: number;
  areaHigh: number;
  /** 95th percentile of the longest over the shortest stretch. */
  angleHigh: number;
}

export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** When it fails, the former model stays. */
  open: { body: { source: SceneSource; setup: Setup }; reply: Opened };
  /** A new model of the same meshes. When it fails, the former model stays. */
  rebuild: { body: Setup; reply: Ready };
  /** What is played, and the frame it is at. */
  film: { body: { film: Film | undefined; frame: number }; reply: undefined };
  /** Plays the film from where it is, from the start where it is at its end; without one, goes on to rest. */
  play: { body: undefined; reply: undefined };
  /** Goes on to rest, whatever film there is. */
  settle: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  setParams: { body: ParamValues; reply: ParamValues };
  show: { body: Shown; reply: undefined };
  /** The undeformed base and the detailed surface, as given. */
  originals: { body: undefined; reply: { base: Surface; detail: Surface | undefined } };
  /** The model as it is at this moment, also while it goes on. */
  save: { body: undefined; reply: SavedPose };
  /** Back to a saved model of the same meshes. */
  restore: { body: SavedPose; reply: Ready };
  stages: { body: StageKind; reply: Stage[] };
  /** The film from its first frame as an animated GLB, and how long each frame is seen; nothing when it was cancelled. */
  record: { body: { frameSeconds: number }; reply: Uint8Array | undefined };
  cancelRecord: { body: undefined; reply: undefined };
  export: { body: { format: MeshFormat }; reply: Uint8Array };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
/** The frame last sent is on the screen; has no reply. */
export interface ShownMessage {
  kind: 'shown';
}
/** Where the ellipsoids are to be from now on; has no reply. */
export interface PoseMessage {
  kind: 'pose';
  pose: Pose;
  /** Counts poses; frames say which was the last that they follow. */
  turn: number;
  /** The hand is still at it. */
  dragging: boolean;
}
export type ToWorker = RequestMessage | ShownMessage | PoseMessage;

/** The model after a step. */
export interface FrameEvent {
  event: 'frame';
  result: Surface;
  /** The deformed base, and the map T, where the layout shows them. */
  base?: Surface;
  link?: Surface;
  /** The solver's meshes from coarse to fine, where the layout shows them. */
  levels?: Stage[];
  reports: StepReport[];
  /** Where the ellipsoids are now; some more may be vanishing. */
  ellipsoids: Pose;
  /** Where they are to be. */
  pose: Pose;
  /** The last pose that came before this step. */
  turn: number;
  /** Of the film. */
  frame: number;
  /** The frame's work, milliseconds. */
  took: number;
  /** Edges are twice as long as set, so that a drag is answered in time. */
  coarse: boolean;
}
/** At rest, or standing still. */
export interface MeasuredEvent {
  event: 'measured';
  measures: Measures;
  facts: Facts;
}
/** A pose that was refused; the ellipsoids go on to where they were sent before. */
export interface RefusedEvent {
  event: 'refused';
  failure: Failure;
  pose: Pose;
}
/** How far a recording is, 0 to 1. */
export interface RecordedEvent {
  event: 'recorded';
  part: number;
}
export type WorkerEvent = RecordedEvent | FrameEvent | MeasuredEvent | RefusedEvent | StateEvent | FailureEvent;
