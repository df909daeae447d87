/// <reference path="./untyped.d.ts" />
// Compressed glTF documents, made with the encoders of the libraries that decode them.
import draco3d from 'draco3dgltf';
import { MeshoptEncoder } from 'meshoptimizer/encoder';
import init, { Mesh } from '../../pkg/index.js';

await init();

type Json = Record<string, unknown>;

/** The JSON of a GLB. */
export function jsonOf(glb: Uint8Array) {
  const length = new DataView(glb.buffer, glb.byteOffset).getUint32(12, true);
  return JSON.parse(new TextDecoder().decode(glb.subarray(20, 20 + length)));
}

/** Returns a GLB of a document and its binary chunk. */
export function glb(json: object, binary: Uint8Array): Uint8Array {
  const text = Buffer.from(JSON.stringify(json));
  const [head, padded, data] = [Buffer.alloc(20), Buffer.alloc(aligned(text.length), ' '), Buffer.alloc(8)];
  text.copy(padded);
  const length = 28 + padded.length + aligned(binary.length);
  for (const [k, word] of [0x46546c67, 2, length, padded.length, 0x4e4f534a].entries()) head.writeUInt32LE(word, 4 * k);
  data.writeUInt32LE(aligned(binary.length), 0);
  data.writeUInt32LE(0x004e4942, 4);
  return new Uint8Array(
    Buffer.concat([head, padded, data, binary, Buffer.alloc(aligned(binary.length) - binary.length)]),
  );
}

const aligned = (length: number) => Math.ceil(length / 4) * 4;

/** A mesh to compress; texture coordinates are (x, y). */
export interface Given {
  positions: Float32Array;
  indices: Uint32Array;
}

/** Returns a ball of radius 1. */
export function ball(edge = 0.3): Given {
  const mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: edge });
  const { positions, indices } = mesh.arrays();
  mesh.free();
  return { positions: Float32Array.from(positions), indices: Uint32Array.from(indices) };
}

export const uvsOf = ({ positions }: Given) => positions.filter((_, k) => k % 3 < 2);

const { createEncoderModule } = draco3d;
const encoders = await createEncoderModule({});

/** A Draco stream with its attributes: positions (0) and texture coordinates (1). */
interface Stream {
  bytes: Uint8Array;
  points: number;
  corners: number;
}

/** Returns a Draco stream of a mesh, quantised to `bits` unless these are 0. */
export function dracoStream(given: Given, { bits = 0, sequential = false, metadata = false } = {}): Stream {
  const [builder, mesh, encoder] = [new encoders.MeshBuilder(), new encoders.Mesh(), new encoders.Encoder()];
  const [points, faces] = [given.positions.length / 3, given.indices.length / 3];
  builder.AddFacesToMesh(mesh, faces, given.indices);
  builder.AddFloatAttributeToMesh(mesh, encoders.POSITION, points, 3, given.positions);
  builder.AddFloatAttributeToMesh(mesh, encoders.TEX_COORD, points, 2, uvsOf(given));
  encoder.SetEncodingMethod(sequential ? encoders.MESH_SEQUENTIAL_ENCODING : encoders.MESH_EDGEBREAKER_ENCODING);
  encoder.SetTrackEncodedProperties(true);
  if (bits > 0)
    for (const kind of [encoders.POSITION, encoders.TEX_COORD]) encoder.SetAttributeQuantization(kind, bits);
  if (metadata) {
    const [notes, note] = [new encoders.MetadataBuilder(), new encoders.Metadata()];
    notes.AddStringEntry(note, 'name', 'ball');
    builder.AddMetadata(mesh, note);
  }
  const array = new encoders.DracoInt8Array();
  const length = encoder.EncodeMeshToDracoBuffer(mesh, array);
  if (length <= 0) throw new Error('not encoded');
  const bytes = Uint8Array.from({ length }, (_, k) => array.GetValue(k));
  const corners = 3 * encoder.GetNumberOfEncodedFaces();
  return { bytes, points: encoder.GetNumberOfEncodedPoints(), corners };
}

/** Returns a GLB with a primitive for each stream, as encoders write it. */
export function dracoGlb(streams: readonly Stream[], more: Json = {}): Uint8Array {
  const accessor = (type: string, count: number, componentType = 5126) => ({ type, count, componentType });
  const starts = streams.map((_, k) => streams.slice(0, k).reduce((sum, { bytes }) => sum + aligned(bytes.length), 0));
  const binary = new Uint8Array(streams.reduce((sum, { bytes }) => sum + aligned(bytes.length), 0));
  for (const [k, { bytes }] of streams.entries()) binary.set(bytes, starts[k]);
  const primitives = streams.map((_, k) => ({
    attributes: { POSITION: 3 * k, TEXCOORD_0: 3 * k + 1 },
    indices: 3 * k + 2,
    ...('materials' in more && { material: 0 }),
    extensions: { KHR_draco_mesh_compression: { bufferView: k, attributes: { POSITION: 0, TEXCOORD_0: 1 } } },
  }));
  const json = {
    asset: { version: '2.0' },
    extensionsUsed: ['KHR_draco_mesh_compression'],
    extensionsRequired: ['KHR_draco_mesh_compression'],
    ...{ scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], meshes: [{ primitives }] },
    accessors: streams.flatMap(({ points, corners }) => [
      accessor('VEC3', points),
      accessor('VEC2', points),
      accessor('SCALAR', corners, 5123),
    ]),
    bufferViews: streams.map(({ bytes }, k) => ({ buffer: 0, byteOffset: starts[k], byteLength: bytes.length })),
    buffers: [{ byteLength: binary.length }],
    ...more,
  };
  return glb(json, binary);
}

/** Returns a GLB whose buffer views are compressed by meshopt, into a second buffer which is not there. */
export async function meshoptGlb(given: Given, name = 'EXT_meshopt_compression'): Promise<Uint8Array> {
  await MeshoptEncoder.ready;
  const [vertices, corners] = [given.positions.length / 3, given.indices.length];
  const raw = (array: Float32Array) => new Uint8Array(array.slice().buffer);
  const parts = [
    { source: raw(given.positions), count: vertices, byteStride: 12, mode: 'ATTRIBUTES' },
    { source: raw(uvsOf(given)), count: vertices, byteStride: 8, mode: 'ATTRIBUTES' },
    { source: new Uint8Array(given.indices.slice().buffer), count: corners, byteStride: 4, mode: 'TRIANGLES' },
  ];
  const version = name.startsWith('KHR') ? 1 : 0;
  const pieces = parts.map((one) =>
    MeshoptEncoder.encodeGltfBuffer(one.source, one.count, one.byteStride, one.mode, version),
  );
  const starts = pieces.map((_, k) => pieces.slice(0, k).reduce((sum, piece) => sum + aligned(piece.length), 0));
  const binary = new Uint8Array(pieces.reduce((sum, piece) => sum + aligned(piece.length), 0));
  for (const [k, piece] of pieces.entries()) binary.set(piece, starts[k]);
  let total = 0;
  const bufferViews = parts.map(({ source, count, byteStride, mode }, k) => {
    const place = { byteOffset: total, byteLength: source.length };
    total += source.length;
    const compressed = { buffer: 0, byteOffset: starts[k], byteLength: pieces[k]?.length, byteStride, count, mode };
    return { buffer: 1, ...place, ...(mode === 'ATTRIBUTES' && { byteStride }), extensions: { [name]: compressed } };
  });
  const json = {
    asset: { version: '2.0' },
    ...{ extensionsUsed: [name], extensionsRequired: [name] },
    ...{ scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }] },
    meshes: [{ primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1 }, indices: 2 }] }],
    accessors: [
      { type: 'VEC3', componentType: 5126, count: vertices, bufferView: 0 },
      { type: 'VEC2', componentType: 5126, count: vertices, bufferView: 1 },
      { type: 'SCALAR', componentType: 5125, count: corners, bufferView: 2 },
    ],
    bufferViews,
    buffers: [{ byteLength: binary.length }, { byteLength: total, extensions: { [name]: { fallback: true } } }],
  };
  return glb(json, binary);
}
