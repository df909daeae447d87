import { mkdir, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { createServer } from 'vite';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { measures, open, reach } from './browser';
import { deploy } from './deployment';
import { LONG } from './long';

let app: Awaited<ReturnType<typeof deploy>>;

beforeAll(async () => {
  app = await deploy();
});
afterAll(() => app.close());

test('a first visit caches the page, all its code, and the data it opened', async () => {
  await app.page.goto(`${app.address}#extract?example=tooth`);
  await reach(app.page, 'running', 'done');
  const wanted = [...(await app.listed()), '', 'icon.svg', 'data/tooth.nrrd'];
  await expect.poll(app.kept).toEqual(expect.arrayContaining(wanted));
  expect(await app.kept()).not.toContain('data/angel.ply');
});

test('data opened later are cached, too', async () => {
  await app.page.goto(`${app.address}#reconstruct?example=angel`);
  await reach(app.page, 'running', 'done');
  await expect.poll(app.kept).toContain('data/angel.ply');
});

test('what the page reads of images beside it is not cached', async () => {
  await mkdir(join(app.folder, 'images'));
  await writeFile(join(app.folder, 'images/zarr.json'), '{}');
  const read = (name: string) => app.page.evaluate(async (url) => (await fetch(url)).text(), app.address + name);
  expect(await read('images/zarr.json')).toBe('{}');
  await read('data/README.md');
  await expect.poll(app.kept).toContain('data/README.md');
  expect(await app.kept()).not.toContain('images/zarr.json');
});

test('without a server the examples run as before', LONG, async () => {
  await open(app, 'reconstruct?example=angel');
  await reach(app.page, 'running', 'done');
  await expect.poll(app.kept).toEqual(expect.arrayContaining([...(await app.listed()), '', 'data/angel.ply']));
  await open(app, 'extract?example=tooth');
  await reach(app.page, 'done');
  await expect.poll(app.kept).toContain('data/tooth.nrrd');
  const before = await measures(app.page);
  await app.stopServer();
  await open(app, 'reconstruct?example=angel');
  await reach(app.page, 'running', 'done');
  await open(app, 'extract?example=tooth');
  await reach(app.page, 'done');
  expect(await measures(app.page)).toEqual(before);
  expect(app.uncaught).toEqual([]);
  await app.restartServer();
});

test('without a server the page opens at all of its addresses', async () => {
  await app.stopServer();
  await app.page.goto('about:blank');
  await app.page.goto(`${app.address}?from=somewhere#reconstruct?example=angel`);
  await reach(app.page, 'running', 'done');
  await open(app, 'extract?example=tooth');
  await reach(app.page, 'done');
  expect(app.uncaught).toEqual([]);
});

test('data never opened before need the network, which a message says, and the lab stays usable', async () => {
  await app.page.selectOption('.data select', 'ovule');
  await reach(app.page, 'error');
  expect(await app.page.textContent('.banner')).toMatch(/ovule.* could not be opened.*network/s);
  await app.page.click('.banner button');
  await reach(app.page, 'done');
  expect(app.uncaught).toEqual([]);
});

test('during development nothing is cached', LONG, async () => {
  const vite = await createServer({ configFile: at('www/vite.config.ts'), server: { port: 0 }, logLevel: 'error' });
  await vite.listen();
  const developing = await app.browser.newPage();
  await developing.goto(vite.resolvedUrls?.local[0] ?? '');
  await reach(developing, 'running', 'done');
  const found = await developing.evaluate(() => navigator.serviceWorker.getRegistrations());
  expect(found).toEqual([]);
  await developing.close();
  await vite.close();
});
