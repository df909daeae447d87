import { invalid, knownOnly, list, number } from './check.js';
import { type Mesh, meshHandle } from './mesh.js';
import { call } from './runtime.js';
import { RawAnimation } from './vesicle.js';

/**
 * Meshes one after the other as an animated glb (binary glTF). They may have nothing in common; each has its normals,
 * texture coordinates, colours and texture. Viewers that play animations show one at a time, others the first.
 *
 * Frames that are equal to the one before are not stored again, nor are equal textures. Each frame that is stored takes
 * 24 bytes a vertex and 12 a triangle, with texture coordinates 8 and with colours 12 a vertex more; all of it is in
 * memory twice at the end.
 *
 * @param frames - At least one. The mesh of a model is as it is now wherever it is named: `clone()` it as it moves.
 * @param options - `frameSeconds`: how long each frame is seen, 0.001 to 1000; default 0.1.
 * @throws {@link VesicleError} `invalid-argument`: no frames, one that is no mesh or has no triangles, a time out of
 *   range; `too-large`: more than there is memory for, or than a glb can hold, 4 GiB; `freed`.
 */
export function animationGlb(frames: readonly Mesh[], options: { frameSeconds?: number } = {}): Uint8Array {
  const { frameSeconds = 0.1 } = knownOnly('options', options, ['frameSeconds']);
  number('frameSeconds', frameSeconds, { min: 0.001, max: 1000 });
  if (list('frames', frames).length === 0) throw invalid('frames', 'there are none; at least one Mesh is needed');
  const handles = frames.map((frame, at) => meshHandle(`frames[${at}]`, frame));
  const animation = call(() => new RawAnimation());
  try {
    for (const handle of handles) handle.use((mesh) => animation.add(mesh));
  } catch (error) {
    call(() => animation.free());
    throw error;
  }
  return call(() => animation.finish(frameSeconds));
}
