// The voxels of images: from bytes, compressed or not, to typed arrays of stored values.
import type { DataSet, Fragment } from 'dicom-parser';
import type { VoxelArray } from '../data.js';
import { isSmall } from '../small-files.js';
import { type Decode, type Decoded, type Decoders, decoderOf } from './codecs.js';
import { badDicom, reasonOf } from './error.js';
import { BIG_ENDIAN, type Parser, PLAIN, pixelsOf, readWhole } from './parser.js';
import { decodeRle } from './rle.js';
import type { Source } from './source.js';
import { statedSize } from './stated-size.js';
import type { Frame, PixelFormat } from './types.js';

const RLE = '1.2.840.10008.1.2.5';
const JPEG_LS = ['1.2.840.10008.1.2.4.80', '1.2.840.10008.1.2.4.81'];

/** The type of array for stored values of a format. */
export function arrayOf({ bitsAllocated, signed, float }: PixelFormat): new (length: number) => VoxelArray {
  if (float) return bitsAllocated === 32 ? Float32Array : Float64Array;
  if (bitsAllocated <= 8) return signed ? Int8Array : Uint8Array;
  if (bitsAllocated === 16) return signed ? Int16Array : Uint16Array;
  return signed ? Int32Array : Uint32Array;
}

/** Throws `bad-file` unless the file of an image that is not compressed has all of its bytes. */
export function checkLength({ file, index, pixelsAt, pixelsEnd, format }: Frame): void {
  if (!PLAIN.includes(format.transferSyntax)) return;
  const size = (format.rows * format.columns * format.bitsAllocated) / 8;
  const [from, to] = [pixelsAt + Math.floor(index * size), pixelsAt + Math.ceil((index + 1) * size)];
  if (to > pixelsEnd)
    throw badDicom(
      file.name,
      `pixel data: needs ${Math.ceil(size)} bytes, has ${Math.max(0, Math.min(to, pixelsEnd) - from)}`,
    );
}

/** Reads the voxels of images; keeps the file of the last one, if that is compressed and has several. */
export class PixelReader {
  readonly #parser: Parser;
  readonly #decoders: Decoders;
  #last: { file: Source; data: DataSet; starts?: number[] } | undefined;
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
    checkSize(image, packed);
    // Its decoder searches the end in gigabytes of memory.
    if (JPEG_LS.includes(transferSyntax) && !hasEnd(packed, packed.length))
      throw badDicom(image.file.name, 'the compressed image could not be decoded: it has no end');
    try {
      const decoded = decode(packed);
      if (decoded.lossy) this.lossy.add(image.file.name);
      return decoded;
    } catch (error) {
      throw badDicom(image.file.name, `the compressed image could not be decoded: ${reasonOf(error)}`);
    }
  }

  async #plain(image: Frame, voxels: number): Promise<Decoded> {
    const { file, index, pixelsAt, pixelsEnd, format } = image;
    const { bitsAllocated, transferSyntax } = format;
    const [from, to] = [index, index + 1].map((frame) => pixelsAt + (frame * voxels * bitsAllocated) / 8) as [
      number,
      number,
    ];
    const size = bitsAllocated / 8;
    const source = image.deflated ? (await this.#whole(file)).byteArray : undefined;
    // The elements that follow are no part of the pixels.
    const until = (end: number) => Math.max(pixelsAt, Math.min(end, pixelsEnd));
    const read = (start: number, end: number) => {
      const [first, last] = [until(start), until(end)];
      return source?.subarray(first, last) ?? file.read(first, last);
    };
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
    if (count === 1) return joined(file, data, fragments);
    if (fragments.length === count) return joined(file, data, fragments.slice(index, index + 1));
    const starts = this.#starts(data);
    return joined(file, data, fragments.slice(starts[index], starts[index + 1]));
  }

  /** Returns the index of the first fragment of each image, which is found once for all images of a file. */
  #starts(data: DataSet): number[] {
    if (this.#last?.starts) return this.#last.starts;
    const element = pixelsOf(data);
    const table =
      element && !element.basicOffsetTable?.length
        ? this.#parser.createJPEGBasicOffsetTable(data, element)
        : (element?.basicOffsetTable ?? []);
    const fragmentAt = new Map(element?.fragments?.map(({ offset }, k) => [offset, k]));
    const starts = table.map((offset) => fragmentAt.get(offset) ?? -1);
    if (this.#last) this.#last.starts = starts;
    return starts;
  }
}

/** Returns the bytes of fragments one after the other; throws `bad-file` if there are none, or less than all of them. */
function joined(file: Source, { byteArray }: DataSet, fragments: readonly Fragment[]): Uint8Array {
  const parts = fragments.map(({ position, length }) => byteArray.subarray(position, position + length));
  const whole = fragments.reduce((sum, { length }) => sum + length, 0);
  const found = parts.reduce((sum, { length }) => sum + length, 0);
  if (fragments.length === 0) throw badDicom(file.name, 'pixel data: a compressed image is missing');
  if (found < whole) throw badDicom(file.name, `pixel data: needs ${whole} bytes of a compressed image, has ${found}`);
  const bytes = new Uint8Array(whole);
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}

/** Voxels of an image whose compressed bytes may be any, and more of them for each of these bytes. */
const FREE_VOXELS = 2 ** 24;
const VOXELS_PER_BYTE = 1000;
/** The same for JPEG 2000, whose decoder may go through a voxel dozens of times; per byte of images that are not small. */
const FREE_OF_JPEG_2000 = 1_500_000;
const OF_JPEG_2000_PER_BYTE = 64;
/** Most bytes that a byte of RLE can stand for. */
const RLE_RATIO = 64;
/** Most parts of an image of JPEG 2000, which take time of its decoder. */
const MOST_TILES = 1024;
/** Most precincts, which take half a kilobyte each, and packets, which take time and memory although they may be empty. */
const MOST_PRECINCTS = 2 ** 16;
const MOST_PACKETS = 2 ** 20;

/** Throws `bad-file` unless a compressed image is as large as its file says, before a decoder allocates memory for it. */
function checkSize({ format, file }: Frame, packed: Uint8Array): void {
  const { rows, columns, transferSyntax } = format;
  const isRle = transferSyntax === RLE;
  const most = isRle ? RLE_RATIO * packed.length : Math.max(FREE_VOXELS, VOXELS_PER_BYTE * packed.length);
  if (rows * columns > most)
    throw badDicom(file.name, `${columns} × ${rows} voxels are more than ${packed.length} compressed bytes can hold`);
  if (isRle) return;
  const stated = statedSize(packed);
  if (!stated) throw badDicom(file.name, 'the compressed image could not be decoded: it states no size');
  const { width, height, samples, problem, isCodestream } = stated;
  if (problem) throw badDicom(file.name, problem);
  const mostOfJ2k = isSmall(packed.length) ? FREE_OF_JPEG_2000 : OF_JPEG_2000_PER_BYTE * packed.length;
  if (isCodestream && rows * columns > mostOfJ2k)
    throw badDicom(
      file.name,
      `${columns} × ${rows} voxels in ${packed.length} bytes of JPEG 2000 could take long; at most ${mostOfJ2k} are decoded`,
    );
  if (width !== columns || height !== rows || samples !== 1)
    throw badDicom(
      file.name,
      `the compressed image has ${width} × ${height} pixels of ${samples} samples, the file states ${columns} × ${rows} of 1`,
    );
  const bounds = { tiles: MOST_TILES, precincts: MOST_PRECINCTS, packets: MOST_PACKETS };
  for (const [parts, most] of Object.entries(bounds)) {
    const count = stated[parts as keyof typeof bounds];
    if (!(count <= most)) throw badDicom(file.name, `the compressed image has ${count} ${parts}; at most ${most}`);
  }
}

/** Whether a compressed image has the marker that ends images of the JPEG family, before padding. */
function hasEnd(bytes: Uint8Array, within = END): boolean {
  const tail = bytes.subarray(-within);
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
