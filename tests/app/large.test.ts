/** Volumes larger than memory in the Extract lab: OME-Zarr images as ZIP, folder and address. */
import { readFile } from 'node:fs/promises';
import { unzipSync } from 'fflate';
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { mayReach, SERVERS } from '../../www/src/ui/large-source';
import { type App, drop, measures, open, openApp, QUICK, reach, recordStates, unfold } from './browser';

/** A box of a stack of plant cells in two levels, of 26 × 22 × 14 and 13 × 11 × 7 voxels. */
const IMAGE = at('tests/data/zarr/v3-zstd-zyx.zip');

let app: App;

beforeAll(async () => {
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const amount = () => app.page.textContent('.large-progress .amount');

/** Opens the lab with its fast example, done. */
async function openLab(): Promise<void> {
  await open(app, QUICK.extract);
  await reach(app.page, 'done');
  await unfold(app.page);
}

/** Waits until an image that `opening` opens has been extracted, and checks the surface. */
async function expectExtracted(opening: () => Promise<unknown>): Promise<void> {
  const states = await recordStates(app.page);
  await opening();
  await expect.poll(async () => (await states()).join(' ')).toMatch(/loading.* running.* done$/);
  await expect.poll(() => measures(app.page)).toMatchObject({ closed: true, oriented: true, crossings: 0 });
  expect((await measures(app.page)).triangles).toBeGreaterThan(100);
}

test('a ZIP is opened, its coarsest level displayed, and the surface refined down to the finest', async () => {
  await openLab();
  await expectExtracted(async () => drop(app.page, [{ name: 'cells.zip', bytes: await readFile(IMAGE) }]));
  expect(await app.page.textContent('.facts')).toMatch(/Levels26 × 22 × 14, 13 × 11 × 7/);
  expect(await amount()).toMatch(/^[\d.]+ kB of [\d.]+ kB read, in \d+ chunks$/);
});
