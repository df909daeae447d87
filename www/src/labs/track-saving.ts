/** What the Track lab saves beside the surface of one frame. */
import { zipSync } from 'three/addons/libs/fflate.module.js';
import type { TrackClient } from '../track/client';
import type { Saving } from './saving';
import { framesCsv } from './track-measures';
import type { TrackResults } from './track-results';

/** The surface of each frame that is done, as PLY, in one archive. */
export async function saveFrames(client: TrackClient, saving: Saving, { frames }: TrackResults): Promise<void> {
  const files: Record<string, Uint8Array> = {};
  const digits = String(frames.length).length;
  for (const frame of frames.keys())
    files[`frame-${String(frame + 1).padStart(digits, '0')}.ply`] = await client.request('export', {
      frame,
      format: 'ply',
    });
  // Numbers hardly shrink: quick rather than small.
  saving.bytes('zip', zipSync(files, { level: 1 }), 'application/zip');
}

export async function saveAnimation(client: TrackClient, saving: Saving): Promise<void> {
  saving.bytes('glb', await client.request('animation', undefined), 'model/gltf-binary');
}

export function saveTable(saving: Saving, { frames, truth }: TrackResults): void {
  saving.bytes('csv', new TextEncoder().encode(framesCsv(frames, truth)), 'text/csv');
}
