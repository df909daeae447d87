// A store behind an address: zarrita's, with errors that state why a request failed.
import type { AsyncReadable } from '@zarrita/storage';
import type { Zarrita } from './error.js';
import { HttpError } from './requests.js';

/**
 * Returns the store at an address. Its requests fail with an {@link HttpError} for an answer without data, except 404,
 * and when no byte comes for `timeoutMs` milliseconds: a large chunk on a slow line may take longer.
 */
export function httpStore(zarrita: Zarrita, url: URL, timeoutMs: number): AsyncReadable {
  // Ranges that are counted from the end are not asked for: servers of other origins would have to allow each in
  // advance, and those of Azure do not know them.
  const root = new URL(url);
  return new zarrita.FetchStore(url, {
    fetch: (request) => {
      checkWithin(root, request);
      return send(request, timeoutMs);
    },
  });
}

/** Throws unless a request stays below the address of the image: paths in its metadata may be whole addresses. */
function checkWithin(root: URL, { url }: Request): void {
  const { origin, pathname } = new URL(url);
  const folder = root.pathname.endsWith('/') ? root.pathname : `${root.pathname}/`;
  if (origin !== root.origin || !pathname.startsWith(folder))
    throw new HttpError(400, `${url}: outside of the image at ${root.href}`);
}

/** Sends a request, and returns the answer with all of its body. */
async function send(request: Request, timeoutMs: number): Promise<Response> {
  const watch = new StallWatch(request.signal, timeoutMs);
  try {
    const response = await fetch(request, { signal: watch.signal });
    const { status, headers } = response;
    if (new URL(response.url || request.url).origin !== new URL(request.url).origin) {
      await response.body?.cancel();
      throw new HttpError(
        400,
        `${request.url}: redirected to ${new URL(response.url).origin}; open that address instead`,
      );
    }
    if (status === 200 && request.method === 'HEAD') checkLength(headers, request);
    if (hasData(request, status)) return new Response(await read(response, watch), { status, headers });
    await response.body?.cancel();
    if (status === 404) return new Response(null, { status });
    throw refusal(response, request);
  } finally {
    watch.end();
  }
}

const hasData = (request: Request, status: number): boolean =>
  status === 206 || (status === 200 && !request.headers.has('Range'));

function checkLength(headers: Headers, { url }: Request): void {
  if (headers.has('Content-Length')) return;
  throw new HttpError(400, `${url}: the server does not tell the length of files, which sharded arrays need`);
}

function refusal({ status, statusText }: Response, { url }: Request): HttpError {
  if (status === 200) return new HttpError(400, `${url}: the server ignores byte ranges, which sharded arrays need`);
  return new HttpError(status, `${url}: ${status} ${statusText}`.trimEnd());
}

async function read(response: Response, watch: StallWatch): Promise<Blob> {
  const parts: Uint8Array<ArrayBuffer>[] = [];
  const reader = response.body?.getReader();
  for (;;) {
    const part = await reader?.read();
    if (!part?.value) return new Blob(parts);
    watch.progress();
    parts.push(part.value);
  }
}

/** A signal that aborts with another one, and when nothing has happened for a while. */
class StallWatch {
  readonly #stop = new AbortController();
  readonly #timeoutMs: number;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(outer: AbortSignal, timeoutMs: number) {
    this.#timeoutMs = timeoutMs;
    const abort = () => this.#stop.abort(outer.reason);
    outer.addEventListener('abort', abort);
    if (outer.aborted) abort();
    this.progress();
  }

  get signal(): AbortSignal {
    return this.#stop.signal;
  }

  progress(): void {
    clearTimeout(this.#timer);
    const stalled = () => this.#stop.abort(new Error(`no data for ${this.#timeoutMs / 1000} s`));
    this.#timer = setTimeout(stalled, this.#timeoutMs);
  }

  end(): void {
    clearTimeout(this.#timer);
  }
}
