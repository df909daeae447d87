// Sizes that compressed images state, which decoders allocate memory for before they decode anything.
import { jpegSize } from '../tiff/frames.js';

/** Size of an image in its own header. */
export interface StatedSize {
  width: number;
  height: number;
  samples: number;
  /** Number of parts that are decoded by themselves. */
  tiles: number;
}

/** Returns the size in the header of an image of the JPEG family; undefined if it has none, or several. */
export function statedSize(bytes: Uint8Array): StatedSize | undefined {
  const at = startOfCodestream(bytes);
  if (at >= 0) return sizeOfCodestream(new DataView(bytes.buffer, bytes.byteOffset + at, bytes.length - at));
  const found = jpegSize(bytes);
  return found && { ...found, tiles: 1 };
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
  const tiles = Math.ceil((right - tileLeft) / wide) * Math.ceil((bottom - tileTop) / high);
  // Decoders wait without end for the rows that an image with fewer samples than pixels does not have.
  const [across, down] = [view.getUint8(43), view.getUint8(44)];
  const width = Math.ceil(right / across) - Math.ceil(left / across);
  const height = Math.ceil(bottom / down) - Math.ceil(top / down);
  return { width, height, samples: view.getUint16(40), tiles };
}
