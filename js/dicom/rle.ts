// RLE Lossless (PS3.5, annex G): each byte of the voxels is a segment of its own, packed like TIFF's PackBits.

/** Returns the voxels of an image as little-endian integers; throws an `Error` if it is damaged. */
export function decodeRle(bytes: Uint8Array, voxels: number): { bytes: Uint8Array; size: number } {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const size = bytes.length >= 64 ? view.getUint32(0, true) : 0;
  if (![1, 2, 4].includes(size)) throw new Error(`${size} RLE segments; accepted: 1, 2 or 4`);
  const out = new Uint8Array(voxels * size);
  for (let segment = 0; segment < size; segment++) {
    const from = view.getUint32(4 + 4 * segment, true);
    const to = segment + 1 < size ? view.getUint32(8 + 4 * segment, true) : bytes.length;
    // The first segment has the most significant bytes.
    unpack(bytes.subarray(from, Math.max(from, to)), out, size - 1 - segment, size, voxels);
  }
  return { bytes: out, size };
}

function unpack(packed: Uint8Array, out: Uint8Array, offset: number, stride: number, count: number): void {
  let [at, written] = [0, 0];
  const put = (byte: number) => {
    if (written < count) out[offset + stride * written] = byte;
    written += 1;
  };
  while (at < packed.length && written < count) {
    const code = packed[at++] ?? 0;
    if (code < 128) for (let k = 0; k <= code && at < packed.length; k++) put(packed[at++] ?? 0);
    else if (code > 128) {
      const byte = packed[at++] ?? 0;
      for (let k = 0; k < 257 - code; k++) put(byte);
    }
  }
  if (written < count) throw new Error(`an RLE segment ends after ${written} of ${count} bytes`);
}
