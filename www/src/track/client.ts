import { Channel } from '../channel';
import type { Requests, WorkerEvent } from './protocol';

/** The Track lab's worker, from the page. */
export class TrackClient extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    const spawn = () => new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle track' });
    super(spawn, onEvent);
  }
}
