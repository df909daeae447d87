/** How the page loads code and receives surfaces: nothing too early, nothing twice. */
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import { watchPage, watchWorker } from '../../bench/watch.mjs';
import { type App, iteration, openApp, reach } from './browser';
import { LONG } from './long';

let app: App;
/** Names of the scripts that were fetched since the page was opened. */
let scripts: string[] = [];

beforeAll(async () => {
  app = await openApp();
  await app.page.addInitScript(watchPage);
  app.page.on('worker', (worker) => void worker.evaluate(watchWorker).catch(() => undefined));
  app.page.on('request', (request) => {
    if (/\.(js|css)$/.test(request.url())) scripts.push(request.url().split('/').at(-1) ?? '');
  });
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

async function openAt(hash: string): Promise<void> {
  await app.page.goto('about:blank');
  scripts = [];
  await app.page.goto(app.address + hash);
}

interface Watched {
  drawn: number;
  frames: number;
  gpu: number;
  copied: number;
  largestCopy: number;
  uploads: { made: number; refilled: number };
}

const watched = () => app.page.evaluate(() => (window as unknown as { watched: Watched }).watched);

test('the code of a lab is fetched when the lab is opened', async () => {
  await openAt('#extract?example=linked-rings');
  await reach(app.page, 'running', 'done');
  expect(scripts.filter((name) => /^extract-(?!worker-)/.test(name))).toHaveLength(1);
  expect(scripts.filter((name) => /^(reconstruct|track|sculpt)-/.test(name))).toEqual([]);
  expect(scripts.filter((name) => /worker-/.test(name))).toEqual([expect.stringMatching(/^extract-worker-/)]);
  await app.page.click('[data-lab=sculpt]');
  await app.page.waitForSelector('.ellipsoids');
  expect(scripts.filter((name) => /^sculpt-/.test(name))).toHaveLength(1);
  expect(scripts.filter((name) => /^(reconstruct|track)-/.test(name))).toEqual([]);
});

test('when several labs are requested in quick succession, only the last one opens', LONG, async () => {
  await openAt('#extract?example=linked-rings');
  await app.page.evaluate(() => {
    for (const lab of ['track', 'sculpt', 'reconstruct', 'extract', 'sculpt'])
      document.querySelector<HTMLElement>(`[data-lab=${lab}]`)?.click();
  });
  await app.page.waitForSelector('.ellipsoids');
  await reach(app.page, 'running', 'done', 'paused');
  await expect.poll(() => app.page.workers().length).toBe(1);
  expect(await app.page.textContent('#lab-name')).toBe('Sculpt');
});

test('surfaces are transferred by the worker and uploaded unchanged, into the same buffers', async () => {
  // From the enclosing start the run is long enough to be paused.
  await openAt('#extract?start=enclosing&v=2');
  await reach(app.page, 'running');
  await expect.poll(() => iteration(app.page)).toBeGreaterThan(10);
  await app.page.locator('.scene > canvas').press(' ');
  await reach(app.page, 'paused');
  for (let step = 0; step < 6; step++) {
    const { frames } = await watched();
    await app.page.locator('.scene > canvas').press('s');
    await expect.poll(async () => (await watched()).frames).toBeGreaterThan(frames);
  }
  const sent = await app.page.workers()[0]?.evaluate(() => (self as unknown as { watched: object }).watched);
  expect(sent).toMatchObject({ cloned: 0 });
  const { largestCopy, uploads } = await watched();
  // Outlines in the slices have some 50 kB, positions more than 1 MB.
  expect(largestCopy).toBeLessThan(200_000);
  // Positions, normals and indices of nearly every step.
  expect(uploads.refilled).toBeGreaterThanOrEqual(9);
});

test('frames of the Sculpt lab are transferred, too', async () => {
  await openAt('#sculpt?example=lava');
  await reach(app.page, 'running', 'done');
  await expect.poll(async () => (await watched()).frames).toBeGreaterThan(5);
  const sent = await app.page.workers()[0]?.evaluate(() => (self as unknown as { watched: object }).watched);
  expect(sent).toMatchObject({ cloned: 0 });
  expect((await watched()).copied).toBe(0);
});

test('the page keeps the displayed surface and returns the previous one', LONG, async () => {
  await openAt('#extract?example=linked-rings');
  await reach(app.page, 'done');
  // Colours are computed from the displayed arrays.
  await app.page.selectOption('.view-options select', 'component');
  await app.page.getByLabel('Wireframe').check();
  await app.page.locator('.scene > canvas').press('ArrowLeft');
  await expect.poll(async () => (await watched()).drawn).toBeGreaterThan(1000);
});

test(
  'with software rendering a large surface is rotated with fewer triangles, and shown at rest with all of them',
  LONG,
  async () => {
    await openAt('#extract');
    await reach(app.page, 'done');
    const all = Number((await app.page.textContent('[data-measure=triangles]'))?.replace(/\D/g, ''));
    expect(all).toBeGreaterThan(50_000);
    await expect.poll(async () => (await watched()).drawn).toBe(all);
    const { gpu } = await watched();
    const box = await app.page.locator('.scene > canvas').boundingBox();
    const [x, y] = [(box?.x ?? 0) + 90, (box?.y ?? 0) + (box?.height ?? 0) - 60];
    await app.page.mouse.move(x, y);
    await app.page.mouse.down();
    await app.page.mouse.move(x + 40, y);
    await expect.poll(async () => (await watched()).drawn).toBeLessThan(20_000);
    expect((await watched()).drawn).toBeGreaterThan(4000);
    await app.page.mouse.up();
    await expect.poll(async () => (await watched()).drawn).toBe(all);
    // The temporary buffers have been freed.
    expect((await watched()).gpu).toBe(gpu);
  },
);

test('slices are rendered by the processor, and the view keeps its size when a run begins', async () => {
  await openAt('#extract?example=linked-rings');
  await reach(app.page, 'done');
  const byProcessor = await app.page
    .locator('.slice canvas')
    .evaluateAll((all) =>
      all.map((canvas) => (canvas as HTMLCanvasElement).getContext('2d')?.getContextAttributes().willReadFrequently),
    );
  expect(byProcessor).toEqual([true, true, true]);
  const view = app.page.locator('.scene > canvas');
  const running = await view.boundingBox();
  await app.page.getByRole('button', { name: 'Reset', exact: true }).click();
  await expect.poll(() => app.page.textContent('.phase')).toBe('');
  expect(await view.boundingBox()).toEqual(running);
});

test('files with a hash in their name are cached forever, all others are revalidated', async () => {
  const page = await fetch(app.address);
  expect(page.headers.get('cache-control')).toBe('no-cache');
  const again = await fetch(app.address, { headers: { 'If-None-Match': page.headers.get('etag') ?? '' } });
  expect(again.status).toBe(304);
  const [script] = (await page.text()).match(/assets\/index-[\w-]+\.js/) ?? [];
  expect((await fetch(app.address + script)).headers.get('cache-control')).toContain('immutable');
});
