/** The labs with data far from the origin of world space, as surveys have them: the same as beside the origin. */
import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import init, { Mesh } from '../../pkg/index.js';
import type { Vec3 } from '../../www/src/engine/protocol';
import { type App, afterRun, drop, openApp, reach } from './browser';
import { asText, ballPoints, FAR } from './far';
import { difference } from './pixels';

const RADIUS = 5;

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp(undefined, '#reconstruct?example=two-balls', 1);
  await reach(app.page, 'done');
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

async function saved(selector: string): Promise<Uint8Array> {
  const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click(selector)]);
  return new Uint8Array(await readFile(await download.path()));
}

/** Returns the surface of a survey of a ball, and its picture. */
async function surveyed(name: string, centre: Vec3): Promise<{ mesh: Mesh; picture: Buffer }> {
  const points = asText(ballPoints(centre, RADIUS, 1));
  await afterRun(app.page, () => drop(app.page, [{ name, bytes: points }]));
  await app.page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  const picture = await app.page.locator('.scene > canvas').screenshot();
  return { mesh: Mesh.parse(await saved('[data-export=ply]')), picture };
}

test('a survey in metres of UTM is drawn as beside the origin, and keeps its millimetres from lab to lab', async () => {
  const { page } = app;
  await page.selectOption('[data-view=color]', 'distance');
  await page.check('[data-view=edges]');
  const near = await surveyed('near.xyz', [0.123, 0.456, 0.789]);
  const far = await surveyed('far.xyz', FAR);
  expect(await difference(page, near.picture, far.picture)).toBeLessThan(1e-3);
  expect(far.mesh.triangleCount).toBe(near.mesh.triangleCount);
  const [here, there] = [near, far].map(({ mesh }) => mesh.arrays({ relative: true }).positions) as [
    Float32Array,
    Float32Array,
  ];
  const { origin } = far.mesh;
  const moved = FAR.map((value, axis) => value - ([0.123, 0.456, 0.789][axis] ?? 0) - (origin[axis] ?? 0));
  const off = there.map((value, i) => Math.abs(value - (here[i] ?? 0) - (moved[i % 3] ?? 0)));
  expect(Math.max(...off)).toBeLessThan(1e-3);

  // STL is too coarse there.
  await page.click('[data-export=stl]');
  const atOrigin = Mesh.parse(await saved('[data-action=recentre]'));
  expect(atOrigin.triangleCount).toBe(far.mesh.triangleCount);
  expect(Math.hypot(...atOrigin.info().centroid)).toBeLessThan(20);

  // A click in the view adds a point over the surface.
  await page.click('[data-tool=add]');
  const { x = 0, y = 0, width = 0, height = 0 } = (await page.locator('.scene > canvas').boundingBox()) ?? {};
  await afterRun(page, () => page.mouse.click(x + width / 2, y + height / 2));
  const [, added = ''] = (await page.evaluate(() => location.hash)).match(/add=([^&]*)/) ?? [];
  const from = added.split(',').map((value, axis) => Number(value) - (FAR[axis] ?? 0));
  expect(Math.hypot(...from) / RADIUS).toBeCloseTo(1.18, 1);

  await page.click('[data-action=extract]');
  await page.waitForSelector('[data-lab=extract][aria-current=page]');
  await reach(page, 'done');
  expect(await page.textContent('.readout')).toMatch(/RAS 50000\d\.\d+, 54055\d\d\.\d+, 35\d\.\d+/);
  expect(await page.locator('.slice canvas').first().getAttribute('aria-label')).toContain('outline');
  const extracted = Mesh.parse(await saved('[data-export=ply]')).info();
  expect(Math.hypot(...extracted.centroid.map((value, axis) => value - (FAR[axis] ?? 0)))).toBeLessThan(0.1);
  expect(extracted.volume / ((4 / 3) * Math.PI * RADIUS ** 3)).toBeCloseTo(1, 1);
});
