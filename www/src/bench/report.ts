/** What scripts/bench.mjs writes into bench.json, as far as it is drawn. Times are in milliseconds. */
export interface Report {
  processor?: string;
  bestOf: number;
  points?: (Host & PointFigures)[];
  remesh?: (Host & { rows: RemeshRow[] })[];
  skin?: (Host & { rows: SkinRow[] })[];
  track?: (Host & TrackFigures)[];
  steps?: (Host & { rows: StepRow[] })[];
  head?: (Host & HeadFigures)[];
  phantom?: (Host & HeadFigures)[];
  /** `load` is what the machine was busy with when it began. */
  peers?: { bestOf: number; load?: number; cores?: number; rows: PeerRow[] };
  page?: Host & PageFigures;
}

export interface Host {
  /** The name and, where there is one, the version. */
  host: string;
}

interface PointRun {
  points: number;
  exterior: number;
  first: { solve: number; extract: number };
  solve: number;
  extract: number;
  solveAfterEdit: number;
}

export interface PointFigures {
  few: PointRun;
  many: PointRun;
  bytes: number;
}

export interface RemeshRow {
  name: string;
  /** Length of the edges asked for, in the mean edge of before. */
  factor: number;
  milliseconds: number;
  triangles: number;
}

export interface SkinRow {
  name: string;
  milliseconds: number;
  triangles: number;
}

export interface TrackFigures {
  dims: number[];
  frames: number;
  cubes: number;
  run: { milliseconds: number; enrich: number; begin: number; votes: number; tracked: number; closingTime: number };
}

export interface StepRow {
  vertices: number;
  /** Nanoseconds a vertex. */
  step: number;
  topology: number;
}

export interface HeadFigures {
  dims: number[];
  cubes: { milliseconds: number; vertices: number };
  model: {
    milliseconds: number;
    parts: Record<string, number>;
    iterations: number;
    converged: boolean;
    vertices: number;
    closed: boolean;
    selfIntersections: number;
  };
  ratio: number;
}

interface Start {
  interactive: number;
  surface: number;
}

interface Turning {
  fps: number;
  triangles: number;
}

/** Of the app in a browser; memory in bytes. */
export interface PageFigures {
  cold: Start;
  warm: Start;
  runs: { name: string; longest: number }[];
  motion: { resting: Turning; running: Turning };
  memory: { heap: number; arrays: number; wasm?: number; gpu: number };
}

/** What one side needed in the row's unit, and what came out. */
export interface Side {
  figure: number;
  vertices?: number;
  triangles?: number;
  volume?: number;
  minAngleDegrees?: number;
  selfIntersections?: number;
  refused?: string;
}

export interface PeerRow {
  task: string;
  name: string;
  unit: string;
  package: string;
  version?: string;
  ours: Side & Host;
  theirs?: Side & { what: string };
  /** Ours to theirs. */
  ratio?: number;
  /** Why there is nothing of theirs. */
  skipped?: string;
}
