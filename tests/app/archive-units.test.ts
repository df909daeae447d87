/** Archives as they are not made by any program that packs files. */
import { strToU8, zipSync } from 'three/addons/libs/fflate.module.js';
import { expect, test } from 'vitest';
import { ArchiveTooLarge, MOST_FILES, unpack } from '../../www/src/kit/archive';

const MOST = 1e9;
const unpacked = (archive: Uint8Array, most = MOST) => unpack(archive, most, 'too large');

/** Returns an archive whose directory lists its one file `count` times. */
function shared(count: number, content: Uint8Array): Uint8Array {
  const archive = zipSync({ 'a0000.bin': content });
  const view = new DataView(archive.buffer, archive.byteOffset);
  const end = archive.length - 22;
  const start = view.getUint32(end + 16, true);
  const entry = archive.subarray(start, end);
  const copies = Array.from({ length: count }, (_, k) => {
    const copy = entry.slice();
    copy.set(strToU8(`a${String(k).padStart(4, '0')}`), 46);
    return copy;
  });
  const tail = archive.slice(end);
  const fields = new DataView(tail.buffer);
  for (const at of [8, 10]) fields.setUint16(at, count, true);
  fields.setUint32(12, count * entry.length, true);
  return Uint8Array.from([...archive.subarray(0, start), ...copies.flatMap((copy) => [...copy]), ...tail]);
}

test('one whose files share their bytes is refused before any is unpacked', () => {
  const archive = shared(900, new Uint8Array(1_000_000));
  expect(archive.length).toBeLessThan(1e5);
  expect(() => unpacked(archive)).toThrow('share bytes');
  expect(Object.keys(unpacked(shared(1, new Uint8Array(1_000_000))))).toEqual(['a0000.bin']);
});

test('more files or bytes than it may have', () => {
  const files = Object.fromEntries(Array.from({ length: MOST_FILES + 1 }, (_, k) => [`${k}`, new Uint8Array(1)]));
  expect(() => unpacked(zipSync(files))).toThrow(ArchiveTooLarge);
  expect(() => unpacked(zipSync({ a: new Uint8Array(2e6) }), 1e6)).toThrow(ArchiveTooLarge);
});
