import { EngineChannel } from '../engine/channel';
import type { ProgressEvent, Requests } from './protocol';

const spawn = () => new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle files' });

/** Connects the page to the worker that reads formats of other programs. */
export const connectImport = (onProgress: (progress: ProgressEvent) => void): EngineChannel<Requests, ProgressEvent> =>
  new EngineChannel(spawn, (event) => {
    if (event.event === 'progress') onProgress(event);
  });
