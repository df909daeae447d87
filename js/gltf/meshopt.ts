// EXT_meshopt_compression and KHR_meshopt_compression: each buffer view is compressed by itself.
import type { Budget } from './budget.js';
import { type Buffers, rangeOf } from './container.js';
import { badGltf, reasonOf } from './error.js';
import { entry, type Json, object, whole } from './json.js';

/** Names of the extension. */
export const MESHOPT = ['EXT_meshopt_compression', 'KHR_meshopt_compression'] as const;

/** The decoder of the library. */
export interface MeshoptDecoder {
  ready: Promise<void>;
  decodeGltfBuffer(
    target: Uint8Array,
    count: number,
    size: number,
    source: Uint8Array,
    mode: string,
    filter: string,
  ): void;
}

/** Returns the decoder of an imported module once it can be used. */
export async function meshoptDecoder(module: unknown): Promise<MeshoptDecoder> {
  const { MeshoptDecoder } = module as { MeshoptDecoder: MeshoptDecoder };
  await MeshoptDecoder.ready;
  return MeshoptDecoder;
}

/** Returns the extension of a buffer view whose bytes are only there compressed; undefined for all others. */
export function meshoptOf(root: Json, buffers: Buffers, view: Json): Json | undefined {
  const extensions = object(view.extensions);
  const name = MESHOPT.find((name) => extensions[name] !== undefined);
  if (!name) return undefined;
  const index = whole(view.buffer, 'bufferViews.buffer');
  const fallback = object(object(entry(root, 'buffers', index).extensions)[name]).fallback;
  return fallback === true || !buffers(index) ? object(extensions[name]) : undefined;
}

/** Sizes of an element by the way it is compressed; the library does not check them. */
const SIZES: Record<string, (size: number) => boolean> = {
  ATTRIBUTES: (size) => size > 0 && size <= 256 && size % 4 === 0,
  TRIANGLES: (size) => size === 2 || size === 4,
  INDICES: (size) => size === 2 || size === 4,
};

/** Sizes of an element by the filter that is undone. */
const FILTERED: Record<string, (size: number) => boolean> = {
  NONE: () => true,
  OCTAHEDRAL: (size) => size === 4 || size === 8,
  QUATERNION: (size) => size === 8,
  EXPONENTIAL: (size) => size % 4 === 0,
  COLOR: (size) => size === 4 || size === 8,
};

/** Returns the bytes of a compressed buffer view. */
export function decodedView(
  decoder: MeshoptDecoder,
  { root, buffers, budget }: { root: Json; buffers: Buffers; budget: Budget },
  [view, extension]: [Json, Json],
  field: string,
): Uint8Array {
  const [count, size] = [whole(extension.count, `${field}.count`), whole(extension.byteStride, `${field}.byteStride`)];
  const [mode, filter] = [String(extension.mode), String(extension.filter ?? 'NONE')];
  checkLayout(mode, filter, size, field);
  if (mode === 'TRIANGLES' && count % 3 !== 0) throw badGltf(field, `${count} indices are no triangles`);
  const length = whole(view.byteLength, `${field}.byteLength`);
  if (length !== count * size) throw badGltf(field, `has ${length} bytes, but ${count} elements of ${size} bytes`);
  const source = rangeOf(root, buffers, extension, field);
  budget(length, field);
  const target = new Uint8Array(length);
  try {
    decoder.decodeGltfBuffer(target, count, size, source, mode, filter);
  } catch (error) {
    throw badGltf(field, `the data of ${MESHOPT[0]} are damaged (${reasonOf(error)})`);
  }
  return target;
}

function checkLayout(mode: string, filter: string, size: number, field: string): void {
  if (!Object.hasOwn(SIZES, mode))
    throw badGltf(`${field}.mode`, `must be ${Object.keys(SIZES).join(', ')}, got ${mode}`);
  if (!Object.hasOwn(FILTERED, filter) || (filter !== 'NONE' && mode !== 'ATTRIBUTES'))
    throw badGltf(`${field}.filter`, `${filter} is not supported for ${mode}`);
  if (!SIZES[mode]?.(size) || !FILTERED[filter]?.(size))
    throw badGltf(`${field}.byteStride`, `${size} is not possible for ${mode} with filter ${filter}`);
}
