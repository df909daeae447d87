/**
 * The messages between page and worker. Both sides import this file and nothing else of each other.
 *
 * The page sends requests and gets exactly one reply each; the worker also sends events on its own.
 * Stopping a run is an ordinary request with an ordinary reply: a cancellation is not an error.
 */
import type {
  Attractor,
  Coverage,
  MeshFormat,
  MeshInfo,
  MeshReport,
  ParamSpec,
  StepReport,
  UncoveredPart,
  Vec3,
} from 'vesicle';

import type { Shape } from './shapes';

export type { Attractor, Coverage, MeshFormat, MeshInfo, MeshReport, ParamSpec, StepReport, UncoveredPart, Vec3 };

export type ParamValues = Record<string, unknown>;

export interface NamedBytes {
  name: string;
  bytes: Uint8Array;
}

/** Where the surface starts. Points are world coordinates, packed xyz. */
export type StartShape =
  | { kind: 'contour' }
  | { kind: 'enclosing' }
  | { kind: 'bubbles'; count: number }
  | { kind: 'sphere'; center: Vec3; radius: number }
  | { kind: 'isosurface' };

/** Where a volume comes from: one file, or a header and its data; or a computed shape. */
export type VolumeSource = { files: NamedBytes[] } | { shape: Shape };

export interface Setup {
  start: StartShape;
  /** Pyramid levels above the volume itself. */
  levels: number;
  /** Mean edge at the end in world units; chosen by the model where undefined. */
  edge: number | undefined;
  /** What differs from the defaults; without `iso` the worker chooses one from the histogram. */
  params: ParamValues;
  attractors: Attractor[];
}

/** A coarser copy of the volume, reduced to 8 bits like the volume itself. */
export interface LevelView {
  dims: Vec3;
  voxels: Uint8Array;
}

/** What can be told of each vertex beside its place; the names are shown. */
export type Shade = 'speed' | 'mean curvature' | 'gaussian curvature';

/** Everything a run has, to come back to it. */
export interface SavedRun {
  state: Uint8Array;
  levels: number;
  iteration: number;
  done: boolean;
}

/** What the page needs to know of a volume, with its voxels reduced to 8 bits for display. */
export interface VolumeView {
  name: string;
  dims: Vec3;
  frames: number;
  spacing: Vec3;
  /** Voxel index to world, column-major, 16 numbers. */
  affine: Float64Array;
  space: 'RAS' | 'LPS';
  /** Smallest and largest intensity. */
  range: [number, number];
  histogram: Uint32Array;
  /** The intensities shown as black and as white. */
  window: [number, number];
  /** x fastest, 0 = black, 255 = white; where all frames are wanted, one after the other. */
  voxels: Uint8Array;
}

export interface Plane {
  origin: Vec3;
  normal: Vec3;
}

/** Buffers that travel to the page and back, so that none is allocated per frame. They may be longer than what is used. */
export interface SurfaceBuffers {
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
}

export interface Surface extends SurfaceBuffers {
  /** How many vertices and triangles of the buffers are in use. */
  vertices: number;
  triangles: number;
  /** One number a vertex, where a shade was asked for. */
  values?: Float32Array;
  /** rgb of each vertex, 0..1, where it has one of its own. */
  colors?: Float32Array;
  /** Place of each vertex in a picture, where one was asked for. */
  uvs?: Float32Array;
}

/** `report` is there when the surface was checked, which costs time and is done only when it stands still. */
export interface Measures {
  info: MeshInfo;
  report?: MeshReport;
}

/** A model that was just built, before its first step. */
export interface Ready {
  params: ParamValues;
  /** Edge length the model starts with, world units. */
  delta: number;
}

/** Coverage, and the iteration it was measured at. */
export interface MeasuredCoverage extends Coverage {
  iteration: number;
}

/** One of the two ways in a comparison, and what it cost. */
export interface ComparedRun {
  levels: number;
  /** How many iterations and milliseconds by part each level took, the coarsest first. */
  byLevel: { level: number; iterations: number; times: Record<string, number> }[];
  /** Of the last iteration. */
  report: StepReport;
  info: MeshInfo;
}

export interface Loaded extends Ready {
  volume: VolumeView;
}

/** Every request: what is sent, and what comes back. */
export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /** When it fails, the former volume and model stay. */
  load: { body: { name: string; source: VolumeSource; setup: Setup }; reply: Loaded };
  /** A new model on the same volume. When it fails, the former model stays. */
  rebuild: { body: Setup; reply: Ready };
  play: { body: undefined; reply: undefined };
  pause: { body: undefined; reply: undefined };
  step: { body: { count: number }; reply: undefined };
  /** Replies with all the parameters as they are now. */
  setParams: { body: ParamValues; reply: ParamValues };
  /** The planes whose cuts with the surface are to be sent. */
  planes: { body: Plane[]; reply: undefined };
  export: { body: { format: MeshFormat }; reply: Uint8Array };
  /** So many coarser copies of the volume, the finest first. */
  pyramid: { body: { levels: number }; reply: LevelView[] };
  setAttractors: { body: Attractor[]; reply: undefined };
  /** What to tell of each vertex from now on. */
  shade: { body: Shade | undefined; reply: undefined };
  /** The run as it is at this moment, also while it goes on. */
  save: { body: undefined; reply: SavedRun };
  /** Back to a saved run of the same volume. */
  restore: { body: SavedRun; reply: Ready };
  /** The same extraction twice, direct and coarse to fine; nothing when it was cancelled. */
  compare: { body: Setup; reply: { direct: ComparedRun; coarseToFine: ComparedRun } | undefined };
  cancelCompare: { body: undefined; reply: undefined };
  /** How much of the iso-surface is covered, now and also while a run goes on; nothing when it was cancelled. */
  coverage: { body: undefined; reply: MeasuredCoverage | undefined };
  cancelCoverage: { body: undefined; reply: undefined };
  /** Adds parts that the surface leaves out; replies with how many there were. */
  seed: { body: undefined; reply: number };
}

export type RequestKind = keyof Requests;
export type RequestMessage = { [K in RequestKind]: { id: number; kind: K; body: Requests[K]['body'] } }[RequestKind];
/** Buffers the page is done with; has no reply. */
export interface ReturnMessage {
  kind: 'return';
  buffers: SurfaceBuffers;
}
export type ToWorker = RequestMessage | ReturnMessage;

export interface Failure {
  /** A VesicleError's code, or 'internal' when the engine itself broke and has to be started again. */
  code: string;
  message: string;
}
export type ReplyMessage = { id: number; ok: true; body: unknown } | { id: number; ok: false; failure: Failure };

export interface SnapshotEvent {
  event: 'snapshot';
  surface: Surface;
  /** Pyramid level the model is on. */
  level: number;
  /** Cuts with the planes, pairs of world points. */
  sections: Float32Array[];
  /** One per step since the last snapshot. */
  reports: StepReport[];
  measures?: Measures;
}
/** Steps that came faster than the page draws, so that it need not take in too many at once. */
export interface ProgressEvent {
  event: 'progress';
  reports: StepReport[];
}
export interface SectionsEvent {
  event: 'sections';
  sections: Float32Array[];
}
/** Sent when a run has ended by itself or was stopped, after its last snapshot. */
export interface StateEvent {
  event: 'state';
  state: 'running' | 'paused' | 'done';
}
export interface FailureEvent {
  event: 'failure';
  failure: Failure;
}
/** How far a comparison is. */
export interface ComparingEvent {
  event: 'comparing';
  run: 'direct' | 'coarseToFine';
  report: StepReport;
}
/** How far a measurement of coverage is, 0..1. */
export interface CoveringEvent {
  event: 'covering';
  share: number;
}
export type WorkerEvent =
  | SnapshotEvent
  | ProgressEvent
  | SectionsEvent
  | StateEvent
  | FailureEvent
  | ComparingEvent
  | CoveringEvent;
export type FromWorker = ReplyMessage | WorkerEvent;
