/** Code of the Sculpt lab's runs. */
import { VesicleError } from 'vesicle/channel';
import { isCompressedGltf } from 'vesicle/gltf';
import { bytesOf, callsOf, chosen, type Program } from '../../engine/code';
import { literal } from '../../engine/literal';
import { text } from '../../texts';
import type { MeshSource, PoseLog, SceneSource } from './protocol';
import { BALL, type ComputedMesh, globeAsObj } from './shapes';

/**
 * Where the meshes of a model are from; a file may have the picture of its texture in another one, of the type `texture`, and
 * be `compressed`.
 */
export type Origins = {
  [Mesh in keyof SceneSource]:
    | { file: string; texture: string | undefined; compressed: boolean }
    | { shape: ComputedMesh };
};

/** Returns where meshes are from, without their bytes. */
export function originsOf(source: SceneSource): Origins {
  const origin = (one: MeshSource) =>
    'file' in one
      ? { file: one.file.name, texture: one.texture?.type, compressed: isCompressedGltf(one.file.bytes) }
      : { shape: one.shape };
  return Object.fromEntries(Object.entries(source).map(([mesh, one]) => [mesh, origin(one)]));
}

/** Returns how code makes the model of a set-up. */
export function programOf(
  { start, params, support = 'membrane' }: PoseLog['setup'],
  origins: Origins,
  stem: string,
): Program {
  const meshes = Object.entries(origins);
  /** Files and the parameters for their bytes. */
  const inputs: [file: string, parameter: string][] = [];
  let given = '';
  for (const [mesh, origin] of meshes) {
    const texture = 'file' in origin ? origin.texture : undefined;
    if (!isBall(origin)) inputs.push(['file' in origin ? origin.file : `${stem}.obj`, mesh]);
    if (texture) inputs.push([text('sculpt.textureFile', { type: texture.slice('image/'.length) }), 'picture']);
    const options = texture ? `, { texture: { type: ${literal(texture)}, bytes: picture } }` : '';
    const made = isBall(origin) ? `icosphere(${literal(BALL)})` : `parse(${bytesFor(mesh, origin)}${options})`;
    given += `${mesh}: Mesh.${made}, `;
  }
  const [files, parameters] = [inputs.map(([file]) => file), inputs.map(([, parameter]) => parameter)];
  const needs = meshes.some(([, origin]) => isGlobe(origin)) ? 'saved' : 'files';
  // The default of a detail without a base is the surface.
  const usual = 'detail' in origins && !('base' in origins) ? 'surface' : 'membrane';
  const stated = support === usual ? {} : { support };
  const options = literal({ ellipsoids: start, ...stated, params: chosen('multires', params) }).slice(2);
  return {
    ...(inputs.length > 0 && bytesOf(files, parameters, needs)),
    ...(meshes.some(([, origin]) => isCompressed(origin)) && { imports: DECOMPRESSION }),
    names: ['MultiresolutionModel', ...(meshes.length > 0 ? ['Mesh'] : [])],
    begin: [`const model = new MultiresolutionModel({ ${given}${options});`],
    calls: callsOf('step', 'setParams', 'setEllipsoids'),
    // Its map is drawn by the app.
    note: needs === 'saved' ? text('sessions.noPictures') : undefined,
  };
}

/** Lines of the code of a run with compressed meshes. */
const DECOMPRESSION = [
  '// Imports draco3dgltf or meshoptimizer, which have to be installed.',
  `import { decompressGltf } from 'vesicle/gltf';`,
];

const isCompressed = (origin: Origins[keyof SceneSource]) => origin && 'file' in origin && origin.compressed;

const bytesFor = (mesh: string, origin: Origins[keyof SceneSource]) =>
  isCompressed(origin) ? `await decompressGltf(${mesh})` : mesh;

const isBall = (origin: object) => 'shape' in origin && origin.shape === 'ball';
const isGlobe = (origin: object) => 'shape' in origin && !isBall(origin);

/** Returns the mesh that code reads if it is a computed one, as a file. */
export function meshFile(origins: Origins): Uint8Array {
  if (Object.values(origins).some(isGlobe)) return globeAsObj();
  throw new VesicleError('invalid-argument', text('sessions.noDataNeeded'));
}
