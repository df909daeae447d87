import { Channel } from '../../engine/channel';
import type { Requests, WorkerEvent } from './protocol';

/**
 * Starts the Segment lab's web worker, which keeps the surfaces of the label map; called by the lab's client, or earlier
 * by `preloadWorker`.
 */
export const spawnSegment = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle segment' });

/** The page's client of the Segment lab's worker: sends requests to it and receives its replies and events. */
export class SegmentClient extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnSegment, onEvent);
  }
}
