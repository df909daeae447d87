/** Seconds that the example has the machine for itself. */
const PATIENCE = 3;

/** Lets the page open without a network from the second time on; where the browser has no such thing, or refuses, nothing is lost. */
export function workOffline(): void {
  // While developing, files have to be those of the moment.
  if (!import.meta.env.PROD || !('serviceWorker' in navigator)) return;
  window.addEventListener('load', () => setTimeout(() => void begin().catch(() => undefined), 1000 * PATIENCE));
}

async function begin(): Promise<void> {
  await navigator.serviceWorker.register('./offline.js', { updateViaCache: 'none' });
  const { active } = await navigator.serviceWorker.ready;
  const tell = (urls: string[]) => active?.postMessage(urls);
  tell([location.href]);
  const observer = new PerformanceObserver((list) => tell(list.getEntries().map(({ name }) => name)));
  observer.observe({ type: 'resource', buffered: true });
}
