/** The Track lab asks for the object in a sequence of the user's, and proposes settings to track it. */
import { readFile } from 'node:fs/promises';
import type { Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Volume } from '../../pkg/index.js';
import { centreOf, cineVoxels, trueVolume } from '../../www/src/labs/track/cine';
import type { CineSpec } from '../../www/src/labs/track/protocol';
import { type App, cancelAtOnce, drop, open, openApp, reach, recordStates } from './browser';
import { LONG } from './long';

/** A ventricle with papillary muscles, off the middle of the image in no slice. */
const SPEC: CineSpec = { dims: [40, 40, 40], spacing: [2, 2, 2], frames: 6, noise: 6, size: 26, papillary: true };

let app: App;
let page: Page;
let film: Uint8Array;

beforeAll(async () => {
  await init();
  film = fileOf(cineVoxels(SPEC));
  app = await openApp(undefined, '#track?example=ventricle');
  page = app.page;
  // Looped playback would only slow the tests down.
  await page.emulateMedia({ reducedMotion: 'reduce' });
  await reach(page, 'done');
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

function fileOf(data: Uint8Array): Uint8Array {
  const volume = new Volume({ data, dims: [...SPEC.dims, SPEC.frames], spacing: SPEC.spacing });
  const file = volume.toNifti();
  volume.free();
  return file;
}

const hash = () => page.evaluate(() => location.hash);
const state = () => page.getAttribute('#lab', 'data-state');
const cavity = () => page.locator('[data-cavity=closed]').isChecked();
const measured = async (): Promise<Record<string, number>> =>
  JSON.parse((await page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
const beat = async () => JSON.parse((await page.getAttribute('[data-beat]', 'data-beat')) ?? '{}');

/** Opens a sequence, for whose object the lab then asks. */
async function dropped(name: string, bytes = film): Promise<void> {
  await drop(page, [{ name, bytes }]);
  await page.waitForFunction((name) => document.querySelector('.facts')?.textContent?.includes(name), name);
  await page.waitForSelector('.object-choice:not([hidden])');
  await reach(page, 'paused');
}

/** Clicks at fractions of the width and height of the axial slice's canvas. */
async function clickSlice(x: number, y: number): Promise<void> {
  const slice = page.locator('.slice canvas').first();
  await slice.scrollIntoViewIfNeeded();
  const box = await slice.boundingBox();
  if (!box) throw new Error('there is no slice');
  await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
}

/** Waits until the lab does not ask any more and all frames are tracked. */
async function tracked(frames = SPEC.frames): Promise<void> {
  await page.waitForSelector('.object-choice', { state: 'hidden' });
  await expect.poll(async () => [await state(), (await measured()).tracked]).toEqual(['done', frames]);
}

/** The ejection fraction of the computed ventricle with its papillary muscles, which count as blood. */
function trueEjection(): number {
  const filled = { ...SPEC, papillary: false };
  const volumes = Array.from({ length: SPEC.frames }, (_, frame) => trueVolume(filled, frame));
  return 1 - Math.min(...volumes) / Math.max(...volumes);
}

describe('a sequence that is dropped', () => {
  test('is not tracked before the object is known', async () => {
    await dropped('asked.nii');
    expect(await measured()).toMatchObject({ frames: SPEC.frames, tracked: 0 });
    expect(await hash()).toBe('#track?file=asked.nii');
    expect(await cavity()).toBe(false);
    const states = await recordStates(page);
    // Neither by the button nor by its key.
    expect(await page.locator('.play').isEnabled()).toBe(false);
    await page.locator('.scene > canvas').press(' ');
    await page.click('summary:has-text("Preparation")');
    await page.selectOption('[data-prepare=binning]', '2');
    await expect.poll(hash).toContain('binning=2');
    await reach(page, 'paused');
    expect(await states()).not.toContain('running');
  });

  test('is tracked after one click, with box, threshold and closed cavity proposed', LONG, async () => {
    await dropped('clicked.nii');
    await clickSlice(0.5, 0.5);
    await tracked();
    expect(Math.abs((await beat()).ejection - trueEjection())).toBeLessThan(0.02);
    expect(await cavity()).toBe(true);
    expect(await hash()).toMatch(
      /^#track\?file=clicked\.nii&box=[-\d.,]+&at=[-\d.,]+&cavity=closed&p\.threshold=[\d.]{2,6}$/,
    );
    expect(Number(await page.locator('[data-box="0-last"]').inputValue())).toBeLessThan(SPEC.dims[0] - 1);
  });

  test('is asked about again when the proposal is undone', LONG, async () => {
    await dropped('undone.nii');
    await page.click('[data-object=moving]');
    await tracked();
    await page.click('[data-transport=undo]');
    await page.waitForSelector('.object-choice:not([hidden])');
    await expect.poll(hash).toBe('#track?file=undone.nii');
    expect(await cavity()).toBe(false);
    await page.click('[data-transport=redo]');
    await expect.poll(hash).toContain('cavity=closed');
    await page.waitForSelector('.object-choice', { state: 'hidden' });
  });

  test('is tracked by the keyboard alone', LONG, async () => {
    await dropped('keys.nii');
    const slider = page.locator('.slices .slice-control input').first();
    await slider.focus();
    await slider.press('ArrowLeft');
    await slider.press('Enter');
    await tracked();
    expect(await hash()).toContain('cavity=closed');
  });

  test('is tracked in a box that is drawn', LONG, async () => {
    await dropped('boxed.nii');
    expect(await page.locator('[data-object=box]').isEnabled()).toBe(false);
    const slice = page.locator('.slice canvas').first();
    await slice.scrollIntoViewIfNeeded();
    const box = await slice.boundingBox();
    if (!box) throw new Error('there is no slice');
    const [x, y, half] = [box.x + box.width / 2, box.y + box.height / 2, box.height * 0.4];
    await page.mouse.move(x - half, y - half);
    await page.mouse.down();
    await page.mouse.move(x + half, y + half, { steps: 4 });
    await page.mouse.up();
    expect(Number(await page.locator('[data-box="0-last"]').inputValue())).toBeLessThan(SPEC.dims[0] - 2);
    expect(await state()).toBe('paused');
    await page.click('[data-object=box]');
    await tracked();
    expect(await hash()).toMatch(/box=-?\d.*cavity=closed/);
  });

  test('is tracked as a whole if that is asked for, as before, and says so in its link', LONG, async () => {
    await dropped('whole.nii');
    await page.click('[data-object=whole]');
    await tracked();
    expect(await hash()).toBe('#track?file=whole.nii&box=whole');
    expect(await cavity()).toBe(false);
  });
});

describe('a refusal', () => {
  test('is shown in words, with what to do, and the lab asks again', async () => {
    await dropped('background.nii');
    await clickSlice(0.35, 0.1);
    await expect
      .poll(() => page.textContent('[data-refusal]'))
      .toMatch(/^No object was found\. Click the middle .* Reason: .*bright/);
    expect(await state()).toBe('paused');
    expect(await page.locator('.object-choice').isVisible()).toBe(true);
    expect(await hash()).toBe('#track?file=background.nii');
  });

  test('is that of a box in which nothing moves', async () => {
    const size = cineVoxels(SPEC).length / SPEC.frames;
    const still = cineVoxels(SPEC).subarray(0, size);
    const frames = Uint8Array.from({ length: size * SPEC.frames }, (_, i) => still[i % size] ?? 0);
    await dropped('still.nii', fileOf(frames));
    await page.click('[data-object=moving]');
    await expect
      .poll(() => page.textContent('[data-refusal]'))
      .toMatch(/Click the object.* Reason: .*nothing that moves/);
  });
});

test('a proposal is cancelled at once, and the lab goes on to ask', LONG, async () => {
  await dropped('cancelled.nii');
  // From inside the page: the proposal may end before a click from outside arrives.
  await page.evaluate(() => {
    document.querySelector<HTMLElement>('[data-object=moving]')?.click();
    queueMicrotask(() => document.querySelector<HTMLElement>('[data-action=cancel]')?.click());
  });
  await expect.poll(() => page.textContent('.status')).toBe('Cancelled.');
  expect(await state()).toBe('paused');
  expect(await hash()).toBe('#track?file=cancelled.nii');
  await clickSlice(0.5, 0.5);
  await tracked();
});

test('a proposal that is cancelled when its tracker is being built stays, and is not run', LONG, async () => {
  await dropped('late.nii');
  await page.evaluate(() => {
    const line = document.querySelector('.status');
    const watch = new MutationObserver(() => {
      if (!line?.textContent?.startsWith('Preparing')) return;
      watch.disconnect();
      document.querySelector<HTMLElement>('[data-action=cancel]')?.click();
    });
    if (line) watch.observe(line, { childList: true, characterData: true, subtree: true });
  });
  const states = await recordStates(page);
  await page.click('[data-object=moving]');
  await expect.poll(hash).toContain('cavity=closed');
  await expect.poll(() => page.textContent('.status')).toBe('Cancelled.');
  expect(await states()).not.toContain('running');
  await page.click('[data-object=keep]');
  await page.click('.play');
  await tracked();
});

test('a change that is cancelled leaves the settings before, and the tracker does not run', LONG, async () => {
  await open(app, 'track?example=ventricle&at=largest');
  await reach(page, 'done');
  await page.evaluate(() => {
    for (const one of document.querySelectorAll('details')) one.open = true;
  });
  const states = await recordStates(page);
  await cancelAtOnce(page);
  await page.selectOption('[data-prepare=binning]', '2');
  await expect.poll(async () => (await states()).join(' ')).toMatch(/loading paused$/);
  expect(await page.textContent('.status')).toBe('Cancelled.');
  expect(await hash()).toBe('#track?example=ventricle&at=largest');
  expect(await states()).not.toContain('running');
  await page.click('.play');
  await tracked(12);
});

test('another object of an example is found, or the present one kept', LONG, async () => {
  await open(app, 'track?example=ventricle');
  await reach(page, 'done');
  expect(await cavity()).toBe(false);
  await page.click('[data-action=ask]');
  await page.click('[data-object=keep]');
  await page.waitForSelector('.object-choice', { state: 'hidden' });
  expect(await state()).toBe('done');
  expect(await hash()).toBe('#track?example=ventricle');
  await page.click('[data-action=ask]');
  await page.click('[data-object=here]');
  await page.waitForSelector('.object-choice', { state: 'hidden' });
  await expect.poll(hash).toContain('cavity=closed');
  await reach(page, 'done');
});

test('links and sessions keep closed cavities', LONG, async () => {
  await open(app, 'track?example=ventricle&cavity=closed');
  await reach(page, 'done');
  expect(await cavity()).toBe(true);
  expect(await hash()).toBe('#track?example=ventricle&cavity=closed');
  const download = page.waitForEvent('download');
  await page.click('[data-action=session]');
  const session = new Uint8Array(await readFile(await (await download).path()));
  await page.uncheck('[data-cavity=closed]');
  await expect.poll(hash).toBe('#track?example=ventricle');
  await reach(page, 'done');
  const states = await recordStates(page);
  await drop(page, [{ name: 'a.vesicle.zip', bytes: session }]);
  await expect.poll(async () => (await states()).join(' ')).toMatch(/\bloading\b.* done$/);
  expect(await cavity()).toBe(true);
});

test('a link to a file asks for its object; one with a region or a surface does not', LONG, async () => {
  for (const [settings, asks] of [
    ['', true],
    ['&p.threshold=60', true],
    ['&at=largest', false],
    [`&at=${centreOf(SPEC).join()}`, false],
  ] as const) {
    await open(app, `track?file=linked.nii${settings}`);
    await reach(page, 'done', 'running', 'paused');
    await drop(page, [{ name: 'linked.nii', bytes: film }]);
    await page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('linked.nii'));
    if (asks) await page.waitForSelector('.object-choice:not([hidden])');
    else await tracked();
    expect(await cavity()).toBe(false);
  }
});
