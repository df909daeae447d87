import { Channel } from '../engine/channel';
import type { ProgressEvent, Requests } from './protocol';

const spawn = () => new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle files' });

/** The page's connection to the worker that reads formats of other programs. */
export class ImportClient extends Channel<Requests, ProgressEvent> {
  constructor(onProgress: (progress: ProgressEvent) => void) {
    super(spawn, (event) => {
      if (event.event === 'progress') onProgress(event);
    });
  }
}
