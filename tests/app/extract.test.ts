import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { type App, drop, iteration, measures, openApp, reach } from './browser';
import { ball, metaImageHeader, ring } from './volumes';

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints).toEqual([]);
});

function niftiOf(data: Uint8Array): Uint8Array {
  return new Volume({ data, dims: [32, 32, 32], spacing: [1, 1, 1] }).toNifti();
}

/** Clicks an export button and gives the file that comes of it. */
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

  test('is drawn: the view shows far more than one colour', async () => {
    const png = await app.page.locator('.view > canvas').screenshot();
    const colors = await app.page.evaluate(async (base64) => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
      const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
      context?.drawImage(image, 0, 0);
      const pixels = new Uint32Array(context?.getImageData(0, 0, image.width, image.height).data.buffer ?? []);
      return new Set(pixels).size;
    }, png.toString('base64'));
    expect(colors).toBeGreaterThan(1000);
  });

  test('says in words what the plots show', async () => {
    const captions = await app.page.locator('figcaption').allTextContents();
    expect(captions).toHaveLength(3);
    expect(captions[0]).toMatch(/After \d+ iterations the energy is .* below the tolerance/);
    expect(captions[1]).toMatch(/^Vertices: now [\d,]+; between/);
  });

  test.each(['ply', 'stl', 'glb', 'obj'])('exports %s that reads back closed', async (format) => {
    const mesh = Mesh.parse(await exported(format));
    const { triangles, volume } = await measures(app.page);
    expect(mesh.check()).toMatchObject({ closed: true, oriented: true });
    expect(mesh.triangleCount).toBe(triangles);
    expect(mesh.info().volume / volume).toBeCloseTo(1, 3);
    mesh.free();
  });

  test('keeps the result when a wrong file comes, and says what was wrong', async () => {
    const before = await measures(app.page);
    await drop(app.page, [{ name: 'notes.txt', bytes: new TextEncoder().encode('not a volume at all') }]);
    await reach(app.page, 'error');
    expect(await app.page.textContent('.banner')).toContain('notes.txt could not be opened');
    expect((await app.page.textContent('[data-error]'))?.length).toBeGreaterThan(20);
    expect(await measures(app.page)).toEqual(before);
    await app.page.click('.banner button');
    await reach(app.page, 'done');
  });

  test('refuses a parameter out of range in words, and keeps the former value', async () => {
    const field = app.page.locator('[data-param=damping] input[type=number]');
    const before = await field.inputValue();
    await field.fill('-1');
    await field.press('Enter');
    await app.page.waitForFunction(() => document.querySelector('[data-param=damping] .field-error')?.textContent);
    expect(await field.inputValue()).toBe(before);
  });
});

describe('running', () => {
  test('reset, step, ten steps, play and pause by keyboard', async () => {
    await app.page.locator('.view > canvas').focus();
    await app.page.keyboard.press('r');
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBe(0);
    await app.page.keyboard.press('s');
    await app.page.waitForFunction(() => document.querySelector('.iteration')?.textContent === 'Iteration 1');
    await app.page.keyboard.press('d');
    await app.page.waitForFunction(() => document.querySelector('.iteration')?.textContent === 'Iteration 11');
    await app.page.keyboard.press(' ');
    await reach(app.page, 'running');
    await app.page.keyboard.press(' ');
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBeGreaterThan(11);
    expect(await measures(app.page)).toMatchObject({ closed: true, oriented: true });
  });

  test('a parameter changed while paused is used from then on, and survives a reset', async () => {
    const field = app.page.locator('[data-param=rigidity] input[type=number]');
    await field.fill('0.3');
    await field.press('Enter');
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    expect(await field.inputValue()).toBe('0.3');
  });

  test('the arrow keys turn the view', async () => {
    const view = app.page.locator('.view > canvas');
    const before = await view.screenshot();
    await view.press('ArrowLeft');
    await view.press('ArrowLeft');
    await expect.poll(async () => (await view.screenshot()).equals(before)).toBe(false);
  });
});

describe('files', () => {
  test('a dropped volume replaces the example and is found at its true size', async () => {
    await drop(app.page, [{ name: 'ball.nii', bytes: niftiOf(ball()) }]);
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('ball.nii'));
    await reach(app.page, 'done');
    const found = await measures(app.page);
    expect(found).toMatchObject({ components: 1, genus: 0, closed: true, oriented: true });
    expect(found.volume / ((4 / 3) * Math.PI * 10 ** 3)).toBeCloseTo(1, 1);
  });

  test('another iso value moves the surface on', async () => {
    const before = await measures(app.page);
    const field = app.page.locator('[data-param=iso] input[type=number]');
    await field.fill('180');
    await field.press('Enter');
    await expect.poll(async () => (await measures(app.page)).volume).toBeLessThan(before.volume);
    await reach(app.page, 'done');
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

  test('bubbles grow to the same ring', async () => {
    await app.page.selectOption('.start select', 'bubbles');
    await reach(app.page, 'running');
    await reach(app.page, 'done');
    expect(await measures(app.page)).toMatchObject({ components: 1, genus: 1, closed: true });
  });
});
