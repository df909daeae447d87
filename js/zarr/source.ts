// Stores of all that an image can be read from.
import type { Readable } from '@zarrita/storage';
import { invalid } from '../check.js';
import type { Zarrita } from './error.js';
import { entryStore, filesStore, handleStore, zipStore } from './folder.js';
import { httpStore } from './http.js';
import type { RequestOptions } from './requests.js';
import type { ZarrSource, ZarrStore } from './types.js';

/** A store, and the limits of requests to it. */
export interface Source {
  store: Readable;
  limits: Omit<RequestOptions, 'concurrency'>;
}

/** Returns the store of a source; `limits` are those that the caller asks for. */
export async function openSource(
  zarrita: Zarrita,
  source: ZarrSource,
  { retries = 5, timeoutMs = 30_000 }: Partial<Source['limits']>,
): Promise<Source> {
  // Its requests have a time limit of their own.
  const http = (url: URL) => ({ store: httpStore(zarrita, url, timeoutMs), limits: { retries, timeoutMs: Infinity } });
  if (typeof source === 'string') return http(address(source));
  if (source instanceof URL) return http(source);
  const local = await localStore(source);
  // Another attempt to read a file fails like the first.
  if (local) return { store: local, limits: { retries: 0, timeoutMs: Infinity } };
  if (typeof (Object(source) as ZarrStore).get !== 'function') throw unknownSource();
  return { store: source as Readable, limits: { retries, timeoutMs } };
}

function address(text: string): URL {
  try {
    return new URL(text, globalThis.document?.baseURI);
  } catch {
    throw invalid('source', `must be an address if it is a string, got '${text}'; for a path in Node pass a store`);
  }
}

async function localStore(source: Exclude<ZarrSource, string | URL>): Promise<Readable | undefined> {
  if (source instanceof Blob) return zipStore(source);
  const parts = Object(source) as Record<string, unknown>;
  if (typeof parts.getFileHandle === 'function') return handleStore(source as FileSystemDirectoryHandle);
  if (parts.isDirectory === true) return entryStore(source as FileSystemDirectoryEntry);
  const isList = typeof source === 'object' && typeof parts.length === 'number';
  return isList ? filesStore(source as ArrayLike<File>) : undefined;
}

function unknownSource(): Error {
  return invalid('source', 'must be an address, a store with get(), a folder, its files, or a ZIP as a Blob');
}
