import { EngineChannel } from '../../engine/channel';
import type { Requests, ShownMessage, WorkerEvent } from './protocol';

/**
 * Starts the Reconstruct lab's web worker, which runs the model; called by the lab's client, or earlier by
 * `preloadWorker`.
 */
export const spawnReconstruct = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle reconstruct' });

/** Connects the page to that worker. */
export const connectReconstruct = (onEvent: (event: WorkerEvent) => void) =>
  new EngineChannel<Requests, WorkerEvent, ShownMessage>(spawnReconstruct, onEvent);

export type ReconstructClient = ReturnType<typeof connectReconstruct>;
