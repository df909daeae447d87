// DICOM images before their voxels are read: geometry, scale and identifiers.
import type { Vec3 } from '../data.js';
import type { Source } from './source.js';

/** How the voxels of a frame are stored (PS3.5, section 8; PS3.3, C.7.6.3). */
export interface PixelFormat {
  rows: number;
  columns: number;
  bitsAllocated: number;
  bitsStored: number;
  highBit: number;
  signed: boolean;
  /** Whether voxels of 8 bits are stored as words of 16, whose order of bytes then matters. */
  inWords: boolean;
  /** Whether voxels are floats: Float or Double Float Pixel Data. */
  float: boolean;
  transferSyntax: string;
}

/** One image of a file: a slice at one position and time. */
export interface Frame {
  file: Source;
  /** Number of the frame in its file, and of all frames there. */
  index: number;
  count: number;
  /** Byte at which the value of the pixel data begins, and the one after its end. */
  pixelsAt: number;
  pixelsEnd: number;
  /** Whether the dataset is compressed as a whole, so that offsets are those of the inflated file. */
  deflated: boolean;
  format: PixelFormat;
  series: Series;
  /** Unique identifier of the image that the file is. */
  uid: string;
  instance: number | undefined;
  /** Centre of the first voxel, and directions of increasing column and row index, in LPS; millimetres. */
  position: Vec3;
  along: Vec3;
  down: Vec3;
  /** Distance between columns and between rows. */
  spacing: [number, number];
  slope: number;
  intercept: number;
  /** Distance between slices that the file states, millimetres; used for segmentations, which leave slices out. */
  statedStep: number | undefined;
  /** Values that distinguish images at the same position, by the name of the attribute. */
  marks: Record<string, string | number>;
  /** Whether only the first image of the file has a position, and the others follow at a distance that the file states. */
  isChained: boolean;
  /** Number of the segment that the frame belongs to, in segmentations. */
  segment: number | undefined;
}

/** Attributes that all images of a series have in common. */
export interface Series {
  uid: string;
  /** Identifiers of patient and study, and what else distinguishes series whose own identifiers were removed. */
  origin: string;
  /** Class of the objects. */
  sopClass: string;
  number: number | undefined;
  description: string;
  modality: string;
  /** Name of the patient, for people to choose by; nothing else is done with it. */
  patient: string;
  /** Day of the study, `YYYY-MM-DD`; empty if it is not known. */
  date: string;
  frameOfReference: string;
  isLocaliser: boolean;
  /** Whether small values are bright. */
  inverted: boolean;
  /** Unit of intensities that the file states, such as `BQML`. */
  units: string;
  lossy: boolean;
  /** Whether intensities are given by a table, which is not applied, instead of slope and intercept. */
  hasTable: boolean;
  /** Stored value outside of what was measured. */
  padding: number | undefined;
  segments: readonly Segment[];
  /** Value of a whole voxel in a fractional segmentation; 0 for others. */
  wholeFraction: number;
}

/** A segment of a segmentation: the value of its voxels, and what its file says of it. */
export interface Segment {
  value: number;
  name?: string;
  /** Recommended colour, `#rrggbb`. */
  color?: string;
}

/** A file, or an image of one, that is part of no volume, and the reason. */
export interface Skipped {
  name: string;
  reason: string;
  /** Identifier of the series that the file is of, if it could be read.
   * @internal */
  series?: string;
  /** Whether it should have been read, but could not. */
  damaged?: boolean;
}
