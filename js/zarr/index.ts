/**
 * Reads OME-Zarr images (OME-NGFF 0.4 on Zarr 2, 0.5 on Zarr 3, sharded or not), larger than memory, chunk by chunk.
 *
 * Needs the package `zarrita`, 0.7 or newer, which reads Zarr; for ZIP files also `@zarrita/storage`. Both are imported
 * by {@link openZarr}. Volumes are those of `vesicle`.
 *
 * @module vesicle/zarr
 */
import { checkProperties, integer, invalid } from '../check.js';
import { checkSignal } from '../stepper.js';
import { importZarrita, openLevels } from './open.js';
import { Requests } from './requests.js';
import { openSource } from './source.js';
import type { ZarrSource } from './types.js';
import { ZarrVolume } from './volume.js';

export type { ZarrBox, ZarrLevel, ZarrLoaded, ZarrSource, ZarrStore, ZarrVoxelType } from './types.js';
export { ZarrVolume } from './volume.js';

/** Options of {@link openZarr}. */
export interface ZarrOptions {
  /** Path of the image's group inside the store; default the store itself. */
  path?: string;
  /** Index of the channel to read; default 0. */
  channel?: number;
  /** Index of the time to read; default 0. */
  time?: number;
  /** Aborts the opening, which then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /** Number of bytes of decoded chunks to keep, those used last; default 256 MB. */
  cache?: number;
  /** Largest number of requests at the same time; default 8. */
  concurrency?: number;
  /**
   * Number of times that a request is repeated if the server fails, cannot be reached or does not answer, after pauses
   * of 0.25 s, 0.5 s, 1 s and so on; default 5. Requests that are refused are not repeated.
   */
  retries?: number;
  /**
   * Milliseconds without an answer after which a request has failed; default 30,000. For an address it is the time
   * without any byte, for a store of your own that of the whole answer.
   */
  timeoutMs?: number;
}

const OPTIONS = ['path', 'channel', 'time', 'signal', 'cache', 'concurrency', 'retries', 'timeoutMs'];

/** Default number of bytes of chunks to keep. */
const CACHE_BYTES = 256e6;

/**
 * Opens an OME-Zarr image: reads its metadata, and the coarsest level, if that is not larger than 256 MB.
 *
 * Axes may have any order; z, channel and time may be missing. World coordinates are those of
 * `coordinateTransformations`, in millimetres if the axes have units of length. OME-Zarr does not say how they lie in a
 * body: volumes are RAS by default.
 *
 * @param source - An address, a store, a folder or its files, or a ZIP; see {@link ZarrSource}.
 * @throws `VesicleError` `bad-file`: no image, or metadata that is inconsistent or not supported; `unavailable`: a
 *   request that failed; `invalid-argument` naming the option; `too-large`: chunks or sizes that do not fit into memory.
 *   `signal.reason` when aborted.
 */
export async function openZarr(source: ZarrSource, given?: ZarrOptions): Promise<ZarrVolume> {
  const options = checked(given);
  const { path = '', channel = 0, time = 0, cache = CACHE_BYTES, concurrency = 8, signal } = options;
  signal?.throwIfAborted();
  const zarrita = await importZarrita();
  const { store, limits } = await openSource(zarrita, source, options);
  const requests = new Requests(store, { ...limits, concurrency });
  const image = await openLevels(zarrita, requests, path, { channel, time }, signal);
  const volume = new ZarrVolume({ ...image, cache, concurrency });
  await volume.readCoarsest(signal, () => requests.chunkBytes);
  return volume;
}

function checked(given: ZarrOptions | undefined): ZarrOptions {
  const options = checkProperties<ZarrOptions>('options', given, OPTIONS);
  const { path, channel, time, signal, cache, concurrency, retries, timeoutMs } = options;
  if (path !== undefined && typeof path !== 'string') throw invalid('path', 'must be a string');
  if (channel !== undefined) integer('channel', channel);
  if (time !== undefined) integer('time', time);
  if (cache !== undefined) integer('cache', cache, { max: Number.MAX_SAFE_INTEGER });
  if (concurrency !== undefined) integer('concurrency', concurrency, { min: 1, max: 1024 });
  if (retries !== undefined) integer('retries', retries, { max: 16 });
  if (timeoutMs !== undefined) integer('timeoutMs', timeoutMs, { min: 1, max: 2 ** 31 - 1 });
  checkSignal(signal);
  return options;
}
