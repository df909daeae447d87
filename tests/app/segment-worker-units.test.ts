// The worker of the Segment lab holds no more copies of a large volume than it needs.
import { gzipSync } from 'node:zlib';
import { afterEach, expect, test, vi } from 'vitest';
import { Volume } from '../../pkg/index.js';
import type { Requests, Vec3 } from '../../www/src/labs/segment/protocol';
import { startWorker } from './worker-in-node';

const worker = await startWorker<Requests>(() => import('../../www/src/labs/segment/worker'));
await worker.request('hello', undefined);
afterEach(() => vi.restoreAllMocks());

/** Returns a label map of a side of `n` voxels, with two labels beside each other in a box of `size` voxels. */
function map(n: number, size: number) {
  const data = Buffer.alloc(n ** 3);
  for (let z = 0; z < size; z++)
    for (let y = 0; y < size; y++) {
      const first = ((z + 9) * n + y + 9) * n + 9;
      data.fill(1, first, first + size).fill(2, first + size, first + 2 * size);
    }
  const head = `NRRD0004\ntype: uint8\ndimension: 3\nsizes: ${n} ${n} ${n}\nencoding: gzip\n\n`;
  return { name: 'labels.nrrd', bytes: new Uint8Array(Buffer.concat([Buffer.from(head), gzipSync(data)])) };
}

// Beyond 16 million voxels, the labels are not kept a second time.
test.each([40, 260])('labels of a map of %i³ voxels are counted when they are painted over', async (n) => {
  const slice = vi.spyOn(Volume.prototype, 'slice');
  const opened = await worker.request('open', {
    name: 'labels',
    source: { files: [map(n, 10)] },
    params: {},
    labels: undefined,
  });
  // The page gets the voxels that were read.
  expect(slice).not.toHaveBeenCalled();
  expect(opened.volume.voxels).toHaveLength(n ** 3);
  expect(opened.voxels).toHaveLength(n ** 3);
  expect(opened.surfaces.map(({ value, voxels }) => [value, voxels])).toEqual([
    [1, 1000],
    [2, 1000],
  ]);
  const paint = async (min: Vec3, label: number) => {
    const block = { min, dims: [2, 3, 4] as Vec3, data: new Uint8Array(24).fill(label) };
    const { surfaces } = await worker.request('edit', { map: opened.map, block });
    return Object.fromEntries(surfaces.map(({ value, voxels }) => [value, voxels]));
  };
  expect(await paint([18, 10, 10], 2)).toMatchObject({ 1: 988, 2: 1012 });
  expect(await paint([18, 10, 10], 0)).toMatchObject({ 2: 988 });
  expect(slice.mock.calls.length > 0).toBe(n > 256);
});

test('a label map in a small file has at most 400 labels', async () => {
  const file = (labels: number) => {
    const data = Buffer.alloc(2 * 16 ** 3);
    for (let label = 1; label <= labels; label++) data.writeUInt16LE(label, 2 * label);
    const head = 'NRRD0004\ntype: uint16\ndimension: 3\nsizes: 16 16 16\nendian: little\nencoding: raw\n\n';
    return { name: 'labels.nrrd', bytes: new Uint8Array(Buffer.concat([Buffer.from(head), data])) };
  };
  await worker.request('open', { name: 'image', source: { files: [file(1)] }, params: {}, labels: undefined });
  const opened = await worker.request('openLabels', { files: [file(400)] });
  expect(opened.surfaces).toHaveLength(400);
  await expect(worker.request('openLabels', { files: [file(401)] })).rejects.toThrow(
    '401 labels; from files of at most 128 KiB, the app shows at most 400',
  );
});

test('of two volumes without a telling name, the label map is the one of integers', async () => {
  const file = (name: string, type: string, bytes: Uint8Array) => {
    const head = `NRRD0004\ntype: ${type}\ndimension: 3\nsizes: 16 16 16\nendian: little\nencoding: raw\n\n`;
    return { name, bytes: new Uint8Array(Buffer.concat([Buffer.from(head), bytes])) };
  };
  const integers = file(
    'a.nrrd',
    'uint8',
    Uint8Array.from({ length: 16 ** 3 }, (_, k) => (k * 7919) % 97),
  );
  // Fewer values than the other one.
  const ramp = file(
    'b.nrrd',
    'float',
    new Uint8Array(Float32Array.from({ length: 16 ** 3 }, (_, k) => (k % 16) / 10).buffer),
  );
  for (const files of [
    [integers, ramp],
    [ramp, integers],
  ]) {
    const opened = await worker.request('open', { name: 'both', source: { files }, params: {}, labels: undefined });
    expect(opened.labelFile).toBe('a.nrrd');
  }
});
