// `<vesicle-lab>` on other pages: with the package's own files, and nothing of the app.
import { cp, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import init, { Mesh } from 'vesicle';
import type {} from 'vesicle/element';
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { beating } from '../js/beating';
import { launch, openPage, writePage } from './browser';
import { LONG } from './long';
import { changes, countPixels } from './pixels';
import { metaImageHeader, ring } from './volumes';

const POLICY =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; img-src data:";

let browser: Browser;
let folder = '';
let server: { address: string; close: () => unknown };
let page: Page;
const complaints: string[] = [];

beforeAll(async () => {
  await init();
  folder = await mkdtemp(join(tmpdir(), 'vesicle-element-'));
  await cp(at('pkg'), join(folder, 'vesicle'), { recursive: true });
  const header = Buffer.from(metaImageHeader('LOCAL'));
  await writeFile(join(folder, 'ring.mha'), Buffer.concat([header, ring()]));
  await cp(at('www/public/data/nefertiti-base.ply'), join(folder, 'bust.ply'));
  server = await serve(folder, 0);
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.close();
  await rm(folder, { recursive: true, force: true });
});
afterEach(async () => {
  await page.close();
  expect(complaints.splice(0)).toEqual([]);
});

/** Opens a page with the element in it and records the element's events. */
async function open(body: string, before = ''): Promise<void> {
  page = await openPage(browser, complaints);
  page.setDefaultTimeout(120_000);
  await writePage(folder, POLICY, body, `${before}<script type="module" src="./vesicle/element.js"></script>`);
  await page.goto(server.address);
}

// From an enclosing box a run takes long enough to be observed; from the contour it takes a few steps.
const FROM_AFAR = `start="enclosing" params='{ "integrator": "euler" }'`;

const state = (wanted: string) => page.waitForSelector(`vesicle-lab[data-state=${wanted}]`);
const words = () => page.locator('vesicle-lab output').textContent();
const press = (name: string) => page.getByRole('button', { name, exact: true }).click();

/** Returns the number of pixels of the view that are not background. */
async function drawnPixels(): Promise<number> {
  const picture = await page.locator('vesicle-lab canvas').screenshot();
  return countPixels(page, picture, (r, _g, _b, ground) => Math.abs(r - ground) > 12);
}

test('it runs on its volume by itself, under a strict policy', async () => {
  await open('<vesicle-lab src="ring.mha" params=\'{ "iso": 128 }\'></vesicle-lab>');
  await state('done');
  expect(await words()).toMatch(/^Done: [\d,]+ vertices in one component\.$/);
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
  const { genus, closed } = await page.evaluate(async () => {
    const mesh = document.querySelector('vesicle-lab')?.model?.mesh;
    return { genus: (await mesh?.info())?.genus, closed: (await mesh?.check())?.closed };
  });
  expect({ genus, closed }).toEqual({ genus: 1, closed: true });
});

test('pause, step, play and reset work, and every step emits an event', async () => {
  await open(`<vesicle-lab src="ring.mha" ${FROM_AFAR} paused></vesicle-lab>`);
  await state('paused');
  await page.evaluate(() => {
    const lab = document.querySelector('vesicle-lab');
    const told: unknown[] = [];
    for (const name of ['vesicle-step', 'vesicle-done'])
      lab?.addEventListener(name, (event) => told.push((event as CustomEvent).detail?.iteration ?? event.type));
    Object.assign(window, { told });
  });
  await press('Step');
  await expect.poll(() => page.evaluate('told')).toEqual([1]);
  expect(await page.locator('vesicle-lab .figures').textContent()).toMatch(/^Step 1, level 0: [\d,]+ vertices$/);
  await press('Play');
  await state('done');
  const told = (await page.evaluate('told')) as unknown[];
  expect(told.filter((one) => one === 'vesicle-done')).toEqual([told.at(-1)]);
  // In order, several steps at a time.
  const steps = told.slice(0, -1).map(Number);
  expect(steps).toEqual(steps.toSorted((a, b) => a - b));
  expect(steps.length).toBeGreaterThan(5);
  await press('Reset');
  await state('paused');
  expect(await words()).toBe('Ready.');
});

test('changed attributes restart it', LONG, async () => {
  await open('<vesicle-lab src="ring.mha" paused></vesicle-lab>');
  await state('paused');
  const rigidity = () =>
    page.evaluate(async () => (await document.querySelector('vesicle-lab')?.model?.params)?.rigidity);
  expect(await rigidity()).not.toBe(0.05);
  await page.evaluate(() => document.querySelector('vesicle-lab')?.setAttribute('params', '{ "rigidity": 0.05 }'));
  await expect.poll(rigidity).toBe(0.05);
});

test('the view rotates by keys and is described in words', LONG, async () => {
  await open('<vesicle-lab src="ring.mha"></vesicle-lab>');
  await state('done');
  const view = page.getByRole('img', { name: /^The surface\. Arrow keys rotate it/ });
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
  const before = await view.screenshot();
  await view.press('ArrowUp');
  await changes(page, before, () => view.screenshot(), 0.02);
});

/** Elements with invalid attributes or data, and their error messages. */
const INVALID: [string, string | RegExp][] = [
  ['<vesicle-lab></vesicle-lab>', 'src: must be the address of a file'],
  [
    '<vesicle-lab src="ring.mha" method="magic"></vesicle-lab>',
    /^method: must be one of deformable, implicit, tracking, multires, got 'magic'$/,
  ],
  ['<vesicle-lab src="ring.mha" params="iso 3"></vesicle-lab>', /^params: 'iso 3' is not JSON/],
  ['<vesicle-lab src="ring.mha" start="above"></vesicle-lab>', /^start: 'above'; accepted: contour, enclosing/],
  ['<vesicle-lab src="ring.mha" params=\'{ "isoo": 3 }\'></vesicle-lab>', /isoo/],
  ['<vesicle-lab src="bust.ply"></vesicle-lab>', /NIfTI/],
  [
    `<vesicle-lab src="bust.ply" method="multires" ellipsoids='[{ "center": [0, 0, 0] }]'></vesicle-lab>`,
    /ellipsoids\[0\]\.axes/,
  ],
];

test('each element with invalid attributes or data shows an error message', async () => {
  await open(INVALID.map(([body]) => body).join(''));
  await expect.poll(() => page.locator('vesicle-lab[data-state=error]').count()).toBe(INVALID.length);
  const messages = await page.locator('vesicle-lab output').allTextContents();
  for (const [i, [body, message]] of INVALID.entries()) expect(messages[i], body).toMatch(message);
});

test('a missing file', LONG, async () => {
  await open('<vesicle-lab src="gone.nii"></vesicle-lab>');
  await state('error');
  expect(await words()).toMatch(/gone\.nii: 404/);
  // The browser reports it as well.
  expect(complaints.splice(0)).toHaveLength(1);
});

test('points', async () => {
  const points = Array.from({ length: 600 }, (_, k) => {
    const z = 1 - (2 * (k + 0.5)) / 600;
    const [radius, turn] = [Math.sqrt(1 - z * z), k * 2.399963];
    return `${radius * Math.cos(turn)} ${radius * Math.sin(turn)} ${z}`;
  });
  await writeFile(join(folder, 'ball.xyz'), points.join('\n'));
  await open('<vesicle-lab src="ball.xyz" method="implicit"></vesicle-lab>');
  await state('done');
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
});

test('a mesh without ellipsoids, which stays as it is', async () => {
  await open('<vesicle-lab src="bust.ply" method="multires"></vesicle-lab>');
  await state('done');
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
});

test('a mesh with ellipsoids, which runs without end', LONG, async () => {
  await writeFile(
    join(folder, 'ball.ply'),
    Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.3 }).toBytes('ply'),
  );
  const axes = [0, 1, 2].map((axis) => [0, 1, 2].map((other) => (axis === other ? 0.9 : 0)));
  const ellipsoids = JSON.stringify([{ center: [0, 0, 0], axes }]);
  await open(`<vesicle-lab src="ball.ply" method="multires" ellipsoids='${ellipsoids}' paused></vesicle-lab>`);
  await state('paused');
  await press('Step');
  await expect.poll(() => page.locator('vesicle-lab .figures').textContent()).toMatch(/^Step 1/);
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
});

test('a volume with frames', LONG, async () => {
  await writeFile(join(folder, 'beating.nii'), beating().toNifti());
  await open('<vesicle-lab src="beating.nii" method="tracking" params=\'{ "threshold": 60 }\'></vesicle-lab>');
  await state('done');
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
});

test('cavities of a volume with frames are open or closed, and nothing else', async () => {
  const tracking = (cavity: string) =>
    `<vesicle-lab src="beating.nii" method="tracking" cavity="${cavity}" paused></vesicle-lab>`;
  await writeFile(join(folder, 'beating.nii'), beating().toNifti());
  await open(tracking('closed'));
  await state('paused');
  await open(tracking('shut'));
  await state('error');
  expect(await page.locator('vesicle-lab output').textContent()).toMatch(
    /^cavity: must be 'closed' or 'open', got 'shut'/,
  );
});

test('removed from the page it stops, and inserted again it restarts', LONG, async () => {
  await open(`<vesicle-lab src="ring.mha" ${FROM_AFAR}></vesicle-lab>`);
  await state('done');
  // A run may end before a look at the page finds it running, so the states are recorded.
  await page.evaluate(() => {
    const lab = document.querySelector('vesicle-lab');
    if (!lab) return;
    const before: (string | null)[] = [];
    const record = (changes: MutationRecord[]) => before.push(...changes.map(({ oldValue }) => oldValue));
    new MutationObserver(record).observe(lab, { attributeFilter: ['data-state'], attributeOldValue: true });
    Object.assign(window, { before });
    lab.remove();
    document.body.append(lab);
  });
  await page.waitForFunction(() => (window as unknown as { before: string[] }).before.includes('running'));
  await state('done');
  await expect.poll(drawnPixels).toBeGreaterThan(2000);
});

test('without WebGL there are numbers, and a message in place of the view', LONG, async () => {
  await writeFile(join(folder, 'blind.js'), 'HTMLCanvasElement.prototype.getContext = () => null;');
  await open('<vesicle-lab src="ring.mha"></vesicle-lab>', '<script src="./blind.js"></script>');
  await state('done');
  expect(await page.locator('vesicle-lab p').textContent()).toMatch(/WebGL is not available/);
  // three.js reports it as well.
  expect(complaints.splice(0).every((complaint) => /WebGL/.test(complaint))).toBe(true);
});
