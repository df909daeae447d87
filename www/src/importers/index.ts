/**
 * Imports volume formats that other libraries read (DICOM), or another entry of the package (TIFF); each is loaded when the
 * first such file is opened.
 */
import type { VolumeInit } from 'vesicle';
import type { NamedBytes } from '../protocol';
import { text } from '../texts';
import { Refusal } from '../worker/refusal';
import type { Segmentation } from './segmentation';

/** Number of bytes before the letters DICM at the start of a DICOM file. */
const PREAMBLE = 128;

const hasBytes = (bytes: Uint8Array, at: number, expected: number[]) =>
  expected.every((byte, k) => bytes[at + k] === byte);

export function isDicom({ bytes, name }: NamedBytes): boolean {
  return hasBytes(bytes, PREAMBLE, [0x44, 0x49, 0x43, 0x4d]) || /\.(dcm|dicom)$/i.test(name);
}

/** Whether a file is a TIFF of either byte order; includes BigTIFF with 64-bit offsets. */
export function isTiff({ bytes }: NamedBytes): boolean {
  return [42, 43].some(
    (kind) => hasBytes(bytes, 0, [0x49, 0x49, kind, 0]) || hasBytes(bytes, 0, [0x4d, 0x4d, 0, kind]),
  );
}

/** Number of bytes at the start of a DICOM file that contain the class of the object. */
const META = 1024;
/** Classes of segmentations by their number after the prefix of all. */
const SEGMENTATIONS = /1\.2\.840\.10008\.5\.1\.4\.1\.1\.66\.([47])(?![\d.])/;

/** Whether a file is a DICOM segmentation, with segments or with a label map. */
export function isSegmentation(file: NamedBytes): boolean {
  return isDicom(file) && SEGMENTATIONS.test(metaOf(file));
}

const metaOf = ({ bytes }: NamedBytes) => String.fromCharCode(...bytes.subarray(0, META));

/**
 * Reads a DICOM segmentation. Throws a `Refusal` if it cannot be read, or is of the newer class with a label map, which
 * ITK does not read.
 */
export async function importSegmentation(file: NamedBytes): Promise<Segmentation> {
  if (SEGMENTATIONS.exec(metaOf(file))?.[1] === '7') throw new Refusal('bad-file', text('files.segmentationClass'));
  return (await import('./segmentation')).readSegmentation(file);
}

/**
 * Reads the volume from the DICOM files among `files`, or else from TIFF files with one slice each or all in one;
 * undefined if no file is DICOM and not all are TIFF. A DICOM segmentation is read if there is no series. Throws a
 * `Refusal`, or for TIFF a `VesicleError`, if the files cannot be read, and a `Refusal` if they hold a single slice.
 */
export async function importVolume(files: NamedBytes[]): Promise<VolumeInit | undefined> {
  // DICOM folders contain other files as well, and DICOM files without that extension.
  const dicom = files.filter(isDicom);
  const series = dicom.filter((file) => !isSegmentation(file));
  const [first, second] = dicom;
  if (first && series.length === 0) {
    if (second) throw new Refusal('bad-file', text('files.manySegmentations', { count: dicom.length }));
    return (await importSegmentation(first)).init;
  }
  if (series.length > 0) return rejectSingleSlice('DICOM', await (await import('./dicom')).readSeries(series));
  if (files.length > 0 && files.every(isTiff))
    return rejectSingleSlice('TIFF', await (await import('vesicle/tiff')).readTiff(files));
  return undefined;
}

/** Returns the imported volume unchanged; throws a `Refusal` if it is a single slice, which has no surface. */
function rejectSingleSlice(format: string, init: VolumeInit): VolumeInit {
  if (init.dims[2] > 1) return init;
  throw new Refusal('bad-file', text('files.singleSlice', { format }));
}
