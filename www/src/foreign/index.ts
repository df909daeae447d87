/** Formats that others’ libraries read: fetched when such a file is opened, and not before. */
import type { VolumeInit } from 'vesicle';
import type { NamedBytes } from '../protocol';
import { Refusal } from '../worker/refusal';

/** Bytes before the letters DICM at the head of a DICOM file. */
const PREAMBLE = 128;

const hasBytes = (bytes: Uint8Array, at: number, expected: number[]) =>
  expected.every((byte, k) => bytes[at + k] === byte);

export function isDicom({ bytes, name }: NamedBytes): boolean {
  return hasBytes(bytes, PREAMBLE, [0x44, 0x49, 0x43, 0x4d]) || /\.(dcm|dicom)$/i.test(name);
}

/** Of either byte order; the larger kind with addresses of 64 bits, too. */
export function isTiff({ bytes }: NamedBytes): boolean {
  return [42, 43].some(
    (kind) => hasBytes(bytes, 0, [0x49, 0x49, kind, 0]) || hasBytes(bytes, 0, [0x4d, 0x4d, 0, kind]),
  );
}

/** The volume in a series of DICOM files, or in TIFF files one a slice or one with all; undefined where they are neither. */
export async function readForeign(files: NamedBytes[]): Promise<VolumeInit | undefined> {
  // Folders of DICOM hold other files as well, without that name at their end.
  const series = files.filter(isDicom);
  if (series.length > 0) return solid('DICOM', await (await import('./dicom')).readSeries(series));
  if (files.length > 0 && files.every(isTiff)) return solid('TIFF', await (await import('./tiff')).readStack(files));
  return undefined;
}

/** Of a single slice there is no surface. */
function solid(format: string, init: VolumeInit): VolumeInit {
  if (init.dims[2] > 1) return init;
  throw new Refusal('bad-file', `${format}: a single slice; choose or drop all files of the series together`);
}
