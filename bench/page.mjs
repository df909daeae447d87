// Measures the built app in Chromium, which renders in software: start-up, long tasks while models run, frame rate of
// the view, memory, and how often a mesh is copied.
import { launchChromium } from '../scripts/chromium.mjs';
import { serveApp } from '../scripts/serve.mjs';
import { watchPage, watchWorker } from './watch.mjs';

const VIEWPORT = { width: 1280, height: 800 };
/** Loads before a start counts as warm: browsers keep the compiled code of scripts that were loaded twice. */
const WARMING = 2;
/** Longest time in milliseconds for which a run is watched, and the time for which the view is turned. */
const WATCHED = 12_000;
const TURNED = 5_000;
const PATIENCE = 180_000;

/** Labs and examples that run while long tasks are counted. */
const RUNS = [
  { name: 'head, bone', hash: '#extract' },
  { name: 'head, skin', hash: '#extract?example=head-skin' },
  { name: 'head at full size', hash: '#extract?example=head-full' },
  { name: 'tooth', hash: '#extract?example=tooth' },
  { name: 'ovule', hash: '#extract?example=ovule' },
  { name: 'sponge', hash: '#extract?example=sponge' },
  { name: 'reconstruct', hash: '#reconstruct' },
  { name: 'track', hash: '#track' },
  { name: 'sculpt, lava lamp', hash: '#sculpt?example=lava' },
];

const middle = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

/** Opens a page that is watched from the start. */
async function open(browser, address) {
  const context = browser.contexts()[0] ?? (await browser.newContext({ viewport: VIEWPORT }));
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  page.on('worker', (worker) => worker.evaluate(watchWorker).catch(() => undefined));
  await page.addInitScript(watchPage);
  await page.goto(address);
  return page;
}

/**
 * Returns the milliseconds from navigation to the first paint, the engine's first answer, a model that can be run, and
 * the first surface.
 */
async function startOnce(browser, address) {
  const page = await open(browser, address);
  await page.waitForFunction(() => window.watched.marks.surface && window.watched.marks.interactive);
  const { paint, engine, interactive, surface } = await page.evaluate(() => window.watched.marks);
  await page.close();
  return { paint, engine, interactive, surface };
}

const middles = (starts) =>
  Object.fromEntries(Object.keys(starts[0]).map((name) => [name, middle(starts.map((start) => start[name]))]));

async function coldStart(address, repeats) {
  const starts = [];
  for (let k = 0; k < repeats; k++) {
    const browser = await launchChromium();
    starts.push(await startOnce(browser, address));
    await browser.close();
  }
  return middles(starts);
}

async function warmStart(browser, address, repeats) {
  const starts = [];
  for (let k = 0; k < WARMING + repeats; k++) starts.push(await startOnce(browser, address));
  return middles(starts.slice(WARMING));
}

/** Returns the long tasks of the main thread, from a model's first step on. */
async function longTasks(browser, address, { name, hash }) {
  const page = await open(browser, address + hash);
  await page.waitForSelector('[data-state=running], [data-state=done]');
  const from = await page.evaluate(() => performance.now());
  const done = page.waitForSelector('[data-state=done]', { timeout: WATCHED }).catch(() => undefined);
  await done;
  const found = await page.evaluate((from) => window.watched.long.filter(({ start }) => start > from), from);
  const { triangles, frames, until } = await page.evaluate(() => ({
    ...{ triangles: window.watched.triangles, frames: window.watched.frames },
    until: performance.now(),
  }));
  await page.close();
  const longest = found.toSorted((a, b) => b.duration - a.duration)[0];
  return {
    name,
    triangles,
    frames: (1000 * frames) / until,
    over: found.length,
    longest: longest?.duration ?? 0,
    by: longest?.by,
  };
}

/** Returns frames per second and the median frame time while a pointer turns the view. */
async function turn(page) {
  const box = await page.locator('.view > canvas').boundingBox();
  return page.evaluate(turnInPage, [box.x + 90, box.y + box.height - 60, TURNED]);
}

/** Runs in the page: drags a pointer that moves a little with each animation frame. */
async function turnInPage([x, y, milliseconds]) {
  const canvas = document.querySelector('.view > canvas');
  // Synthetic pointers cannot be captured.
  canvas.setPointerCapture = () => undefined;
  canvas.releasePointerCapture = () => undefined;
  const fire = (type, clientX) => {
    const rest = { bubbles: true, clientX, clientY: y, pointerId: 1, pointerType: 'mouse', buttons: 1 };
    canvas.dispatchEvent(new PointerEvent(type, { ...rest, button: type === 'pointermove' ? -1 : 0 }));
  };
  fire('pointerdown', x);
  const times = [performance.now()];
  while (times.at(-1) - times[0] < milliseconds) {
    await new Promise(requestAnimationFrame);
    times.push(performance.now());
    fire('pointermove', x + 3 * times.length);
  }
  fire('pointerup', x + 3 * times.length);
  const deltas = times.slice(1).map((time, i) => time - times[i]);
  const sorted = deltas.toSorted((a, b) => a - b);
  return {
    fps: (1000 * deltas.length) / (times.at(-1) - times[0]),
    middle: sorted[sorted.length >> 1],
    triangles: window.watched.drawn,
  };
}

/**
 * Returns the frame rates while the view of the head is turned: with the surface, with slices only, and while the model
 * runs.
 */
async function motion(browser, address) {
  const page = await open(browser, `${address}#extract`);
  await page.waitForSelector('[data-state=running]');
  await page.waitForFunction(() => window.watched.triangles > 90_000);
  const running = await turn(page);
  await page.waitForSelector('[data-state=done]');
  const resting = await turn(page);
  await page.getByLabel('Surface', { exact: true }).uncheck();
  const without = await turn(page);
  const { triangles, renderer, canvas } = await page.evaluate(() => ({
    ...window.watched,
    canvas: [document.querySelector('.view > canvas').width, document.querySelector('.view > canvas').height],
  }));
  await page.close();
  return { triangles, renderer, canvas, resting, without, running };
}

/**
 * Returns the bytes that the page, its worker and the GPU hold when the head is done, and how many were sent, copied
 * and uploaded.
 */
async function memory(browser, address) {
  const page = await open(browser, `${address}#extract`);
  await page.waitForSelector('[data-state=done]');
  const session = await page.context().newCDPSession(page);
  await session.send('HeapProfiler.collectGarbage');
  const heap = await session.send('Runtime.getHeapUsage');
  const worker = await page
    .workers()[0]
    .evaluate(() => self.watched)
    .catch(() => undefined);
  const { gpu, uploads, copied, triangles } = await page.evaluate(() => window.watched);
  await page.close();
  return {
    triangles,
    heap: heap.usedSize,
    arrays: heap.backingStorageSize,
    wasm: worker?.wasm,
    gpu,
    frames: worker?.frames,
    sent: { handedOver: worker?.handedOver, cloned: worker?.cloned },
    onPage: { copied, uploaded: uploads.bytes },
    buffers: { made: uploads.made, refilled: uploads.refilled },
  };
}

/** Measures everything, of the app in a folder. */
export async function measure(folder, repeats) {
  const server = await serveApp(folder);
  const { address } = server;
  const cold = await coldStart(address, repeats);
  const browser = await launchChromium();
  try {
    const host = `Chromium ${browser.version()}`;
    const warm = await warmStart(browser, address, repeats);
    const runs = [];
    for (const run of RUNS) runs.push(await longTasks(browser, address, run));
    return {
      host,
      viewport: VIEWPORT,
      cold,
      warm,
      runs,
      motion: await motion(browser, address),
      memory: await memory(browser, address),
    };
  } finally {
    await browser.close();
    await server.close();
  }
}
