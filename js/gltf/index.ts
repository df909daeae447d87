/**
 * Compressed glTF: meshes that Draco or meshopt compressed are decoded by the libraries that made them, imported when the
 * first file needs them, so that `Mesh.parse` can read the document.
 *
 * @module vesicle/gltf
 */
import { checkProperties, typedArray } from '../check.js';
import type { NamedFile } from '../data.js';
import type { DecoderSource } from '../decoder-source.js';
import { VesicleError } from '../error.js';
import { checkedNamedFiles } from '../input-file.js';
import { budgetOf, checkRepeated } from './budget.js';
import { type Buffers, buffersOf, packed, parsed, partsOf, rangeOf } from './container.js';
import { type MeshDecoders, started } from './decoders.js';
import { DRACO, decodePrimitive, dracoInstance, dracoOf, type Target } from './draco.js';
import { badGltf } from './error.js';
import { entry, type Json, list, object, objects, whole } from './json.js';
import { decodedView, MESHOPT, meshoptDecoder, meshoptOf } from './meshopt.js';

export type { NamedFile } from '../data.js';
export { type ErrorCode, VesicleError } from '../error.js';
export type { DecoderSource, MeshDecoders };

/** Options of {@link decompressGltf}. */
export interface DecompressOptions {
  /** Buffers beside the document, found by their names. */
  files?: readonly NamedFile[];
  /** The libraries; in Node those that are installed are found. */
  decoders?: MeshDecoders;
}

const EXTENSIONS: readonly string[] = [DRACO, ...MESHOPT];

/** Whether a file is a glTF document, as GLB or as text, that names one of the compressions. */
export function isCompressedGltf(bytes: Uint8Array): boolean {
  const parts = partsOf(typedArray('bytes', bytes, Uint8Array));
  if (!parts) return false;
  const text = new TextDecoder().decode(parts.text);
  return EXTENSIONS.some((name) => text.includes(name));
}

/**
 * Returns a glTF document without `KHR_draco_mesh_compression`, `EXT_meshopt_compression` and `KHR_meshopt_compression`,
 * as GLB: `Mesh.parse(await decompressGltf(bytes))`. All else is kept: materials, nodes, skins, morph targets; images in
 * files beside the document stay there. Any other file is returned as it is.
 *
 * @throws {@link VesicleError} `bad-file` naming what is damaged, or the file that is missing; `too-large` for what would
 *   decode to far more than its file; `invalid-argument` naming the package of a decoder that is not there.
 */
export async function decompressGltf(bytes: Uint8Array, options: DecompressOptions = {}): Promise<Uint8Array> {
  const { files = [], decoders = {} } = checkProperties('options', options, ['files', 'decoders']);
  const beside = checkedNamedFiles('files', files);
  if (!isCompressedGltf(bytes)) return bytes;
  try {
    return await decompressed(bytes, beside, checkProperties('decoders', decoders, ['draco', 'meshopt']));
  } catch (error) {
    if (error instanceof RangeError)
      throw badGltf('JSON', `is nested too deeply, or needs too much memory (${error.message})`);
    throw error;
  }
}

async function decompressed(bytes: Uint8Array, files: NamedFile[], decoders: MeshDecoders): Promise<Uint8Array> {
  const parts = partsOf(bytes);
  if (!parts) throw new VesicleError('bad-file', 'glTF: is damaged');
  const root = parsed(parts);
  const buffers = buffersOf(root, parts, files);
  const fileBytes = files.reduce((sum, { bytes }) => sum + bytes.length, bytes.length);
  const budget = budgetOf(fileBytes);
  const contents = await viewsOf({ root, buffers, budget }, decoders);
  const add = (view: Uint8Array) => {
    contents.push(view);
    return list(root, 'bufferViews').push({}) - 1;
  };
  await decodePrimitives({ root, budget, add }, contents, decoders);
  forget(root);
  checkRepeated(root, fileBytes);
  return packed(root, withoutUnused(root, contents));
}

/** Returns the bytes of all buffer views, those of meshopt decoded. */
async function viewsOf(
  document: { root: Json; buffers: Buffers; budget: Target['budget'] },
  decoders: MeshDecoders,
): Promise<Uint8Array[]> {
  const { root, buffers, budget } = document;
  const views = objects(root.bufferViews);
  const compressed = views.map((view) => meshoptOf(root, buffers, view));
  const decoder = compressed.some(Boolean) ? await started('meshopt', decoders, meshoptDecoder) : undefined;
  return views.map((view, k) => {
    const [field, extension] = [`bufferViews[${k}]`, compressed[k]];
    const bytes =
      decoder && extension
        ? decodedView(decoder, document, [view, extension], field)
        : rangeOf(root, buffers, view, field);
    // Views may overlap, and each is written by itself.
    if (!extension) budget(bytes.length, field);
    removeExtensions(view);
    return bytes;
  });
}

async function decodePrimitives(
  target: Target,
  contents: readonly Uint8Array[],
  decoders: MeshDecoders,
): Promise<void> {
  const { root } = target;
  const primitives = objects(root.meshes).flatMap((mesh, m) =>
    objects(mesh.primitives).map((primitive, p) => ({ primitive, field: `meshes[${m}].primitives[${p}]` })),
  );
  const compressed = primitives.map(({ primitive }) => dracoOf(root, primitive));
  const draco = compressed.some(Boolean) ? await started('draco', decoders, dracoInstance) : undefined;
  primitives.forEach(({ primitive, field }, k) => {
    const extension = compressed[k];
    if (draco && extension) {
      const view = whole(extension.bufferView, `${field}.bufferView`);
      entry(root, 'bufferViews', view);
      decodePrimitive(draco, target, primitive, extension, contents[view] ?? new Uint8Array(), field);
    }
    removeExtensions(primitive);
  });
}

function removeExtensions(owner: Json): void {
  const extensions = object(owner.extensions);
  for (const name of EXTENSIONS) delete extensions[name];
  if (Object.keys(extensions).length === 0) delete owner.extensions;
}

/** Removes the compressions from the extensions that the document says it uses or requires. */
function forget(root: Json): void {
  for (const name of ['extensionsUsed', 'extensionsRequired']) {
    const left = list(root, name).filter((one) => !EXTENSIONS.includes(String(one)));
    if (left.length > 0) root[name] = left;
    else delete root[name];
  }
}

/** Removes the buffer views to which nothing refers, as those of the streams, and returns the contents of the others. */
function withoutUnused(root: Json, contents: readonly Uint8Array[]): Uint8Array[] {
  const users: Json[] = [];
  collectUsers(root, users);
  const used = [...new Set(users.map((user) => whole(user.bufferView, 'bufferView')))].sort((a, b) => a - b);
  const kept = used.map((index) => entry(root, 'bufferViews', index));
  const places = new Map(used.map((index, k) => [index, k]));
  for (const user of users) user.bufferView = places.get(Number(user.bufferView));
  if (kept.length > 0) root.bufferViews = kept;
  else delete root.bufferViews;
  return used.map((index) => contents[index] ?? new Uint8Array());
}

/** Collects all objects that refer to a buffer view: accessors, sparse data, images, and those of extensions. */
function collectUsers(value: unknown, users: Json[]): void {
  if (Array.isArray(value)) for (const one of value) collectUsers(one, users);
  else if (typeof value === 'object' && value !== null) {
    const { bufferView, extras: _, ...others } = value as Json;
    if (bufferView !== undefined) users.push(value as Json);
    for (const one of Object.values(others)) collectUsers(one, users);
  }
}
