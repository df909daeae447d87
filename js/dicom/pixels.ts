// The voxels of images: from bytes, compressed or not, to typed arrays of stored values.
import type { DataSet, Element } from 'dicom-parser';
import type { VoxelArray } from '../data.js';
import { type Decode, type Decoded, type Decoders, decoderOf } from './codecs.js';
import { badDicom, reasonOf } from './error.js';
import { type Parser, pixelsOf, readWhole } from './parser.js';
import { decodeRle } from './rle.js';
import type { Source } from './source.js';
import type { Frame, PixelFormat } from './types.js';

/** Transfer syntaxes without compression of voxels: implicit, explicit, deflated as a whole, and big-endian. */
const PLAIN = ['1.2.840.10008.1.2', '1.2.840.10008.1.2.1', '1.2.840.10008.1.2.1.99', '1.2.840.10008.1.2.2'];
const BIG_ENDIAN = '1.2.840.10008.1.2.2';
const RLE = '1.2.840.10008.1.2.5';

/** The type of array for stored values of a format. */
export function arrayOf({ bitsAllocated, signed, float }: PixelFormat): new (length: number) => VoxelArray {
  if (float) return bitsAllocated === 32 ? Float32Array : Float64Array;
  if (bitsAllocated <= 8) return signed ? Int8Array : Uint8Array;
  if (bitsAllocated === 16) return signed ? Int16Array : Uint16Array;
  return signed ? Int32Array : Uint32Array;
}

/** Reads the voxels of images; keeps the file of the last one, if that is compressed and has several. */
export class PixelReader {
  readonly #parser: Parser;
  readonly #decoders: Decoders;
  #last: { file: Source; data: DataSet } | undefined;
  /** Files whose images were compressed with loss, and those that do not end as compressed images do. */
  readonly lossy = new Set<string>();
  readonly endless = new Set<string>();

  constructor(parser: Parser, decoders: Decoders) {
    this.#parser = parser;
    this.#decoders = decoders;
  }

  /** Returns the stored values of an image; throws `bad-file` if it is damaged or cut off. */
  async read(image: Frame): Promise<VoxelArray> {
    const { format, file } = image;
    const voxels = format.rows * format.columns;
    const { bytes, size } = await this.#bytes(image, voxels);
    const expected = format.bitsAllocated === 1 ? voxels / 8 : voxels * size;
    if (bytes.length < expected)
      throw badDicom(file.name, `pixel data: needs ${Math.ceil(expected)} bytes, has ${bytes.length}`);
    return format.bitsAllocated === 1 ? unpackedBits(bytes, voxels) : valuesOf(bytes, size, voxels, format);
  }

  async #bytes(image: Frame, voxels: number): Promise<Decoded> {
    const { transferSyntax } = image.format;
    if (PLAIN.includes(transferSyntax)) return this.#plain(image, voxels);
    const packed = await this.#compressed(image);
    if (transferSyntax !== RLE && !hasEnd(packed)) this.endless.add(image.file.name);
    const decode: Decode =
      transferSyntax === RLE ? (bytes) => decodeRle(bytes, voxels) : await decoderOf(transferSyntax, this.#decoders);
    try {
      const decoded = decode(packed);
      if (decoded.lossy) this.lossy.add(image.file.name);
      return decoded;
    } catch (error) {
      throw badDicom(image.file.name, `the compressed image could not be decoded: ${reasonOf(error)}`);
    }
  }

  async #plain(image: Frame, voxels: number): Promise<Decoded> {
    const { file, index, pixelsAt, format } = image;
    const { bitsAllocated, transferSyntax } = format;
    const [from, to] = [index, index + 1].map((frame) => pixelsAt + (frame * voxels * bitsAllocated) / 8) as [
      number,
      number,
    ];
    const size = bitsAllocated / 8;
    const source = image.deflated ? (await this.#whole(file)).byteArray : undefined;
    const read = (start: number, end: number) => source?.subarray(start, end) ?? file.read(start, end);
    if (bitsAllocated === 1)
      return { bytes: shifted(await read(Math.floor(from), Math.ceil(to)), (from % 1) * 8), size };
    if (format.inWords && transferSyntax === BIG_ENDIAN) {
      const even = from - (from % 2);
      return { bytes: swapped(await read(even, to + (to % 2)), 2).subarray(from - even), size };
    }
    const bytes = await read(from, to);
    return { bytes: transferSyntax === BIG_ENDIAN ? swapped(bytes, size) : bytes, size };
  }

  async #whole(file: Source): Promise<DataSet> {
    if (this.#last?.file !== file) this.#last = { file, data: (await readWhole(this.#parser, file)).data };
    return this.#last.data;
  }

  /** Returns the bytes of a compressed image: those of all its fragments. */
  async #compressed({ file, index, count }: Frame): Promise<Uint8Array> {
    const data = await this.#whole(file);
    const element = pixelsOf(data);
    const fragments = element?.fragments ?? [];
    if (!element || fragments.length === 0) throw badDicom(file.name, 'pixel data: no compressed image is there');
    try {
      return this.#fragmentsOf(data, element, index, count) as Uint8Array;
    } catch (error) {
      throw badDicom(file.name, `pixel data: ${reasonOf(error)}`);
    }
  }

  #fragmentsOf(data: DataSet, element: Element, index: number, count: number): Uint8Array {
    const parser = this.#parser;
    const fragments = element.fragments ?? [];
    const one = (first: number, number: number) =>
      new Uint8Array(parser.readEncapsulatedPixelDataFromFragments(data, element, first, number));
    if (count === 1) return one(0, fragments.length);
    if (fragments.length === count) return one(index, 1);
    const table = element.basicOffsetTable?.length
      ? element.basicOffsetTable
      : parser.createJPEGBasicOffsetTable(data, element);
    return new Uint8Array(parser.readEncapsulatedImageFrame(data, element, index, table));
  }
}

/** Whether a compressed image has the marker that ends images of the JPEG family, before padding. */
function hasEnd(bytes: Uint8Array): boolean {
  const tail = bytes.subarray(-END);
  return tail.some((byte, k) => byte === 0xff && tail[k + 1] === 0xd9);
}

/** Number of bytes at the end of a compressed image in which its end marker is: the marker, and padding. */
const END = 10;

/** Returns bytes whose bits begin at `first` of the first byte. */
function shifted(bytes: Uint8Array, first: number): Uint8Array {
  return first === 0 ? bytes : bytes.map((byte, k) => (byte >> first) | ((bytes[k + 1] ?? 0) << (8 - first)));
}

/** Returns one value for each bit; the least significant bit of a byte is the first (PS3.5, section 8.1.1). */
function unpackedBits(bytes: Uint8Array, voxels: number): Uint8Array {
  return new Uint8Array(voxels).map((_, k) => ((bytes[k >> 3] ?? 0) >> (k & 7)) & 1);
}

function swapped(bytes: Uint8Array, size: number): Uint8Array {
  return bytes.map((_, k) => bytes[k - (k % size) + size - 1 - (k % size)] ?? 0);
}

/** Returns the stored values in little-endian bytes of `size` each. */
function valuesOf(bytes: Uint8Array, size: number, voxels: number, format: PixelFormat): VoxelArray {
  // A copy begins at an address that any typed array accepts.
  const { buffer } = bytes.slice(0, voxels * size);
  const kind = arrayOf(format);
  if (format.float) return new (kind as Float32ArrayConstructor)(buffer);
  const raw = size === 1 ? new Uint8Array(buffer) : size === 2 ? new Uint16Array(buffer) : new Uint32Array(buffer);
  // A decoder may return fewer bytes for a voxel than the file allocates.
  const { bitsStored, highBit, signed } = format;
  const bits = Math.min(bitsStored, 8 * size);
  const values = new kind(voxels);
  const [left, right] = [31 - Math.min(highBit, 8 * size - 1), 32 - bits];
  for (let k = 0; k < voxels; k++) {
    const top = (raw[k] ?? 0) << left;
    values[k] = signed ? top >> right : top >>> right;
  }
  return values;
}
