// The worker of the Extract lab sends no more voxels than the page needs, and says how a run has failed.
import { afterEach, expect, test, vi } from 'vitest';
import { DeformableModel, VesicleError, Volume } from '../../pkg/index.js';
import type { VolumeSource } from '../../www/src/engine/protocol';
import { levelsOf } from '../../www/src/engine/volumes';
import type { Requests, Setup, WorkerEvent } from '../../www/src/labs/extract/protocol';
import { paintSlice } from '../../www/src/scene/slicing';
import { ball } from './volumes';
import { startWorker } from './worker-in-node';

const events: WorkerEvent[] = [];
const worker = await startWorker<Requests>(
  () => import('../../www/src/labs/extract/worker'),
  (event) => events.push(event as WorkerEvent),
);
await worker.request('hello', undefined);

const SETUP: Setup = { start: { kind: 'contour' }, levels: 1, edge: undefined, params: {}, attractors: [] };
const rings: VolumeSource = { shape: 'linked rings' };

afterEach(() => vi.restoreAllMocks());

test('a run that fails has stopped before it is said, and its surface is checked last', async () => {
  await worker.request('load', { name: 'linked rings', source: rings, setup: SETUP, frame: 0 });
  vi.spyOn(DeformableModel.prototype, 'run').mockRejectedValue(new VesicleError('too-large', 'many vertices'));
  events.length = 0;
  await worker.request('play', undefined);
  await vi.waitFor(() => expect(events.some(({ event }) => event === 'failure')).toBe(true));
  const told = events.map((one) => (one.event === 'state' ? one.state : one.event));
  expect(told).toEqual(['running', 'snapshot', 'paused', 'failure', 'snapshot']);
  expect(events.at(-1)).toMatchObject({ measures: { report: {} } });
});

test('voxels that the page shows already are not sent again', async () => {
  const load = (isShown: boolean) =>
    worker.request('load', { name: 'linked rings', source: rings, setup: SETUP, frame: 0, isShown });
  const [first, again] = [await load(false), await load(true)];
  expect(first.volume.voxels.length).toBeGreaterThan(0);
  expect(again).toMatchObject({ volume: { dims: first.volume.dims, window: first.volume.window } });
  expect(again.volume.voxels).toHaveLength(0);
});

test('coarser levels of whole numbers come in two bytes a voxel, and look the same', () => {
  const volume = new Volume({ data: ball().map((value) => 3 * value), dims: [32, 32, 32] });
  const [, level] = volume.pyramid(2);
  const [view] = levelsOf(volume, 1, [0, 3]);
  if (!level || !view) throw new Error('no level');
  const { dims } = level;
  const exact = { dims, voxels: level.intensities(), window: view.window };
  const side = { axis: 2, name: 'Axial', horizontal: { axis: 0, flip: false }, vertical: { axis: 1, flip: true } };
  const [greys, expected] = [view, exact].map((one) => {
    const pixels = new Uint8ClampedArray(4 * dims[0] * dims[1]);
    paintSlice(one, side as Parameters<typeof paintSlice>[1], dims[2] >> 1, pixels);
    return pixels;
  });
  expect(view.voxels).toBeInstanceOf(Uint16Array);
  expect(Math.max(...Array.from(greys ?? [], (grey, i) => Math.abs(grey - (expected?.[i] ?? 0))))).toBeLessThanOrEqual(
    1,
  );
  expect(new Set(greys).size).toBeGreaterThan(4);
});
