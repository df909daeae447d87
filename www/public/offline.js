// Service worker that caches the page's own files, so that pages and data that were opened once open without a network.
//
// Files with a hash in their name never change and are served from the cache; all others are requested from the server,
// and from the cache if it does not respond. So a new deployment is loaded at the next visit: its index.html comes from
// the server and refers to other files. If the browser refuses to store anything, every request goes to the server.

const CACHE = 'vesicle';
const HASHED = /\/assets\/[^/]+-[\w-]{8}\.\w+$/;

const scope = self.registration.scope;
// Images that are larger than memory must not fill the storage chunk by chunk: only the page's own files are kept.
const KEPT = /^(?:(?:assets|data|dicom|docs|embed|lessons)\/.*|[^/]*)$/;
const isOwn = (url) => url.startsWith(scope) && KEPT.test(url.slice(scope.length).replace(/[?#].*$/, ''));
const withoutHash = (url) => url.replace(/#.*$/, '');

/** Returns the cached response, or undefined if there is none or the cache is not available. */
async function kept(request) {
  try {
    const cache = await caches.open(CACHE);
    // Addresses of one page differ in their query.
    return await cache.match(request, { ignoreSearch: request.mode === 'navigate', ignoreVary: true });
  } catch {
    return undefined;
  }
}

async function keep(url, response) {
  if (!response.ok || response.status === 206) return;
  try {
    const cache = await caches.open(CACHE);
    await cache.put(url, response);
  } catch {
    // The storage is full or not permitted: the page works without it.
  }
}

/** Returns the server's response and caches it; returns the cached one if the server does not respond. */
async function fromServer(event) {
  const { request } = event;
  try {
    const response = await fetch(request);
    event.waitUntil(keep(withoutHash(request.url), response.clone()));
    return response;
  } catch (error) {
    const old = await kept(request);
    if (old) return old;
    throw error;
  }
}

async function answer(event) {
  const found = HASHED.test(new URL(event.request.url).pathname) ? await kept(event.request) : undefined;
  return found ?? fromServer(event);
}

async function keepUrl(url) {
  if (await kept(new Request(url))) return;
  const response = await fetch(url).catch(() => undefined);
  if (response) await keep(url, response);
}

/** Caches all hashed files of the current deployment, also those not requested yet; deletes those of older ones. */
async function renew() {
  const response = await fetch(new URL('files.json', scope)).catch(() => undefined);
  if (!response?.ok) return;
  const files = (await response.json()).map((name) => new URL(name, scope).href);
  // One after the other: the requests of the open page take precedence.
  for (const url of files) await keepUrl(url);
  const cache = await caches.open(CACHE);
  for (const { url } of await cache.keys()) if (HASHED.test(url) && !files.includes(url)) await cache.delete(url);
}

const renewQuietly = () => renew().catch(() => undefined);

self.addEventListener('install', () => self.skipWaiting());

self.addEventListener('activate', (event) => {
  event.waitUntil(Promise.all([self.clients.claim(), renewQuietly()]));
});

self.addEventListener('fetch', (event) => {
  const { method, url, mode } = event.request;
  if (method !== 'GET' || !isOwn(url)) return;
  event.respondWith(answer(event));
  if (mode === 'navigate') event.waitUntil(renewQuietly());
});

/** Caches the files that the page had loaded before this worker was active; the page sends their addresses. */
self.addEventListener('message', (event) => {
  const urls = event.data.filter(isOwn).map(withoutHash);
  event.waitUntil(Promise.all(urls.map(keepUrl)));
});
