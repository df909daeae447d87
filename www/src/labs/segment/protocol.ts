/**
 * Messages between the page and the worker of the Segment lab. Both sides import this file, and neither imports the
 * other's code.
 */
import type { VolumeFormat } from 'vesicle';
import type { KnownLabel, Label, LabelArray } from '../../engine/labels';
import type {
  ExportRequest,
  FailureEvent,
  NamedBytes,
  ParamSpec,
  ParamValues,
  Surface,
  Vec3,
  VolumeView,
  Warning,
} from '../../engine/protocol';

export type { FailureEvent, NamedBytes, ParamSpec, ParamValues, Surface, Vec3, VolumeFormat, VolumeView };

/** A box of voxels: the index of its first voxel, and the numbers of voxels along x, y and z. */
export interface Region {
  min: Vec3;
  dims: Vec3;
}

/** The voxels of a box of a label map, x fastest. */
export interface LabelBlock extends Region {
  data: LabelArray;
}

/** Label map that is computed from an example's intensities. */
export type Labelling = 'tooth' | 'head';

/** Source of a volume and, if there is one, its label map. */
export interface ImageSource {
  /** Files of the volume, or of the volume and its label map. */
  files: NamedBytes[];
  labelling?: Labelling;
}

/** Measures of a label, and its surface. Lengths are in world units. */
export interface LabelSurface {
  value: number;
  voxels: number;
  /** Volume of the voxels. */
  volume: number;
  /** Area of the surface. */
  area: number;
  /** Undefined if the label has no voxels. */
  surface: Surface | undefined;
}

/** Surfaces that may have changed, and the milliseconds that the worker spent on them. */
export interface SurfaceUpdate {
  surfaces: LabelSurface[];
  milliseconds: number;
}

/** The surfaces that have changed, after a step; `done` says whether they are smooth. */
export interface StepUpdate extends SurfaceUpdate {
  done: boolean;
  /** Warnings about the surfaces. */
  warnings: readonly Warning[];
}

/** The open label map, with the surfaces of all its labels, which are not smooth yet. */
export interface OpenedLabels extends SurfaceUpdate {
  /** Number of the map, which requests that concern it name; another one opened meanwhile has another number. */
  map: number;
  voxels: LabelArray;
  /** Names and colours of labels that the file of the label map has, also of labels without voxels. */
  known: KnownLabel[];
  /** Name of the file with the label map; undefined if there is none, and the map was made by the lab. */
  labelFile: string | undefined;
  /** Warnings about the volume and the label map. */
  warnings: readonly Warning[];
}

export interface OpenedImage extends OpenedLabels {
  /** Number of labels, if the volume looks like a label map; with several, it was opened as one. Else 0. */
  looksLike: number;
  volume: VolumeView;
  params: ParamValues;
}

/** Requests of the page to the Segment lab's worker: the body of each and its reply. */
export interface Requests {
  hello: { body: undefined; reply: { version: string; specs: ParamSpec[] } };
  /**
   * Opens a volume with its label map, or with an empty one; `labels` are voxels that replace those of the file, after a
   * failure of the engine or of a session, which also has the `state` of the surfaces. On failure, what was open before
   * stays.
   */
  open: {
    body: {
      name: string;
      source: ImageSource;
      params: ParamValues;
      labels: LabelArray | undefined;
      state?: Uint8Array | undefined;
      /** Whether the labels come from a small session; by default, whether they come from small files. */
      isSmall?: boolean;
    };
    reply: OpenedImage;
  };
  /** Replaces the label map of the open volume by that of a file, which must have the grid of the volume. */
  openLabels: { body: { files: NamedBytes[] }; reply: OpenedLabels };
  /**
   * Changes voxels of the label map and makes a step, after which the surfaces are smooth unless the change was large; the
   * reply has the surfaces in either case. Does nothing if another map is open.
   */
  edit: { body: { map: number; block: LabelBlock }; reply: StepUpdate };
  /**
   * Makes a step that smooths what has changed; the reply to the last one has the surfaces. Does nothing if another map
   * is open.
   */
  step: { body: { map: number }; reply: StepUpdate };
  /** Replies with the state of the surfaces, for a session. */
  save: { body: undefined; reply: Uint8Array };
  /** Changes parameters of the surfaces, which the next steps adopt; replies with all parameters. */
  setParams: { body: ParamValues; reply: ParamValues };
  /** Replies with one byte for each voxel: not 0 if its intensity is from `low` to `high`, both included. */
  mask: { body: { low: number; high: number }; reply: Uint8Array };
  /** Replies with the label map as a file, in the geometry of the volume; NRRD has names and colours of the labels, too. */
  exportMap: { body: { format: VolumeFormat; labels: readonly Label[] }; reply: Uint8Array };
  /** Replies with the surface of a label as a file. */
  exportMesh: { body: ExportRequest & { value: number }; reply: Uint8Array };
}

export type WorkerEvent = FailureEvent;
