/** Pictures, films and plots that a lab saves, as files that other programs read. */
import { readFile } from 'node:fs/promises';
import type { Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, anotherPage, open, openApp, QUICK, RUNNING, reach } from './browser';
import { LONG } from './long';

let app: App;

beforeAll(async () => {
  app = await openApp({ width: 1280, height: 900 }, 'bench.html');
  await app.page.emulateMedia({ reducedMotion: 'reduce' });
  await open(app, QUICK.extract);
  await reach(app.page, 'done');
  await app.page.click('.picture-panel > summary');
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const setting = (name: string) => app.page.locator(`[data-picture=${name}]`);
const canvasSize = () =>
  app.page.locator('.scene > canvas').evaluate(({ width, height }: HTMLCanvasElement) => [width, height]);
const messages = () => app.page.locator('.picture-panel .field-error:not(:empty)').allTextContents();
const said = () => app.page.locator('.picture-panel [role=status]').textContent();

async function choose(width: number, height: number, content = 'view'): Promise<void> {
  await setting('width').fill(String(width));
  await setting('height').fill(String(height));
  await setting('content').selectOption(content);
}

/** Does something that saves a file, and returns its name and content. */
async function saved(page: Page, save: () => Promise<void>): Promise<{ name: string; bytes: Buffer }> {
  const [download] = await Promise.all([page.waitForEvent('download'), save()]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

const picture = () => saved(app.page, () => setting('save').click());

/** Returns size of a picture, the alpha of its upper left pixel, and the length of its scale bar in pixels. */
function look(picture: Buffer): Promise<{ size: number[]; alpha: number; bar: number }> {
  const inPage = async (base64: string) => {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const { width, height } = image;
    const context = new OffscreenCanvas(width, height).getContext('2d');
    context?.drawImage(image, 0, 0);
    const [{ data } = { data: [] }] = [context?.getImageData(0, 0, width, height)];
    // The row through the middle of the bar: equal pixels from the first one that differs from the edge by far.
    const row = height - Math.round((18 * Math.min(width, height)) / 480);
    const red = (x: number) => data[4 * (row * width + x)] ?? 0;
    const start = Math.round((20 * Math.min(width, height)) / 480);
    let [from, to] = [start, start];
    while (from > 0 && Math.abs(red(from - 1) - red(start)) < 40) from -= 1;
    while (to < width && Math.abs(red(to) - red(start)) < 40) to += 1;
    return { size: [width, height], alpha: data[3] ?? 0, bar: to - from };
  };
  // As text, which no policy of the page forbids.
  return app.page.evaluate(`(${inPage})(${JSON.stringify(picture.toString('base64'))})`);
}

describe('a picture', () => {
  test('of the 3D view has the chosen size, and the view keeps its own', async () => {
    const before = await canvasSize();
    await choose(800, 960);
    const { name, bytes } = await picture();
    expect(name).toBe('linked-rings.png');
    expect(await look(bytes)).toMatchObject({ size: [800, 960], alpha: 255 });
    expect(await canvasSize()).toEqual(before);
  });

  test('is transparent on request', async () => {
    await setting('transparent').check();
    expect((await look((await picture()).bytes)).alpha).toBe(0);
    await setting('transparent').uncheck();
  });

  test('has a scale bar in proportion to its size', LONG, async () => {
    await choose(1000, 1000);
    const large = (await look((await picture()).bytes)).bar;
    await choose(500, 500);
    expect((await look((await picture()).bytes)).bar).toBeCloseTo(large / 2, -1);
    await setting('scale-bar').uncheck();
    expect((await look((await picture()).bytes)).bar).toBeGreaterThan(0.9 * 500);
    await setting('scale-bar').check();
  });

  test('of a slice has a scale bar of 20 of its 64 voxels', async () => {
    await choose(1280, 640, 'Axial');
    const { name, bytes } = await picture();
    expect(name).toBe('linked-rings-axial.png');
    const { size, bar } = await look(bytes);
    expect(size).toEqual([1280, 640]);
    expect(Math.abs(bar - 200)).toBeLessThan(10);
  });

  test('of a size that is not possible is refused with the sizes that are', async () => {
    await choose(100_000, 8);
    await setting('save').click();
    expect(await messages()).toEqual([
      expect.stringMatching(/from 16 to \d+/),
      expect.stringMatching(/from 16 to \d+/),
    ]);
    expect(await setting('height').getAttribute('aria-invalid')).toBe('true');
    await choose(320, 240);
    await picture();
    expect(await messages()).toEqual([]);
  });
});

/** Plays a film to its end, and returns its size and the number of frames. */
async function play(film: Buffer): Promise<{ size: number[]; frames: number }> {
  const inPage = async (base64: string) => {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    const video = document.createElement('video');
    video.muted = true;
    video.src = URL.createObjectURL(new Blob([bytes], { type: 'video/webm' }));
    await video.play();
    await new Promise((resolve) => video.addEventListener('ended', resolve));
    return { size: [video.videoWidth, video.videoHeight], frames: video.getVideoPlaybackQuality().totalVideoFrames };
  };
  // The policy of the app's own page forbids videos.
  const page = await anotherPage(app);
  const played: { size: number[]; frames: number } = await page.evaluate(
    `(${inPage})(${JSON.stringify(film.toString('base64'))})`,
  );
  await page.close();
  return played;
}

/** The first four bytes of WebM. */
const EBML = '1a45dfa3';

describe('a film', () => {
  const record = () => setting('start').click();

  test('of one turn is a WebM of the chosen size with several frames, and the view keeps its own size', async () => {
    await choose(320, 240);
    await app.page.locator('.picture-panel input[type=number]').last().fill('2');
    const before = await canvasSize();
    const { name, bytes } = await saved(app.page, record);
    expect(name).toBe('linked-rings.webm');
    expect(bytes.subarray(0, 4).toString('hex')).toBe(EBML);
    const { size, frames } = await play(bytes);
    expect(size).toEqual([320, 240]);
    expect(frames).toBeGreaterThan(2);
    expect(await canvasSize()).toEqual(before);
  });

  test('can be cancelled, which saves nothing', async () => {
    const files: string[] = [];
    app.page.on('download', (download) => files.push(download.suggestedFilename()));
    await record();
    await setting('cancel').click();
    await expect.poll(said).toBe('Cancelled.');
    expect(files).toEqual([]);
    expect(await setting('save').isEnabled()).toBe(true);
  });

  test('of the run needs one, continues it, and ends with it', LONG, async () => {
    await choose(320, 240);
    await setting('film').selectOption('run');
    await record();
    expect(await said()).toContain('Reset');
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    const { bytes } = await saved(app.page, record);
    expect(await app.page.getAttribute('[data-state]', 'data-state')).toBe('done');
    expect((await play(bytes)).frames).toBeGreaterThan(1);
  });

  test('goes on until the user finishes it', LONG, async () => {
    await choose(320, 240);
    await setting('film').selectOption('open');
    await record();
    await app.page.locator('.scene > canvas').press('ArrowLeft');
    const { bytes } = await saved(app.page, () => setting('finish').click());
    expect((await play(bytes)).size).toEqual([320, 240]);
  });

  test('is refused with a message by a browser that cannot record', LONG, async () => {
    const page = await anotherPage(app, () => {
      Object.assign(window, { MediaRecorder: undefined });
    });
    await open({ page, address: app.address }, QUICK.extract);
    await reach(page, 'done');
    await page.click('.picture-panel > summary');
    await page.click('[data-picture=start]');
    expect(await page.locator('.picture-panel [role=status]').textContent()).toContain('cannot record');
    await page.close();
  });
});

/** Contents of the file of a plot, as an XML parser reads it. */
interface PlotFile {
  error: string | undefined;
  viewBox: string | null;
  texts: string[];
  /** Numbers of points of the curves. */
  curves: number[];
}

function parse(file: Buffer): Promise<PlotFile> {
  return app.page.evaluate((xml) => {
    const parsed = new DOMParser().parseFromString(xml, 'image/svg+xml');
    return {
      error: parsed.querySelector('parsererror')?.textContent ?? undefined,
      viewBox: parsed.documentElement.getAttribute('viewBox'),
      texts: [...parsed.querySelectorAll('text')].map(({ textContent }) => textContent),
      curves: [...parsed.querySelectorAll('path')].map((path) => path.getAttribute('d')?.match(/[ML]/g)?.length ?? 0),
    };
  }, file.toString('utf8'));
}

describe('a plot', () => {
  test('is saved as SVG, with its curves, title, axes, level changes and legend', async () => {
    const button = app.page.getByRole('button', { name: 'Save as SVG: Kinetic energy' });
    const { name, bytes } = await saved(app.page, () => button.click());
    expect(name).toBe('kinetic-energy.svg');
    const { error, viewBox, texts, curves } = await parse(bytes);
    expect([error, viewBox?.split(' ').length]).toEqual([undefined, 4]);
    expect(texts).toEqual(expect.arrayContaining(['Kinetic energy', 'iteration', 'energy', 'level 0', 'level 1', '0']));
    const iterations = await app.page.locator('.iteration').textContent();
    expect(curves).toHaveLength(2);
    expect(iterations).toBe(`Iteration ${curves[0]}`);
  });

  describe.each(RUNNING)('in the %s lab', (lab) => {
    test('each has a button that saves it', LONG, async () => {
      const page = await anotherPage(app);
      await open({ page, address: app.address }, QUICK[lab]);
      await reach(page, 'done');
      const figures = page.locator('figure:has(.plot)');
      expect(await figures.count()).toBeGreaterThan(0);
      expect(await figures.getByRole('button', { name: /^Save as SVG: ./, includeHidden: true }).count()).toBe(
        await figures.count(),
      );
      await page.close();
    });
  });
});
