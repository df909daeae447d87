// Sessions are packed in slices, between which the page answers.
import { unzipSync } from 'three/addons/libs/fflate.module.js';
import { expect, test, vi } from 'vitest';
import { writeSession } from '../../www/src/lab/session/file';
import { zipped } from '../../www/src/lab/session/zip';

const file = (name: string, length: number, compressed: boolean) => {
  return { name, bytes: Uint8Array.from({ length }, (_, i) => i >> 4), compressed };
};

test('files are packed a MiB at a time, compressed or not, and unpacked again', async () => {
  const files = [file('a', 2 ** 21 + 5, true), file('b', 2 ** 21, false), file('c', 0, true), file('d', 7, false)];
  let pauses = 0;
  const archive = await zipped(files, async () => {
    pauses += 1;
  });
  expect(pauses).toBe(3 + 2 + 1 + 1);
  const unpacked = unzipSync(archive);
  expect(Object.keys(unpacked)).toEqual(['a', 'b', 'c', 'd']);
  for (const { name, bytes } of files) expect(Buffer.compare(unpacked[name] ?? Buffer.of(1), bytes)).toBe(0);
  expect(archive.length).toBeLessThan(2 ** 22);
});

test('sessions are packed so', async () => {
  const pauses = vi.spyOn(globalThis, 'MessageChannel');
  const { bytes } = file('voxels', 2 ** 22, true);
  const source = { name: 'a.nii', files: [] };
  const session = await writeSession({ lab: 'segment', hash: '#segment', source, content: { voxels: bytes } });
  expect(unzipSync(session)).toHaveProperty(['voxels.bin', 'length'], bytes.length);
  expect(pauses.mock.calls.length).toBeGreaterThanOrEqual(4);
});
