import { EngineChannel } from '../../engine/channel';
import type { PoseMessage, Requests, ShownMessage, WorkerEvent } from './protocol';

/**
 * Starts the Sculpt lab's web worker, which runs the model; called by the lab's client, or earlier by `preloadWorker`.
 */
export const spawnSculpt = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle sculpt' });

/** Connects the page to that worker. */
export const connectSculpt = (onEvent: (event: WorkerEvent) => void) =>
  new EngineChannel<Requests, WorkerEvent, PoseMessage | ShownMessage>(spawnSculpt, onEvent);

export type SculptClient = ReturnType<typeof connectSculpt>;
