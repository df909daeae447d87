// The head of a Draco stream, which states how much there is to decode.
import { badGltf } from './error.js';

/** Number of triangles for each byte of a stream that is possible: the best compressed have a tenth. */
const MOST_PER_BYTE = 64;

const [MESH, EDGEBREAKER, HAS_METADATA] = [1, 1, 0x8000];
/** Deepest nesting of metadata; none is written deeper than two. */
const DEEPEST = 16;

/** Reads numbers of a stream one after the other. */
class Reader {
  readonly #bytes: Uint8Array;
  #at: number;
  readonly #field: string;

  constructor(bytes: Uint8Array, at: number, field: string) {
    this.#bytes = bytes;
    this.#at = at;
    this.#field = field;
  }

  byte(): number {
    const byte = this.#bytes[this.#at++];
    if (byte === undefined) throw badGltf(this.#field, 'the Draco stream is truncated');
    return byte;
  }

  word(): number {
    return this.byte() + 2 ** 8 * this.byte() + 2 ** 16 * this.byte() + 2 ** 24 * this.byte();
  }

  /** A number of seven bits per byte. */
  varint(): number {
    let value = 0;
    for (let scale = 1; scale <= 2 ** 35; scale *= 128) {
      const byte = this.byte();
      value += (byte & 127) * scale;
      if (byte < 128) return value;
    }
    throw badGltf(this.#field, 'the Draco stream has a number that is too long');
  }

  skip(bytes: number): void {
    this.#at += bytes;
  }
}

/** Returns the number of triangles of a stream; throws `bad-file` unless it has any, and not more than its bytes can hold. */
export function dracoTriangles(bytes: Uint8Array, field: string): number {
  if (new TextDecoder('latin1').decode(bytes.subarray(0, 5)) !== 'DRACO') throw badGltf(field, 'is no Draco stream');
  const reader = new Reader(bytes, 5, field);
  const version = 256 * reader.byte() + reader.byte();
  if (reader.byte() !== MESH) throw badGltf(field, 'the Draco stream has points instead of triangles');
  const isEdgebreaker = reader.byte() === EDGEBREAKER;
  const flags = reader.byte() + 256 * reader.byte();
  if (flags & HAS_METADATA) {
    for (let left = reader.varint(); left > 0; left--) {
      reader.varint();
      skipMetadata(reader, field);
    }
    skipMetadata(reader, field);
  }
  const faces = facesOf(reader, version, isEdgebreaker);
  if (faces > bytes.length * MOST_PER_BYTE)
    throw badGltf(field, `the Draco stream states ${faces} triangles in ${bytes.length} bytes`);
  return faces;
}

/** Returns the number of triangles, which older versions precede by more, or write as four bytes. */
function facesOf(reader: Reader, version: number, isEdgebreaker: boolean): number {
  const isLong = version < (isEdgebreaker ? 0x200 : 0x202);
  const count = () => (isLong ? reader.word() : reader.varint());
  if (!isEdgebreaker) return count();
  // The way in which the traversal is coded.
  reader.skip(1);
  if (version < 0x202) count();
  count();
  return count();
}

function skipMetadata(reader: Reader, field: string, depth = 0): void {
  if (depth > DEEPEST) throw badGltf(field, 'the metadata of the Draco stream are nested too deeply');
  // Entries: a name and a value. Then metadata within: a name, and the same again. Only their lengths matter here.
  for (let left = reader.varint(); left > 0; left--) {
    reader.skip(reader.byte());
    reader.skip(reader.varint());
  }
  for (let left = reader.varint(); left > 0; left--) {
    reader.skip(reader.byte());
    skipMetadata(reader, field, depth + 1);
  }
}
