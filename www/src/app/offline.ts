/**
 * Delay in seconds between loading the page and caching its files, so that caching does not slow down the first
 * example.
 */
const CACHE_DELAY_SECONDS = 3;

/**
 * Registers the service worker that caches the page's files, so that later visits need no network. Does nothing during
 * development or if the browser has no service workers; errors are ignored.
 */
export function workOffline(): void {
  // During development, files must not come from a cache.
  if (!import.meta.env.PROD || !('serviceWorker' in navigator)) return;
  window.addEventListener('load', () =>
    setTimeout(() => void begin().catch(() => undefined), 1000 * CACHE_DELAY_SECONDS),
  );
}

async function begin(): Promise<void> {
  await navigator.serviceWorker.register('./offline.js', { updateViaCache: 'none' });
  const { active } = await navigator.serviceWorker.ready;
  const post = (urls: string[]) => active?.postMessage(urls);
  post([location.href]);
  const observer = new PerformanceObserver((list) => post(list.getEntries().map(({ name }) => name)));
  observer.observe({ type: 'resource', buffered: true });
}
