import { Channel } from '../channel';
import type { Requests, ShownMessage, WorkerEvent } from './protocol';

export const spawnReconstruct = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle reconstruct' });

/** The Reconstruct lab's worker, from the page. */
export class ReconstructClient extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnReconstruct, onEvent);
  }

  /** The surface last sent is on the screen: another may come. */
  shown(): void {
    const message: ShownMessage = { kind: 'shown' };
    this.tell(message);
  }
}
