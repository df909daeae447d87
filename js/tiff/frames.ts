// Sizes that compressed blocks state.

/** Marker of the header in JPEG-LS. */
const LS = 0xf7;

/** Marker of a scan, of which an image has some ten at most: decoders go through the whole image for each. */
const SCAN = 0xda;
/** Largest number of scans; and of pixels, added up over all scans, of which large files may have this many for each byte. */
const [MOST_SCANS, MOST_SCANNED, SCANNED_PER_BYTE] = [20, 2 ** 27, 1000];

export interface JpegSize {
  width: number;
  height: number;
  samples: number;
  bits: number;
}

/** Problem of a JPEG of very many scans. */
export const TOO_MANY_SCANS =
  `a JPEG of more than ${MOST_SCANS} scans, or ${Math.floor(MOST_SCANNED / 1e6)} million pixels in all of them ` +
  `and ${SCANNED_PER_BYTE} for each byte, ` +
  'is not decoded: it would take long';

/** Returns the size in the header of a JPEG; undefined if it has not exactly one. */
export function jpegSize(bytes: Uint8Array): (JpegSize & { hasManyScans: boolean }) | undefined {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const found: JpegSize[] = [];
  let scans = 0;
  // Markers without a length, and bytes of the image between them, are passed over.
  for (let at = 0; at + 9 < bytes.length; ) {
    const marker = bytes[at] === 0xff ? (bytes[at + 1] ?? 0) : 0;
    const isFrame = marker === LS || (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker));
    if (isFrame) {
      const [bits, height, width] = [view.getUint8(at + 4), view.getUint16(at + 5), view.getUint16(at + 7)];
      found.push({ bits, height, width, samples: view.getUint8(at + 9) });
    }
    if (marker === SCAN) scans += 1;
    const hasLength = marker >= 0xc0 && marker < 0xff && !(marker >= 0xd0 && marker <= 0xd9);
    at += hasLength ? 2 + view.getUint16(at + 2) : 1;
  }
  const [size] = found;
  if (!size || found.length !== 1) return undefined;
  const mostScanned = Math.max(MOST_SCANNED, SCANNED_PER_BYTE * bytes.length);
  const hasManyScans = scans > MOST_SCANS || scans * size.width * size.height > mostScanned;
  return { ...size, hasManyScans };
}

/** Number at the start of a frame of Zstandard. */
const MAGIC = 0xfd2fb528;

/** Bytes that a frame may have beyond those that are needed. */
const SURPLUS = 2 ** 20;

/**
 * Returns the first frame of Zstandard, with `size` as the size of its content if it states none; undefined if it is
 * damaged, or states a size that does not fit. The decoder of geotiff 3.0 does not end on damaged frames without a
 * size, and needs frames without surplus bytes.
 */
export function zstandardFrame(bytes: Uint8Array, size: number): Uint8Array<ArrayBuffer> | undefined {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 6 || view.getUint32(0, true) !== MAGIC) return undefined;
  const flags = view.getUint8(4);
  const isSingle = (flags & 32) !== 0;
  const sizeBytes = [isSingle ? 1 : 0, 2, 4, 8][flags >> 6] ?? 0;
  const fixed = 5 + (isSingle ? 0 : 1) + ([0, 1, 2, 4][flags & 3] ?? 0);
  const end = endOfBlocks(view, fixed + sizeBytes, (flags & 4) !== 0);
  if (end === undefined) return undefined;
  if (sizeBytes > 0) {
    const stated = statedSize(view, fixed, sizeBytes) ?? 0;
    return stated >= size && stated <= 4 * size + SURPLUS ? bytes.slice(0, end) : undefined;
  }
  const frame = new Uint8Array(end + 8);
  frame.set(bytes.subarray(0, fixed));
  // A size of 8 bytes.
  frame[4] = flags | 0xc0;
  new DataView(frame.buffer).setBigUint64(fixed, BigInt(size), true);
  frame.set(bytes.subarray(fixed, end), fixed + 8);
  return frame;
}

function statedSize(view: DataView, at: number, length: number): number | undefined {
  if (at + length > view.byteLength) return undefined;
  if (length === 1) return view.getUint8(at);
  if (length === 2) return view.getUint16(at, true) + 256;
  return length === 4 ? view.getUint32(at, true) : Number(view.getBigUint64(at, true));
}

/** Returns where a frame ends whose blocks start at `at`; undefined if they go beyond the bytes. */
function endOfBlocks(view: DataView, at: number, hasSum: boolean): number | undefined {
  let end = at;
  for (let isLast = false; !isLast; ) {
    if (end + 3 > view.byteLength) return undefined;
    const head = view.getUint16(end, true) + (view.getUint8(end + 2) << 16);
    const isRun = ((head >> 1) & 3) === 1;
    end += 3 + (isRun ? 1 : head >> 3);
    isLast = (head & 1) === 1;
  }
  end += hasSum ? 4 : 0;
  return end <= view.byteLength ? end : undefined;
}
