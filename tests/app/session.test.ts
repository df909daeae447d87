/** Sessions of the labs: saved, and opened in a new browser, they go on as if nothing had been in between. */
import { readFile } from 'node:fs/promises';
import type { Page } from 'playwright-core';
import { unzipSync } from 'three/addons/libs/fflate.module.js';
import { afterAll, beforeAll, expect, test } from 'vitest';
import init, { Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { contentOf } from '../../www/src/lab/session/content';
import type { ExtractContent } from '../../www/src/labs/extract/schema';
import { type App, afterRun, drop, open, openApp, QUICK, reach, recordStates, unfold } from './browser';
import { LONG } from './long';
import { readSession } from './read-session';

let app: App;
/** A file of the user's: a tooth, of few voxels. */
let tooth: { name: string; bytes: Uint8Array };

beforeAll(async () => {
  await init();
  const volume = Volume.parse(new Uint8Array(await readFile(at('www/public/data/tooth.nrrd'))));
  tooth = { name: 'tooth.nrrd', bytes: volume.pyramid(4).at(-1)?.toBytes('nrrd') ?? new Uint8Array() };
  app = await openApp();
});
afterAll(async () => {
  expect(app.complaints).toEqual([]);
  await app.close();
});

/** Clicks what saves a file, and returns its content. */
async function saved(page: Page, selector: string): Promise<Uint8Array> {
  const download = page.waitForEvent('download');
  await page.click(selector);
  return new Uint8Array(await readFile(await (await download).path()));
}

/** Matches plain data whose numbers are nearly the same: the camera is rounded on its way. */
function nearly(value: unknown): unknown {
  if (typeof value === 'number') return expect.closeTo(value, 6);
  if (typeof value !== 'object' || value === null) return value;
  if (Array.isArray(value)) return value.map(nearly);
  return Object.fromEntries(Object.entries(value).map(([name, one]) => [name, nearly(one)]));
}

const surface = (page: Page) => saved(page, '[data-export=ply]');
const session = (page: Page) => saved(page, '[data-action=session]');
/** Bytes of a saved state before its contents: version and checksum. */
const HEADER = 16;
const asFile = (bytes: Uint8Array) => [{ name: 'a.vesicle.zip', bytes }];
const banner = (page: Page) => expect.poll(() => page.textContent('.banner:not([hidden]) [data-error]'));

// The buttons to undo and redo name the parameter, too.
const rigidity = (page: Page) => page.getByRole('spinbutton', { name: 'Rigidity' });

async function setRigidity(page: Page, value: string): Promise<void> {
  await rigidity(page).fill(value);
  await rigidity(page).press('Enter');
}

/** Opens the app in a new browser at a lab, calls `work`, and closes the browser. */
async function elsewhere(hash: string, work: (page: Page) => Promise<void>): Promise<void> {
  const another = await openApp(undefined, `#${hash}`);
  try {
    await reach(another.page, 'running', 'done');
    await work(another.page);
    expect(another.complaints).toEqual([]);
  } finally {
    await another.close();
  }
}

/** Opens files that another lab takes, and waits until it has, in a state that is not running. */
async function reopened(page: Page, files: { name: string; bytes: Uint8Array }[], lab: string): Promise<void> {
  const isOpen = await page.isVisible(`#lab.${lab}`);
  const states = await recordStates(page);
  await drop(page, files);
  // The lab that is open may be paused or done before the files are read.
  if (isOpen) await expect.poll(async () => (await states()).join(' ')).toMatch(/\bloading\b.* (paused|done)$/);
  else await page.waitForSelector(`#lab.${lab}[data-state=paused], #lab.${lab}[data-state=done]`);
}

test('a run that was interrupted opens in a new browser as it was, and ends at the same bits', LONG, async () => {
  const { page } = app;
  await open(app, 'extract?example=linked-rings&v=2&p.iso=100');
  await reach(page, 'done');
  await page.press('canvas', 'r');
  await reach(page, 'paused');
  for (const key of ['d', 's', 's']) await page.press('canvas', key);
  await setRigidity(page, '0.3');
  await page.press('canvas', 's');
  await page.check('[data-view=edges]');
  await page.selectOption('[data-view=color]', 'mean curvature');
  await page.press('canvas', 'ArrowLeft');
  const file = await session(page);
  const before = await surface(page);
  await elsewhere('track?example=ventricle', async (other) => {
    await reopened(other, asFile(file), 'extract');
    expect(Buffer.compare(await surface(other), before)).toBe(0);
    // All that is in a session: state, undo, reports, view.
    const [left, found] = [await readSession(file), await readSession(await session(other))];
    expect(found.content.view).toEqual(nearly(left.content.view));
    expect({ ...found, content: { ...found.content, view: undefined } }).toEqual({
      ...left,
      content: { ...left.content, view: undefined },
    });
    for (const one of [page, other]) await afterRun(one, () => one.press('canvas', ' '));
    expect(Buffer.compare(await surface(other), await surface(page))).toBe(0);
  });
});

test('undo goes back beyond the opening of a session', LONG, async () => {
  const { page } = app;
  await open(app, 'extract?example=linked-rings&v=2');
  await reach(page, 'done');
  const before = await surface(page);
  await afterRun(page, () => setRigidity(page, '0.4'));
  const file = await session(page);
  await open(app, 'extract?example=sponge&v=2');
  await reach(page, 'running', 'done');
  await reopened(page, asFile(file), 'extract');
  await page.click('[data-transport=undo]');
  await expect.poll(() => rigidity(page).inputValue()).toBe('0.1');
  expect(Buffer.compare(await surface(page), before)).toBe(0);
});

test('a session that is being saved is the one before data that are opened meanwhile', LONG, async () => {
  const { page } = app;
  await open(app, 'extract?example=linked-rings&v=2');
  await reach(page, 'done');
  await afterRun(page, () => setRigidity(page, '0.4'));
  const expected = await readSession(await session(page));
  const download = page.waitForEvent('download');
  const states = await recordStates(page);
  await page.evaluate(() => {
    document.querySelector<HTMLElement>('[data-action=session]')?.click();
    const examples = document.querySelector<HTMLSelectElement>('.data select');
    if (!examples) return;
    examples.value = 'sponge';
    examples.dispatchEvent(new Event('change'));
  });
  const found = await readSession(await readFile(await (await download).path()));
  expect(contentOf<ExtractContent>(found, 'extract').state).toEqual(
    contentOf<ExtractContent>(expected, 'extract').state,
  );
  expect([found.hash, found.source]).toEqual([expected.hash, expected.source]);
  await expect.poll(async () => (await states()).join(' ')).toMatch(/\bloading\b.* done$/);
  expect(await page.inputValue('.data select')).toBe('sponge');
});

test('a session asks for a file of the user’s, and refuses one with other content', LONG, async () => {
  const { page } = app;
  await open(app, 'extract?example=linked-rings&v=2');
  await reach(page, 'done');
  await afterRun(page, () => drop(page, [tooth]));
  const file = await session(page);
  const before = await surface(page);
  await open(app, 'track?example=ventricle');
  await reach(page, 'running', 'done');
  await drop(page, asFile(file));
  await page.waitForSelector('#lab.extract');
  await banner(page).toContain('Open tooth.nrrd from your disk');
  await drop(page, [{ name: 'tooth.nrrd', bytes: tooth.bytes.slice(1) }]);
  await banner(page).toContain('made with another file tooth.nrrd');
  await drop(page, [{ name: 'other.nrrd', bytes: tooth.bytes.slice(1) }]);
  await banner(page).toContain('It needs the file tooth.nrrd');
  await drop(page, [{ ...tooth, name: 'renamed.nrrd' }]);
  await page.waitForSelector('.banner[hidden]', { state: 'attached' });
  await reach(page, 'done');
  expect(await page.textContent('.facts')).toContain('tooth.nrrd');
  expect(Buffer.compare(await surface(page), before)).toBe(0);
});

test('a session with its data opens anywhere, and one that cannot be read changes nothing', async () => {
  const { page } = app;
  await open(app, 'extract?example=linked-rings&v=2');
  await reach(page, 'done');
  await afterRun(page, () => drop(page, [tooth]));
  await page.check('[data-session=included]');
  const file = await session(page);
  const before = await surface(page);
  await elsewhere('extract?example=linked-rings&v=2', async (other) => {
    // During a run, it would go on, in the same state.
    await reach(other, 'done');
    await afterRun(other, () => setRigidity(other, '0.4'));
    const own = await surface(other);
    await drop(other, asFile(file.slice(0, -100)));
    await banner(other).toContain('It is damaged, or no ZIP');
    await other.click('.banner button');
    expect(Buffer.compare(await surface(other), own)).toBe(0);
    await reopened(other, asFile(file), 'extract');
    await expect.poll(() => other.textContent('.facts')).toContain('tooth.nrrd');
    expect(Buffer.compare(await surface(other), before)).toBe(0);
  });
});

test('a file of version 1 opens', async () => {
  const { page } = app;
  const bytes = new Uint8Array(await readFile(at('tests/app/data/version-1.vesicle.zip')));
  const content = contentOf<ExtractContent>(await readSession(bytes), 'extract');
  await reopened(page, asFile(bytes), 'extract');
  const now = contentOf<ExtractContent>(await readSession(await session(page)), 'extract');
  // Below the version and checksum, a state has one more number since: the iteration in which the run began.
  expect(now.state?.slice(HEADER)).toEqual(Uint8Array.of(0, ...(content.state ?? []).slice(HEADER)));
  expect(now.undo).toEqual(content.undo);
});

test('labels go on in a new browser: the same voxels, surfaces, names and view', LONG, async () => {
  const { page } = app;
  await open(app, QUICK.segment);
  await reach(page, 'done');
  await afterRun(page, () => page.press('canvas', 'p'));
  await page.press('canvas', 'n');
  for (const key of ['.', '.', '.', '.', ']', ']']) await page.press('canvas', key);
  await afterRun(page, () => page.press('canvas', 'p'));
  await page.fill('[data-control=name][data-value="2"]', 'nucleus');
  await page.keyboard.press('Enter');
  await page.press('canvas', 'ArrowLeft');
  await page.uncheck('[data-view=outlines]');
  await page.click('[data-control=visible][data-value="1"]');
  const file = await session(page);
  const [map, surfaces] = [await saved(page, '[data-map=nrrd]'), unzipSync(await saved(page, '[data-export=ply]'))];
  expect(Object.keys(surfaces)).toHaveLength(2);
  await elsewhere('extract?example=linked-rings&v=2', async (other) => {
    await drop(other, asFile(file));
    await other.waitForSelector('#lab.segment[data-state=done]');
    expect(Buffer.compare(await saved(other, '[data-map=nrrd]'), map)).toBe(0);
    expect(unzipSync(await saved(other, '[data-export=ply]'))).toEqual(surfaces);
    const [left, found] = [await readSession(file), await readSession(await session(other))];
    expect(found.content.view).toEqual(nearly(left.content.view));
    expect({ ...found.content, view: undefined }).toEqual({ ...left.content, view: undefined });
    expect(await other.isDisabled('[data-transport=undo]')).toBe(true);
    // Strokes go on from there.
    for (const one of [page, other]) {
      await one.press('canvas', ',');
      await afterRun(one, () => one.press('canvas', 'p'));
    }
    expect(Buffer.compare(await saved(other, '[data-map=nrrd]'), await saved(page, '[data-map=nrrd]'))).toBe(0);
  });
});

test('edits that were undone can be redone in a new browser', LONG, async () => {
  const { page } = app;
  const edits = (one: Page) => one.locator('.edit-log li').allTextContents();
  await open(app, 'extract?example=linked-rings&v=2');
  await reach(page, 'done');
  await unfold(page);
  for (const edit of ['smooth', 'decimate']) await page.click(`[data-finish=${edit}]:enabled`);
  await expect.poll(async () => (await edits(page)).length).toBe(2);
  await expect.poll(() => page.textContent('.status')).toMatch(/Edited surface: [\d,]+ vertices/);
  const edited = await surface(page);
  // Without a clipboard, code is saved as a file.
  await page.evaluate(() => Object.assign(navigator.clipboard, { writeText: () => Promise.reject() }));
  const code = new TextDecoder().decode(await saved(page, '[data-action=code]'));
  expect(code).toMatch(/model\.step\(\d+\);\s*const mesh = .*\s*mesh\.smooth\(.*\s*mesh\.decimate\(/);
  await page.click('[data-finish=undo]:enabled');
  await expect.poll(async () => (await edits(page)).length).toBe(1);
  await page.click('[data-finish=undo]:enabled');
  await expect.poll(() => page.textContent('.status')).toContain('Converged');
  await page.click('[data-finish=redo]:enabled');
  await expect.poll(async () => (await edits(page)).length).toBe(1);
  const before = await surface(page);
  const file = await session(page);
  await elsewhere('track?example=ventricle', async (other) => {
    await reopened(other, asFile(file), 'extract');
    await unfold(other);
    await other.waitForSelector('[data-finish=redo]:enabled');
    expect(Buffer.compare(await surface(other), before)).toBe(0);
    await other.click('[data-finish=redo]');
    await expect.poll(async () => (await edits(other)).length).toBe(2);
    expect(Buffer.compare(await surface(other), edited)).toBe(0);
  });
});

test('a session keeps the log of a run, also after a change of edge lengths in Sculpt', LONG, async () => {
  const { page } = app;
  const codeOf = async (one: Page) => {
    await one.evaluate(() => Object.assign(navigator.clipboard, { writeText: () => Promise.reject() }));
    return new TextDecoder().decode(await saved(one, '[data-action=code]'));
  };
  await open(app, 'sculpt?example=lava');
  await reach(page, 'running');
  await page.press('canvas', ' ');
  await reach(page, 'paused', 'done');
  await unfold(page);
  const edge = page.locator('[data-param=edgeMax] input[type=number]');
  const longer = String(Number((1.1 * Number(await edge.inputValue())).toFixed(3)));
  await edge.fill(longer);
  await edge.press('Enter');
  await page.press('canvas', 's');
  await expect.poll(() => page.inputValue('[data-param=edgeMax] input[type=number]')).toBe(longer);
  await page.waitForSelector('#lab[data-state=paused], #lab[data-state=done]');
  const [file, before, code] = [await session(page), await surface(page), await codeOf(page)];
  expect(code).toContain(`edgeMax: ${longer}`);
  await elsewhere('extract?example=linked-rings&v=2', async (other) => {
    await reopened(other, asFile(file), 'sculpt');
    expect(Buffer.compare(await surface(other), before)).toBe(0);
    expect(await codeOf(other)).toBe(code);
  });
});
