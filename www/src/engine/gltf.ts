/// <reference path="../importers/decoders.d.ts" />
/** Reads meshes that may be compressed: the libraries that decode them are fetched with the first file that needs them. */
import dracoModule from 'draco3dgltf/draco_decoder_gltf.wasm?url';
import { decompressGltf, type MeshDecoders } from 'vesicle/gltf';
import type { NamedBytes } from './protocol';

const decoders: MeshDecoders = {
  draco: { load: () => import('draco3dgltf/draco_decoder_gltf_nodejs.js'), wasm: dracoModule },
  meshopt: { load: () => import('meshoptimizer/decoder') },
};

/** Returns the bytes of a mesh file without compression; `files` are those beside it. */
export function withoutCompression(bytes: Uint8Array, files: readonly NamedBytes[] = []): Promise<Uint8Array> {
  return decompressGltf(bytes, { files: files.map(({ name, bytes }) => ({ name, bytes })), decoders });
}
