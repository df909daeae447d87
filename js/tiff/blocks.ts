// Where the strips and tiles of a page are in its file.
import { type Page, TAG } from './directory.js';
import { badTiff } from './error.js';
import { arrayOf, type Format } from './format.js';

/** Largest number of bytes that are read at once, unless one block has more. */
const READ_BYTES = 2 ** 22;

/** A strip, a part of one, or a tile. */
export interface Block {
  /** Offset in the file, and number of bytes there; both 0 if it is not stored, which means zeros. */
  at: number;
  bytes: number;
  /** First pixel. */
  x: number;
  y: number;
  /** Number of its pixels along x, and of those along y that are stored. */
  width: number;
  height: number;
}

/** Returns the number of samples of a pixel in a block. */
export const samplesIn = ({ isPlanar, samples }: Format): number => (isPlanar ? 1 : samples);

/** Returns the number of bytes of a row of a block. */
export const rowBytes = (format: Format, width: number): number =>
  Math.ceil((width * samplesIn(format) * format.type.bits) / 8);

/** Returns the number of bytes of the image of a page, if it is not compressed. */
export function pageBytes(format: Format): number {
  return format.height * rowBytes(format, format.width) * (format.isPlanar ? format.samples : 1);
}

/** Returns the number of bytes of all blocks of a page that one slice needs, once they are decompressed. */
export function decodedBytes(format: Format): number {
  const { block, width, height } = format;
  const rows = block.isTile ? Math.ceil(height / block.height) * block.height : height;
  return Math.ceil(width / block.width) * rowBytes(format, block.width) * rows;
}

/** Returns the number of bytes of the numbers in these blocks, of which some have fewer bits in the file. */
export function numberBytes(format: Format): number {
  const bits = 8 * new (arrayOf(format.type))(0).BYTES_PER_ELEMENT;
  return (decodedBytes(format) / format.type.bits) * bits;
}

/**
 * Returns the blocks of a page with the samples from `sample` on. With `part` > 0 they are those of the image that comes
 * `part` images after it in the same format, without a directory of its own.
 */
export async function blocksOf(page: Page, format: Format, sample: number, part: number): Promise<Block[]> {
  const stored = await storedBlocks(page, format, sample);
  if (format.compression !== 'none') return stored;
  const shift = part * pageBytes(format);
  const blocks = stored.flatMap((block) => pieces(format, { ...block, at: block.at + shift }));
  for (const { at, bytes } of blocks) page.source.check(at, bytes);
  return blocks;
}

async function storedBlocks(page: Page, format: Format, sample: number): Promise<Block[]> {
  const { block, width, height, isPlanar } = format;
  const [wide, high] = [Math.ceil(width / block.width), Math.ceil(height / block.height)];
  const before = isPlanar ? sample * wide * high : 0;
  const [atTag, bytesTag] = block.isTile ? [TAG.tileOffsets, TAG.tileBytes] : [TAG.stripOffsets, TAG.stripBytes];
  const name = block.isTile ? 'tiles' : 'strips';
  if (page.count(atTag) < before + wide * high)
    throw badTiff(page.label, `${before + wide * high} ${name} are needed, the page has ${page.count(atTag)}`);
  const offsets = await page.numbers(atTag, before + wide * high);
  const counts = await page.numbers(bytesTag, before + wide * high);
  return Array.from({ length: wide * high }, (_, k) => {
    const y = Math.floor(k / wide) * block.height;
    const rows = block.isTile ? block.height : Math.min(block.height, height - y);
    const found = {
      at: page.checked(atTag, offsets[before + k] ?? 0),
      x: (k % wide) * block.width,
      y,
      width: block.width,
      height: rows,
    };
    const counted = counts[before + k];
    const bytes = bytesOf(format, found, counted === undefined ? undefined : page.checked(bytesTag, counted));
    if (bytes === undefined) throw badTiff(page.label, `offset or number of bytes of ${name} is missing`);
    return { ...found, bytes };
  });
}

/**
 * Returns the number of bytes of a block; undefined if it is not known. Of one that is not compressed it is, and some
 * writers count wrong, among them those of files above 4 GB.
 */
function bytesOf(format: Format, block: Omit<Block, 'bytes'>, counted: number | undefined): number | undefined {
  if (block.at === 0) return counted === 0 ? 0 : undefined;
  if (format.compression === 'none') return block.height * rowBytes(format, block.width);
  return counted === 0 ? undefined : counted;
}

/** Splits a strip that is not compressed, so that no more of it is in memory than needed. */
function pieces(format: Format, block: Block): Block[] {
  const row = rowBytes(format, block.width);
  if (block.bytes <= READ_BYTES || format.block.isTile) return [block];
  const rows = Math.max(1, Math.floor(READ_BYTES / row));
  return Array.from({ length: Math.ceil(block.height / rows) }, (_, k) => {
    const height = Math.min(rows, block.height - k * rows);
    return { ...block, at: block.at + k * rows * row, bytes: height * row, y: block.y + k * rows, height };
  });
}

/** Returns blocks in groups that are contiguous in the file, and read together. */
export function contiguous(blocks: Block[]): Block[][] {
  const groups: Block[][] = [];
  let [end, bytes] = [-1, 0];
  for (const block of blocks) {
    const group = groups.at(-1);
    if (group && block.at === end && bytes + block.bytes <= READ_BYTES) group.push(block);
    else {
      groups.push([block]);
      bytes = 0;
    }
    end = block.at + block.bytes;
    bytes += block.bytes;
  }
  return groups;
}
