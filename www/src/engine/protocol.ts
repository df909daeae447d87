/** Messages between the page and the workers, as far as all labs have them in common. */
import type {
  Attractor,
  Coverage,
  LengthUnit,
  MeshFormat,
  MeshInfo,
  MeshReport,
  MeshSnapshot,
  ParamSpec,
  PointArray,
  Space,
  StepReport,
  UncoveredRegion,
  Vec3,
  Warning,
} from 'vesicle';

import type { Shape } from './shapes';

export type {
  Attractor,
  Coverage,
  MeshFormat,
  MeshInfo,
  MeshReport,
  MeshSnapshot,
  ParamSpec,
  PointArray,
  Space,
  StepReport,
  UncoveredRegion,
  Vec3,
  Warning,
};

export type ParamValues = Record<string, unknown>;

/** Facts about a file that its format cannot hold, since it was written from one of another program. */
export interface FileNotes {
  warnings: readonly Warning[];
  /** Further statements of the other file, in words. */
  remarks?: readonly string[];
  /** Space that positions are to be in; the file's own by default. */
  space?: 'LPS';
  /** Whether small intensities are to be shown bright. */
  inverted?: boolean;
}

export interface NamedBytes {
  name: string;
  bytes: Uint8Array;
  notes?: FileNotes;
  /** Whether it was written from files of another program that are small, all together, however large it is itself. */
  isOfSmall?: boolean;
}

/** Source of a volume: its files (one, a header and its data, or a DICOM or TIFF series), or a computed shape. */
export type VolumeSource = { files: NamedBytes[] } | { shape: Shape };

/** Intensities of voxels, in the narrowest of these types that holds all of them exactly. */
export type Intensities = Uint8Array | Uint16Array | Int16Array | Float32Array;

/** Voxels of a volume, of one coarser level of its pyramid or, in the Track lab, of one frame, for display. */
export interface LevelView {
  dims: Vec3;
  /** Intensities of the voxels, x fastest. */
  voxels: Intensities;
  /** Intensities that are displayed as black and as white, until the user chooses others. */
  window: [number, number];
  /** Whether small intensities are displayed bright instead. */
  inverted?: boolean;
  /** Slope and intercept of the map from `voxels` to intensities; without them, these are the same. */
  scale?: readonly [slope: number, intercept: number];
}

/** A quantity computed at each vertex to colour the surface by; the names appear in the interface. */
export type VertexQuantity = 'speed' | 'mean curvature' | 'gaussian curvature';

/**
 * Description of a volume for the page, with its voxels: frame after frame if all frames were requested, else only the
 * first.
 */
export interface VolumeView extends LevelView {
  name: string;
  frames: number;
  spacing: Vec3;
  /** 4 × 4 affine matrix from voxel indices to world coordinates, column-major. */
  affine: Float64Array;
  space: 'RAS' | 'LPS';
  /** Unit of lengths in world space, if the volume's file states it. */
  unit?: LengthUnit;
  /** Smallest and largest intensity of the volume. */
  range: [number, number];
  histogram: Uint32Array;
  /** Warnings about the volume. */
  warnings: readonly Warning[];
  /** Further statements of its file, in words. */
  remarks?: readonly string[];
  /**
   * If the volume is the coarsest level of one larger than memory: the numbers of voxels of all its levels, finest first,
   * and the bytes of all.
   */
  large?: { levels: readonly Vec3[]; bytes: number };
}

export interface Plane {
  origin: Vec3;
  normal: Vec3;
}

/** A triangle mesh that a lab's worker sends to the page for drawing. */
export interface Surface extends MeshSnapshot {
  /** One value per vertex to colour the surface by, if a quantity was requested. */
  values?: Float32Array;
}

/**
 * Measures of a surface. `report`, the result of the mesh checks, takes time: while the Extract lab's model is running,
 * it is left out.
 */
export interface Measures {
  info: MeshInfo;
  report?: MeshReport;
}

export interface CodeRequest {
  /** Name, without an ending, of the file that the lab saves for the code. */
  stem: string;
  /** Edits of the finished surface, which follow the run. */
  edits: readonly Edit[];
  /** Index of the frame whose surface is the result, in the Track lab. */
  frame?: number;
}

/** JavaScript that repeats a run. */
export interface RunCode {
  code: string;
  /** Data that its function takes: files that were opened, or one that the lab saves for it, or a folder. */
  needs: 'files' | 'saved' | 'folder' | 'nothing';
  /** Names of the files, or of the folder. */
  name: string;
  /** Part of the run that the code lacks, in a sentence. */
  note?: string | undefined;
}

/** A surface as a file. */
export interface ExportRequest {
  format: MeshFormat;
  /** Whether the surface is moved to the origin. */
  recentre?: boolean;
  /** Warnings that the file is to have in comments, besides those of the mesh. */
  warnings?: readonly Warning[];
  /** Directions of the axes of the surface, and of those in the file, if they are to be others. */
  space?: Space;
  as?: Space;
  /** Length of a unit of its positions. */
  unit?: LengthUnit;
}

/** Requests of the page to the workers of all labs whose model runs. */
export interface CodeRequests {
  code: { body: CodeRequest; reply: RunCode };
  /** Replies with the data as a file that the code reads. */
  data: { body: undefined; reply: { extension: string; bytes: Uint8Array } };
}

export interface Failure {
  /**
   * Code of a VesicleError; 'internal' if the engine (the worker's WebAssembly module) broke and has to be restarted,
   * 'page' for an error of the page itself.
   */
  code: string;
  message: string;
}
/**
 * Event with the state of a lab's run: sent when a run starts and, after its last results, when it is done or was
 * stopped; also after single steps, in the Extract lab after seeding or restoring, and in the Track lab on request.
 */
export interface StateEvent {
  event: 'state';
  state: 'running' | 'paused' | 'done';
  /** Measures of the surface, where they come with the state. */
  measures?: Measures;
}
export interface FailureEvent {
  event: 'failure';
  failure: Failure;
}

/** Unit of lengths in world space; empty if the file does not state one. */
export type Unit = 'm' | 'mm' | 'µm' | '';

/** One edit of a surface: the name of a method of `Mesh`, and its arguments by name. */
export type Edit =
  | { op: 'remesh'; min: number; max: number }
  | { op: 'decimate'; targetTriangles: number }
  | { op: 'decimateWithin'; maxDistance: number }
  | { op: 'smooth'; iterations: number; keepVolume: boolean }
  | { op: 'keepComponents'; indices: number[] }
  | { op: 'removeCavities' }
  | { op: 'cut'; origin: Vec3; normal: Vec3 };

/** A point on the surface, by the index of its triangle. */
export interface SurfacePoint {
  triangle: number;
  point: Vec3;
}
