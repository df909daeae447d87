/** Work that is not saved: whoever would lose it is asked first. */
import type { Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest';
import { type App, anotherPage, drop, iteration, measures, open, openApp, QUICK, reach, unfold } from './browser';
import { LONG } from './long';

let app: App;
let page: Page;

beforeAll(async () => {
  app = await openApp({ width: 1280, height: 800 }, 'bench.html');
  page = app.page;
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const question = () => page.locator('dialog.question[open]');

/** Has this test answer questions. */
async function ask(): Promise<void> {
  await page.evaluate(() => {
    document.documentElement.dataset.asked = '';
  });
}

async function openLab(address: string): Promise<void> {
  await open(app, address);
  await ask();
  await reach(page, 'done');
}

/** Answers the question, which must say all of `losses`. */
async function answer(go: boolean, ...losses: string[]): Promise<void> {
  await question().waitFor();
  for (const loss of losses) expect(await question().textContent()).toContain(loss);
  await question()
    .locator(`button[value="${go ? 'go' : ''}"]`)
    .click();
  await question().waitFor({ state: 'detached' });
}

const lab = () => page.locator('#labs [aria-current=page]').getAttribute('data-lab');

/** Loads the page again, which has to ask first, and stays. */
async function reload(): Promise<void> {
  const asked = page.waitForEvent('dialog');
  const again = page.evaluate(() => location.reload());
  const dialog = await asked;
  expect(dialog.type()).toBe('beforeunload');
  await dialog.dismiss();
  await again.catch(() => undefined);
}

/** Opens a lab in another page, whose `crash` breaks the worker that was started last, as a lack of memory does. */
async function breakable(address: string): Promise<Page> {
  const another = await anotherPage(app, () => {
    window.Worker = class extends Worker {
      constructor(url: string | URL, options?: WorkerOptions) {
        super(url, options);
        const crash = () => this.dispatchEvent(new ErrorEvent('error', { message: 'out of memory', cancelable: true }));
        Object.assign(window, { crash });
      }
    };
  });
  page = another;
  await open({ ...app, page: another }, address);
  await ask();
  await reach(another, 'done');
  return another;
}

/** Paints where the crosshair is. */
async function paint(): Promise<void> {
  await page.locator('input[data-tool=brush]').check({ force: true });
  await page.locator('[data-action=apply]').click();
  await expect.poll(() => page.locator('[data-transport=undo]').isDisabled()).toBe(false);
}

test('labels that were painted: other data and loading again ask first', LONG, async () => {
  await openLab(QUICK.segment);
  await paint();
  const address = page.url();
  await drop(page, [{ name: 'other.nrrd', bytes: new TextEncoder().encode('NRRD0004\n') }]);
  await answer(false, 'Open other data', 'labels that you have painted');
  await page.evaluate(() => {
    location.hash = '#segment?example=tooth';
  });
  await answer(false);
  expect(page.url()).toBe(address);
  await reload();
  expect(await page.locator('[data-transport=undo]').isDisabled()).toBe(false);
});

test(
  'a run that was started comes back; loading again asks, and no longer once its surface is saved',
  LONG,
  async () => {
    await openLab(QUICK.extract);
    await page.keyboard.press('r');
    await reach(page, 'paused');
    await page.keyboard.press('s');
    await expect.poll(() => iteration(page)).toBe(1);
    // The report of the mesh comes after its measures.
    await expect.poll(async () => 'closed' in (await measures(page))).toBe(true);
    const before = [await iteration(page), await measures(page)];
    await page.click('#labs [data-lab=sculpt]');
    await page.waitForSelector('#labs [data-lab=sculpt][aria-current=page]');
    await reload();
    await page.click('#labs [data-lab=extract]');
    await page.waitForSelector('#lab.extract[data-state=paused]');
    expect([await iteration(page), await measures(page)]).toEqual(before);
    await reload();
    await unfold(page);
    const [file] = await Promise.all([
      page.waitForEvent('download'),
      page.locator('[data-export=ply]').first().click(),
    ]);
    expect(file.suggestedFilename()).toMatch(/ply$/);
    await page.reload();
  },
);

test('a lab whose engine has failed asks before it is left, since its labels cannot be kept', LONG, async () => {
  const own = page;
  page = await breakable(QUICK.segment);
  await paint();
  await reach(page, 'done');
  await page.evaluate(() => (window as unknown as { crash: () => void }).crash());
  await page.waitForSelector('[data-state=error]');
  await page.click('#labs [data-lab=track]');
  await answer(false, 'labels that you have painted');
  expect(await lab()).toBe('segment');
  await page.click('#labs [data-lab=track]');
  await answer(true);
  await page.waitForSelector('#labs [data-lab=track][aria-current=page]');
  await page.close();
  page = own;
});

test('edits of a surface: a crash of their worker loses none, and other data ask first', LONG, async () => {
  const own = page;
  page = await breakable(QUICK.extract);
  await page.getByRole('heading', { name: 'Edit the surface' }).click();
  const edits = () => page.locator('.edit-log li').count();
  for (const [count, edit] of ['keep-largest', 'cut'].entries()) {
    await page.click(`[data-finish=${edit}]`);
    await expect.poll(edits).toBe(count + 1);
  }
  const before = await measures(page);
  await page.evaluate(() => (window as unknown as { crash: () => void }).crash());
  await page.click('[data-finish=decimate]');
  await expect.poll(edits).toBe(3);
  await page.click('[data-finish=undo]');
  await expect.poll(edits).toBe(2);
  expect(await measures(page)).toEqual(before);
  await page.selectOption('.data select', { index: 1 });
  await answer(false, 'edits of the surface');
  expect(await edits()).toBe(2);
  // Closing the page asks, too.
  const asked = page.waitForEvent('dialog');
  await page.close({ runBeforeUnload: true });
  const dialog = await asked;
  expect(dialog.type()).toBe('beforeunload');
  await dialog.accept();
  page = own;
});
