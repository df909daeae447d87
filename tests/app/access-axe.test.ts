import type { Result } from 'axe-core';
import axe from 'axe-core';
import type { Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, openApp, reach } from './browser';

/** All that WCAG 2.2 asks for up to AA, what is good besides, and what axe only tries out. */
const TAGS = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice', 'experimental'];
const LABS = ['extract', 'reconstruct', 'track', 'sculpt'];
const SCHEMES = ['light', 'dark'] as const;
const SIZES = [
  { width: 1280, height: 800 },
  { width: 390, height: 844 },
];
const LOOKS = SCHEMES.flatMap((colorScheme) => SIZES.map((size) => ({ colorScheme, size })));

let app: App;

beforeAll(async () => {
  app = await openApp();
  // Before the page's own scripts: its policy lets in none that comes later.
  await app.page.addInitScript({ content: axe.source });
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

/** What axe finds wrong with the page as it is, one line each. */
function violations(page: Page): Promise<string[]> {
  return page.evaluate(async (values) => {
    const { axe } = window as unknown as { axe: { run: (...given: unknown[]) => Promise<{ violations: Result[] }> } };
    const found = await axe.run(document, { resultTypes: ['violations'], runOnly: { type: 'tag', values } });
    return found.violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html.slice(0, 200)}`));
  }, TAGS);
}

async function look(page: Page, { colorScheme, size }: (typeof LOOKS)[number]): Promise<void> {
  await page.emulateMedia({ colorScheme });
  await page.setViewportSize(size);
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
}

function openAll(page: Page): Promise<void> {
  return page.locator('details').evaluateAll((all) => {
    for (const one of all) (one as HTMLDetailsElement).open = true;
  });
}

async function openLab(lab: string): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(`${app.address}#${lab}`);
  await reach(app.page, 'running', 'done');
}

describe.each(LABS)('the %s lab', (lab) => {
  test('has nothing against it while it runs', async () => {
    await openLab(lab);
    for (const one of LOOKS) {
      await look(app.page, one);
      expect(await violations(app.page), JSON.stringify(one)).toEqual([]);
    }
  });

  test('has nothing against it when it is done, all unfolded', async () => {
    await reach(app.page, 'done');
    await openAll(app.page);
    for (const one of LOOKS) {
      await look(app.page, one);
      expect(await violations(app.page), JSON.stringify(one)).toEqual([]);
    }
  });

  test('has nothing against its list of keys, nor against a message', async () => {
    await app.page.evaluate((address) => {
      location.hash = address;
    }, `#${lab}?example=nowhere`);
    await app.page.waitForSelector('.banner:not([hidden])');
    for (const one of LOOKS) {
      await look(app.page, one);
      expect(await violations(app.page), JSON.stringify(one)).toEqual([]);
    }
    await app.page.click('#help');
    for (const one of LOOKS) {
      await look(app.page, one);
      expect(await violations(app.page), `list of keys ${JSON.stringify(one)}`).toEqual([]);
    }
  });
});

test('the measurements have nothing against them', async () => {
  await app.page.goto(`${app.address}bench.html`);
  await app.page.waitForSelector('[data-bench]');
  await openAll(app.page);
  for (const one of LOOKS) {
    await look(app.page, one);
    expect(await violations(app.page), JSON.stringify(one)).toEqual([]);
  }
});
