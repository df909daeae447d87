/**
 * Messages between the page and the worker that reads formats of other programs: it lists what files hold, and writes what
 * the user chooses as files that all labs read.
 */
import type { NamedBytes, Vec3 } from '../engine/protocol';

/** A volume that files hold. */
export interface Candidate {
  /** Index in the list. */
  id: number;
  kind: 'image' | 'segmentation';
  name: string;
  /** Name of the volume once it is open: that of its file, if it is one. */
  title: string;
  /** Name of the patient, to choose by; it is not to go anywhere else. */
  patient: string;
  modality: string;
  /** `YYYY-MM-DD`; empty if unknown. */
  date: string;
  dims: Vec3;
  spacing: Vec3;
  unit: string;
  frames: number;
  /** Number of images or pages. */
  images: number;
  warnings: string[];
  remarks: string[];
  /** Why slices are uneven; undefined if they are even. */
  uneven: string | undefined;
}

/** The volumes that files hold. */
export interface Listing {
  candidates: Candidate[];
  /** Files that are part of none, each with the reason. */
  skipped: { name: string; reason: string }[];
}

export interface Requests {
  list: { body: { files: File[] }; reply: Listing };
  /** Reads volumes of the list; `resample` says what to do with uneven slices. */
  read: { body: { ids: number[]; resample: boolean }; reply: NamedBytes[] };
}

/** How far the worker is. */
export interface ProgressEvent {
  event: 'progress';
  stage: 'headers' | 'images';
  done: number;
  total: number;
}
