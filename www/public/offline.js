// A service worker: keeps the page's own files, so that what was opened once opens without a network.
//
// Files with a hash in their name never change and are kept as they are; all others are asked for anew and kept for when
// nobody answers. A new deployment is therefore there at the next visit: its index.html comes from the server and names
// other files. Where the browser refuses to keep anything, every request goes to the server as if this were not here.

const CACHE = 'vesicle';
const HASHED = /\/assets\/[^/]+-[\w-]{8}\.\w+$/;

const scope = self.registration.scope;
const isOwn = (url) => url.startsWith(scope);
const withoutHash = (url) => url.replace(/#.*$/, '');

/** What is kept, or nothing where keeping is refused. */
async function kept(request) {
  try {
    const cache = await caches.open(CACHE);
    // Two addresses of one page differ in what follows its name.
    return await cache.match(request, { ignoreSearch: request.mode === 'navigate', ignoreVary: true });
  } catch {
    return undefined;
  }
}

async function keep(request, response) {
  if (!response.ok || response.status === 206) return;
  try {
    const cache = await caches.open(CACHE);
    await cache.put(request, response);
  } catch {
    // No room, or not allowed: the page works without.
  }
}

/** From the server, and kept; where nobody answers, as it was kept. */
async function fromServer(event) {
  const { request } = event;
  try {
    const response = await fetch(request);
    event.waitUntil(keep(request, response.clone()));
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

/** All hashed files of the deployment that is there now, also those nobody has asked for yet; those of older ones go. */
async function renew() {
  const response = await fetch(new URL('files.json', scope)).catch(() => undefined);
  if (!response?.ok) return;
  const files = (await response.json()).map((name) => new URL(name, scope).href);
  // One after the other: the page that is open needs the network more.
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

/** The page tells what it had loaded before this worker was there. */
self.addEventListener('message', (event) => {
  const urls = event.data.filter(isOwn).map(withoutHash);
  event.waitUntil(Promise.all(urls.map(keepUrl)));
});
