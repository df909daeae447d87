import { Channel } from '../../engine/channel';
import type { SurfaceBuffers } from '../../engine/protocol';
import type { Requests, ReturnMessage, WorkerEvent } from './protocol';

export { RequestError, toFailure } from '../../engine/channel';

/** Starts the Extract lab's worker. */
export const spawnExtract = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle' });

/** The page's connection to the Extract lab's worker. */
export class Client extends Channel<Requests, WorkerEvent> {
  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnExtract, onEvent);
  }

  /**
   * Returns to the worker, for reuse, the arrays of a surface that is no longer drawn, which also tells it that the
   * page is ready for the next surface.
   */
  returnBuffers({ positions, normals, indices }: SurfaceBuffers): void {
    const message: ReturnMessage = { kind: 'return', buffers: { positions, normals, indices } };
    this.post(message, [positions.buffer, normals.buffer, indices.buffer]);
  }
}
