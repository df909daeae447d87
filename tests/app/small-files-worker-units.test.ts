// The workers' side of the bounds of small files, and how a run that fails is reported.
import { afterEach, expect, test, vi } from 'vitest';
import { DeformableModel, VesicleError } from '../../pkg/index.js';
import type { Requests, Setup, VolumeSource, WorkerEvent } from '../../www/src/protocol';
import { startWorker } from './worker-in-node';

const events: WorkerEvent[] = [];
const worker = await startWorker<Requests>(
  () => import('../../www/src/worker'),
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
