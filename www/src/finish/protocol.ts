/** Messages between the page and the worker that edits and compares surfaces after a run. */
import type {
  Edit,
  ExportRequest,
  Measures,
  NamedBytes,
  Plane,
  PointArray,
  Surface,
  SurfacePoint,
} from '../engine/protocol';

/** A connected component, in the order of {@link Edited.components}, which is that of `Mesh.components`. */
export interface Component {
  vertices: number;
  /** Negative for the wall of a cavity. */
  volume: number;
  area: number;
}

/** The edited surface and everything the page shows of it. */
export interface Edited {
  surface: Surface;
  measures: Measures;
  components: Component[];
  /** Edits so far, those that were undone left out. */
  log: Edit[];
  /** Whether the last edit can be undone: there is memory for some of the surfaces before. */
  undoable: boolean;
  /** Edits that were undone last, and can be redone, the next one first. */
  undone: Edit[];
}

/** Summary of the distances of points of one surface to another one, world units. */
export interface Distances {
  mean: number;
  rms: number;
  p95: number;
  max: number;
}

/** Comparison of the edited surface with a reference. */
export interface Comparison {
  toReference: Distances;
  fromReference: Distances;
  /** Both directions together, as `Mesh.distanceTo` returns them. */
  both: Distances;
  /** Dice coefficient of the voxels inside; undefined where the reference is open. */
  dice: number | undefined;
  /** Labels of a reference that is a label map with several. */
  labels: number[];
  /** Distance of each vertex of the edited surface to the reference. */
  values: Float32Array;
}

export interface Requests {
  /** Takes over a surface as the bytes of a mesh file; edits of the one before are forgotten. */
  open: { body: Uint8Array; reply: Edited };
  /** Makes an edit, unless it would give more than about `most` vertices. */
  edit: { body: { edit: Edit; most?: number }; reply: Edited };
  undo: { body: undefined; reply: Edited };
  redo: { body: undefined; reply: Edited };
  export: { body: ExportRequest; reply: Uint8Array };
  /** Cross-section of the surface with a plane: pairs of points in world space. */
  section: { body: Plane; reply: PointArray };
  /** Distances between two points, straight and along the surface; the latter is Infinity between two components. */
  measure: { body: [SurfacePoint, SurfacePoint]; reply: { straight: number; geodesic: number } };
  /** Reads a mesh, or a label map, as the reference of `compare`. */
  reference: { body: NamedBytes[]; reply: undefined };
  /** Compares with the reference; of a label map, the voxels of one label, or of all. */
  compare: { body: { label?: number }; reply: Comparison };
}

export type RequestKind = keyof Requests;
