/** Reads DICOM segmentation objects with ITK (dcmqi): labels with names and colours, in the grid of their slices. */
import { type Image, InterfaceTypes, runPipeline } from 'itk-wasm';
import type { VolumeInit } from 'vesicle';
import type { NamedBytes } from '../protocol';
import type { KnownLabel } from '../segment/labels';
import { text } from '../texts';
import { Refusal } from '../worker/refusal';
import { firstLine, geometryOf, options } from './dicom';

/** Program for segments that share no voxel: one label map. */
const DISJOINT = 'read-segmentation';
/** Program for all others: one image for each segment, which takes more memory. */
const SEPARATE = 'read-overlapping-segmentation';
/** Number of bytes at the start of a file within which the description of the segments begins. */
const HEADER = 1_000_000;

/** A label map with what its file says of the labels. */
export interface Segmentation {
  init: VolumeInit;
  labels: KnownLabel[];
  /** Number of voxels that are in several segments; they have the label of the last one. */
  shared: number;
}

interface SegmentInfo {
  labelID: number;
  SegmentLabel?: string;
  SegmentDescription?: string;
  recommendedDisplayRGBValue?: number[];
}

/**
 * Reads a segmentation. Of fractional segments, a voxel gets the one with the largest fraction, if that is at least a
 * half. Throws a `Refusal` if the file cannot be read.
 */
export async function readSegmentation(file: NamedBytes): Promise<Segmentation> {
  const most = largestFraction(file.bytes);
  const found = most === undefined ? await run(DISJOINT, file).catch(() => undefined) : undefined;
  if (found) return { init: initOf(found.image, labelsIn(found.image)), labels: known(found.segments), shared: 0 };
  const { image, segments } = await run(SEPARATE, file).catch((error: unknown) => {
    throw unreadable(error instanceof Error ? error.message : String(error));
  });
  const { data, shared } = combined(labelsIn(image), segments, most);
  return { init: initOf(image, data), labels: known(segments), shared };
}

/** Runs a program; returns the image and the descriptions of the segments, in the order of the image's components. */
async function run(program: string, { bytes }: NamedBytes): Promise<{ image: Image; segments: SegmentInfo[] }> {
  const input = { type: InterfaceTypes.BinaryFile, data: { path: 'seg.dcm', data: bytes.slice() } };
  const outputs = [{ type: InterfaceTypes.Image }, { type: InterfaceTypes.JsonCompatible }];
  const {
    returnValue,
    stderr,
    outputs: results,
  } = await runPipeline(program, ['seg.dcm', '0', '1', '--memory-io'], outputs, [input], options());
  const [image, info] = results ?? [];
  if (returnValue !== 0 || !image || !info) throw new Error(stderr);
  const { segmentAttributes } = info.data as unknown as { segmentAttributes: SegmentInfo[][] };
  return { image: image.data as Image, segments: segmentAttributes.flat() };
}

function initOf(image: Image, data: Int16Array): VolumeInit {
  return { ...geometryOf(image), data };
}

function labelsIn({ data }: Image): Int16Array {
  return data instanceof Int16Array ? data : Int16Array.from(data as ArrayLike<number>);
}

/** Combines images of single segments, whose voxels are interleaved, to a label map. */
function combined(
  values: Int16Array,
  segments: SegmentInfo[],
  most: number | undefined,
): { data: Int16Array; shared: number } {
  const count = segments.length;
  const data = new Int16Array(values.length / Math.max(1, count));
  let shared = 0;
  for (let voxel = 0; voxel < data.length; voxel++) {
    let [present, best] = [0, most === undefined ? 1 : most / 2];
    for (const [k, { labelID }] of segments.entries()) {
      const value = values[voxel * count + k] ?? 0;
      if (most === undefined ? value === 0 : value < best || value === 0) continue;
      // A later segment takes a voxel from an earlier one, but not with the same fraction.
      if (most !== undefined && value === best && present > 0) continue;
      present += 1;
      best = value;
      data[voxel] = labelID;
    }
    if (most === undefined && present > 1) shared += 1;
  }
  return { data, shared };
}

/**
 * Returns the value that stands for a whole voxel in a file of fractional segments; undefined for other files. The reader
 * tells neither.
 */
function largestFraction(bytes: Uint8Array): number | undefined {
  const type = positionOf(bytes, [0x62, 0, 1, 0]);
  if (type < 0 || !latin(bytes.subarray(type, type + 24)).includes('FRACTIONAL')) return undefined;
  const most = positionOf(bytes, [0x62, 0, 0x0e, 0]);
  // With or without a type before it, the value has the same place.
  return most < 0 ? 255 : (bytes[most + 8] ?? 0) + 256 * (bytes[most + 9] ?? 0) || 255;
}

/** Returns the position of the first of some bytes in the header of a file; −1 if they are not there. */
function positionOf(bytes: Uint8Array, wanted: number[]): number {
  const [first = 0] = wanted;
  for (let at = bytes.indexOf(first); at >= 0 && at < HEADER; at = bytes.indexOf(first, at + 1))
    if (wanted.every((byte, k) => bytes[at + k] === byte)) return at;
  return -1;
}

const latin = (bytes: Uint8Array) => String.fromCharCode(...bytes);

function known(segments: SegmentInfo[]): KnownLabel[] {
  return segments.map(({ labelID, SegmentLabel, SegmentDescription, recommendedDisplayRGBValue }) => {
    const name = SegmentLabel?.trim() || SegmentDescription?.trim();
    const color = recommendedDisplayRGBValue && hex(recommendedDisplayRGBValue);
    return { value: labelID, ...(name && { name }), ...(color && { color }) };
  });
}

function hex(rgb: number[]): string | undefined {
  if (rgb.length !== 3 || rgb.some((value) => !(value >= 0 && value <= 255))) return undefined;
  return `#${rgb.map((value) => Math.round(value).toString(16).padStart(2, '0')).join('')}`;
}

function unreadable(reason: string): Refusal {
  return new Refusal('bad-file', text('files.segmentationUnreadable', { reason: firstLine(reason) }));
}
