/** Work that is not saved is kept: labs that are left come back as they were, and those of a page that has crashed can. */
import { readFile } from 'node:fs/promises';
import type { Browser, BrowserContext, Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from 'vitest';
import init, { Volume } from '../../pkg/index.js';
import { serveApp } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { afterRun, drop, launch, QUICK, reach } from './browser';
import { LONG } from './long';

let server: Awaited<ReturnType<typeof serveApp>>;
let browser: Browser;
let context: BrowserContext;
let page: Page;
const complaints: string[] = [];

beforeAll(async () => {
  await init();
  server = await serveApp(at('dist'), 0);
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.close();
});
// Each test has a browser profile of its own, in which the user was never asked.
beforeEach(async () => {
  context = await browser.newContext({ viewport: { width: 1280, height: 800 }, deviceScaleFactor: 0.5 });
  context.setDefaultTimeout(60_000);
});
afterEach(async () => {
  await context.close();
  expect(complaints.splice(0)).toEqual([]);
});

/** Opens a page of the same profile at a lab. */
async function openTab(address: string, ...states: string[]): Promise<Page> {
  const tab = await context.newPage();
  tab.on('pageerror', (error) => complaints.push(error.message));
  tab.on('console', (message) => message.type() === 'error' && complaints.push(message.text()));
  await tab.goto(`${server.address}#${address}`);
  await reach(tab, ...(states.length > 0 ? states : ['done']));
  return tab;
}

const lab = () => page.locator('#labs [aria-current=page]').getAttribute('data-lab');
const notice = () => page.locator('#notice');
const questions = () => page.locator('dialog.question[open]').count();

async function saved(selector: string): Promise<Buffer> {
  const download = page.waitForEvent('download');
  await page.locator(selector).first().click();
  return readFile(await (await download).path());
}

/** Goes to another lab and comes back. */
async function leaveAndReturn(...states: string[]): Promise<void> {
  const from = (await lab()) ?? '';
  const other = from === 'track' ? 'extract' : 'track';
  await page.click(`#labs [data-lab=${other}]`);
  await page.waitForSelector(`#labs [data-lab=${other}][aria-current=page]`);
  expect(await questions()).toBe(0);
  await page.click(`#labs [data-lab=${from}]`);
  await page.waitForSelector(`#lab.${from}`);
  await reach(page, ...states);
}

/** Paints a ball in Segment, a slice further than before. */
async function paint(): Promise<void> {
  await page.locator('input[data-tool=brush]').check({ force: true });
  await page.keyboard.press('.');
  await page.locator('[data-action=apply]').click();
  await expect.poll(() => page.locator('[data-transport=undo]').isDisabled()).toBe(false);
  await reach(page, 'done');
}

const LABEL_MAP = '[data-map=nrrd]';

/** Has the browser keep unsaved work, by the dialog. */
async function agree(): Promise<void> {
  await page.click('[data-action=kept]');
  await page.getByRole('checkbox', { name: 'Keep unsaved work in this browser' }).check();
  await page.keyboard.press('Escape');
}

/** Loads the page again, which has to ask first, and stays. */
async function askedBeforeReload(): Promise<void> {
  const asked = page.waitForEvent('dialog');
  const again = page.evaluate(() => location.reload());
  await (await asked).dismiss();
  await again.catch(() => undefined);
}

/** Times at which the labs were kept that the browser's storage has. */
const times = (): Promise<number[]> =>
  page.evaluate(async () => {
    const all = await indexedDB.databases();
    if (!all.some(({ name }) => name === 'vesicle')) return [];
    const request = <T>(one: IDBRequest<T>) =>
      new Promise<T>((resolve) => {
        one.onsuccess = () => resolve(one.result);
      });
    const database = await request(indexedDB.open('vesicle'));
    const labs = await request(database.transaction('labs').objectStore('labs').getAll());
    database.close();
    return labs.map(({ time }) => time);
  });
const stored = async () => (await times()).length;

test('labels that were painted come back when their lab is left and opened again, or gone back to', LONG, async () => {
  page = await openTab(QUICK.segment);
  await paint();
  // Saved or not: it is there when one comes back.
  const before = await saved(LABEL_MAP);
  expect(await questions()).toBe(0);
  await page.click('#labs [data-lab=track]');
  await page.waitForSelector('#labs [data-lab=track][aria-current=page]');
  await page.goBack();
  await page.waitForSelector('#lab.segment');
  await reach(page, 'done');
  expect(Buffer.compare(await saved(LABEL_MAP), before)).toBe(0);
  // Nothing was asked to be kept beyond the page.
  expect(await stored()).toBe(0);
});

test("a user's own file comes back with its run and the edits of its surface, to the same bits", LONG, async () => {
  const volume = Volume.parse(new Uint8Array(await readFile(at('www/public/data/tooth.nrrd'))));
  const bytes = volume.pyramid(4).at(-1)?.toBytes('nrrd') ?? new Uint8Array();
  page = await openTab(QUICK.extract);
  await afterRun(page, () => drop(page, [{ name: 'my tooth.nrrd', bytes }]));
  await page.getByRole('heading', { name: 'Edit the surface' }).click();
  for (const [count, edit] of ['keep-largest', 'decimate'].entries()) {
    await page.click(`[data-finish=${edit}]`);
    await expect.poll(() => page.locator('.edit-log li').count()).toBe(count + 1);
  }
  const before = await page.evaluate(() => document.querySelector('[data-measures]')?.getAttribute('data-measures'));
  await leaveAndReturn('paused', 'done');
  await expect.poll(() => page.locator('.edit-log li').count()).toBe(2);
  expect(await page.getAttribute('[data-measures]', 'data-measures')).toBe(before);
  const surface = await saved('[data-export=ply]');
  await leaveAndReturn('paused', 'done');
  await expect.poll(() => page.locator('.edit-log li').count()).toBe(2);
  expect(Buffer.compare(await saved('[data-export=ply]'), surface)).toBe(0);
});

// Track shows one frame after the other, so that it is compared by the measures of all frames.
test.each([
  ['reconstruct', '[data-export=ply]'],
  ['track', '[data-action=save-table]'],
  ['sculpt', '[data-export=ply]'],
] as const)('a run in %s comes back to the same bits', LONG, async (lab, result) => {
  page = await openTab(QUICK[lab]);
  await page.press('canvas', 'r');
  await reach(page, 'paused');
  await afterRun(page, () => page.press('canvas', ' '));
  const before = await saved(result);
  await leaveAndReturn('paused', 'done');
  expect(Buffer.compare(await saved(result), before)).toBe(0);
});

test(
  'a page that ends without a word: its work is offered, comes back to the same bits, and can be discarded',
  LONG,
  async () => {
    page = await openTab(QUICK.segment);
    await paint();
    // Asked once, where it moves nothing.
    await notice().getByRole('button', { name: 'Keep it', exact: true }).click();
    await expect.poll(stored).toBe(1);
    const before = await saved(LABEL_MAP);
    // Saved as a file, it is kept no more.
    await expect.poll(stored).toBe(0);
    await paint();
    await expect.poll(stored).toBe(1);
    const undone = Date.now();
    await page.locator('[data-transport=undo]').click();
    await expect.poll(async () => (await times()).every((time) => time > undone)).toBe(true);
    const ended = page;
    page = await openTab(QUICK.extract);
    // The other page is open.
    expect(await notice().isVisible()).toBe(false);
    await ended.close();
    await page.reload();
    await notice().getByText('Segment: Plant ovule').waitFor();
    await notice()
      .getByRole('button', { name: /^Bring back/ })
      .click();
    await page.waitForSelector('#lab.segment');
    await reach(page, 'done');
    expect(Buffer.compare(await saved(LABEL_MAP), before)).toBe(0);
    await paint();
    await expect.poll(stored).toBe(1);
    const another = page;
    page = await openTab(QUICK.extract);
    await another.close();
    await page.reload();
    await notice()
      .getByRole('button', { name: /^Discard/ })
      .click();
    await expect.poll(stored).toBe(0);
    expect(await notice().isVisible()).toBe(false);
  },
);

test('a lab that is left again before it is back, and one that two pages bring back', LONG, async () => {
  page = await openTab(QUICK.segment);
  await paint();
  const before = await saved(LABEL_MAP);
  // Twice before it is back.
  for (const lab of ['track', 'segment', 'track', 'segment', 'track', 'segment']) {
    await page.click(`#labs [data-lab=${lab}]`);
    await page.waitForSelector(`#labs [data-lab=${lab}][aria-current=page]`);
  }
  await page.waitForSelector('#lab.segment');
  await reach(page, 'done');
  expect(Buffer.compare(await saved(LABEL_MAP), before)).toBe(0);
  await paint();
  await agree();
  await expect.poll(stored).toBe(1);
  const ended = page;
  const tabs = [await openTab(QUICK.extract), await openTab(QUICK.extract)];
  await ended.close();
  for (const tab of tabs) await tab.reload();
  for (const tab of tabs) {
    page = tab;
    await notice()
      .getByRole('button', { name: /^Bring back/ })
      .click();
    await page.waitForSelector('#lab.segment');
    await reach(page, 'done');
  }
  // Each keeps its own, in place of the one that both are from.
  await expect.poll(stored).toBe(2);
});

test(
  'loading the page again asks only about what the browser does not keep, and no longer keeps what it shall not',
  LONG,
  async () => {
    page = await openTab(QUICK.segment);
    await paint();
    await notice().getByRole('button', { name: 'Do not keep it' }).click();
    await askedBeforeReload();
    // Work in a lab that was left would be lost with the page, too.
    await page.click('#labs [data-lab=track]');
    await page.waitForSelector('#labs [data-lab=track][aria-current=page]');
    await askedBeforeReload();
    await page.click('#labs [data-lab=segment]');
    await page.waitForSelector('#lab.segment');
    await reach(page, 'done');
    await agree();
    await expect.poll(stored).toBe(1);
    // Nothing is lost now, and nothing is asked: a dialog would fail the reload.
    await page.reload();
    await notice().getByText('Segment: Plant ovule').waitFor();
    await page.click('[data-action=kept]');
    await page.getByRole('checkbox', { name: 'Keep unsaved work in this browser' }).uncheck();
    await expect.poll(stored).toBe(0);
  },
);

test('a browser without room says so, and loading the page again asks', LONG, async () => {
  page = await openTab(QUICK.segment);
  await agree();
  await page.evaluate(() => {
    IDBObjectStore.prototype.put = () => {
      throw new DOMException('full', 'QuotaExceededError');
    };
  });
  await paint();
  await expect.poll(() => notice().textContent()).toContain('the browser has no more room');
  await askedBeforeReload();
  // The page itself keeps it.
  await leaveAndReturn('done');
  expect(await page.locator('[data-transport=undo]').count()).toBe(1);
});
