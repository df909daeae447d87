/** Saves label map and surfaces of the Segment lab as files. */

import { zipSync } from 'three/addons/libs/fflate.module.js';
import type { Label } from '../../engine/labels';
import type { ExportRequest } from '../../engine/protocol';
import { concerning, type Warning } from '../../engine/warnings';
import { RECENTRED } from '../../kit/exports';
import type { Saving } from '../../lab/saving';
import type { SegmentClient } from './client';
import type { SurfaceFormat } from './parts';
import type { VolumeFormat } from './protocol';
import type { SegmentView } from './scene';

/** Extension and media type of the files of label maps. */
const MAPS: Record<VolumeFormat, [string, string]> = {
  nifti: ['nii.gz', 'application/gzip'],
  nrrd: ['seg.nrrd', 'application/octet-stream'],
  mha: ['mha', 'application/octet-stream'],
};

export async function saveMap(
  format: VolumeFormat,
  client: SegmentClient,
  saving: Saving,
  labels: readonly Label[],
): Promise<void> {
  const [extension, type] = MAPS[format];
  saving.bytes(extension, await client.request('exportMap', { format, labels }), type, '-labels');
}

/**
 * Saves the surfaces: as one GLB, with a node for each label that has its name and colour, or else as files of the same
 * format, one a label, in a ZIP archive; `recentre` moves them to the origin, as all have the same.
 */
export async function saveSurfaces(
  { format, recentre = false, ...frame }: Omit<ExportRequest, 'format'> & { format: SurfaceFormat },
  client: SegmentClient,
  { saving, warnings: { all } }: { saving: Saving; warnings: { all: readonly Warning[] } },
  labels: readonly Label[],
  surfaces: ReturnType<SegmentView['surfaces']>,
): Promise<void> {
  if (format === 'glb') {
    const { toGlb } = await import('./glb');
    return saving.bytes('glb', await toGlb(labels, surfaces, all, frame), 'model/gltf-binary', '-labels');
  }
  const files: Record<string, Uint8Array> = {};
  for (const { value, name } of labels) {
    if (!surfaces.has(value)) continue;
    const body = { value, format, warnings: concerning(all, { label: value }) };
    const stem = `${value}-${name.replace(/[^\p{L}\p{N}]+/gu, '-')}`;
    files[`${stem}.${format}`] = await client.request('exportMesh', { ...body, ...frame, recentre });
  }
  saving.bytes('zip', zipSync(files, { level: 1 }), 'application/zip', `-${format}${recentre ? RECENTRED : ''}`);
}
