// Turns the bytes of a block into numbers.

import type { VoxelArray } from '../data.js';
import type { Pause } from '../pause.js';
import { badTiff } from './error.js';
import { arrayOf, type SampleType } from './format.js';

type Bytes = Uint8Array<ArrayBuffer>;

/** How the numbers of a block are stored. */
export interface Storage {
  type: SampleType;
  isLittle: boolean;
  predictor: 1 | 2 | 3;
  /** Number of samples of a row, and of a pixel in the block. */
  row: number;
  samples: number;
  /** Name of the page, for messages. */
  label: string;
}

/** Reverses the bits of each byte. */
export function reverseBits(bytes: Bytes): void {
  for (let k = 0; k < bytes.length; k++) {
    let byte = bytes[k] ?? 0;
    byte = ((byte & 0x55) << 1) | ((byte >> 1) & 0x55);
    byte = ((byte & 0x33) << 2) | ((byte >> 2) & 0x33);
    bytes[k] = ((byte & 0x0f) << 4) | (byte >> 4);
  }
}

/** Returns the numbers of a block, whose bytes are changed; 64-bit integers as doubles. */
export async function numbersOf(given: Bytes, storage: Storage, pause: Pause): Promise<VoxelArray> {
  const { type, predictor } = storage;
  const size = type.bits / 8;
  if (![1, 2, 4, 8].includes(size)) return unpacked(given, storage, pause);
  // Views of numbers need an offset that is a multiple of their size.
  const bytes = given.byteOffset % size === 0 ? given : Uint8Array.from(given);
  if (predictor === 3) addPlanes(bytes, storage);
  else if (!storage.isLittle) swap(bytes, size);
  if (predictor === 2) addNeighbours(bytes, storage);
  return viewed(bytes, storage);
}

function viewed(bytes: Bytes, { type, label }: Storage): VoxelArray {
  const length = (8 * bytes.length) / type.bits;
  const view = <T>(Kind: new (buffer: ArrayBuffer, offset: number, length: number) => T) =>
    new Kind(bytes.buffer, bytes.byteOffset, length);
  if (type.kind === 'float') {
    if (type.bits === 16) return Float32Array.from(view(Uint16Array), half);
    return type.bits === 32 ? view(Float32Array) : view(Float64Array);
  }
  const isSigned = type.kind === 'signed';
  if (type.bits === 64) return exact(isSigned ? view(BigInt64Array) : view(BigUint64Array), label);
  if (type.bits === 32) return isSigned ? view(Int32Array) : view(Uint32Array);
  if (type.bits === 16) return isSigned ? view(Int16Array) : view(Uint16Array);
  return isSigned ? view(Int8Array) : view(Uint8Array);
}

/** Reverses the bytes of each number. */
function swap(bytes: Bytes, size: number): void {
  if (size === 1) return;
  for (let start = 0; start + size <= bytes.length; start += size) {
    for (let low = start, high = start + size - 1; low < high; low++, high--) {
      const byte = bytes[low] ?? 0;
      bytes[low] = bytes[high] ?? 0;
      bytes[high] = byte;
    }
  }
}

/** Undoes horizontal differencing: each number is stored as its difference from that of the pixel before. */
function addNeighbours(bytes: Bytes, { type, row, samples }: Storage): void {
  const length = (8 * bytes.length) / type.bits;
  if (type.bits === 64) {
    const longs = new BigUint64Array(bytes.buffer, bytes.byteOffset, length);
    for (let k = 0; k < length; k++) if (k % row >= samples) longs[k] = (longs[k] ?? 0n) + (longs[k - samples] ?? 0n);
    return;
  }
  const Kind = type.bits === 32 ? Uint32Array : type.bits === 16 ? Uint16Array : Uint8Array;
  const words = new Kind(bytes.buffer, bytes.byteOffset, length);
  for (let start = 0; start < length; start += row) {
    for (let k = start + samples; k < start + row; k++) words[k] = (words[k] ?? 0) + (words[k - samples] ?? 0);
  }
}

/** Undoes the predictor of floats: differences of bytes, the highest ones of a row first. */
function addPlanes(bytes: Bytes, { type, row, samples }: Storage): void {
  const size = type.bits / 8;
  for (let start = 0; start < bytes.length; start += row * size) {
    const line = bytes.slice(start, start + row * size);
    for (let k = samples; k < line.length; k++) line[k] = (line[k] ?? 0) + (line[k - samples] ?? 0);
    for (let k = 0; k < row; k++)
      for (let byte = 0; byte < size; byte++) bytes[start + k * size + byte] = line[(size - 1 - byte) * row + k] ?? 0;
  }
}

/** Returns the number of 16 bits as a float. */
function half(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const [exponent, fraction] = [(bits >> 10) & 31, bits & 1023];
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 25) * (1024 + fraction) : 2 ** -24 * fraction);
}

/** Returns 64-bit integers as doubles; throws `bad-file` if one would be rounded. */
function exact(values: BigInt64Array | BigUint64Array, label: string): Float64Array {
  const out = new Float64Array(values.length);
  for (let k = 0; k < out.length; k++) {
    out[k] = Number(values[k]);
    if (!(Math.abs(out[k] ?? 0) <= 2 ** 53))
      throw badTiff(label, `64-bit samples must be at most 9007199254740992 (2^53) in size, got ${values[k]}`);
  }
  return out;
}

/** Returns numbers that are not whole bytes: bits from the highest to the lowest, rows from whole bytes. */
async function unpacked(bytes: Bytes, { type, row }: Storage, pause: Pause): Promise<VoxelArray> {
  const { bits, kind } = type;
  const stride = Math.ceil((row * bits) / 8);
  const rows = bytes.length / stride;
  const out = new (arrayOf(type))(rows * row);
  const together = Math.ceil(TOGETHER / row);
  for (let y = 0; y < rows; y++) {
    if (bits <= SHORT) unpackShort(bytes, y * stride, out, y * row, row, bits);
    else for (let x = 0; x < row; x++) out[y * row + x] = bitsAt(bytes, 8 * y * stride + x * bits, bits);
    if (y % together === 0) await pause.turn();
  }
  return kind === 'signed' ? withSigns(out, bits) : out;
}

/** Numbers that are unpacked at a time. */
const TOGETHER = 2 ** 18;

/** Most bits of a number that fit into 32 together with those of a byte. */
const SHORT = 24;

/** Unpacks `count` numbers of few bits each, from byte `at` on, to `start` and what follows. */
function unpackShort(bytes: Bytes, at: number, out: VoxelArray, start: number, count: number, bits: number): void {
  const mask = 2 ** bits - 1;
  let [next, word, held] = [at, 0, 0];
  for (let k = start; k < start + count; k++) {
    for (; held < bits; held += 8) {
      word = (word << 8) | (bytes[next] ?? 0);
      next += 1;
    }
    held -= bits;
    out[k] = (word >>> held) & mask;
    word &= (1 << held) - 1;
  }
}

/** Returns unsigned numbers of some bits as signed ones. */
function withSigns(numbers: VoxelArray, bits: number): VoxelArray {
  const [half, whole] = [2 ** (bits - 1), 2 ** bits];
  // Numbers of up to 8, 16 or 32 bits are in arrays of signed ones, where large ones are negative by now.
  for (let k = 0; k < numbers.length; k++) if ((numbers[k] ?? 0) >= half) numbers[k] = (numbers[k] ?? 0) - whole;
  return numbers;
}

/** Returns the unsigned integer of some bits, up to 32. */
function bitsAt(bytes: Bytes, at: number, bits: number): number {
  const end = at + bits;
  let value = 0;
  for (let byte = Math.floor(at / 8); 8 * byte < end; byte++) value = value * 256 + (bytes[byte] ?? 0);
  return Math.floor(value / 2 ** ((8 - (end % 8)) % 8)) % 2 ** bits;
}
