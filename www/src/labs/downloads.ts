/** Files that come with the page. */
const early = new Map<string, Promise<Uint8Array>>();

/** Begins with a file that will be wanted as soon as the engine has started. */
export function fetchAhead(url: string): void {
  const bytes = download(url);
  // Whoever wants it hears of it.
  bytes.catch(() => undefined);
  early.set(url, bytes);
}

/** The bytes of a file, which are the caller's to give away. */
export function fetchBytes(url: string): Promise<Uint8Array> {
  const bytes = early.get(url) ?? download(url);
  early.delete(url);
  return bytes;
}

async function download(url: string): Promise<Uint8Array> {
  return new Uint8Array(await (await fetched(url)).arrayBuffer());
}

/** A file that comes with the page, from the server or as it was kept. */
export async function fetched(url: string): Promise<Response> {
  const response = await fetch(url).catch(() => undefined);
  if (!response)
    throw new Error(`The network does not answer, and ${url} has not been opened here before. Try again when it does.`);
  if (!response.ok) throw new Error(`The server answered ${response.status} for ${url}.`);
  return response;
}
