import { EngineChannel } from '../engine/channel';
import type { Requests } from './protocol';

const spawn = () => new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle edits' });

/** The page's connection to the worker that edits and compares surfaces; all labs have the same. */
export type FinishClient = EngineChannel<Requests, never>;

/** Connects to that worker. */
export const connectFinish = (onFailure: () => void): FinishClient => new EngineChannel(spawn, onFailure);
