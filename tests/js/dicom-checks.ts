// Opens and reads any DICOM files, and tests what holds for the result whatever they are.
import { type DicomListing, openDicom } from '../../pkg/dicom/index.js';
import { bounded, expectInit, expectTexts, holds, isName, isSize } from './properties.js';

export const named = (files: readonly Uint8Array[]) => files.map((bytes, k) => ({ name: `IM${k}`, bytes }));

/** Tests what holds for the volumes of any files. */
export function expectListing({ volumes, skipped }: DicomListing): void {
  for (const { reason } of skipped) holds(reason.length > 0 && reason.length <= 2000, reason);
  for (const volume of volumes) {
    const { name, patient, modality, dims, spacing, frames, images, warnings, remarks, segments } = volume;
    holds([name, patient, modality].every(isName), name);
    holds([...dims, frames, images].every(isSize), String(dims));
    holds(
      spacing.every((size) => size > 0 && Number.isFinite(size)),
      String(spacing),
    );
    expectTexts([...warnings.map(({ text }) => text), ...remarks]);
    for (const segment of segments) holds(isName(segment.name ?? ''), segment.name ?? '');
  }
  holds(new Set(volumes.map(({ name }) => name)).size === volumes.length, 'two volumes of the same name');
}

/** Opens files, reads the first volumes, and tests what holds for any. */
export async function readAny(files: readonly Uint8Array[]): Promise<void> {
  const listing = await bounded(() => openDicom(named(files)));
  if (listing instanceof Error) throw listing;
  expectListing(listing);
  for (const volume of listing.volumes.slice(0, 3)) {
    const init = await bounded(() => volume.read({ uneven: 'resample' }));
    if (init instanceof Error) continue;
    expectInit(init);
    holds(String(init.dims?.slice(0, 3)) === String(volume.dims), `${init.dims} of ${volume.dims}`);
  }
}
