import { EngineChannel } from '../../engine/channel';
import type { Requests, WorkerEvent } from './protocol';

/**
 * Starts the Track lab's web worker, which runs the tracker; called by the lab's client, or earlier by `preloadWorker`.
 */
export const spawnTrack = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle track' });

/** Connects the page to that worker. */
export const connectTrack = (onEvent: (event: WorkerEvent) => void) =>
  new EngineChannel<Requests, WorkerEvent>(spawnTrack, onEvent);

export type TrackClient = ReturnType<typeof connectTrack>;
