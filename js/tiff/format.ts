// How the image of a page is stored.
import type { VoxelArray } from '../data.js';
import { type Page, TAG } from './directory.js';
import { badTiff } from './error.js';

/** Compressions by their number. */
const COMPRESSIONS: Record<number, string> = {
  1: 'none',
  2: 'CCITT RLE',
  3: 'CCITT Group 3',
  4: 'CCITT Group 4',
  5: 'LZW',
  6: 'JPEG as of TIFF 6',
  7: 'JPEG',
  8: 'deflate',
  32773: 'PackBits',
  32809: 'ThunderScan',
  32946: 'deflate',
  33003: 'JPEG 2000',
  33004: 'JPEG 2000',
  33005: 'JPEG 2000',
  33007: 'JPEG XR',
  34661: 'JBIG',
  34676: 'SGI LogLuv',
  34677: 'SGI LogLuv',
  34712: 'JPEG 2000',
  34887: 'LERC',
  34892: 'lossy JPEG',
  34925: 'LZMA',
  50000: 'Zstandard',
  50001: 'WebP',
  50002: 'JPEG XL',
  52546: 'JPEG XL',
};

/** Compressions that are read, and the most bytes that one byte can stand for. */
const RATIOS = { none: 1, PackBits: 64, LZW: 1400, deflate: 1040, JPEG: 1024, Zstandard: 32768 };

export type Compression = keyof typeof RATIOS;

/** Compressions whose bytes may be differences of neighbours. */
const WITH_PREDICTOR: Compression[] = ['LZW', 'deflate', 'Zstandard'];

/** Values of the tag of the photometric interpretation. */
export const PHOTOMETRIC = { whiteIsZero: 0, blackIsZero: 1, rgb: 2, palette: 3, mask: 4, yCbCr: 6 } as const;

/** Types of samples, by the tag of the sample format. */
const FORMATS: Record<number, 'unsigned' | 'signed' | 'float'> = {
  1: 'unsigned',
  2: 'signed',
  3: 'float',
  4: 'unsigned',
};

/** The type of samples. */
export interface SampleType {
  kind: 'unsigned' | 'signed' | 'float';
  bits: number;
}

/** How the image of a page is stored. */
export interface Format {
  width: number;
  height: number;
  /** Number of samples per pixel. */
  samples: number;
  type: SampleType;
  /** Whether each sample has blocks of its own. */
  isPlanar: boolean;
  compression: Compression;
  /** Largest number of bytes that a byte of the file can stand for. */
  ratio: number;
  predictor: 1 | 2 | 3;
  photometric: number;
  /** Whether the first pixel of a byte is in its lowest bits. */
  isReversed: boolean;
  /** Size of the blocks in pixels: tiles, or strips as wide as the image. */
  block: { width: number; height: number; isTile: boolean };
}

/** Returns the class of the arrays that samples are read into; 64-bit integers are read as doubles first. */
export function arrayOf({ kind, bits }: SampleType): new (length: number) => VoxelArray {
  if (kind === 'float') return bits === 64 ? Float64Array : Float32Array;
  if (bits > 32) return Float64Array;
  if (kind === 'signed') return bits > 16 ? Int32Array : bits > 8 ? Int16Array : Int8Array;
  return bits > 16 ? Uint32Array : bits > 8 ? Uint16Array : Uint8Array;
}

/** Returns the size of a page, which is enough to select it. */
export async function sizeOf(page: Page): Promise<{ width: number; height: number }> {
  const [width, height] = [await page.number(TAG.width, 0), await page.number(TAG.height, 0)];
  for (const [name, size] of Object.entries({ ImageWidth: width, ImageLength: height }))
    if (!(Number.isInteger(size) && size > 0 && size < 2 ** 31))
      throw badTiff(page.label, `${name} must be from 1 to ${2 ** 31 - 1}, got ${size}`);
  return { width, height };
}

/** Reads how the image of a page is stored; throws `bad-file` if it is not supported. */
export async function formatOf(page: Page): Promise<Format> {
  const size = await sizeOf(page);
  const samples = await page.integer(TAG.samples, 1);
  if (samples < 1 || samples > 65_535) throw badTiff(page.label, `SamplesPerPixel must be 1 to 65535, got ${samples}`);
  const type = await sampleType(page);
  const compression = await compressionOf(page);
  if (compression === 'JPEG' && (type.bits !== 8 || type.kind !== 'unsigned'))
    throw badTiff(page.label, `samples in JPEG must be unsigned, 8 bits, got ${type.kind}, ${type.bits} bits`);
  const predictor = await predictorOf(page, compression, type);
  const planar = await page.integer(TAG.planar, 1);
  if (planar !== 1 && planar !== 2) throw badTiff(page.label, `PlanarConfiguration must be 1 or 2, got ${planar}`);
  return {
    ...size,
    ...{ samples, type, compression, predictor, ratio: RATIOS[compression] },
    isPlanar: planar === 2 && samples > 1,
    photometric: await page.integer(TAG.photometric, PHOTOMETRIC.blackIsZero),
    isReversed: (await page.integer(TAG.fillOrder, 1)) === 2,
    block: await blockOf(page, size),
  };
}

async function sampleType(page: Page): Promise<SampleType> {
  const found = await page.numbers(TAG.bits);
  const bits = page.checked(TAG.bits, found[0] ?? 1);
  if (found.some((other) => other !== bits))
    throw badTiff(page.label, `all samples must have the same number of bits, got ${found.slice(0, 8).join(', ')}`);
  const formats = new Set(await page.numbers(TAG.sampleFormat));
  const [format = 1] = formats;
  const kind = FORMATS[format];
  if (format === 5 || format === 6) throw badTiff(page.label, 'complex numbers are not supported');
  if (formats.size > 1 || !kind)
    throw badTiff(page.label, `unsupported SampleFormat ${[...formats].slice(0, 8).join(', ')}`);
  // Readers disagree about the order of three bytes.
  const isInteger = (bits >= 1 && bits <= 32 && bits !== 24) || bits === 64;
  if (kind === 'float' ? [16, 32, 64].includes(bits) : isInteger) return { kind, bits };
  const known =
    kind === 'float' ? 'floats of 16, 32 and 64 bits' : 'integers of 1 to 32 bits, but for 24, and of 64 bits';
  throw badTiff(page.label, `BitsPerSample is ${bits}; ${known} are read`);
}

async function compressionOf(page: Page): Promise<Compression> {
  const number = await page.integer(TAG.compression, 1);
  const name = COMPRESSIONS[number] ?? `number ${number}`;
  if (Object.hasOwn(RATIOS, name)) return name as Compression;
  throw badTiff(page.label, `unsupported compression ${name}; supported: ${Object.keys(RATIOS).join(', ')}`);
}

async function predictorOf(page: Page, compression: Compression, { kind, bits }: SampleType): Promise<1 | 2 | 3> {
  const predictor = await page.integer(TAG.predictor, 1);
  if (predictor === 1) return 1;
  const isKnown =
    (predictor === 2 && [8, 16, 32, 64].includes(bits)) || (predictor === 3 && kind === 'float' && bits <= 64);
  if (isKnown && WITH_PREDICTOR.includes(compression)) return predictor as 2 | 3;
  throw badTiff(page.label, `unsupported predictor ${predictor} for compression ${compression}, ${kind}, ${bits} bits`);
}

async function blockOf(page: Page, { width, height }: { width: number; height: number }): Promise<Format['block']> {
  if (!page.has(TAG.tileWidth) || page.has(TAG.stripOffsets)) {
    const rows = await page.integer(TAG.rowsPerStrip, height);
    return { width, height: rows > 0 ? Math.min(rows, height) : height, isTile: false };
  }
  const tile = { width: await page.integer(TAG.tileWidth, 0), height: await page.integer(TAG.tileHeight, 0) };
  if (tile.width > 0 && tile.height > 0) return { ...tile, isTile: true };
  throw badTiff(page.label, `tiles must have a size, got ${tile.width} × ${tile.height}`);
}
