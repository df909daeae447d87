// Decoders that stop at the size of a chunk: a few bytes may decode to gigabytes, and two codecs multiply that.
import { badZarr, type Zarrita } from './error.js';

type Registry = Zarrita['registry'];
type Factory = NonNullable<ReturnType<Registry['get']>>;
type CodecClass = Awaited<ReturnType<Factory>>;

/** The part of zarrita's description of a chunk that codecs here use. */
interface ChunkMeta {
  dataType: string;
  shape: readonly number[];
}

interface BytesCodec {
  kind: 'bytes_to_bytes';
  encode: (bytes: Uint8Array) => unknown;
  decode: (bytes: Uint8Array) => Promise<Uint8Array>;
}

/** Decodes bytes to at most `most`, by a codec; throws if they are more. */
type Decode = (bytes: Uint8Array, most: number, codec: BytesCodec) => Promise<Uint8Array>;

const DECODERS: Record<string, Decode> = {
  gzip: (bytes, most) => inflated(bytes, 'gzip', most),
  zlib: (bytes, most) => inflated(bytes, 'deflate', most),
  blosc: checkedBefore((bytes) => uint32(bytes, 4)),
  lz4: checkedBefore((bytes) => uint32(bytes, 0)),
  zstd: checkedBefore(zstdSize),
};

/** The most codecs of an array, those of the chunks in its shards included: a chunk is decoded by all of them in one go. */
const MOST_CODECS = 8;
/** The most that change the order of axes, as one by itself can: each makes a copy of the chunk. */
const MOST_TRANSPOSED = 1;

/** Throws `bad-file` for the metadata of an array with too many codecs. */
export function checkCodecs(key: string, metadata: Uint8Array): void {
  const names = codecsIn(parsed(metadata));
  if (names.length > MOST_CODECS) throw badZarr(key, `must have at most ${MOST_CODECS} codecs, got ${names.length}`);
  const transposed = names.filter((name) => name === 'transpose').length;
  if (transposed > MOST_TRANSPOSED)
    throw badZarr(key, `must have at most ${MOST_TRANSPOSED} codec 'transpose', got ${transposed}`);
}

/** Returns a value of JSON; undefined for what is none, of which zarrita says what is wrong. */
function parsed(bytes: Uint8Array): unknown {
  try {
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    return undefined;
  }
}

/** Returns the names of the codecs of an array of Zarr 2 or 3, or of the configuration of a codec. */
function codecsIn(value: unknown): unknown[] {
  const { codecs, index_codecs, filters } = Object(value) as Record<string, unknown>;
  const lists = [codecs, index_codecs, filters].filter((list) => Array.isArray(list));
  return lists.flat().flatMap((codec) => [Object(codec).name, ...codecsIn(Object(codec).configuration)]);
}

const bounded = new WeakSet<Registry>();

/**
 * Makes zarrita's decoders of compressed bytes stop at the size that the metadata declare for a chunk. zarrita has one
 * table of codecs, which others on the page share: for them, too, a chunk that is larger than declared is an error.
 */
export function boundDecoders({ registry }: Zarrita): void {
  if (bounded.has(registry)) return;
  bounded.add(registry);
  for (const [name, decode] of Object.entries(DECODERS)) {
    for (const known of [name, `numcodecs.${name}`]) {
      const factory = registry.get(known);
      if (factory) registry.set(known, async () => boundedClass(await factory(), decode) as unknown as CodecClass);
    }
  }
}

function boundedClass(inner: CodecClass, decode: Decode) {
  return {
    fromConfig(configuration: unknown, meta: ChunkMeta): BytesCodec {
      const codec = inner.fromConfig(configuration as never, meta as never) as unknown as BytesCodec;
      const most = mostBytes(meta);
      return { ...codec, kind: 'bytes_to_bytes', encode: codec.encode, decode: (bytes) => decode(bytes, most, codec) };
    },
  };
}

/** Most bytes of a chunk after a step of decoding: what does not compress becomes a little larger. */
function mostBytes({ dataType, shape }: ChunkMeta): number {
  const bits = /^(?:u?int|float)(\d+)$/.exec(dataType)?.[1];
  // Other types, such as texts, are refused where an array is checked.
  return withSlack(shape.reduce((product, size) => product * size, Number(bits ?? 64) / 8));
}

/** Returns the most bytes that data of a size may have when they are stored, compressed or not. */
export function withSlack(bytes: number): number {
  return bytes + bytes / 64 + 65536;
}

function tooLong(most: number): Error {
  return new Error(`larger than its chunk, which has at most ${Math.floor(most)} bytes`);
}

/** Returns a decoder that first asks `sizeOf` for a size, undefined if the bytes do not tell it. */
function checkedBefore(sizeOf: (bytes: Uint8Array, most: number) => number | undefined): Decode {
  return async (bytes, most, codec) => {
    const size = sizeOf(bytes, most);
    if (size !== undefined && size > most) throw tooLong(most);
    return codec.decode(bytes);
  };
}

function uint32(bytes: Uint8Array, at: number): number | undefined {
  if (bytes.length < at + 4) return undefined;
  return new DataView(bytes.buffer, bytes.byteOffset).getUint32(at, true);
}

async function inflated(bytes: Uint8Array, format: CompressionFormat, most: number): Promise<Uint8Array> {
  const stream = new Blob([bytes as Uint8Array<ArrayBuffer>]).stream().pipeThrough(new DecompressionStream(format));
  const reader = stream.getReader();
  const parts: Uint8Array<ArrayBuffer>[] = [];
  for (let length = 0; ; ) {
    const { value } = await reader.read();
    if (!value) break;
    length += value.length;
    if (length > most) {
      await reader.cancel();
      throw tooLong(most);
    }
    parts.push(value);
  }
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

/** Most bytes of a block of Zstandard (RFC 8878, section 3.1.1.2). */
const ZSTD_BLOCK = 2 ** 17;

/**
 * Bytes that frames without a size may have in the worst case, at least and as a multiple of those of the chunk; their blocks
 * are mostly shorter than the longest.
 */
const ZSTD_UNKNOWN = [2 ** 25, 8] as const;

/**
 * Returns the size that the first frame of Zstandard states; or else, if its blocks could give more than is bearable, the
 * size that they could.
 */
function zstdSize(bytes: Uint8Array, most: number): number | undefined {
  if (uint32(bytes, 0) !== 0xfd2fb528) return undefined;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const flags = bytes[4] ?? 0;
  const isSingle = (flags & 0x20) !== 0;
  const idBytes = [0, 1, 2, 4][flags & 3] as number;
  const at = 5 + (isSingle ? 0 : 1) + idBytes;
  const sizeBytes = [isSingle ? 1 : 0, 2, 4, 8][flags >> 6] as number;
  if (bytes.length < at + sizeBytes) return undefined;
  if (sizeBytes === 1) return view.getUint8(at);
  if (sizeBytes === 2) return view.getUint16(at, true) + 256;
  if (sizeBytes === 4) return view.getUint32(at, true);
  if (sizeBytes === 8) return Number(view.getBigUint64(at, true));
  const size = worstBlocks(view, at);
  return size > Math.max(ZSTD_UNKNOWN[0], ZSTD_UNKNOWN[1] * most) ? size : undefined;
}

/** Returns the most bytes that the blocks from `at` on can give (RFC 8878, section 3.1.1.2). */
function worstBlocks(view: DataView, at: number): number {
  let size = 0;
  for (let next = at; next + 3 <= view.byteLength; ) {
    const header = view.getUint16(next, true) + view.getUint8(next + 2) * 2 ** 16;
    const [isLast, type, length] = [header & 1, (header >> 1) & 3, header >> 3];
    size += type === 2 ? ZSTD_BLOCK : length;
    next += 3 + (type === 1 ? 1 : length);
    if (isLast) break;
  }
  return size;
}
