// Documents and their buffers: in the container, in data URIs, or in files beside it.
import type { NamedFile } from '../data.js';
import { badGltf, tooLarge } from './error.js';
import { entry, type Json, object, objects, whole } from './json.js';

const [MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];
const [HEADER, CHUNK_HEADER] = [12, 8];

/** Largest text of a document that is parsed, in bytes; larger ones would take gigabytes. */
const TEXT_LIMIT = 1 << 28;

/** Lengths in containers have 32 bits. */
const FILE_LIMIT = 2 ** 32 - 1;

/** A document's text and, of a container, the binary chunk. */
interface Parts {
  text: Uint8Array;
  binary?: Uint8Array;
}

const viewOf = (bytes: Uint8Array) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

/** Returns the parts of a document; undefined for other files, and for containers that are damaged. */
export function partsOf(bytes: Uint8Array): Parts | undefined {
  const view = viewOf(bytes);
  if (bytes.length < HEADER || view.getUint32(0, true) !== MAGIC) return isText(bytes) ? { text: bytes } : undefined;
  if (view.getUint32(4, true) !== 2) return undefined;
  const chunks = new Map<number, Uint8Array>();
  for (let at = HEADER; at + CHUNK_HEADER <= bytes.length; ) {
    const [length, kind] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    const end = at + CHUNK_HEADER + length;
    if (end > bytes.length) return undefined;
    if (!chunks.has(kind)) chunks.set(kind, bytes.subarray(at + CHUNK_HEADER, end));
    at = end;
  }
  const text = chunks.get(JSON_CHUNK);
  const binary = chunks.get(BINARY_CHUNK) ?? new Uint8Array();
  return text && { text, binary };
}

/** Whether bytes may be a document as text: whether a brace is first, after spaces or a byte order mark. */
function isText(bytes: Uint8Array): boolean {
  return /^\ufeff?\s*\{/.test(new TextDecoder('utf-8', { ignoreBOM: true }).decode(bytes.subarray(0, 64)));
}

/** Returns the JSON of a document. */
export function parsed({ text }: Parts): Json {
  if (text.length > TEXT_LIMIT) throw tooLarge('JSON', text.length);
  try {
    // Some programs pad it with zeros.
    return object(JSON.parse(new TextDecoder().decode(text).replace(/\0+$/, '')));
  } catch (error) {
    throw badGltf('JSON', (error as Error).message);
  }
}

/** Returns a function that gives the bytes of a buffer; undefined if they are not there. */
export function buffersOf(root: Json, { binary }: Parts, files: readonly NamedFile[]) {
  const known = new Map<number, Uint8Array | undefined>();
  const found = (index: number): Uint8Array | undefined => {
    const { uri } = entry(root, 'buffers', index);
    if (typeof uri !== 'string') return index === 0 ? binary : undefined;
    return /^data:/i.test(uri) ? decodedUri(uri, `buffers[${index}].uri`) : fileOf(uri, files);
  };
  return (index: number) => {
    if (!known.has(index)) known.set(index, found(index));
    return known.get(index);
  };
}

export type Buffers = ReturnType<typeof buffersOf>;

function decodedUri(uri: string, field: string): Uint8Array {
  const comma = uri.indexOf(',');
  try {
    if (!uri.slice(0, comma).endsWith(';base64')) throw new Error();
    return Uint8Array.from(atob(uri.slice(comma + 1)), (letter) => letter.charCodeAt(0));
  } catch {
    throw badGltf(field, 'must be a base64 data URI');
  }
}

/** Returns the file that a relative address refers to: the one of the same path, else of the same name. */
function fileOf(uri: string, files: readonly NamedFile[]): Uint8Array | undefined {
  const plain = (path: string) => path.replaceAll('\\', '/').replace(/^(\.\/)+/, '');
  const last = (path: string) => plain(path).split('/').at(-1);
  const path = unescaped(uri);
  const same = files.find(({ name }) => plain(name) === plain(path));
  return (same ?? files.find(({ name }) => last(name) === last(path)))?.bytes;
}

function unescaped(uri: string): string {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

/** Returns the bytes from `byteOffset` on, `byteLength` many, of the buffer that an object names. */
export function rangeOf(root: Json, buffers: Buffers, place: Json, field: string): Uint8Array {
  const index = whole(place.buffer, `${field}.buffer`);
  const start = whole(place.byteOffset, `${field}.byteOffset`, 0);
  const end = start + whole(place.byteLength, `${field}.byteLength`);
  const bytes = buffers(index);
  if (!bytes) {
    const { uri } = entry(root, 'buffers', index);
    const problem =
      typeof uri === 'string' ? `is in the file '${unescaped(uri)}', which is needed as well` : 'has no data';
    throw badGltf(`buffers[${index}]`, problem);
  }
  if (end <= bytes.length) return bytes.subarray(start, end);
  throw badGltf(field, `is truncated: ${end} bytes are needed, ${bytes.length} are there`);
}

/** Returns a container with one buffer, in which `views` are the contents of the buffer views. */
export function packed(root: Json, views: readonly Uint8Array[]): Uint8Array {
  let length = 0;
  objects(root.bufferViews).forEach((view, k) => {
    Object.assign(view, { buffer: 0, byteOffset: length, byteLength: views[k]?.length });
    length = aligned(length + (views[k]?.length ?? 0));
  });
  if (length > 0) root.buffers = [{ byteLength: length }];
  else delete root.buffers;
  const json = new TextEncoder().encode(JSON.stringify(root));
  const binaryAt = HEADER + CHUNK_HEADER + aligned(json.length) + CHUNK_HEADER;
  if (binaryAt + length > FILE_LIMIT) throw tooLarge('GLB', binaryAt + length);
  const bytes = new Uint8Array(length > 0 ? binaryAt + length : binaryAt - CHUNK_HEADER).fill(0x20, HEADER, binaryAt);
  const words = viewOf(bytes);
  const put = (at: number, ...values: number[]) => {
    for (const [k, value] of values.entries()) words.setUint32(at + 4 * k, value, true);
  };
  put(0, MAGIC, 2, bytes.length, aligned(json.length), JSON_CHUNK);
  bytes.set(json, HEADER + CHUNK_HEADER);
  if (length === 0) return bytes;
  put(binaryAt - CHUNK_HEADER, length, BINARY_CHUNK);
  objects(root.bufferViews).forEach(({ byteOffset }, k) => {
    bytes.set(views[k] ?? [], binaryAt + Number(byteOffset));
  });
  return bytes;
}

const aligned = (length: number) => Math.ceil(length / 4) * 4;
