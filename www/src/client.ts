import { Channel } from './channel';
import type { Requests, ReturnMessage, SurfaceBuffers, WorkerEvent } from './protocol';

export { RequestError, toFailure } from './channel';

export const spawnExtract = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle' });

/** The Extract lab's worker, from the page. */
export class Client extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnExtract, onEvent);
  }

  /** Gives a snapshot's buffers back, which also tells the worker that the page is ready for another. */
  giveBack({ positions, normals, indices }: SurfaceBuffers): void {
    const message: ReturnMessage = { kind: 'return', buffers: { positions, normals, indices } };
    this.tell(message, [positions.buffer, normals.buffer, indices.buffer]);
  }
}
