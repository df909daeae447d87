// examples/viewer as its reader tries it: in a folder outside of the repository, with the packed package.
import { cp, mkdtemp, readFile, rm, symlink, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { build } from 'vite';
import { afterAll, beforeAll, expect, test } from 'vitest';
import init, { DeformableModel, Volume } from '../../pkg/index.js';
import { serve } from '../../scripts/serve.mjs';
import { at, must } from '../../scripts/shell.mjs';
import { launch, openPage } from './browser';
import { countPixels } from './pixels';

let folder = '';
let server: Awaited<ReturnType<typeof serve>>;
let browser: Browser;
let page: Page;
const complaints: string[] = [];
let volume: Volume;

beforeAll(async () => {
  await init();
  volume = Volume.parse(new Uint8Array(await readFile(at('www/public/data/tooth.nrrd')))).pyramid(3)[2] as Volume;
  folder = await mkdtemp(join(tmpdir(), 'vesicle-viewer-'));
  await cp(at('examples/viewer'), folder, { recursive: true });
  // While developing, the package may lack what `prepack` asks for.
  const pack = ['pack', '--silent', '--ignore-scripts', '--pack-destination', folder, at('pkg')];
  const packed = (await must('npm', pack)).trim().split('\n').at(-1) ?? '';
  await writeFile(join(folder, 'package.json'), '{ "private": true, "type": "module" }');
  await must('npm', ['install', '--offline', '--no-audit', '--no-fund', join(folder, packed)], { cwd: folder });
  await symlink(at('node_modules/three'), join(folder, 'node_modules/three'));
  await build({ root: folder, configFile: false, logLevel: 'error' });
  server = await serve(join(folder, 'dist'), 0);
  browser = await launch();
  page = await openPage(browser, complaints, { viewport: { width: 900, height: 600 } });
  page.setDefaultTimeout(120_000);
  await page.goto(server.address);
});
afterAll(async () => {
  await browser.close();
  await server.close();
  await rm(folder, { recursive: true, force: true });
  expect(complaints).toEqual([]);
});

const status = () => page.locator('#status').textContent();
const press = (name: string) => page.getByRole('button', { name }).click();

async function saved(): Promise<Buffer> {
  const download = page.waitForEvent('download');
  await press('Save STL');
  return readFile(await (await download).path());
}

/** Number of triangles in a binary STL file. */
const triangles = (stl: Buffer) => stl.readUInt32LE(80);

test('a volume is opened, and its surface is that of the package', async () => {
  await expect.poll(status).toMatch(/^Open a volume/);
  await page
    .locator('#file')
    .setInputFiles({ name: 'tooth.nrrd', mimeType: '', buffer: Buffer.from(volume.toBytes('nrrd')) });
  await expect.poll(status).toMatch(/^tooth\.nrrd, /);
  const iso = Number(await page.locator('#iso').inputValue());
  await press('Run');
  await expect.poll(status).toMatch(/^\d+ triangles/);
  const model = new DeformableModel({ volume: Volume.parse(volume.toBytes('nrrd')), params: { iso } });
  await model.run();
  expect(Buffer.compare(await saved(), Buffer.from(model.mesh.toBytes('stl')))).toBe(0);
  const coloured = (r: number, g: number, b: number) => r > b + 40 && g > 20;
  if (process.env.SHOT) await page.screenshot({ path: process.env.SHOT });
  await expect.poll(async () => countPixels(page, await page.screenshot(), coloured)).toBeGreaterThan(5000);
});

test('the surface is edited and saved', async () => {
  const before = triangles(await saved());
  await press('Smooth');
  await expect.poll(status).toMatch(/^\d+ triangles/);
  expect(triangles(await saved())).toBe(before);
  await press('Halve');
  await expect.poll(status).toMatch(/^\d+ triangles/);
  expect(triangles(await saved()) / before).toBeCloseTo(0.5, 2);
});

test('a run is cancelled, and the next one goes to the end', async () => {
  // At once, before a run of so few voxels is over.
  await page.evaluate(() => {
    for (const id of ['run', 'cancel']) document.getElementById(id)?.click();
  });
  await expect.poll(status).toBe('Cancelled.');
  await press('Run');
  await expect.poll(status).toMatch(/^\d+ triangles/);
});

test('a file that is no volume is refused in words', async () => {
  await page
    .locator('#file')
    .setInputFiles({ name: 'notes.txt', mimeType: 'text/plain', buffer: Buffer.from('no volume') });
  await expect.poll(status).toMatch(/not|no /);
  // The volume before stays open.
  await press('Run');
  await expect.poll(status).toMatch(/^\d+ triangles/);
});
