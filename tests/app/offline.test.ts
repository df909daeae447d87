import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { build, createServer } from 'vite';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { launch, measures, open, reach } from './browser';

let folder: string;
let browser: Browser;
let page: Page;
let server: Awaited<ReturnType<typeof serve>>;
const uncaught: string[] = [];

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'vesicle-'));
  await cp(at('dist'), folder, { recursive: true });
  server = await serve(folder, 0);
  browser = await launch();
  page = await browser.newPage();
  page.setDefaultTimeout(120_000);
  page.on('pageerror', ({ message }) => uncaught.push(message));
});
afterAll(async () => {
  await browser.close();
  await server.close();
  await rm(folder, { recursive: true });
});

/** Returns the addresses of all cached files, without the server's. */
async function kept(): Promise<string[]> {
  const urls = await page.evaluate(async () => {
    const lists = (await caches.keys()).map(async (name) => (await caches.open(name)).keys());
    return (await Promise.all(lists)).flat().map(({ url }) => url);
  });
  expect(urls.filter((url) => !url.startsWith(server.address))).toEqual([]);
  return urls.map((url) => url.slice(server.address.length)).sort();
}

const listed = async (): Promise<string[]> => JSON.parse(await readFile(join(folder, 'files.json'), 'utf8'));

test('a first visit caches the page, all its code, and the data it opened', async () => {
  await page.goto(`${server.address}#extract?example=tooth`);
  await reach(page, 'done');
  const wanted = [...(await listed()), '', 'icon.svg', 'data/tooth.nrrd'];
  await expect.poll(kept).toEqual(expect.arrayContaining(wanted));
  expect(await kept()).not.toContain('data/angel.ply');
});

test('data opened later are cached, too', async () => {
  await page.goto(`${server.address}#reconstruct?example=angel`);
  await reach(page, 'running', 'done');
  await expect.poll(kept).toContain('data/angel.ply');
});

test('what the page reads of images beside it is not cached', async () => {
  await mkdir(join(folder, 'images'));
  await writeFile(join(folder, 'images/zarr.json'), '{}');
  const read = (name: string) => page.evaluate(async (url) => (await fetch(url)).text(), server.address + name);
  expect(await read('images/zarr.json')).toBe('{}');
  await read('data/README.md');
  await expect.poll(kept).toContain('data/README.md');
  expect(await kept()).not.toContain('images/zarr.json');
});

test('without a server the examples run as before, at all of their addresses', async () => {
  await page.goto(`${server.address}#extract?example=tooth`);
  await reach(page, 'done');
  const before = await measures(page);
  await server.close();
  await page.goto('about:blank');
  await page.goto(`${server.address}?from=somewhere#reconstruct?example=angel`);
  await reach(page, 'running', 'done');
  await open({ page, address: server.address }, 'extract?example=tooth');
  await reach(page, 'done');
  expect(await measures(page)).toEqual(before);
  expect(uncaught).toEqual([]);
});

test('data never opened before need the network, which a message says, and the lab stays usable', async () => {
  await page.selectOption('.data select', 'ovule');
  await reach(page, 'error');
  expect(await page.textContent('.banner')).toMatch(/ovule.* could not be opened.*network/s);
  await page.click('.banner button');
  await reach(page, 'done');
  expect(uncaught).toEqual([]);
});

test('a new deployment is used at the next visit, and files of the old one are deleted', async () => {
  const old = await listed();
  const mark = "\ndocument.documentElement.dataset.deployment = 'second';";
  await build({
    configFile: at('www/vite.config.ts'),
    logLevel: 'error',
    build: { outDir: folder, emptyOutDir: true },
    plugins: [{ name: 'another', transform: (code, id) => (id.endsWith('www/src/main.ts') ? code + mark : undefined) }],
  });
  const fresh = await listed();
  server = await serve(folder, Number(new URL(server.address).port));
  await open({ page, address: server.address }, 'sculpt?example=globe');
  await reach(page, 'done');
  expect(await page.getAttribute('html', 'data-deployment')).toBe('second');
  const gone = old.filter((name) => !fresh.includes(name));
  expect(gone.length).toBeGreaterThan(0);
  await expect.poll(async () => (await kept()).filter((name) => name.startsWith('assets/'))).toEqual(fresh);
});

test('during development nothing is cached', async () => {
  const vite = await createServer({ configFile: at('www/vite.config.ts'), server: { port: 0 }, logLevel: 'error' });
  await vite.listen();
  const developing = await browser.newPage();
  await developing.goto(vite.resolvedUrls?.local[0] ?? '');
  await reach(developing, 'running', 'done');
  const found = await developing.evaluate(() => navigator.serviceWorker.getRegistrations());
  expect(found).toEqual([]);
  await developing.close();
  await vite.close();
});
