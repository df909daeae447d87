import { Channel } from '../channel';
import type { Requests, WorkerEvent } from './protocol';

export const spawnTrack = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle track' });

/** The Track lab's worker, from the page. */
export class TrackClient extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnTrack, onEvent);
  }
}
