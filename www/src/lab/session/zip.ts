/** Packs files as a ZIP in slices, between which the page answers: a label map may have a hundred million voxels. */
import { Zip, ZipDeflate, ZipPassThrough } from 'three/addons/libs/fflate.module.js';

/** Bytes that are packed at a time; a slice takes some hundredths of a second at most. */
const SLICE = 2 ** 20;

/** A file to be packed, compressed or not. */
export interface ToPack {
  name: string;
  bytes: Uint8Array;
  compressed: boolean;
}

/** Returns files as a ZIP; `pause` is called after each slice. */
export async function zipped(files: Iterable<ToPack>, pause = nextTask): Promise<Uint8Array> {
  const packed: Uint8Array[] = [];
  const zip = new Zip((error, bytes) => {
    if (error) throw error;
    packed.push(bytes);
  });
  for (const { name, bytes, compressed } of files) {
    const file = compressed ? new ZipDeflate(name, { level: 1 }) : new ZipPassThrough(name);
    zip.add(file);
    let at = 0;
    do {
      const slice = bytes.subarray(at, at + SLICE);
      at += SLICE;
      file.push(slice, at >= bytes.length);
      await pause();
    } while (at < bytes.length);
  }
  zip.end();
  return joined(packed);
}

/** Resolves in a later task, without the delay that timers have in pages that are not visible. */
function nextTask(): Promise<void> {
  const { port1, port2 } = new MessageChannel();
  return new Promise((resolve) => {
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(undefined);
  });
}

function joined(parts: readonly Uint8Array[]): Uint8Array {
  const out = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}
