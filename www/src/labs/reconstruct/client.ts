import { Channel } from '../../engine/channel';
import type { Requests, ShownMessage, WorkerEvent } from './protocol';

/**
 * Starts the Reconstruct lab's web worker, which runs the model; called by the lab's client, or earlier by
 * `preloadWorker`.
 */
export const spawnReconstruct = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle reconstruct' });

/** The page's client of the Reconstruct lab's worker: sends requests to it and receives its replies and events. */
export class ReconstructClient extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnReconstruct, onEvent);
  }

  /** Tells the worker that the surface it sent last is on the screen, so that it may send another preview. */
  acknowledge(): void {
    const message: ShownMessage = { kind: 'shown' };
    this.post(message);
  }
}
