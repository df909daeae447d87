import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import {
  type App,
  anotherPage,
  cancelAtOnce,
  drop,
  iteration,
  measures,
  openApp,
  reach,
  recordStates,
} from './browser';
import { LONG } from './long';
import { changes, countColors } from './pixels';
import { ball, metaImageHeader, ring } from './volumes';

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

function niftiOf(data: Uint8Array): Uint8Array {
  return new Volume({ data, dims: [32, 32, 32], spacing: [1, 1, 1] }).toNifti();
}

/** Clicks an export button and returns the downloaded file. */
async function exported(format: string): Promise<Uint8Array> {
  const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click(`[data-export=${format}]`)]);
  return readFile(await download.path());
}

describe('the built-in example', () => {
  test('runs to the end by itself and leaves a closed surface', async () => {
    await reach(app.page, 'done');
    const found = await measures(app.page);
    expect(found).toMatchObject({ closed: true, oriented: true });
    expect(found.vertices).toBeGreaterThan(5000);
    expect(found.chi).toBe(found.vertices - found.triangles / 2);
    expect(found.chi).toBe(2 * found.components - 2 * found.genus);
  });

  test('is rendered: the view has many colours', async () => {
    const png = await app.page.locator('.scene > canvas').screenshot();
    expect(await countColors(app.page, png)).toBeGreaterThan(1000);
  });

  test('describes the plots in words', async () => {
    const captions = await app.page.locator('figcaption').allTextContents();
    expect(captions).toHaveLength(3);
    expect(captions[0]).toMatch(/After [\d,]+ iterations the energy is .* below the tolerance/);
    expect(captions[1]).toMatch(/^Vertices: now [\d,]+; between/);
  });

  test.each(['ply', 'stl', 'glb', 'obj'])('exports a closed mesh as %s', async (format) => {
    const mesh = Mesh.parse(await exported(format));
    const { triangles, volume } = await measures(app.page);
    expect(mesh.check()).toMatchObject({ closed: true, oriented: true });
    expect(mesh.triangleCount).toBe(triangles);
    expect(mesh.info().volume / volume).toBeCloseTo(1, 3);
    mesh.free();
  });

  test('keeps the result and reports the problem when a file cannot be read', async () => {
    const before = await measures(app.page);
    await drop(app.page, [{ name: 'notes.txt', bytes: new TextEncoder().encode('not a volume at all') }]);
    await reach(app.page, 'error');
    expect(await app.page.textContent('.banner')).toContain('notes.txt could not be opened');
    expect((await app.page.textContent('[data-error]'))?.length).toBeGreaterThan(20);
    expect(await measures(app.page)).toEqual(before);
    await app.page.click('.banner button');
    await reach(app.page, 'done');
  });

  test('refuses a parameter out of range with a message and restores the previous value', async () => {
    const field = app.page.locator('[data-param=damping] input[type=number]');
    const before = await field.inputValue();
    await field.fill('-1');
    await field.press('Enter');
    await app.page.waitForFunction(() => document.querySelector('[data-param=damping] .field-error')?.textContent);
    expect(await field.inputValue()).toBe(before);
    expect(await field.getAttribute('aria-invalid')).toBe('true');
  });
});

describe('running', () => {
  test('reset, step, ten steps, play and pause by keyboard', async () => {
    await app.page.locator('.scene > canvas').focus();
    await app.page.keyboard.press('r');
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBe(0);
    await app.page.keyboard.press('s');
    await app.page.waitForFunction(() => document.querySelector('.iteration')?.textContent === 'Iteration 1');
    await app.page.keyboard.press('d');
    await app.page.waitForFunction(() => document.querySelector('.iteration')?.textContent === 'Iteration 11');
    // Smaller steps, so that the run is still under way when it is paused.
    const timeStep = app.page.locator('[data-param=timeStep] input[type=number]');
    const usual = await timeStep.inputValue();
    await timeStep.fill('0.05');
    await timeStep.press('Enter');
    await app.page.locator('.scene > canvas').focus();
    await app.page.keyboard.press(' ');
    await reach(app.page, 'running');
    // A pause gives up the step that is under way.
    await expect.poll(() => iteration(app.page)).toBeGreaterThan(11);
    await app.page.keyboard.press(' ');
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBeGreaterThan(11);
    expect(await measures(app.page)).toMatchObject({ closed: true, oriented: true });
    await timeStep.fill(usual);
    await timeStep.press('Enter');
    await expect.poll(() => app.page.url()).not.toContain('timeStep');
  });

  test('a parameter changed while paused is used from then on, and kept by a reset', async () => {
    const field = app.page.locator('[data-param=rigidity] input[type=number]');
    await field.fill('0.3');
    await field.press('Enter');
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    expect(await field.inputValue()).toBe('0.3');
  });

  test('the arrow keys rotate the view', async () => {
    const view = app.page.locator('.scene > canvas');
    const before = await view.screenshot();
    await view.press('ArrowLeft');
    await view.press('ArrowLeft');
    await changes(app.page, before, () => view.screenshot(), 0.05);
  });
});

describe('files', () => {
  test('opened while the engine is loading are not replaced by the example', async () => {
    const page = await anotherPage(app, () => {
      const { postMessage } = Worker.prototype;
      // The engine gets the first request only when it is released.
      Worker.prototype.postMessage = function (this: Worker, ...given: unknown[]) {
        Worker.prototype.postMessage = postMessage;
        Object.assign(window, { release: () => Reflect.apply(postMessage, this, given) });
      };
    });
    await page.goto(app.address);
    const buffer = Buffer.from(niftiOf(ball()));
    await page.setInputFiles('input[type=file]', { name: 'ball.nii', mimeType: '', buffer });
    await page.evaluate('release()');
    await reach(page, 'done');
    expect(await page.textContent('.facts')).toContain('ball.nii');
    await page.close();
  });

  test('a dropped volume replaces the example', async () => {
    await drop(app.page, [{ name: 'ball.nii', bytes: niftiOf(ball()) }]);
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('ball.nii'));
    await reach(app.page, 'done');
    expect(await measures(app.page)).toMatchObject({ components: 1, genus: 0, closed: true, oriented: true });
  });

  test('the surface follows the iso value, even after it has converged', async () => {
    const field = app.page.locator('[data-param=iso] input[type=number]');
    const truth = (4 / 3) * Math.PI * 10 ** 3;
    // At 128 the ball has a radius of 10; forty grey levels are one voxel.
    for (const [iso, radius] of [
      [128, 10],
      [188, 8.5],
    ]) {
      await field.fill(String(iso));
      await field.press('Enter');
      const part = ((radius ?? 0) / 10) ** 3;
      await expect.poll(async () => Math.abs((await measures(app.page)).volume / truth / part - 1)).toBeLessThan(0.06);
      await reach(app.page, 'done');
    }
  });

  test('a detached header opens together with its data, chosen in either order', async () => {
    await app.page.setInputFiles('input[type=file]', [
      { name: 'ring.raw', mimeType: 'application/octet-stream', buffer: Buffer.from(ring()) },
      { name: 'ring.mhd', mimeType: 'text/plain', buffer: Buffer.from(metaImageHeader('ring.raw')) },
    ]);
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('ring.mhd'));
    await reach(app.page, 'done');
    expect(await measures(app.page)).toMatchObject({ components: 1, genus: 1, chi: 0, closed: true });
  });

  test('a volume too small for coarser levels opens with none', async () => {
    const field = app.page.locator('.start').getByLabel('Pyramid levels');
    const before = await field.inputValue();
    expect(before).not.toBe('0');
    const dims = [12, 12, 2];
    const voxels = Uint8Array.from({ length: 288 }, (_, i) => {
      const [x, y] = [i % 12, Math.floor(i / 12) % 12];
      return Math.max(0, Math.min(255, 128 + 60 * (4 - Math.hypot(x - 5.5, y - 5.5))));
    });
    await app.page.setInputFiles('input[type=file]', [
      { name: 'disc.raw', mimeType: 'application/octet-stream', buffer: Buffer.from(voxels) },
      { name: 'disc.mhd', mimeType: 'text/plain', buffer: Buffer.from(metaImageHeader('disc.raw', dims)) },
    ]);
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('disc.mhd'));
    await reach(app.page, 'done');
    expect(await measures(app.page)).toMatchObject({ components: 1, genus: 0, closed: true });
    expect(await field.inputValue()).toBe('0');
    await app.page.setInputFiles('input[type=file]', [
      { name: 'ring.raw', mimeType: 'application/octet-stream', buffer: Buffer.from(ring()) },
      { name: 'ring.mhd', mimeType: 'text/plain', buffer: Buffer.from(metaImageHeader('ring.raw')) },
    ]);
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('ring.mhd'));
    await reach(app.page, 'done');
  });

  test('bubbles give the same ring', async () => {
    const states = await recordStates(app.page);
    await app.page.selectOption('.start select', 'bubbles');
    await expect.poll(states).toEqual(['loading', 'paused', 'running', 'done']);
    expect(await measures(app.page)).toMatchObject({ components: 1, genus: 1, closed: true });
  });
});

describe('the mean edge', () => {
  const edge = () => app.page.getByLabel('Mean edge length');
  const complaint = () => app.page.locator('.start .field-error:not(:empty)');

  test('shorter edges give more vertices, also after a reset', async () => {
    const before = await measures(app.page);
    const states = await recordStates(app.page);
    await edge().fill('1');
    await edge().press('Enter');
    await expect.poll(states).toEqual(['loading', 'paused', 'running', 'done']);
    const shorter = await measures(app.page);
    expect(shorter).toMatchObject({ components: 1, genus: 1, closed: true });
    expect(shorter.vertices).toBeGreaterThan(1.3 * before.vertices);
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    expect(await edge().inputValue()).toBe('1');
    await app.page.click('text="Play"');
    await reach(app.page, 'done');
    expect((await measures(app.page)).vertices).toBe(shorter.vertices);
  });

  test.each(['0.001', '-2', '1e9'])('%s is refused, and the previous value is restored', async (value) => {
    const before = await measures(app.page);
    await edge().fill(value);
    await edge().press('Enter');
    await expect.poll(() => edge().inputValue()).toBe('1');
    expect(await complaint().allTextContents()).toEqual([expect.stringMatching(/must be|accepted|Must be/)]);
    expect(await edge().getAttribute('aria-invalid')).toBe('true');
    await reach(app.page, 'done');
    expect(await measures(app.page)).toEqual(before);
  });

  test(
    'an example brings its own edge length, and a file starts without one and without the previous start',
    LONG,
    async () => {
      await reach(app.page, 'running', 'done');
      await edge().fill('1e9');
      await edge().press('Enter');
      await expect.poll(() => complaint().count()).toBe(1);
      await app.page.selectOption('.data select', 'linked-rings');
      await expect.poll(() => edge().inputValue()).toBe('');
      expect([await complaint().count(), await edge().getAttribute('aria-invalid')]).toEqual([0, null]);
      await app.page.selectOption('.data select', 'head-bone');
      await expect.poll(() => edge().inputValue()).toBe('2.2');
      await reach(app.page, 'running');
      await app.page.selectOption('.start select', 'sphere');
      await reach(app.page, 'running');
      await drop(app.page, [{ name: 'ball.nii', bytes: niftiOf(ball()) }]);
      await expect.poll(() => edge().inputValue()).toBe('');
      expect(await app.page.inputValue('.start select')).toBe('contour');
      await reach(app.page, 'done');
      expect(await measures(app.page)).toMatchObject({ components: 1, genus: 0, closed: true });
    },
  );
});

describe('Cancel', () => {
  test('while another volume is opened, the previous one is restored with its state', async () => {
    const states = await recordStates(app.page);
    await app.page.selectOption('.data select', 'linked-rings');
    await expect.poll(states).toEqual(['loading', 'running', 'done']);
    const before = await measures(app.page);
    await cancelAtOnce(app.page);
    await app.page.selectOption('.data select', 'head-full');
    await expect.poll(() => app.page.textContent('.status')).toBe('Cancelled.');
    expect(await app.page.textContent('.facts')).toContain('linked rings');
    expect(await app.page.inputValue('.data select')).toBe('linked-rings');
    expect(await app.page.locator('.banner').isVisible()).toBe(false);
    await reach(app.page, 'done');
    await expect.poll(() => measures(app.page)).toEqual(before);
  });

  test('while the model is created again', async () => {
    await cancelAtOnce(app.page);
    await app.page.selectOption('.start select', 'bubbles');
    await expect.poll(() => app.page.textContent('.status')).toBe('Cancelled.');
    expect(await app.page.inputValue('.start select')).toBe('contour');
    await expect.poll(() => app.page.getAttribute('.lab', 'data-state')).toMatch(/paused|done/);
  });
});

describe('files that cannot be opened', LONG, () => {
  const state = () => app.page.getAttribute('.lab', 'data-state');

  /** Opens a text file as soon as the worker has begun to load another volume. */
  const openNotesDuringLoad = () =>
    app.page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (this: Worker, ...sent: unknown[]) {
        Reflect.apply(postMessage, this, sent);
        if ((sent[0] as { kind?: string }).kind !== 'load') return;
        Worker.prototype.postMessage = postMessage;
        const chosen = new DataTransfer();
        chosen.items.add(new File(['not a volume at all'], 'notes.txt'));
        const input = document.querySelector<HTMLInputElement>('input[type=file]');
        if (input) input.files = chosen.files;
        input?.dispatchEvent(new Event('change'));
      };
    });

  test('keep the previous volume, even during the loading of another', async () => {
    await app.page.selectOption('.data select', 'tooth');
    await app.page.selectOption('.data select', 'linked-rings');
    await app.page.locator('.facts', { hasText: 'linked rings' }).waitFor();
    await reach(app.page, 'done');
    const before = await measures(app.page);
    expect(before.components).toBe(2);
    await openNotesDuringLoad();
    await app.page.selectOption('.data select', 'head-full');
    await app.page.locator('.banner', { hasText: 'notes.txt could not be opened' }).waitFor();
    expect(await app.page.inputValue('.data select')).toBe('linked-rings');
    expect(await state()).toMatch(/paused|done/);
    await app.page.keyboard.press('Escape');
    if ((await state()) === 'paused') await app.page.click('text="Play"');
    await reach(app.page, 'done');
    await expect.poll(() => measures(app.page)).toEqual(before);
  });

  test('do not stop a running model', async () => {
    await app.page.evaluate(() => {
      const { fetch } = window;
      window.fetch = (input, init) => (`${input}`.includes('ovule') ? Promise.reject(new Error()) : fetch(input, init));
    });
    await app.page.selectOption('.data select', 'head-bone');
    await reach(app.page, 'running');
    await app.page.selectOption('.data select', 'ovule');
    await expect.poll(() => app.page.textContent('.banner')).toContain('ovule.nrrd could not be opened');
    expect(await state()).toMatch(/running|done/);
    await app.page.click('.banner button');
    await reach(app.page, 'done');
    expect(await app.page.textContent('.facts')).toContain('visible-human-head');
  });
});
