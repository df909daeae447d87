// `vesicle/zarr` in Chromium: from a server of another origin, and from a folder of the browser.
import { copyFile, mkdir, writeFile } from 'node:fs/promises';
import { build } from 'esbuild';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, test } from 'vitest';
import * as vesicle from '../../pkg/index.js';
import * as zarr from '../../pkg/zarr/index.js';
import { serve } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { filesOf, serveImage, sourceVoxels } from '../js/zarr-stores';
import { launch } from './browser';
import { LONG } from './long';

const FOLDER = 'target/zarr-page';

const PAGE = `
  import init, { DeformableModel } from './pkg/index.js';
  import { openZarr } from './pkg/zarr/index.js';
  Object.assign(window, { init, openZarr, DeformableModel });`;

let browser: Browser;
let server: Awaited<ReturnType<typeof serve>>;
let page: Page;

beforeAll(async () => {
  await mkdir(at(FOLDER), { recursive: true });
  await build({
    stdin: { contents: PAGE, resolveDir: at('.') },
    ...{ bundle: true, format: 'esm', target: 'es2022', outfile: at(FOLDER, 'page.js'), logLevel: 'error' },
    // Imported in Node only; the second by the reader of ZIPs.
    external: ['node:*', 'worker_threads'],
  });
  await copyFile(at('pkg/vesicle_bg.wasm'), at(FOLDER, 'vesicle_bg.wasm'));
  await writeFile(at(FOLDER, 'index.html'), '<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">');
  server = await serve(at(FOLDER), 0);
  browser = await launch();
  page = await browser.newPage();
  await page.goto(server.address);
  await page.addScriptTag({ type: 'module', content: `import './page.js'; await init(); document.title = 'ready';` });
  await page.waitForFunction(() => document.title === 'ready');
});
afterAll(async () => {
  await browser?.close();
  await server?.close();
});

// biome-ignore lint/suspicious/noExplicitAny: functions that the page has
declare const openZarr: any;
// biome-ignore lint/suspicious/noExplicitAny: the same
declare const DeformableModel: any;

const SOURCE = [...sourceVoxels()];
const IMAGES = ['v2-blosc-tczyx', 'v3-zstd-zyx', 'v3-sharded-gzip'];

test.each(IMAGES)('%s is read from a server of another origin', async (image) => {
  const images = await serveImage(image);
  try {
    const read = async (url: string) => {
      const zarr = await openZarr(url, { concurrency: 4 });
      const region = await zarr.region(0, { min: [0, 0, 0], max: zarr.levels[0].dims });
      return [...region.intensities()];
    };
    expect(await page.evaluate(read, images.url)).toEqual(SOURCE);
    expect(images.most()).toBeLessThanOrEqual(4);
    // Nothing that another origin must be asked for in advance.
    expect(images.log.filter((line) => line.startsWith('OPTIONS'))).toEqual([]);
  } finally {
    await images.close();
  }
});

for (const [i, image] of IMAGES.entries()) {
  test(`${image} is read from a folder`, i > 0 ? LONG : {}, async () => {
    const files = [...(await filesOf(image))].map(([key, bytes]) => [key, [...bytes]] as const);
    const read = async (files: (readonly [string, readonly number[]])[]) => {
      const root = await navigator.storage.getDirectory();
      for (const [key, bytes] of files) {
        const parts = key.slice(1).split('/');
        let folder = await root.getDirectoryHandle('image.zarr', { create: true });
        for (const part of parts.slice(0, -1)) folder = await folder.getDirectoryHandle(part, { create: true });
        const file = await folder.getFileHandle(parts.at(-1) as string, { create: true });
        const writable = await file.createWritable();
        await writable.write(Uint8Array.from(bytes));
        await writable.close();
      }
      const zarr = await openZarr(root, { path: 'image.zarr' });
      const region = await zarr.region(0, { min: [0, 0, 0], max: zarr.levels[0].dims });
      await root.removeEntry('image.zarr', { recursive: true });
      return [...region.intensities()];
    };
    expect(await page.evaluate(read, files)).toEqual(SOURCE);
  });
}

test('a surface has the same bits as in Node', LONG, async () => {
  const images = await serveImage('v3-zstd-zyx');
  try {
    const fit = async (url: string) => {
      const model = new DeformableModel({ volume: await openZarr(url), params: { iso: 100 } });
      const { done } = await model.run();
      const { positions, indices } = model.mesh.arrays();
      return { done, positions: [...positions], indices: [...indices] };
    };
    const there = await page.evaluate(fit, images.url);
    const model = new vesicle.DeformableModel({ volume: await zarr.openZarr(images.url), params: { iso: 100 } });
    await model.run();
    const { positions, indices } = model.mesh.arrays();
    expect(there).toEqual({ done: true, positions: [...positions], indices: [...indices] });
    expect(positions.length).toBeGreaterThan(1000);
  } finally {
    await images.close();
  }
});

test('a server that does not allow the page, or is not there, is unavailable', async () => {
  const images = await serveImage('v3-zstd-zyx');
  const open = (url: string) =>
    openZarr(url, { retries: 0 }).catch(({ code, message }: VesicleError) => [code, message]);
  type VesicleError = { code: string; message: string };
  images.answer = (_, response) => !!response.writeHead(200).end('{}');
  const unavailable = ['unavailable', '/zarr.json: Failed to fetch'];
  expect(await page.evaluate(open, images.url)).toEqual(unavailable);
  await images.close();
  expect(await page.evaluate(open, images.url)).toEqual(unavailable);
});
