/** Editing a surface after a run, and comparing it with a reference. */
import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { type App, measures, open, openApp, QUICK, reach } from './browser';
import { LONG } from './long';

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp(undefined, `#${QUICK.extract}`);
  await reach(app.page, 'done');
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const press = (name: string) => app.page.click(`[data-finish=${name}]`);
const log = () => app.page.locator('.edit-log li').allTextContents();
const unfold = (title: string) => app.page.getByRole('heading', { name: title }).click();

async function saved(selector: string): Promise<Uint8Array> {
  const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click(selector)]);
  return readFile(await download.path());
}

/** Chooses a file as the reference. */
function choose(name: string, bytes: Uint8Array): Promise<void> {
  const input = app.page.locator('.reference input[type=file]');
  return input.setInputFiles({ name, mimeType: '', buffer: Buffer.from(bytes) });
}

test('an edit that is asked for before the surface is open is made when it is', async () => {
  const whole = await measures(app.page);
  // Before the panel knows that it was unfolded.
  await app.page.evaluate(() => {
    const panel = document.querySelector('.finish');
    panel?.closest('details')?.setAttribute('open', '');
    panel?.querySelector<HTMLButtonElement>('[data-finish=cut]')?.click();
  });
  await expect.poll(async () => (await log()).length).toBe(1);
  expect((await measures(app.page)).volume / whole.volume).toBeCloseTo(0.5, 1);
  await press('undo');
  await expect.poll(async () => (await log()).length).toBe(0);
  expect(await app.page.isDisabled('[data-finish=redo]')).toBe(false);
  await app.page.getByRole('heading', { name: 'Edit the surface' }).click();
});

test('edits change the surface, its measures and the saved files; undo and redo', async () => {
  const before = await measures(app.page);
  expect(before.components).toBeGreaterThan(1);
  await unfold('Edit the surface');
  // The list moves the buttons below it.
  await app.page.waitForSelector('[data-component]');
  await press('keep-largest');
  await expect.poll(async () => (await measures(app.page)).components).toBe(1);
  await press('cut');
  await expect.poll(async () => (await log()).length).toBe(2);
  await app.page.locator('.finish').getByLabel('Target').fill('400');
  await press('decimate');
  await expect.poll(async () => (await measures(app.page)).triangles).toBeLessThanOrEqual(400);
  const { triangles } = await measures(app.page);
  await app.page.locator('.finish').getByLabel('Largest distance').fill('0.5');
  await press('decimate-within');
  await expect.poll(async () => (await measures(app.page)).triangles).toBeLessThan(triangles);
  const edited = await measures(app.page);
  expect(edited).toMatchObject({ components: 1, closed: true, oriented: true, crossings: 0 });
  expect(Mesh.parse(await saved('[data-export=ply]')).triangleCount).toBe(edited.triangles);
  for (let edits = 4; edits > 0; edits--) {
    await press('undo');
    await expect.poll(async () => (await log()).length).toBe(edits - 1);
  }
  expect(await measures(app.page)).toEqual(before);
  await press('redo');
  await expect.poll(async () => (await measures(app.page)).components).toBe(1);
  expect(await log()).toEqual([expect.stringMatching(/^keepComponents\(\[\d\]\)$/)]);
});

test('an edit that is refused says why, and changes nothing', async () => {
  const before = await measures(app.page);
  await app.page.locator('.finish').getByLabel('Edge length').fill('-1');
  await press('remesh');
  const error = app.page.locator('.finish > .field-error');
  await expect.poll(() => error.textContent()).toContain('Nothing has changed. edge.min');
  expect(await measures(app.page)).toEqual(before);
});

test('a reference is compared in both directions, also after an edit; a bad file changes nothing', async () => {
  await unfold('Compare with a reference');
  await choose('own.ply', await saved('[data-export=ply]'));
  const values = async () =>
    JSON.parse((await app.page.getAttribute('[data-reference=result]', 'data-values')) ?? '{}');
  await expect.poll(async () => (await values()).dice).toBe(1);
  expect((await values()).both.max).toBeLessThan(1e-5);
  await press('cut');
  await expect.poll(async () => (await values()).dice).toBeLessThan(0.9);
  const { toReference, fromReference } = await values();
  expect(fromReference.max).toBeGreaterThan(3 * toReference.max);
  await expect.poll(() => app.page.locator('.color-legend:visible').textContent()).toContain('Distance to reference');
  const before = await values();
  await choose('notes.ply', new TextEncoder().encode('not a mesh'));
  const error = app.page.locator('.reference > .field-error');
  await expect.poll(() => error.textContent()).toContain('The reference could not be used: ');
  expect(await values()).toEqual(before);
  const csv = new TextDecoder().decode(await saved('[data-reference=csv]'));
  expect(csv).toMatch(/^direction,mean,rms,p95,hausdorff\ntoReference,/);
});

test('a long edit can be cancelled: the edits before it, their undo and references stay', async () => {
  const [before, edits] = [await measures(app.page), await log()];
  const surface = await saved('[data-export=ply]');
  const edge = app.page.locator('.finish').getByLabel('Edge length');
  const given = await edge.inputValue();
  await edge.fill('0.06');
  await press('remesh');
  // Waits for the edit, and is read after it was cancelled.
  await choose('other.ply', surface);
  await press('cancel');
  const status = app.page.locator('[data-finish=status]');
  await expect.poll(() => status.textContent()).toBe('Cancelled. Nothing has changed.');
  expect(await app.page.isDisabled('[data-finish=cancel]')).toBe(true);
  expect(await app.page.evaluate(() => document.activeElement?.textContent)).toBe('Remesh');
  await expect.poll(() => app.page.locator('[data-reference=status]').textContent()).toBe('other.ply');
  expect(await measures(app.page)).toEqual(before);
  expect(Buffer.from(await saved('[data-export=ply]')).equals(surface)).toBe(true);
  expect(await log()).toEqual(edits);
  await edge.fill(given);
  await press('undo');
  await expect.poll(async () => (await log()).length).toBe(edits.length - 1);
  await press('redo');
  await expect.poll(log).toEqual(edits);
  await expect.poll(() => app.page.locator('[data-reference=result]').textContent()).toContain('Dice coefficient');
});

test('a mask is a reference, too', async () => {
  const { bounds } = Mesh.parse(await saved('[data-export=ply]')).info();
  const dims = bounds.max.map((x) => Math.ceil(x) + 2) as [number, number, number];
  const data = new Uint8Array(dims[0] * dims[1] * dims[2]);
  for (let z = 4; z < 12; z++)
    for (let y = 4; y < 12; y++) data.fill(1, (z * dims[1] + y) * dims[0] + 4, (z * dims[1] + y) * dims[0] + 12);
  await choose('mask.nii', new Volume({ data, dims }).toNifti());
  await expect.poll(() => app.page.locator('[data-reference=status]').textContent()).toBe('mask.nii');
  await expect.poll(() => app.page.locator('[data-reference=result]').textContent()).toContain('Dice coefficient');
});

test('edits end when the run goes on by a single step', async () => {
  await app.page.getByRole('button', { name: 'Reset' }).click();
  await reach(app.page, 'paused');
  await app.page.waitForSelector('[data-component]');
  await press('cut');
  await expect.poll(async () => (await log()).length).toBe(1);
  await app.page.getByRole('button', { name: 'Step', exact: true }).click();
  await expect.poll(async () => (await log()).length).toBe(0);
  const { triangles } = await measures(app.page);
  expect(Mesh.parse(await saved('[data-export=ply]')).triangleCount).toBe(triangles);
});

test.each(['reconstruct', 'track'] as const)('surfaces are edited in %s, too', LONG, async (lab) => {
  await open(app, QUICK[lab]);
  await reach(app.page, 'done');
  const { triangles } = await measures(app.page);
  await unfold('Edit the surface');
  await app.page.waitForSelector('[data-component]');
  await press('cut');
  await expect.poll(async () => (await log()).length).toBe(1);
  expect(await measures(app.page)).toMatchObject({ closed: true, oriented: true, crossings: 0 });
  await press('undo');
  await expect.poll(async () => (await log()).length).toBe(0);
  expect((await measures(app.page)).components).toBeGreaterThan(0);
  if (lab === 'reconstruct') expect((await measures(app.page)).triangles).toBe(triangles);
});
