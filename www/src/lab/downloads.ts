import { text } from '../texts';

/** Downloads started by {@link preload} and not yet used, by address. */
const early = new Map<string, Promise<Uint8Array>>();

/** Returns the address of a data file served with the page; `file` is its path in the folder `data`. */
export function dataUrl(file: string): string {
  return new URL(`data/${file}`, document.baseURI).href;
}

/** Starts to download a file that will be needed as soon as the engine has loaded; {@link fetchBytes} returns it. */
export function preload(url: string): void {
  const bytes = download(url);
  // `fetchBytes` reports the error.
  bytes.catch(() => undefined);
  early.set(url, bytes);
}

/**
 * Returns the content of the file at an address, downloaded by {@link preload} or now. The caller owns the bytes and
 * may transfer them to a worker.
 */
export function fetchBytes(url: string): Promise<Uint8Array> {
  const bytes = early.get(url) ?? download(url);
  early.delete(url);
  return bytes;
}

async function download(url: string): Promise<Uint8Array> {
  return new Uint8Array(await (await fetched(url)).arrayBuffer());
}

/**
 * Fetches a file that is served with the page, over the network or from the offline cache. Throws if neither has it.
 */
export async function fetched(url: string): Promise<Response> {
  const response = await fetch(url).catch(() => undefined);
  if (!response) throw new Error(text('labs.offline', { url }));
  if (!response.ok) throw new Error(text('labs.serverAnswered', { status: response.status, url }));
  return response;
}
