// Measures in the built app, in Chromium, the way from *Step* to the picture of the new surface, and from the pen to the
// slice that shows its stroke and to the surfaces that follow it.
import { launchChromium } from '../scripts/chromium.mjs';
import { serveApp } from '../scripts/serve.mjs';
import { watchPage } from './watch.mjs';

const STEPS = 20;
const STROKES = 10;
/** Movements of the pen in a stroke. */
const MOVES = 20;
const PATIENCE = 180_000;

const middle = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

/**
 * Counts in `window.messages` what page and workers send each other, and in `window.drawn` the images drawn on slices: the
 * slice, and what is painted on it.
 */
function watchMessages() {
  const messages = { requests: 0, answers: 0 };
  Object.assign(window, { messages, drawn: 0 });
  const { postMessage } = Worker.prototype;
  const known = new WeakSet();
  Worker.prototype.postMessage = function (...given) {
    messages.requests += 1;
    if (!known.has(this)) this.addEventListener('message', () => (messages.answers += 1));
    known.add(this);
    return postMessage.apply(this, given);
  };
  const { drawImage } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.drawImage = function (...given) {
    if (this.canvas.closest('.slices')) window.drawn += 1;
    return drawImage.apply(this, given);
  };
}

async function open(browser, address) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  page.setDefaultTimeout(PATIENCE);
  await page.addInitScript(() => localStorage.setItem('vesicle.keep', 'no'));
  await page.addInitScript(watchPage);
  await page.addInitScript(watchMessages);
  await page.goto(address);
  return page;
}

/** Returns the way of single steps of a model that has begun: milliseconds, messages, and copies of the surface. */
async function steps(browser, address) {
  const page = await open(browser, `${address}#extract?example=tooth`);
  await page.waitForSelector('[data-state=running]');
  await page.getByRole('button', { name: 'Pause', exact: true }).click();
  await page.waitForSelector('[data-state=paused]');
  const all = [];
  for (let k = 0; k < STEPS; k++) all.push(await page.evaluate(stepInPage));
  await page.close();
  const one = (name) => middle(all.map((step) => step[name]));
  const shown = ['milliseconds', 'requests', 'answers', 'uploads', 'copied', 'triangles'];
  return Object.fromEntries(shown.map((name) => [name, one(name)]));
}

/** Runs in the page: clicks *Step*, and waits until the surface is drawn. */
async function stepInPage() {
  const { watched, messages } = window;
  const button = [...document.querySelectorAll('.transport button')].find((one) => one.textContent.trim() === 'Step');
  const before = { ...watched.uploads, copied: watched.copied, ...messages };
  const began = performance.now();
  button.click();
  while (watched.uploads.bytes === before.bytes) await new Promise(requestAnimationFrame);
  const milliseconds = performance.now() - began;
  await new Promise((resolve) => setTimeout(resolve, 300));
  return {
    milliseconds,
    requests: messages.requests - before.requests,
    answers: messages.answers - before.answers,
    uploads: (watched.uploads.bytes - before.bytes) / 1e6,
    copied: (watched.copied - before.copied) / 1e6,
    triangles: watched.drawn,
  };
}

/** Returns the way of strokes: milliseconds of a frame with a movement, and to the surfaces, and draws of slices for each movement. */
async function strokes(browser, address) {
  const page = await open(browser, `${address}#segment`);
  await page.waitForSelector('[data-state=done]');
  const box = await page.locator('.slices canvas').first().boundingBox();
  const all = [];
  for (let k = 0; k < STROKES; k++) {
    all.push(
      await page.evaluate(strokeInPage, [box.x + 0.4 * box.width, box.y + (0.4 + 0.02 * k) * box.height, MOVES]),
    );
    await page.waitForSelector('[data-state=done]');
  }
  await page.close();
  const one = (name) => middle(all.map((stroke) => stroke[name]));
  return Object.fromEntries(['frame', 'draws', 'surfaces', 'requests'].map((name) => [name, one(name)]));
}

/** Runs in the page: draws a stroke, a movement for each animation frame. */
async function strokeInPage([x, y, moves]) {
  const canvas = document.querySelector('.slices canvas');
  canvas.setPointerCapture = () => undefined;
  canvas.releasePointerCapture = () => undefined;
  const { messages } = window;
  const fire = (type, clientX) => {
    const rest = {
      bubbles: true,
      clientX,
      clientY: y,
      pointerId: 1,
      pointerType: 'mouse',
      buttons: type === 'pointerup' ? 0 : 1,
    };
    canvas.dispatchEvent(new PointerEvent(type, { ...rest, button: type === 'pointermove' ? -1 : 0 }));
  };
  const frame = () => new Promise(requestAnimationFrame);
  const times = [];
  const draws = window.drawn;
  const requests = messages.requests;
  fire('pointerdown', x);
  for (let k = 1; k <= moves; k++) {
    const began = performance.now();
    const before = window.drawn;
    fire('pointermove', x + 2 * k);
    await frame();
    while (window.drawn === before) await frame();
    times.push(performance.now() - began);
  }
  const drawn = window.drawn - draws;
  fire('pointerup', x + 2 * moves);
  const lifted = performance.now();
  const lab = document.querySelector('#lab');
  while (lab.dataset.state !== 'done') await frame();
  times.sort((a, b) => a - b);
  return {
    frame: times[times.length >> 1],
    draws: drawn / moves,
    surfaces: performance.now() - lifted,
    requests: messages.requests - requests,
  };
}

/** Measures the built app in a folder. */
export async function measure(folder) {
  const server = await serveApp(folder);
  const browser = await launchChromium();
  try {
    const host = `Chromium ${browser.version()}`;
    return { host, step: await steps(browser, server.address), stroke: await strokes(browser, server.address) };
  } finally {
    await browser.close();
    await server.close();
  }
}
