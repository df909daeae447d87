/** Volumes larger than memory in the Extract lab: OME-Zarr images as ZIP, folder and address. */
import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { addressProblem } from '../../www/src/labs/extract/large-address';
import { filesOf, serveImage } from '../js/zarr-stores';
import { type App, drop, measures, open, openApp, QUICK, reach, recordStates, unfold } from './browser';
import { LONG } from './long';

/** A box of a stack of plant cells in two levels, of 26 × 22 × 14 and 13 × 11 × 14 voxels. */
const IMAGE = 'v3-scaled-zyx';

let app: App;

beforeAll(async () => {
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const amount = () => app.page.textContent('.large-progress .amount');

/** Opens the lab with its fast example, done. */
async function openLab(): Promise<void> {
  await open(app, QUICK.extract);
  await reach(app.page, 'done');
  await unfold(app.page);
}

/** Waits until an image that `opening` opens has been extracted, and checks the surface. */
async function expectExtracted(opening: () => Promise<unknown>): Promise<void> {
  const states = await recordStates(app.page);
  await opening();
  await expect.poll(async () => (await states()).join(' ')).toMatch(/loading.* running.* done$/);
  await expect.poll(() => measures(app.page)).toMatchObject({ closed: true, oriented: true, crossings: 0 });
  expect((await measures(app.page)).triangles).toBeGreaterThan(100);
}

test('a ZIP is opened, its coarsest level displayed, and the surface refined down to the finest', async () => {
  await openLab();
  await expectExtracted(async () =>
    drop(app.page, [{ name: 'cells.zip', bytes: await readFile(at(`tests/data/zarr/${IMAGE}.zip`)) }]),
  );
  expect(await app.page.textContent('.facts')).toMatch(/Levels26 × 22 × 14, 13 × 11 × 14/);
  expect(await amount()).toMatch(/^[\d.]+ kB of [\d.]+ kB read, in \d+ chunks$/);
});

test('an address on the own server is read chunk by chunk; one that is missing gives a message, and nothing is lost', async () => {
  await openLab();
  const files = await filesOf(IMAGE);
  await app.page.context().route('**/images/cells.zarr/**', (route) => {
    const body = files.get(new URL(route.request().url()).pathname.replace('/images/cells.zarr', ''));
    return body ? route.fulfill({ body: Buffer.from(body) }) : route.fulfill({ status: 404 });
  });
  const address = app.page.getByLabel('Address');
  await expectExtracted(async () => {
    await address.fill(`${app.address}images/cells.zarr`);
    await address.press('Enter');
  });
  expect(await app.page.textContent('.facts')).toContain('cells.zarr');
  const { triangles } = await measures(app.page);
  await address.fill(`${app.address}images/none.zarr`);
  await app.page.getByRole('button', { name: 'Open image' }).click();
  await reach(app.page, 'error');
  expect(await app.page.textContent('.banner')).toMatch(/none\.zarr/);
  expect((await measures(app.page)).triangles).toBe(triangles);
  app.complaints.splice(0);
});

test('a folder is opened', LONG, async () => {
  await openLab();
  const files = [...(await filesOf(IMAGE))].map(([path, bytes]) => [path.slice(1), [...bytes]] as const);
  // The dialogue of the browser cannot be used here; the origin's private folder has the same handles.
  await app.page.evaluate(async (list) => {
    const root = await (await navigator.storage.getDirectory()).getDirectoryHandle('cells.zarr', { create: true });
    for (const [path, bytes] of list) {
      let folder = root;
      const names = path.split('/');
      for (const name of names.slice(0, -1)) folder = await folder.getDirectoryHandle(name, { create: true });
      const file = await (await folder.getFileHandle(names.at(-1) ?? '', { create: true })).createWritable();
      await file.write(Uint8Array.from(bytes));
      await file.close();
    }
  }, files);
  await app.page.addInitScript(() => {
    const pick = async () => (await navigator.storage.getDirectory()).getDirectoryHandle('cells.zarr');
    Object.assign(window, { showDirectoryPicker: pick });
  });
  await openLab();
  await expectExtracted(() => app.page.getByRole('button', { name: 'Open a folder…' }).click());
});

test('in a box around the crosshair only, finer levels are followed', LONG, async () => {
  await openLab();
  const field = app.page.getByLabel('Box around the crosshair');
  expect(await field.isVisible()).toBe(false);
  await expectExtracted(async () =>
    drop(app.page, [{ name: 'cells.zip', bytes: await readFile(at(`tests/data/zarr/${IMAGE}.zip`)) }]),
  );
  const { triangles } = await measures(app.page);
  await field.fill('-1');
  await field.press('Enter');
  expect(await app.page.textContent('.start')).toContain('Must be > 0, or empty.');
  expect(await field.inputValue()).toBe('');
  await expectExtracted(async () => {
    // 0.3 µm, of some 4.
    await field.fill('0.0003');
    await field.press('Enter');
  });
  expect((await measures(app.page)).triangles).toBeLessThan(0.8 * triangles);
});

test('what needs the whole volume is refused with a reason', LONG, async () => {
  await openLab();
  await expectExtracted(async () =>
    drop(app.page, [{ name: 'cells.zip', bytes: await readFile(at(`tests/data/zarr/${IMAGE}.zip`)) }]),
  );
  await app.page.getByRole('button', { name: 'Measure coverage' }).click();
  await expect.poll(() => app.page.textContent('.coverage')).toMatch(/larger than memory/);
  expect(await app.page.locator('[data-transport=undo]').isDisabled()).toBe(true);
});

test('an image of another server is read by the worker of this lab; the page itself cannot', async () => {
  await openLab();
  const images = await serveImage(IMAGE);
  const address = app.page.getByLabel('Address');
  await expectExtracted(async () => {
    await address.fill(images.url);
    await address.press('Enter');
  });
  expect(images.log.length).toBeGreaterThan(3);
  expect(app.complaints.splice(0).filter((one) => !one.startsWith(`foreign: ${images.url}/`))).toEqual([]);
  const url = `${images.url}/zarr.json`;
  const read = (url: string) => fetch(url).then(({ status }) => status, String);
  expect(await app.page.evaluate(read, url)).toBe('TypeError: Failed to fetch');
  expect(app.complaints.splice(0).join()).toMatch(/violates .*Content Security Policy.*connect-src 'self'/);
  await images.close();
});

test('other addresses are refused in words: those that are not encrypted, have a password, or name no server', async () => {
  const here = { href: 'http://here.org/app/', origin: 'http://here.org' };
  const accepted = ['https://a.org/image.zarr', 'http://here.org/image.zarr', 'image.zarr'];
  const loopback = ['http://localhost:8080/a.zarr', 'http://127.0.0.1/a.zarr', 'https://[::1]/a.zarr'];
  for (const address of [...accepted, ...loopback]) expect(addressProblem(address, here)).toBeUndefined();
  for (const [address, problem] of [
    ['http://a.org/image.zarr', /^a\.org is not read without encryption/],
    ['http://localhost.a.org/', /^localhost\.a\.org is not read without/],
    ['http://[::1]:8080/', /^\[::1\]:8080 is not read without/],
    ['https://me:secret@a.org/', /user name or a password/],
    ['https://', /not an address/],
    ['file:///etc/passwd', /begin with file:/],
    ['data:,1', /begin with data:/],
    ['blob:http://here.org/1', /begin with blob:/],
  ] as const)
    expect(addressProblem(address, here)).toMatch(problem);
  // Elsewhere the page's own server is another one.
  expect(addressProblem('http://here.org/', { href: 'data:,', origin: 'null' })).toMatch(/not read without/);
  expect(addressProblem('data:,1', { href: 'data:,', origin: 'null' })).toMatch(/begin with data:/);
  await app.page.getByLabel('Address').fill('http://example.org/image.zarr');
  await app.page.getByLabel('Address').press('Enter');
  expect(await app.page.textContent('.large [role=alert]')).toMatch(/^example\.org is not read without encryption/);
  expect(await app.page.getByLabel('Address').getAttribute('aria-invalid')).toBe('true');
});

for (const [before, state, options] of [
  [QUICK.extract, 'done', LONG],
  ['extract?p.timeStep=0.05&v=2', 'running', {}],
] as const) {
  test(
    `an image that does not answer gives way to the next one at once: after ${before}, ${state}`,
    options,
    async () => {
      await open(app, before);
      await reach(app.page, state);
      await unfold(app.page);
      await app.page.context().route('**/images/silent.zarr/**', () => undefined);
      const address = app.page.getByLabel('Address');
      await address.fill(`${app.address}images/silent.zarr`);
      await address.press('Enter');
      await reach(app.page, 'loading');
      await app.page.getByLabel('Example').selectOption('linked-rings');
      // Its requests are given up after minutes only.
      await app.page.waitForSelector('[data-state=done]', { timeout: 60_000 });
      expect(await app.page.textContent('.facts')).not.toContain('silent');
      expect(await app.page.locator('.banner').isVisible()).toBe(false);
    },
  );
}

test('single steps wait for the data that they need', LONG, async () => {
  await openLab();
  await expectExtracted(async () =>
    drop(app.page, [{ name: 'cells.zip', bytes: await readFile(at(`tests/data/zarr/${IMAGE}.zip`)) }]),
  );
  await app.page.getByRole('button', { name: 'Reset', exact: true }).click();
  await reach(app.page, 'paused');
  const step = app.page.getByRole('button', { name: 'Step', exact: true });
  for (const iteration of [1, 2, 3]) {
    await step.click();
    await expect.poll(() => app.page.textContent('.iteration')).toContain(String(iteration));
    await reach(app.page, 'paused');
  }
});
