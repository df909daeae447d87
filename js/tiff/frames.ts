// What compressed blocks say of their size.

/** Returns the size in the header of a JPEG; undefined if it has not exactly one. */
export function jpegSize(
  bytes: Uint8Array,
): { width: number; height: number; samples: number; bits: number } | undefined {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const found: { width: number; height: number; samples: number; bits: number }[] = [];
  // Markers without a length, and bytes of the image between them, are passed over.
  for (let at = 0; at + 9 < bytes.length; ) {
    const marker = bytes[at] === 0xff ? (bytes[at + 1] ?? 0) : 0;
    const isFrame = marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker);
    if (isFrame) {
      const [bits, height, width] = [view.getUint8(at + 4), view.getUint16(at + 5), view.getUint16(at + 7)];
      found.push({ bits, height, width, samples: view.getUint8(at + 9) });
    }
    const hasLength = marker >= 0xc0 && marker < 0xff && !(marker >= 0xd0 && marker <= 0xd9);
    at += hasLength ? 2 + view.getUint16(at + 2) : 1;
  }
  return found.length === 1 ? found[0] : undefined;
}

/** Largest number of bytes that a compressed block of Zstandard stands for. */
const ZSTANDARD_BLOCK = 2 ** 17;

/** Returns the most bytes that frames of Zstandard can decode to; Infinity if they are damaged. */
export function zstandardBound(bytes: Uint8Array): number {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let bound = 0;
  for (let at = 0; at < bytes.length; ) {
    // Surplus bytes after a frame.
    if (at + 5 > bytes.length || view.getUint32(at, true) !== 0xfd2fb528) return at > 0 ? bound : Infinity;
    const flags = view.getUint8(at + 4);
    const isSingle = (flags & 32) !== 0;
    const sizeBytes = [isSingle ? 1 : 0, 2, 4, 8][flags >> 6] ?? 0;
    at += 5 + (isSingle ? 0 : 1) + ([0, 1, 2, 4][flags & 3] ?? 0) + sizeBytes;
    for (let last = false; !last; ) {
      if (at + 3 > bytes.length) return Infinity;
      const head = view.getUint16(at, true) + (view.getUint8(at + 2) << 16);
      const [kind, size] = [(head >> 1) & 3, head >> 3];
      bound += kind === 2 ? ZSTANDARD_BLOCK : size;
      at += 3 + (kind === 1 ? 1 : size);
      last = (head & 1) === 1;
    }
    if ((flags & 4) !== 0) at += 4;
  }
  return bound;
}
