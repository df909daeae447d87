import { zipSync } from 'three/addons/libs/fflate.module.js';
import { merged, type Warning } from '../../engine/warnings';
import type { SurfaceSpace } from '../../lab/surface-space';
import type { TrackClient } from './client';
import { framesCsv } from './measures';
import type { TrackParts } from './parts';
import type { TrackResults } from './results';

/**
 * Saves all tracked frames: their surfaces as PLY files in one ZIP archive, as one animation, or their measures as a
 * table.
 */
export async function saveTrack(
  what: 'frames' | 'animation' | 'table',
  client: TrackClient,
  { page, run: { surfaceSpace } }: Pick<TrackParts, 'page' | 'run'>,
  { frames, truth }: TrackResults,
): Promise<void> {
  const { saving, unit, warnings } = page;
  // Frames have their own.
  const general = warnings.all.filter(({ where }) => !(where && 'frame' in where));
  if (what === 'table') {
    const ofFrames = (await client.request('frameWarnings', undefined)).map((list) => merged(general, list));
    saving.bytes('csv', new TextEncoder().encode(framesCsv(frames, truth, ofFrames, unit)), 'text/csv');
  } else if (what === 'animation')
    saving.bytes('glb', await client.request('animation', surfaceSpace), 'model/gltf-binary');
  else saving.bytes('zip', await archive(frames.length, client, surfaceSpace, general), 'application/zip');
}

async function archive(
  frames: number,
  client: TrackClient,
  space: SurfaceSpace,
  warnings: readonly Warning[],
): Promise<Uint8Array> {
  const files: Record<string, Uint8Array> = {};
  const digits = String(frames).length;
  for (let frame = 0; frame < frames; frame++) {
    const name = `frame-${String(frame + 1).padStart(digits, '0')}.ply`;
    files[name] = await client.request('export', { ...space, frame, format: 'ply', warnings });
  }
  // Fast compression: coordinates hardly compress anyway.
  return zipSync(files, { level: 1 });
}
