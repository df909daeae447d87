import { readFile } from 'node:fs/promises';
import type { Page } from 'playwright-core';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { type App, openApp, overflow } from './browser';

let app: App;
/** The benchmark page, in a tab of its own. */
let page: Page;
let report: Record<string, unknown>;

beforeAll(async () => {
  report = JSON.parse(await readFile(at('bench.json'), 'utf8'));
  app = await openApp({ width: 1100, height: 900 });
  // Opened from the keyboard shortcuts, as by a reader.
  await app.page.click('#help');
  const opened = app.page.waitForEvent('popup');
  await app.page.click('dialog a[href$="bench.html"]');
  page = await opened;
  await page.setViewportSize({ width: 1100, height: 900 });
  await page.waitForSelector('[data-bench]');
});
afterAll(() => app.close());

/** Returns the numbers that are drawn in a part of the page. */
const drawn = (part: string) =>
  page.locator(`${part} data`).evaluateAll((all) => all.map((one) => Number((one as HTMLDataElement).value)));

/** Returns the names of benches in the report: entries that are objects. */
const benches = () => Object.keys(report).filter((name) => typeof report[name] === 'object');

test('every bench of the report is plotted, with a table of its numbers', async () => {
  const found = await page
    .locator('[data-bench]')
    .evaluateAll((all) => all.map((one) => one.getAttribute('data-bench') ?? ''));
  expect(found.toSorted()).toEqual(benches().toSorted());
  for (const name of found) {
    const values = await drawn(`[data-bench=${name}]`);
    const skipped = await page.locator(`[data-bench=${name}] .bench-skipped`).count();
    expect(values.length + skipped, name).toBeGreaterThan(0);
    expect(values.every(Number.isFinite), name).toBe(true);
    const rows = await page.locator(`[data-bench=${name}] tbody tr`).allTextContents();
    expect(rows.length, name).toBeGreaterThan(0);
  }
});

test('the numbers are those of the report', async () => {
  const [head] = report.head as { ratio: number; model: { milliseconds: number } }[];
  expect(await drawn('#head')).toEqual(expect.arrayContaining([head?.ratio, (head?.model.milliseconds ?? 0) / 1000]));
  const { rows } = report.peers as { rows: { ratio?: number }[] };
  expect(await drawn('#peers')).toEqual(rows.flatMap(({ ratio }) => ratio ?? []));
});

test('missed bounds are marked', async () => {
  const count = (outcome: string) => page.locator(`#summary tr[data-verdict="${outcome}"]`).count();
  const all = await page.locator('#summary tr[data-verdict]').count();
  const title = await page.textContent('#summary h2');
  expect(title).toBe(`${await count('met')} of ${all} targets met`);
  const [model] = await page.locator('#head .verdict').allTextContents();
  const slow = (report.head as { model: { milliseconds: number } }[]).some(({ model }) => model.milliseconds > 2000);
  expect(model).toBe(`target: ≤ 2 s; ${slow ? 'not met' : 'met'}`);
});

test.each([
  [360, 800],
  [1100, 900],
])('fits a page of %i by %i, tables expanded', async (width, height) => {
  await page.locator('details').evaluateAll((all) => {
    for (const one of all) (one as HTMLDetailsElement).open = true;
  });
  expect(await overflow(page, width, height)).toBeLessThanOrEqual(0);
});

test('no errors are logged, under the same policy as the labs', async () => {
  const policy = await page.getAttribute('meta[http-equiv=Content-Security-Policy]', 'content');
  expect(policy).toContain("default-src 'self'");
  expect(policy).not.toContain('unsafe-inline');
  expect(app.complaints).toEqual([]);
});
