import { EngineChannel } from '../../engine/channel';
import type { Requests, ReturnMessage, WorkerEvent } from './protocol';

/** Starts the Extract lab's worker. */
export const spawnExtract = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle' });

/** Connects the page to that worker. */
export const connectExtract = (onEvent: (event: WorkerEvent) => void) =>
  new EngineChannel<Requests, WorkerEvent, ReturnMessage>(spawnExtract, onEvent);

export type ExtractClient = ReturnType<typeof connectExtract>;
