import { afterAll, beforeAll, expect, test } from 'vitest';
import { type App, openApp, reach } from './browser';

let app: App;

beforeAll(async () => {
  app = await openApp({ width: 390, height: 844 });
  await reach(app.page, 'running', 'done');
});
afterAll(() => app.close());

test.each([
  [390, 844],
  [1024, 768],
  [1440, 900],
  [390, 844],
])('nothing is wider than a page of %i by %i', async (width, height) => {
  await app.page.setViewportSize({ width, height });
  const overflow = await app.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  expect(overflow).toBeLessThanOrEqual(0);
});

test('every control has a name', async () => {
  const unnamed = await app.page.evaluate(() => {
    const controls = document.querySelectorAll<HTMLInputElement>('input, select, button, canvas');
    const named = (control: HTMLInputElement) =>
      control.getAttribute('aria-label') || control.textContent?.trim() || control.labels?.[0]?.textContent?.trim();
    const decoration = (control: Element) => control.closest('[aria-hidden=true]') !== null;
    return [...controls]
      .filter((control) => !decoration(control) && !named(control))
      .map((control) => control.outerHTML);
  });
  expect(unnamed).toEqual([]);
});

test('the help lists the keys and closes again', async () => {
  await app.page.click('#help');
  expect(await app.page.textContent('dialog')).toContain('play or pause');
  await app.page.keyboard.press('Escape');
  expect(await app.page.locator('dialog').isVisible()).toBe(false);
});

test('the page forbids itself to load anything from elsewhere', async () => {
  const policy = await app.page.getAttribute('meta[http-equiv=Content-Security-Policy]', 'content');
  expect(policy).toContain("default-src 'self'");
  expect(policy).not.toContain('unsafe-inline');
  expect(app.complaints).toEqual([]);
});
