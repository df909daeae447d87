/** Damaged sessions: each lab refuses them, keeps its content, and opens the next file. */

import { readFile } from 'node:fs/promises';
import type { Page } from 'playwright-core';
import { strFromU8, strToU8, unzipSync, type Zippable, zipSync } from 'three/addons/libs/fflate.module.js';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { type App, afterRun, anotherPage, drop, LABS, open, openApp, QUICK, reach } from './browser';

let app: App;
/** A session of the Extract lab with its data. */
let tooth: Uint8Array;

beforeAll(async () => {
  tooth = new Uint8Array(await readFile(at('tests/app/data/version-1.vesicle.zip')));
  app = await openApp();
});
afterAll(async () => {
  expect(app.complaints).toEqual([]);
  await app.close();
});

// biome-ignore lint/suspicious/noExplicitAny: any part of the file may be damaged
type Index = any;

/** Returns the file of a session with `session.json` changed. */
function withIndex(session: Uint8Array, change: (index: Index) => void): Uint8Array {
  const files = unzipSync(session);
  const index = JSON.parse(strFromU8(files['session.json'] ?? Uint8Array.of()));
  change(index);
  files['session.json'] = strToU8(JSON.stringify(index));
  return zipSync(files as Zippable);
}

async function saved(page: Page): Promise<Uint8Array> {
  const download = page.waitForEvent('download');
  await page.click('[data-action=session]');
  return new Uint8Array(await readFile(await (await download).path()));
}

const dropSession = (page: Page, bytes: Uint8Array) => drop(page, [{ name: 'a.vesicle.zip', bytes }]);
const banner = (page: Page) => expect.poll(() => page.textContent('.banner:not([hidden]) [data-error]'));
const facts = (page: Page) => page.textContent('.facts');

test('a session with a damaged view is refused by name, and the file after it opens', async () => {
  const { page } = app;
  await open(app, QUICK.extract);
  await reach(page, 'done');
  const before = await facts(page);
  const damaged = withIndex(tooth, ({ view }) => {
    view.crosshair = ['x', 1, 2];
  });
  await dropSession(page, damaged);
  await banner(page).toContain('view.crosshair[0] is not a number');
  expect(await facts(page)).toBe(before);
  const { 'source/files/0/content.bin': bytes = Uint8Array.of() } = unzipSync(tooth);
  await afterRun(page, () => drop(page, [{ name: 'tooth.nrrd', bytes }]));
  expect(await facts(page)).toContain('tooth.nrrd');
});

test('a session whose state is damaged leaves what is open, and gives up the one that waits for data', async () => {
  const { page } = app;
  await open(app, QUICK.extract);
  await reach(page, 'done');
  const before = await facts(page);
  await dropSession(
    page,
    withIndex(tooth, ({ source }) => delete source.files[0].content),
  );
  await banner(page).toContain('Open tooth.nrrd');
  await dropSession(
    page,
    withIndex(tooth, (index) => Object.assign(index, { state: index.undo[0].page, undo: [] })),
  );
  await banner(page).toContain('state is of the wrong kind');
  // The same state as one of another method.
  const other = withIndex(tooth, (index) => Object.assign(index, { state: index.source.files[0].content, undo: [] }));
  await dropSession(
    page,
    withIndex(other, ({ source }) => Object.assign(source, { example: 'linked-rings', files: [] })),
  );
  await banner(page).toContain('not a saved state');
  await page.waitForSelector('#lab[data-state=done], #lab[data-state=error]');
  expect(await facts(page)).toBe(before);
  await dropSession(page, tooth);
  await expect.poll(() => facts(page)).toContain('tooth.nrrd');
  await page.waitForSelector('.banner[hidden]', { state: 'attached' });
});

test('a session that is dropped with its data opens, and with other data nothing does', async () => {
  const { page } = app;
  await open(app, QUICK.extract);
  await reach(page, 'done');
  const before = await facts(page);
  const data = { name: 'tooth.nrrd', bytes: unzipSync(tooth)['source/files/0/content.bin'] ?? Uint8Array.of() };
  const alone = withIndex(tooth, ({ source }) => delete source.files[0].content);
  const together = (bytes: Uint8Array, ...others: (typeof data)[]) =>
    drop(page, [...others, { name: 'a.vesicle.zip', bytes }]);
  await together(tooth, data);
  await banner(page).toContain('Open one session by itself, or with its data');
  await together(alone, { ...data, bytes: data.bytes.slice(1) });
  await banner(page).toContain('tooth.nrrd');
  expect(await facts(page)).toBe(before);
  await together(alone, data);
  await page.waitForSelector('.banner[hidden]', { state: 'attached' });
  await expect.poll(() => facts(page)).toContain('tooth.nrrd');
});

test.each(LABS)('%s: its own session opens, and with a camera nowhere it is refused', async (lab) => {
  const { page } = app;
  await open(app, QUICK[lab]);
  await reach(page, 'running', 'done');
  const session = await saved(page);
  const damaged = withIndex(session, ({ view }) => {
    view.camera.position[1] = { $number: 'NaN' };
  });
  await dropSession(page, damaged);
  await banner(page).toContain('view.camera.position[1] is not a number');
  await dropSession(page, session);
  await page.waitForSelector('.banner[hidden]', { state: 'attached' });
  await reach(page, 'paused', 'done');
});

test('a small session whose edit would make a large mesh opens without it, and says so', async () => {
  const { page } = app;
  await open(app, QUICK.extract);
  await reach(page, 'done');
  const smooth = { op: 'smooth', iterations: 1, keepVolume: true };
  const remesh = { op: 'remesh', min: 0.1, max: 0.21 };
  await dropSession(
    page,
    withIndex(tooth, (index) => {
      index.edits = [smooth, remesh];
    }),
  );
  await banner(page).toMatch(/remesh\(\{ min: 0\.1, max: 0\.21 \}\) would give about [\d,]+ vertices, .* 200,000\.$/);
  expect(await facts(page)).toContain('tooth.nrrd');
  expect(await page.textContent('.finish [role=alert]')).toMatch(
    /^The session is open; edits of its surface made again: 1 of 2/,
  );
  expect(await page.locator('.edit-log li').count()).toBe(1);
});

test('a session whose edits are cancelled is open without them, and says so', async () => {
  const { page } = app;
  await open(app, QUICK.extract);
  await reach(page, 'done');
  // As many as there may be, of which each takes seconds.
  const smooth = { op: 'smooth', iterations: 10_000, keepVolume: true };
  await dropSession(
    page,
    withIndex(tooth, (index) => {
      index.edits = Array(50).fill(smooth);
    }),
  );
  await expect.poll(() => facts(page)).toContain('tooth.nrrd');
  await page.click('[data-finish=cancel]:enabled');
  const status = () => page.textContent('[data-finish=status]');
  const cancelled = /^Cancelled\. The session is open; edits of its surface made again: (\d+) of 50\.$/;
  await expect.poll(status).toMatch(cancelled);
  // A click may come late, but not by 50 edits.
  const made = Number((await status())?.match(cancelled)?.[1]);
  expect(made).toBeLessThan(50);
  expect(await page.locator('.edit-log li').count()).toBe(made);
});

test('a session is read in a worker, which refuses it in the language of the page', async () => {
  const page = await anotherPage(app, () => {
    const { parse } = JSON;
    JSON.parse = (text, ...more) => {
      if (text.length > 1e5) document.body.dataset.parsed = 'on the page';
      return parse(text, ...more);
    };
  });
  await page.goto(`${app.address}?lang=de#${QUICK.extract}`);
  await reach(page, 'done');
  await dropSession(
    page,
    withIndex(tooth, (index) => {
      index.hash = 'x'.repeat(2 ** 21);
    }),
  );
  await banner(page).toContain('Ihre session.json ist beschädigt: hash ist zu lang');
  expect(await page.getAttribute('body', 'data-parsed')).toBeNull();
  await page.close();
});
