// Decoders of compressed images: libraries of others, each imported when the first image that needs it is read.
import { invalid } from '../check.js';
import { badDicom, reasonOf } from './error.js';

/**
 * Where the decoders' `.wasm` files are, for pages: the address of the folder, or a function from the name of a file to
 * its address. Node finds them itself.
 */
export type DecoderFiles = string | URL | ((file: string) => string | URL);

/** An image as a decoder returns it: bytes of little-endian integers. */
export interface Decoded {
  bytes: Uint8Array;
  /** Bytes of one voxel. */
  size: number;
}

export type Decode = (bytes: Uint8Array) => Decoded;

/** The decoders of a WebAssembly module have this interface. */
interface Instance {
  getEncodedBuffer(length: number): Uint8Array;
  decode(): void;
  getDecodedBuffer(): Uint8Array;
  getFrameInfo(): { width: number; height: number; bitsPerSample: number; componentCount: number };
  delete(): void;
}

type Factory = (options: object) => Promise<Record<string, new () => Instance>>;

interface Codec {
  name: string;
  package: string;
  load: (files: DecoderFiles | undefined) => Promise<Decode>;
}

const wasm = (name: string, from: string, kind: string, file: string, imported: () => Promise<unknown>): Codec => ({
  name,
  package: from,
  load: async (files) =>
    decodeWith(kind, await instantiate((await imported()) as { default: unknown }, name, file, files)),
});

const JPEG = wasm(
  'JPEG',
  '@cornerstonejs/codec-libjpeg-turbo-8bit',
  'JPEGDecoder',
  'libjpegturbowasm_decode.wasm',
  () => import('@cornerstonejs/codec-libjpeg-turbo-8bit/decodewasmjs'),
);
const JPEG_LS = wasm(
  'JPEG-LS',
  '@cornerstonejs/codec-charls',
  'JpegLSDecoder',
  'charlswasm_decode.wasm',
  () => import('@cornerstonejs/codec-charls/decodewasmjs'),
);
const JPEG_2000 = wasm(
  'JPEG 2000',
  '@cornerstonejs/codec-openjpeg',
  'J2KDecoder',
  'openjpegwasm_decode.wasm',
  () => import('@cornerstonejs/codec-openjpeg/decodewasmjs'),
);
const HTJ2K = wasm(
  'HTJ2K',
  '@cornerstonejs/codec-openjph',
  'HTJ2KDecoder',
  'openjphjs.wasm',
  () => import('@cornerstonejs/codec-openjph/wasmjs'),
);
const JPEG_LOSSLESS: Codec = {
  name: 'lossless JPEG',
  package: '@cornerstonejs/jpeg-lossless-decoder-js',
  load: async () => {
    const { Decoder } = await import('@cornerstonejs/jpeg-lossless-decoder-js');
    return (bytes) => {
      const decoder = new Decoder();
      const whole = bytes.slice();
      const decoded = new Uint8Array(decoder.decompress(whole.buffer, 0, whole.length));
      return { bytes: decoded, size: decoder.frame.precision > 8 ? 2 : 1 };
    };
  },
};

/** Decoders by transfer syntax (PS3.5, annex A.4), after the prefix of all. */
const CODECS: Record<string, Codec> = {
  ...{ '4.50': JPEG, '4.51': JPEG, '4.57': JPEG_LOSSLESS, '4.70': JPEG_LOSSLESS },
  ...{ '4.80': JPEG_LS, '4.81': JPEG_LS, '4.90': JPEG_2000, '4.91': JPEG_2000 },
  ...{ '4.201': HTJ2K, '4.202': HTJ2K, '4.203': HTJ2K },
};

const PREFIX = '1.2.840.10008.1.2.';

/** Returns the decoder of a transfer syntax; throws `bad-file` if there is none, `invalid-argument` if it is missing. */
export async function decoderOf(transferSyntax: string, files: DecoderFiles | undefined): Promise<Decode> {
  const codec = transferSyntax.startsWith(PREFIX) ? CODECS[transferSyntax.slice(PREFIX.length)] : undefined;
  if (!codec)
    throw badDicom(
      'transfer syntax',
      `${transferSyntax} is not supported; accepted: uncompressed, deflated, RLE, JPEG, JPEG-LS, JPEG 2000, HTJ2K`,
    );
  return codec.load(files).catch((error: unknown) => {
    const remedy = `install ${codec.package}, and in a page pass the place of its .wasm file as option "decoders"`;
    throw invalid(
      'decoders',
      `the images are compressed as ${codec.name}, whose decoder could not be loaded (${reasonOf(error)}): ${remedy}`,
    );
  });
}

/** Instances of modules by file, which are kept, since an instance takes longer than an image. */
const instances = new Map<string, Promise<Awaited<ReturnType<Factory>>>>();

function instantiate(module: { default: unknown }, name: string, file: string, files: DecoderFiles | undefined) {
  const address = files === undefined ? undefined : addressOf(file, files);
  const key = `${file} ${address ?? ''}`;
  const made = instances.get(key) ?? factoryOf(module)(optionsFor(name, address));
  instances.set(key, made);
  made.catch(() => instances.delete(key));
  return made;
}

/** A module of CommonJS, whose export some bundlers put into another `default`. */
function factoryOf({ default: made }: { default: unknown }): Factory {
  return (typeof made === 'function' ? made : (made as { default: unknown }).default) as Factory;
}

function optionsFor(name: string, address: string | undefined): object {
  const { process } = globalThis as { process?: { versions?: { node?: string } } };
  const isNode = process?.versions?.node !== undefined;
  if (address === undefined && !isNode) throw new Error(`where the .wasm file for ${name} is was not given`);
  const silent = () => {};
  return { print: silent, printErr: silent, ...(address !== undefined && { locateFile: () => address }) };
}

function addressOf(file: string, files: DecoderFiles): string {
  if (typeof files === 'function') return String(files(file));
  return `${String(files).replace(/\/?$/, '/')}${file}`;
}

function decodeWith(kind: string, module: Record<string, new () => Instance>): Decode {
  const Decoder = module[kind] as new () => Instance;
  return (bytes) => {
    const decoder = new Decoder();
    try {
      decoder.getEncodedBuffer(bytes.length).set(bytes);
      decoder.decode();
      const { bitsPerSample, componentCount } = decoder.getFrameInfo();
      if (componentCount !== 1) throw new Error(`${componentCount} components instead of one`);
      // A copy, since the memory of the module is used again.
      return { bytes: decoder.getDecodedBuffer().slice(), size: bitsPerSample > 8 ? 2 : 1 };
    } finally {
      decoder.delete();
    }
  };
}
