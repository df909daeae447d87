import { Channel } from '../../engine/channel';
import type { Requests, WorkerEvent } from './protocol';

/**
 * Starts the Track lab's web worker, which runs the tracker; called by the lab's client, or earlier by `preloadWorker`.
 */
export const spawnTrack = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle track' });

/** The page's client of the Track lab's worker: sends requests to it and receives its replies and events. */
export class TrackClient extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnTrack, onEvent);
  }
}
