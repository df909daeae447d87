// KHR_draco_mesh_compression: all vertices and triangles of a primitive are one stream.
import { type DecoderSource, startedModule } from '../decoder-source.js';
import type { Budget } from './budget.js';
import { dracoTriangles } from './draco-header.js';
import { badGltf, reasonOf } from './error.js';
import { entry, type Json, list, object, whole } from './json.js';

/** Name of the extension. */
export const DRACO = 'KHR_draco_mesh_compression';

interface Status {
  ok(): boolean;
  error_msg(): string;
}

interface Attribute {
  num_components(): number;
}

interface DracoMesh {
  num_faces(): number;
  num_points(): number;
}

interface Decoder {
  DecodeArrayToMesh(bytes: Uint8Array, length: number, mesh: DracoMesh): Status;
  GetAttributeByUniqueId(mesh: DracoMesh, id: number): Attribute & { ptr: number };
  GetAttributeDataArrayForAllPoints(mesh: DracoMesh, from: Attribute, type: number, bytes: number, to: number): boolean;
  GetTrianglesUInt32Array(mesh: DracoMesh, bytes: number, to: number): boolean;
}

/** The module of the library. */
export interface Draco {
  Decoder: new () => Decoder;
  Mesh: new () => DracoMesh;
  destroy(one: object): void;
  HEAPU8: Uint8Array;
  _malloc(bytes: number): number;
  _free(address: number): void;
}

/** Returns a new instance of an imported module: one that a damaged stream broke is used no more, and its memory is given back. */
export const dracoInstance = (module: unknown, wasm: DecoderSource['wasm']) => startedModule<Draco>(module, wasm);

/** Type of numbers in the library, and their bytes, by the component type of an accessor. */
const COMPONENTS = new Map([
  [5120, { type: 1, size: 1 }],
  [5121, { type: 2, size: 1 }],
  [5122, { type: 3, size: 2 }],
  [5123, { type: 4, size: 2 }],
  [5125, { type: 6, size: 4 }],
  [5126, { type: 9, size: 4 }],
]);

const WIDTHS = new Map([
  ['SCALAR', 1],
  ['VEC2', 2],
  ['VEC3', 3],
  ['VEC4', 4],
]);

/** Returns the extension of a primitive whose elements are only there compressed; undefined for all others. */
export function dracoOf(root: Json, primitive: Json): Json | undefined {
  const extension = object(primitive.extensions)[DRACO];
  if (extension === undefined) return undefined;
  const attributes = object(primitive.attributes);
  const names = Object.keys(object(object(extension).attributes));
  const used = [primitive.indices, ...names.map((name) => attributes[name])].filter((one) => one !== undefined);
  const lacks = (one: unknown) => entry(root, 'accessors', whole(one, 'accessor')).bufferView === undefined;
  return used.length <= names.length || used.some(lacks) ? object(extension) : undefined;
}

/** The document into which streams are decoded. */
export interface Target {
  root: Json;
  budget: Budget;
  /** Adds a buffer view with these bytes, and returns its index. */
  add: (bytes: Uint8Array) => number;
}

/** Decodes the stream of a primitive into buffer views of its accessors. */
export function decodePrimitive(
  draco: Draco,
  target: Target,
  primitive: Json,
  extension: Json,
  stream: Uint8Array,
  field: string,
): void {
  const mode = whole(primitive.mode, `${field}.mode`, 4);
  if (mode !== 4 && mode !== 5) throw badGltf(`${field}.mode`, `must be 4 or 5 with ${DRACO}, got ${mode}`);
  // Before they are decoded.
  target.budget(12 * dracoTriangles(stream, field), `${field}.indices`);
  const decoder = new draco.Decoder();
  const mesh = new draco.Mesh();
  try {
    const status = decoder.DecodeArrayToMesh(stream, stream.length, mesh);
    if (!status.ok()) throw new Error(status.error_msg());
    const decoded = new Decoded(draco, decoder, mesh, target, field);
    decoded.fillAttributes(primitive, object(extension.attributes));
    decoded.fillIndices(primitive);
  } catch (error) {
    if (error instanceof Error && 'code' in error) throw error;
    throw badGltf(field, `the Draco stream is damaged (${reasonOf(error)})`);
  } finally {
    // Not after a fault of the module, which may have damaged its memory: the instance is dropped then.
    try {
      draco.destroy(mesh);
      draco.destroy(decoder);
    } catch {}
  }
  delete primitive.mode;
}

/** A decoded mesh, which is copied into buffer views. */
class Decoded {
  constructor(
    private readonly draco: Draco,
    private readonly decoder: Decoder,
    private readonly mesh: DracoMesh,
    private readonly target: Target,
    private readonly field: string,
  ) {}

  fillAttributes(primitive: Json, ids: Json): void {
    const attributes = object(primitive.attributes);
    const count = this.mesh.num_points();
    for (const [name, id] of Object.entries(ids)) {
      const field = `${this.field}.${name}`;
      const accessor = { ...entry(this.target.root, 'accessors', whole(attributes[name], field)) };
      const [type, size] = this.#layout(accessor, field);
      const attribute = this.decoder.GetAttributeByUniqueId(this.mesh, whole(id, field));
      if (!attribute.ptr) throw badGltf(field, `the Draco stream has no attribute ${id}`);
      const width = attribute.num_components();
      if (width !== WIDTHS.get(String(accessor.type)))
        throw badGltf(field, `the Draco stream has ${width} components for ${accessor.type}`);
      this.#checkCount(accessor, count, field);
      // Elements start at multiples of four bytes.
      const [tight, stride] = [width * size, Math.ceil((width * size) / 4) * 4];
      this.target.budget(count * tight, field);
      const bytes = this.#copied(count * tight, field, (length, to) =>
        this.decoder.GetAttributeDataArrayForAllPoints(this.mesh, attribute, type, length, to),
      );
      const view = this.target.add(tight === stride ? bytes : spaced(bytes, tight, stride, count));
      if (tight !== stride) entry(this.target.root, 'bufferViews', view).byteStride = stride;
      attributes[name] = this.#added(accessor, view);
    }
  }

  fillIndices(primitive: Json): void {
    const count = 3 * this.mesh.num_faces();
    const field = `${this.field}.indices`;
    const given = primitive.indices;
    const known = given === undefined ? {} : entry(this.target.root, 'accessors', whole(given, field));
    // A strip has another number of indices than the triangles that are decoded.
    if (given !== undefined && primitive.mode !== 5) this.#checkCount(known, count, field);
    const bytes = this.#copied(4 * count, field, (length, to) =>
      this.decoder.GetTrianglesUInt32Array(this.mesh, length, to),
    );
    const accessor = { ...known, componentType: 5125, type: 'SCALAR', count };
    primitive.indices = this.#added(accessor, this.target.add(bytes));
  }

  #layout(accessor: Json, field: string): [type: number, size: number] {
    const { type, size } = COMPONENTS.get(Number(accessor.componentType)) ?? {};
    if (type !== undefined && size !== undefined) return [type, size];
    throw badGltf(`${field}.componentType`, `${accessor.componentType} is not supported`);
  }

  #checkCount(accessor: Json, count: number, field: string): void {
    if (accessor.count !== count)
      throw badGltf(field, `the Draco stream has ${count} elements, the accessor ${accessor.count}`);
  }

  /** Adds an accessor: other primitives may use the one that it replaces with another stream. */
  #added(accessor: Json, bufferView: number): number {
    return list(this.target.root, 'accessors').push({ ...structuredClone(accessor), bufferView, byteOffset: 0 }) - 1;
  }

  #copied(length: number, field: string, write: (length: number, to: number) => boolean): Uint8Array {
    const to = this.draco._malloc(length);
    try {
      if (!to || !write(length, to)) throw badGltf(field, 'the Draco stream cannot be read as the accessor says');
      return this.draco.HEAPU8.slice(to, to + length);
    } finally {
      this.draco._free(to);
    }
  }
}

function spaced(bytes: Uint8Array, tight: number, stride: number, count: number): Uint8Array {
  const all = new Uint8Array(count * stride);
  for (let k = 0; k < count; k++) all.set(bytes.subarray(k * tight, (k + 1) * tight), k * stride);
  return all;
}
