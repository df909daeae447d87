/** Reads meshes for the Sculpt lab, from an example or from the user's files. */

import { readFiles } from '../../importers/files';
import { dataUrl, fetched } from '../../lab/downloads';
import { text } from '../../texts';
import type { ExampleMesh, SculptExample } from './examples';
import type { MeshSource, MeshTexture, SceneSource } from './protocol';

/** File extensions that the Sculpt lab opens, for the browser's file dialog. */
export const ACCEPT = '.glb,.gltf,.bin,.obj,.ply,.stl,.png,.jpg,.jpeg,.webp';

/** Media types of texture images by file extension. */
const PICTURES: [RegExp, MeshTexture['type']][] = [
  [/\.png$/i, 'image/png'],
  [/\.jpe?g$/i, 'image/jpeg'],
  [/\.webp$/i, 'image/webp'],
];

export async function fromExample({ detail, base }: SculptExample): Promise<SceneSource> {
  const [finest, coarse] = await Promise.all([detail && fetchMesh(detail), base && fetchMesh(base)]);
  return { ...(finest && { detail: finest }), ...(coarse && { base: coarse }) };
}

async function fetchMesh(mesh: ExampleMesh): Promise<MeshSource> {
  if ('shape' in mesh) return mesh;
  const response = await fetched(dataUrl(mesh.file));
  return { file: { name: mesh.file, bytes: new Uint8Array(await response.arrayBuffer()) } };
}

/**
 * Reads a detailed surface and its texture, if there is one. Of two meshes, the larger file is the detailed surface and
 * the smaller one its base. Throws if there is no mesh, or more files than the lab can use.
 */
export async function fromFiles(files: File[]): Promise<SceneSource> {
  const document = files.find(({ name }) => /\.gltf$/i.test(name));
  if (document) return fromDocument(document, files);
  const pictures = files.filter(({ name }) => typeOf(name));
  const meshes = files.filter((file) => !pictures.includes(file));
  if (meshes.length === 0) throw new Error(text('sculpt.textureNeedsMesh'));
  if (meshes.length > 2 || pictures.length > 1) throw new Error(text('sculpt.oneMesh'));
  const [detail, base] = (await readFiles(meshes)).sort((a, b) => b.bytes.length - a.bytes.length);
  const [picture] = await readFiles(pictures);
  const type = picture && typeOf(picture.name);
  const texture = picture && type && { type, bytes: picture.bytes };
  return {
    ...(detail && { detail: { file: detail, ...(texture && { texture }) } }),
    ...(base && { base: { file: base } }),
  };
}

/** Reads a glTF document, with the buffers and images beside it. */
async function fromDocument(document: File, files: File[]): Promise<SceneSource> {
  const beside = files.filter((file) => file !== document);
  const [[file], others] = await Promise.all([readFiles([document]), readFiles(beside)]);
  return file ? { detail: { file, beside: others } } : {};
}

function typeOf(name: string): MeshTexture['type'] | undefined {
  return PICTURES.find(([ending]) => ending.test(name))?.[1];
}
