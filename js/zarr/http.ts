// A store behind an address: zarrita's, with errors that state why a request failed.
import type { AsyncReadable } from '@zarrita/storage';
import type { Zarrita } from './error.js';
import { type FileOptions, HttpError } from './requests.js';

/**
 * Returns the store at an address. Its requests fail with an {@link HttpError} for an answer without data, except 404,
 * and when no byte comes for `timeoutMs` milliseconds, or far too few on the whole: a large chunk on a slow line may take
 * longer.
 */
export function httpStore(zarrita: Zarrita, url: URL, timeoutMs: number): AsyncReadable {
  // Ranges that are counted from the end are not asked for: servers of other origins would have to allow each in
  // advance, and those of Azure do not know them.
  const root = new URL(url);
  const within = (mostBytes: number) =>
    new zarrita.FetchStore(url, {
      fetch: (request) => {
        checkWithin(root, request);
        return send(request, timeoutMs, mostBytes);
      },
    });
  return {
    get: (key, options: FileOptions = {}) => within(options.mostBytes ?? Infinity).get(key, options),
    getRange: (key, range, options) =>
      within('length' in range ? range.length : range.suffixLength).getRange(key, range, options),
  };
}

/** Number of bytes that must come within the time limit, on average, so that no answer can drip without end. */
const SLOWEST = 2 ** 16;

/** Number of time limits within which a short body may come however slowly. */
const PATIENCE = 4;

/** Throws unless a request stays below the address of the image: paths in its metadata may be whole addresses. */
function checkWithin(root: URL, { url }: Request): void {
  const { origin, pathname } = new URL(url);
  const folder = root.pathname.endsWith('/') ? root.pathname : `${root.pathname}/`;
  if (origin !== root.origin || !pathname.startsWith(folder))
    throw new HttpError(400, `${url}: outside of the image at ${root.href}`);
}

/** Sends a request, and returns the answer with all of its body, which is at most `mostBytes` long. */
async function send(request: Request, timeoutMs: number, mostBytes: number): Promise<Response> {
  const watch = new StallWatch(request.signal, timeoutMs);
  try {
    // A redirect could lead to any server: it is not followed.
    const response = await fetch(request, { signal: watch.signal, redirect: 'manual' });
    const { status, headers } = response;
    if (response.type === 'opaqueredirect' || (status >= 300 && status < 400))
      throw await redirected(request, response);
    if (status === 200 && request.method === 'HEAD') checkHasLength(headers, request);
    if (hasData(request, status))
      return new Response(await read(request, response, watch, mostBytes), { status, headers });
    await response.body?.cancel();
    if (status === 404) return new Response(null, { status });
    throw refusal(response, request);
  } finally {
    watch.end();
  }
}

async function redirected({ url }: Request, { headers, body }: Response): Promise<HttpError> {
  await body?.cancel();
  // Browsers do not tell.
  const to = headers.get('Location');
  return new HttpError(400, `${url}: redirected${to ? ` to ${to.slice(0, 200)}` : ''}; open that address instead`);
}

const hasData = (request: Request, status: number): boolean =>
  status === 206 || (status === 200 && !request.headers.has('Range'));

function checkHasLength(headers: Headers, { url }: Request): void {
  if (headers.has('Content-Length')) return;
  throw new HttpError(400, `${url}: the server does not tell the length of files, which sharded arrays need`);
}

function refusal({ status, statusText }: Response, { url }: Request): HttpError {
  if (status === 200) return new HttpError(400, `${url}: the server ignores byte ranges, which sharded arrays need`);
  return new HttpError(status, `${url}: ${status} ${statusText}`.trimEnd());
}

async function read({ url }: Request, { body }: Response, watch: StallWatch, mostBytes: number): Promise<Blob> {
  const parts: Uint8Array<ArrayBuffer>[] = [];
  const reader = body?.getReader();
  for (let length = 0; ; ) {
    const part = await reader?.read();
    if (!part?.value) return new Blob(parts);
    length += part.value.length;
    if (length > mostBytes) {
      await reader?.cancel();
      throw new HttpError(400, `${url}: larger than the ${Math.floor(mostBytes)} bytes that were asked for`);
    }
    watch.progress(part.value.length);
    parts.push(part.value);
  }
}

/** A signal that aborts with another one, and when no data come for a while, or on the whole too few. */
class StallWatch {
  readonly #stop = new AbortController();
  readonly #timeoutMs: number;
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** When a body must have ended that sends no more. */
  #end: number;

  constructor(outer: AbortSignal, timeoutMs: number) {
    this.#timeoutMs = timeoutMs;
    this.#end = performance.now() + PATIENCE * timeoutMs;
    const abort = () => this.#stop.abort(outer.reason);
    outer.addEventListener('abort', abort);
    if (outer.aborted) abort();
    this.progress(0);
  }

  get signal(): AbortSignal {
    return this.#stop.signal;
  }

  /** Tells of bytes that have come. */
  progress(bytes: number): void {
    const limit = this.#timeoutMs;
    this.#end += (bytes / SLOWEST) * limit;
    const left = this.#end - performance.now();
    clearTimeout(this.#timer);
    const stalled = () => this.#stop.abort(new Error(`no data for ${limit / 1000} s`));
    const slow = () => this.#stop.abort(new HttpError(400, `slower than ${SLOWEST} bytes in ${limit / 1000} s`));
    this.#timer = left < limit ? setTimeout(slow, left) : setTimeout(stalled, limit);
  }

  end(): void {
    clearTimeout(this.#timer);
  }
}
