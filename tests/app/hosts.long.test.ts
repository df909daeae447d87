// The live pages with their real hosts: from the host's volume to a converged surface in the host's view.
import type { Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { type App, openApp, overflow, reach } from './browser';
import { found, hide, watch, watched } from './hosts';
import { difference } from './pixels';

let app: App;
let page: Page;
beforeAll(async () => {
  app = await openApp({ width: 800, height: 640 });
  page = app.page;
  await watch(page);
});
afterAll(() => app.close());

const HOSTS = ['three', 'niivue', 'niivue-next', 'vtk', 'itk'];

test("the list of hosts can be reached from the app's help", async () => {
  await page.click('#help');
  // In a tab of its own.
  const [list] = await Promise.all([page.waitForEvent('popup'), page.click('dialog a[href*=embed]')]);
  await list.waitForSelector('.each a');
  const links = await list.locator('.each a').evaluateAll((all) => all.map((one) => one.getAttribute('href')));
  const pages = ['three', 'niivue', 'niivue-next', 'draw', 'vtk', 'vtk-labels', 'itk', 'cornerstone', 'element'];
  expect(links).toEqual(pages.map((name) => `./${name}.html`));
  expect(await overflow(list, 360, 780)).toBeLessThanOrEqual(0);
  await list.close();
});

test('a plain page, without a script of its own', async () => {
  await page.goto(`${app.address}embed/element.html`);
  await page.waitForSelector('vesicle-lab[data-state=done]');
  expect(await page.locator('vesicle-lab output').textContent()).toMatch(/^Done: [\d,]+ vertices/);
  expect(await overflow(page, 360, 780)).toBeLessThanOrEqual(0);
  await page.setViewportSize({ width: 800, height: 640 });
});

describe.each(HOSTS)('%s', (name) => {
  let complaints = 0;
  beforeAll(async () => {
    complaints = app.complaints.length;
    await page.goto(`${app.address}embed/${name}.html`);
    await reach(page, 'done');
  });

  test('frames with changed connectivity arrive, and none is missed', async () => {
    const { times, topologies, missed } = await watched(page);
    // From a contour, a run converges within some ten to twenty iterations.
    expect(topologies).toBeGreaterThan(5);
    expect(missed).toBe(0);
    const middle = times.toSorted((a, b) => a - b)[Math.floor(times.length / 2)] ?? 0;
    console.info(`${name}: ${times.length} frames, ${middle.toFixed(2)} ms for update in the middle`);
  });

  test("the surface lies where the host's image has the iso value, and faces outwards", async () => {
    const { vertices, volume, bracketed } = await found(page, name);
    expect(vertices).toBeGreaterThan(2000);
    expect(volume).toBeGreaterThan(0);
    console.info(`${name}: ${(100 * bracketed).toFixed(1)} % of the triangles of ${vertices} vertices`);
    expect(bracketed).toBeGreaterThan(0.85);
  });

  test('is rendered: the picture differs without it', async () => {
    const view = page.locator('#view');
    const shown = await view.screenshot();
    await hide(page, name);
    expect(await difference(page, shown, await view.screenshot())).toBeGreaterThan(0.005);
  });

  test('fits a phone', async () => {
    expect(await overflow(page, 360, 780)).toBeLessThanOrEqual(0);
    await page.setViewportSize({ width: 800, height: 640 });
  });

  test('no errors are logged, under a policy without eval and inline styles', async () => {
    const policy = await page.getAttribute('meta[http-equiv=Content-Security-Policy]', 'content');
    expect(policy).toMatch(/script-src 'self' 'wasm-unsafe-eval';/);
    expect(policy).not.toMatch(/unsafe-inline|'unsafe-eval'/);
    expect(app.complaints.slice(complaints)).toEqual([]);
  });
});
