import { EngineChannel } from '../../engine/channel';
import type { Requests, WorkerEvent } from './protocol';

/**
 * Starts the Segment lab's web worker, which keeps the surfaces of the label map; called by the lab's client, or earlier
 * by `preloadWorker`.
 */
export const spawnSegment = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle segment' });

/** Connects the page to that worker. */
export const connectSegment = (onEvent: (event: WorkerEvent) => void) =>
  new EngineChannel<Requests, WorkerEvent>(spawnSegment, onEvent);

export type SegmentClient = ReturnType<typeof connectSegment>;
