/**
 * The part of bench.json, written by scripts/bench.mjs, that the benchmark page draws. Times are in milliseconds unless
 * noted.
 */
export interface Report {
  processor?: string;
  bestOf: number;
  points?: (Host & PointFigures)[];
  remesh?: (Host & { rows: RemeshRow[] })[];
  skin?: (Host & { rows: SculptRow[] })[];
  track?: (Host & TrackFigures)[];
  steps?: (Host & { rows: StepRow[] })[];
  head?: (Host & HeadFigures)[];
  phantom?: (Host & HeadFigures)[];
  /**
   * Comparison with other software: `load` is the load average of the machine (over one minute) before the measurement;
   * `cores` its number of cores.
   */
  peers?: { bestOf: number; load?: number; cores?: number; rows: PeerRow[] };
  page?: Host & PageFigures;
}

export interface Host {
  /** Name and version of the browser or of Node that ran the measurement; `native` for native code. */
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
  /** Target edge length of a remeshing run, relative to the mean edge before remeshing. */
  factor: number;
  milliseconds: number;
  triangles: number;
}

export interface SculptRow {
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
  /** Duration of a step of the deformable model per vertex, nanoseconds. */
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

/** Measurements of the app in a browser; memory in bytes. */
export interface PageFigures {
  cold: Start;
  warm: Start;
  runs: { name: string; longest: number }[];
  motion: { resting: Turning; running: Turning };
  memory: { heap: number; arrays: number; wasm?: number; gpu: number };
}

/**
 * Measurement of one side of a comparison, this library or another package, in the unit of its {@link PeerRow}, with
 * facts about the result.
 */
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
  /** Ratio of this library's measurement to that of the other package: below 1, this library takes less time. */
  ratio?: number;
  /** Reason why there is no measurement of the other package. */
  skipped?: string;
}
