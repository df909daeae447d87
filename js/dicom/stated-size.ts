// Sizes that compressed images state, which decoders allocate memory for before they decode anything.
import { jpegSize, TOO_MANY_SCANS } from '../tiff/frames.js';

/** Size of an image in its own header. */
export interface StatedSize {
  width: number;
  height: number;
  samples: number;
  /** Whether it is JPEG 2000, or HTJ2K. */
  isCodestream: boolean;
  /** Number of parts that are decoded by themselves. */
  tiles: number;
  /** Number of precincts of JPEG 2000: parts of the levels of resolution. */
  precincts: number;
  /** Number of packets of JPEG 2000: each layer of quality has one in each precinct. */
  packets: number;
  /** Why the image is not decoded, whatever its size. */
  problem?: string | undefined;
}

/** Returns the size in the header of an image of the JPEG family; undefined if it has none, or several. */
export function statedSize(bytes: Uint8Array): StatedSize | undefined {
  const at = startOfCodestream(bytes);
  if (at >= 0) return sizeOfCodestream(new DataView(bytes.buffer, bytes.byteOffset + at, bytes.length - at));
  const found = jpegSize(bytes);
  const problem = found?.hasManyScans ? TOO_MANY_SCANS : undefined;
  return found && { ...found, isCodestream: false, tiles: 1, precincts: 1, packets: 1, problem };
}

/** Start of the codestream of JPEG 2000 and HTJ2K: the markers SOC and SIZ (ITU-T T.800, annex A). */
const START = [0xff, 0x4f, 0xff, 0x51];

/** Most bytes of the boxes that some files have before the codestream. */
const BOXES = 4096;

function startOfCodestream(bytes: Uint8Array): number {
  const isBoxed = bytes[4] === 0x6a && bytes[5] === 0x50;
  for (let at = 0; at < (isBoxed ? BOXES : 1); at++) if (START.every((byte, k) => bytes[at + k] === byte)) return at;
  return -1;
}

function sizeOfCodestream(view: DataView): StatedSize | undefined {
  if (view.byteLength < 45) return undefined;
  const [right = 0, bottom = 0, left = 0, top = 0] = [8, 12, 16, 20].map((at) => view.getUint32(at));
  const [wide = 0, high = 0, tileLeft = 0, tileTop = 0] = [24, 28, 32, 36].map((at) => view.getUint32(at));
  const tiles = [Math.ceil((right - tileLeft) / wide), Math.ceil((bottom - tileTop) / high)] as const;
  // Decoders wait without end for the rows that an image with fewer samples than pixels does not have.
  const [across, down] = [view.getUint8(43), view.getUint8(44)];
  const width = Math.ceil(right / across) - Math.ceil(left / across);
  const height = Math.ceil(bottom / down) - Math.ceil(top / down);
  const codings = codingsOf(view);
  const most = (counts: number[]) => counts.reduce((most, count) => Math.max(most, count), 0);
  const precincts = most(codings.map(({ sizes }) => precinctsIn([width, height], tiles, sizes)));
  const packets = precincts * most(codings.map(({ layers }) => layers));
  return {
    width,
    height,
    samples: view.getUint16(40),
    isCodestream: true,
    tiles: tiles[0] * tiles[1],
    precincts,
    packets,
  };
}

/** Markers of a codestream: how all components are coded, how one is, and the start of a part of a tile. */
const [COD, COC, SOT] = [0xff52, 0xff53, 0xff90];

/** How an image is coded, or one of its components or tiles. */
interface Coding {
  /** Number of layers of quality; 0 if it is that of the other components. */
  layers: number;
  /** Exponents of the precincts of each level, the coarsest first. */
  sizes: [number, number][];
}

/** Returns how an image is coded, as often as it is stated. */
function codingsOf(view: DataView): Coding[] {
  const found: Coding[] = [];
  let end = 0;
  for (let at = 2; at + 12 < view.byteLength; ) {
    const [marker, length] = [view.getUint16(at), view.getUint16(at + 2)];
    // A part of a tile states its length, after which the next one begins; 0 is that up to the end.
    if (marker === SOT) end = at + view.getUint32(at + 6);
    if (marker === COD)
      found.push({ layers: view.getUint16(at + 6), sizes: precinctsAt(view, at + 9, view.getUint8(at + 4)) });
    if (marker === COC) found.push({ layers: 0, sizes: precinctsAt(view, at + 6, view.getUint8(at + 5)) });
    const isHeader = marker >= 0xff01 && marker !== 0xff93 && length >= 2;
    const next = isHeader ? at + 2 + length : end;
    if (next <= at) break;
    at = next;
  }
  return found;
}

/**
 * Returns the exponents of the precincts of each level, whose number is at a place; 15 where they are not stated, as the
 * lowest bit of the style says.
 */
function precinctsAt(view: DataView, at: number, style: number): [number, number][] {
  const isStated = (style & 1) === 1;
  return Array.from({ length: Math.min(view.getUint8(at), 32) + 1 }, (_, level) => {
    const byte = isStated && at + 5 + level < view.byteLength ? view.getUint8(at + 5 + level) : 0xff;
    return [byte & 15, byte >> 4];
  });
}

/** Returns the number of precincts in all levels of an image, or somewhat more if it has several tiles, which may divide some. */
function precinctsIn(
  [width, height]: readonly [number, number],
  [across, down]: readonly [number, number],
  sizes: Coding['sizes'],
): number {
  return sizes.reduce((sum, [wide, high], level) => {
    const coarser = sizes.length - 1 - level;
    const [columns, rows] = [Math.ceil(width / 2 ** (coarser + wide)), Math.ceil(height / 2 ** (coarser + high))];
    return sum + (columns + across - 1) * (rows + down - 1);
  }, 0);
}
