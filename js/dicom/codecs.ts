// Decoders of compressed images: libraries of others, each imported when the first image that needs it is read.
import { invalid } from '../check.js';
import { type DecoderSource, installed, startedModule } from '../decoder-source.js';
import { shortened } from '../short-text.js';
import { badDicom, reasonOf } from './error.js';

/**
 * Decoders for compressed images. In Node, those that are installed are found; a page gives those that its images need,
 * so that bundlers see what is imported. The modules, and the `.wasm` files of their packages:
 *
 * - `jpeg`: `@cornerstonejs/codec-libjpeg-turbo-8bit/decodewasmjs`, `libjpegturbowasm_decode.wasm`
 * - `jpegLossless`: `@cornerstonejs/jpeg-lossless-decoder-js`
 * - `jpegLs`: `@cornerstonejs/codec-charls/decodewasmjs`, `charlswasm_decode.wasm`
 * - `jpeg2000`: `@cornerstonejs/codec-openjpeg/decodewasmjs`, `openjpegwasm_decode.wasm`
 * - `htj2k`: `@cornerstonejs/codec-openjph/wasmjs`, `openjphjs.wasm`
 */
export type Decoders = Partial<Record<DecoderName, DecoderSource>>;

export type DecoderName = 'jpeg' | 'jpegLossless' | 'jpegLs' | 'jpeg2000' | 'htj2k';

/** An image as a decoder returns it: bytes of little-endian integers. */
export interface Decoded {
  bytes: Uint8Array;
  /** Bytes of one voxel. */
  size: number;
  /** Whether the compression lost something; undefined if the decoder does not tell. */
  lossy?: boolean;
}

export type Decode = (bytes: Uint8Array) => Decoded;

/** The decoders of a WebAssembly module have this interface. */
interface Instance {
  getEncodedBuffer(length: number): Uint8Array;
  decode(): void;
  getDecodedBuffer(): Uint8Array;
  getNearLossless?(): number;
  getIsReversible?(): boolean;
  getFrameInfo(): { width: number; height: number; bitsPerSample: number; componentCount: number };
  delete(): void;
}

type DecoderModule = Record<string, new () => Instance>;

/** A compression, and the library that decodes it. */
interface Codec {
  name: string;
  option: DecoderName;
  module: string;
  /** Name of the class in the library's WebAssembly module; undefined if the library is JavaScript. */
  kind?: string;
}

const JPEG: Codec = {
  ...{ name: 'JPEG', option: 'jpeg', kind: 'JPEGDecoder' },
  module: '@cornerstonejs/codec-libjpeg-turbo-8bit/decodewasmjs',
};
const JPEG_LOSSLESS: Codec = {
  ...{ name: 'lossless JPEG', option: 'jpegLossless' },
  module: '@cornerstonejs/jpeg-lossless-decoder-js',
};
const JPEG_LS: Codec = {
  ...{ name: 'JPEG-LS', option: 'jpegLs', kind: 'JpegLSDecoder' },
  module: '@cornerstonejs/codec-charls/decodewasmjs',
};
const JPEG_2000: Codec = {
  ...{ name: 'JPEG 2000', option: 'jpeg2000', kind: 'J2KDecoder' },
  module: '@cornerstonejs/codec-openjpeg/decodewasmjs',
};
const HTJ2K: Codec = {
  ...{ name: 'HTJ2K', option: 'htj2k', kind: 'HTJ2KDecoder' },
  module: '@cornerstonejs/codec-openjph/wasmjs',
};

/** Decoders by transfer syntax (PS3.5, annex A.4), after the prefix of all. */
const CODECS = new Map(
  Object.entries({
    ...{ '4.50': JPEG, '4.51': JPEG, '4.57': JPEG_LOSSLESS, '4.70': JPEG_LOSSLESS },
    ...{ '4.80': JPEG_LS, '4.81': JPEG_LS, '4.90': JPEG_2000, '4.91': JPEG_2000 },
    ...{ '4.201': HTJ2K, '4.202': HTJ2K, '4.203': HTJ2K },
  }),
);

const PREFIX = '1.2.840.10008.1.2.';

/** Returns the decoder of a transfer syntax; throws `bad-file` if there is none, `invalid-argument` if it is missing. */
export async function decoderOf(transferSyntax: string, decoders: Decoders): Promise<Decode> {
  const codec = transferSyntax.startsWith(PREFIX) ? CODECS.get(transferSyntax.slice(PREFIX.length)) : undefined;
  if (!codec)
    throw badDicom(
      'transfer syntax',
      `${shortened(transferSyntax)} is not supported; accepted: uncompressed, deflated, RLE, JPEG, JPEG-LS, JPEG 2000, HTJ2K`,
    );
  try {
    return await loaded(codec, decoders[codec.option]);
  } catch (error) {
    const what = `the images are compressed as ${codec.name}, whose decoder is not there (${reasonOf(error)})`;
    throw invalid(`decoders.${codec.option}`, `${what}: install the package of ${codec.module}, and in a page pass it`);
  }
}

/** Loaded decoders by what loads them, since an instance of a module takes longer than an image. */
const instances = new Map<unknown, Promise<Decode>>();

function loaded(codec: Codec, source: DecoderSource = foundFor(codec)): Promise<Decode> {
  const key = source.load;
  const made = instances.get(key) ?? guarded(instantiated(codec, source), () => instances.delete(key));
  instances.set(key, made);
  return made;
}

/** Returns a decoder that is forgotten when it fails: its memory may then be damaged, and with it all later images. */
async function guarded(making: Promise<Decode>, forget: () => void): Promise<Decode> {
  const failed = (error: unknown): never => {
    forget();
    throw error;
  };
  const decode = await making.catch(failed);
  return (bytes) => {
    try {
      return decode(bytes);
    } catch (error) {
      return failed(error);
    }
  };
}

/** Decoders that Node finds. */
const found = new Map<Codec, DecoderSource>();

function foundFor(codec: Codec): DecoderSource {
  const source = found.get(codec) ?? installed(codec.module);
  found.set(codec, source);
  return source;
}

async function instantiated({ kind }: Codec, { load, wasm }: DecoderSource): Promise<Decode> {
  const module = await load();
  if (kind === undefined) return losslessJpeg(Object(module));
  return decodeWith(kind, await startedModule<DecoderModule>(module, wasm));
}

/** The class of the decoder of lossless JPEG. */
type LosslessDecoder = new () => {
  decompress(buffer: ArrayBuffer, offset: number, length: number): ArrayBuffer;
  frame: { precision: number };
};

function losslessJpeg(module: object): Decode {
  const { Decoder } = module as { Decoder: LosslessDecoder };
  return (bytes) => {
    const decoder = new Decoder();
    const whole = bytes.slice();
    const decoded = new Uint8Array(decoder.decompress(whole.buffer, 0, whole.length));
    return { bytes: decoded, size: decoder.frame.precision > 8 ? 2 : 1 };
  };
}

function decodeWith(kind: string, module: DecoderModule): Decode {
  const Decoder = module[kind] as new () => Instance;
  return (bytes) => {
    const decoder = new Decoder();
    try {
      decoder.getEncodedBuffer(bytes.length).set(bytes);
      decoder.decode();
      const { bitsPerSample, componentCount } = decoder.getFrameInfo();
      if (!componentCount) throw new Error('it is damaged, or none that the decoder knows');
      if (componentCount !== 1) throw new Error(`${componentCount} components instead of one`);
      // A copy, since the memory of the module is used again.
      const lossy = (decoder.getNearLossless?.() ?? 0) > 0 || decoder.getIsReversible?.() === false;
      return { bytes: decoder.getDecodedBuffer().slice(), size: bitsPerSample > 8 ? 2 : 1, lossy };
    } finally {
      decoder.delete();
    }
  };
}
