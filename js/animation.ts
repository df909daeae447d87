import { checkProperties, denseCopy, invalid, number } from './check.js';
import type { Bytes, SpaceOptions } from './data.js';
import { type Mesh, meshHandle } from './mesh.js';
import { checkedSpaceOptions, frameOf, SPACE_OPTIONS } from './mesh-file.js';
import { call } from './runtime.js';
import { RawAnimation } from './vesicle.js';
import { mergedWarnings, notesOf } from './warnings.js';

/**
 * Encodes a sequence of meshes as an animated glb (binary glTF), one mesh a frame. The meshes need not have the same
 * connectivity; each keeps its normals, texture coordinates, colours and texture. Viewers that play animations show one
 * frame at a time, others the first that has triangles; nothing is shown in a frame without any.
 *
 * Frames equal to the previous one are stored once, and so are equal textures. Each stored frame takes 24 bytes a
 * vertex and 12 a triangle, plus 8 bytes a vertex with texture coordinates and 12 with colours; all of it is in memory
 * twice at the end. The warnings of all meshes are written as by {@link Mesh.toBytes}, each once.
 *
 * @param frames - At least one. The live mesh of a model has only the present state of the model: add a `clone()` of it
 *   for each frame.
 * @param options - `frameSeconds`: duration of each frame in seconds, 0.001 to 1000; default 0.1. `space`, `as` and
 *   `unit`: what to state, as in {@link Mesh.toBytes}, default those of the first frame.
 * @throws {@link VesicleError} `invalid-argument`: no frame with triangles, an entry that is no mesh, a duration out of
 *   range; `too-large`: more than there is memory for, or than a glb can hold, 4 GiB; `freed`: a mesh that was
 *   freed.
 */
export function animationGlb(frames: readonly Mesh[], options: SpaceOptions & { frameSeconds?: number } = {}): Bytes {
  const { frameSeconds = 0.1, ...given } = checkProperties('options', options, ['frameSeconds', ...SPACE_OPTIONS]);
  number('frameSeconds', frameSeconds, { min: 0.001, max: 1000 });
  const meshes = denseCopy('frames', frames);
  if (meshes.length === 0) throw invalid('frames', 'must contain at least one Mesh');
  const handles = meshes.map((frame, at) => meshHandle(`frames[${at}]`, frame));
  const frame = checkedSpaceOptions(given, frameOf(meshes[0]), true);
  const notes = notesOf(mergedWarnings(...meshes.map(({ warnings }) => warnings)));
  const animation = call(() => new RawAnimation(notes, ...frame));
  try {
    for (const handle of handles) handle.use((mesh) => animation.add(mesh));
  } catch (error) {
    call(() => animation.free());
    throw error;
  }
  return call(() => animation.finish(frameSeconds) as Bytes);
}
