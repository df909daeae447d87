/** Warnings beside the measures: shown, announced, a way to their place, and carried into files. */
import { readFile, writeFile } from 'node:fs/promises';
import axe, { type Result } from 'axe-core';
import type { Page } from 'playwright-core';
import { afterAll, beforeAll, expect, test } from 'vitest';
import type { Warning } from '../../www/src/engine/warnings';
import { writeSession } from '../../www/src/lab/session/file';
import { type App, drop, open, openApp, QUICK, reach } from './browser';
import { LONG } from './long';
import { readSession } from './read-session';

/** None of the examples has a warning, so they come with a session. */
const WARNINGS: Warning[] = [
  {
    code: 'anisotropic',
    text: 'Voxels are 6 times as long along z as along x: the shape between the slices is a guess.',
  },
  { code: 'reader', text: 'A slice is missing here.', where: { point: [12, 0, 0] } },
];

let app: App;
beforeAll(async () => {
  app = await openApp();
});
afterAll(async () => {
  expect(app.complaints).toEqual([]);
  await app.close();
});

async function saved(page: Page, selector: string): Promise<Uint8Array> {
  const download = page.waitForEvent('download');
  await page.click(selector);
  return new Uint8Array(await readFile(await (await download).path()));
}

/** Writes a picture for people to look at, if a folder for them is given. */
async function picture(page: Page, name: string): Promise<void> {
  const { WARNING_PICTURES: folder } = process.env;
  if (folder) await writeFile(`${folder}/${name}.png`, await page.screenshot());
}

/** Returns axe's findings in the list of warnings. */
function findings(page: Page): Promise<string[]> {
  return page.evaluate(async () => {
    const { axe } = window as unknown as { axe: { run: (part: string) => Promise<{ violations: Result[] }> } };
    return (await axe.run('[data-warning-list]')).violations.map(({ id, help }) => `${id}: ${help}`);
  });
}

test('warnings are shown beside the measures, lead to their place, and are in all files', async () => {
  const { page } = app;
  await open(app, 'extract?example=linked-rings&v=2');
  await reach(page, 'done');
  const list = page.locator('.warnings');
  expect(await list.isVisible()).toBe(false);
  const plain = await saved(page, '[data-export=ply]');
  const session = await readSession(await saved(page, '[data-action=session]'));
  expect(session.content.warnings).toEqual([]);
  const bytes = await writeSession({ ...session, content: { ...session.content, warnings: WARNINGS } });
  await drop(page, [{ name: 'a.vesicle.zip', bytes }]);

  await list.waitFor();
  expect(await list.locator('h3').textContent()).toBe('2 warnings');
  expect(await list.locator('li').allTextContents()).toEqual([
    WARNINGS[0]?.text,
    'At 12, 0, 0 A slice is missing here.',
  ]);
  const news = page.locator('[data-warning-list] [role=status]');
  expect(await news.textContent()).toMatch(/^2 warnings: Voxels .* At 12, 0, 0: A slice is missing here\.$/);
  await list.scrollIntoViewIfNeeded();
  await page.evaluate(axe.source);
  expect(await findings(page)).toEqual([]);
  await picture(page, 'light');
  await page.emulateMedia({ colorScheme: 'dark' });
  expect(await findings(page)).toEqual([]);
  await picture(page, 'dark');
  await page.setViewportSize({ width: 360, height: 720 });
  await list.scrollIntoViewIfNeeded();
  await picture(page, 'phone');
  expect(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth)).toBe(true);
  await page.setViewportSize({ width: 1280, height: 800 });
  await page.emulateMedia({ colorScheme: 'light' });

  const where = () => page.locator('.slices').textContent();
  const before = await where();
  await list.getByRole('button', { name: 'At 12, 0, 0' }).click();
  await expect.poll(where).not.toBe(before);

  const text = (file: Uint8Array) => new TextDecoder('latin1').decode(file);
  const ply = text(await saved(page, '[data-export=ply]'));
  expect(ply).toContain(`comment warning anisotropic: ${WARNINGS[0]?.text}\n`);
  // All else is the same.
  expect(ply.replace(/comment warning .*\n/g, '')).toBe(text(plain));
  const csv = text(await saved(page, 'button:text("Plot data (CSV)")')).split('\n');
  expect(csv[0]).toMatch(/,warnings$/);
  expect(csv[1]).toMatch(/,anisotropic; reader \(point 12 0 0\)$/);
  expect((await readSession(await saved(page, '[data-action=session]'))).content.warnings).toEqual(WARNINGS);

  await open(app, 'extract?example=sponge&v=2');
  await expect.poll(() => list.isVisible()).toBe(false);
});

/** Opens a session of a lab's example that has a warning about a place, and clicks on it. */
async function goTo(lab: 'track' | 'segment', where: Warning['where'], place: string): Promise<void> {
  const { page } = app;
  await open(app, QUICK[lab]);
  await reach(page, 'done');
  const session = await readSession(await saved(page, '[data-action=session]'));
  const warnings = [{ code: 'reader', text: 'Something is missing.', where }];
  const bytes = await writeSession({ ...session, content: { ...session.content, warnings } });
  await drop(page, [{ name: 'a.vesicle.zip', bytes }]);
  await page.locator('.warnings').getByRole('button', { name: place }).click();
}

test('a click on a frame shows it, and one on a label chooses it', LONG, async () => {
  const { page } = app;
  await goTo('track', { frame: 1 }, 'Frame 2');
  await page.waitForSelector('[data-frame="2"]');
  await open(app, QUICK.segment);
  await reach(page, 'done');
  const radios = page.locator('[data-control=active]');
  const label = await radios.last().getAttribute('data-value');
  await radios.first().check();
  await goTo('segment', { label: Number(label) }, `Label ${label}`);
  await page.waitForSelector(`[data-control=active][data-value="${label}"]:checked`, { state: 'attached' });
});
