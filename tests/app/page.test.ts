import type { Browser } from 'playwright-core';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { type App, LABS, openApp, overflow, reach, unnamedControls } from './browser';
import { inOneLab } from './long';

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
])('the page fits %i by %i', async (width, height) => {
  expect(await overflow(app.page, width, height)).toBeLessThanOrEqual(0);
});

test('every control has a name', async () => {
  expect(await unnamedControls(app.page)).toEqual([]);
});

test('the help can be opened as soon as the lab is there, not before', async () => {
  const browser = app.page.context().browser() as Browser;
  // A service worker would have the lab's code already.
  const page = await browser.newPage({ serviceWorkers: 'block' });
  let load = () => {};
  const wanted = new Promise<void>((resolve) => {
    load = resolve;
  });
  await page.route('**/assets/extract-*.js', async (route) => {
    await wanted;
    await route.continue();
  });
  await page.goto(`${app.address}#extract?example=linked-rings`);
  await page.waitForSelector('[data-state=loading]', { state: 'attached' });
  expect(await page.isDisabled('#help')).toBe(true);
  const pressed = page.click('#help');
  load();
  await pressed;
  expect(await page.isVisible('dialog')).toBe(true);
  await page.close();
});

test('the help lists the keyboard shortcuts and closes again', async () => {
  await app.page.click('#help');
  expect(await app.page.textContent('dialog')).toContain('play or pause');
  await app.page.keyboard.press('Escape');
  expect(await app.page.locator('dialog').isVisible()).toBe(false);
});

for (const lab of LABS) {
  test(
    `${lab} links to its documentation, and from its keyboard shortcuts to all other help`,
    inOneLab(lab),
    async () => {
      await app.page.click(`[data-lab=${lab}]`);
      // By then the shortcuts of the previous lab are gone.
      await expect.poll(async () => (await app.page.title()).toLowerCase()).toBe(`vesicle: ${lab}`);
      await app.page.waitForSelector('dialog', { state: 'attached' });
      const hrefs = await app.page
        .locator('dialog a')
        .evaluateAll((all) => all.map((one) => (one as HTMLAnchorElement).href));
      expect(hrefs[0]).toBe(await app.page.locator('#guide').evaluate((one) => (one as HTMLAnchorElement).href));
      const pages = await Promise.all(hrefs.map(async (href) => (await app.page.request.get(href)).text()));
      expect(pages[0]).toContain(`index.html#${lab}"`);
      expect(pages.pop()).toContain('three');
      expect(pages.map((page) => /<title>(.*)<\/title>/.exec(page)?.[1])).toEqual([
        expect.stringMatching(/^\S+ .+ \| Vesicle documentation$/),
        'Vesicle documentation',
        'Vesicle: Benchmarks',
        'Vesicle in other software',
      ]);
    },
  );
}

test('a requested lab opens, even if the previous one changes its address at the same time', async () => {
  await app.page.click('[data-lab=extract]');
  await app.page.getByText('Copy link to these settings').waitFor();
  await reach(app.page, 'running', 'done', 'paused');
  await app.page.evaluate(() => {
    const buttons = [...document.querySelectorAll('button')];
    document.querySelector<HTMLElement>('[data-lab=track]')?.click();
    buttons.find(({ textContent }) => textContent === 'Copy link to these settings')?.click();
  });
  await expect.poll(() => app.page.title()).toBe('Vesicle: Track');
});

test("the page's policy forbids loading anything from other origins", async () => {
  const policy = await app.page.getAttribute('meta[http-equiv=Content-Security-Policy]', 'content');
  expect(policy).toContain("default-src 'self'");
  expect(policy).not.toContain('unsafe-inline');
  expect(app.complaints).toEqual([]);
});
