import { gzipSync } from 'node:zlib';
import type { Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { randomNumbers } from '../../bench/random.mjs';
import {
  type App,
  anotherPage,
  drop,
  iteration,
  LABS,
  measures,
  open,
  openApp,
  QUICK,
  RUNNING,
  reach,
  recordStates,
} from './browser';
import { inOneLab, LONG } from './long';
import { countColors, showsAgain } from './pixels';
import { ball } from './volumes';

let app: App;
let page: Page;

beforeAll(async () => {
  // Small, so that software rendering is fast.
  app = await openApp({ width: 900, height: 640 }, 'bench.html');
  page = app.page;
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

/** Opens a lab in a page in which `prepare` runs before its own scripts. */
async function openLab(address: string, prepare: () => void = () => undefined): Promise<void> {
  if (page !== app.page) await page.close();
  page = await anotherPage(app, prepare);
  // Pauses the playback of Track's frames.
  await page.emulateMedia({ reducedMotion: 'reduce' });
  await open({ page, address: app.address }, address);
}

const banner = () => page.locator('.banner');

function view(): Promise<Buffer> {
  return page.locator('.lab canvas[tabindex]').screenshot();
}

/** Waits for some turns of the worker's event loop; between two of them, a worker at work does a slice of its run. */
async function turns(count: number): Promise<void> {
  await page.workers()[0]?.evaluate(async (count) => {
    for (let i = 0; i < count; i++) await new Promise((resolve) => setTimeout(resolve));
  }, count);
}

describe.each(LABS)('the %s lab', (lab) => {
  test('renders its view again after a lost WebGL context is restored', inOneLab(lab), async () => {
    await openLab(QUICK[lab]);
    await reach(page, 'done');
    await page.locator('canvas[tabindex]').first().press('Home');
    const before = await view();
    const extension = await page.evaluateHandle(() => {
      const canvas = document.querySelector<HTMLCanvasElement>('.lab canvas[tabindex]');
      return canvas?.getContext('webgl2')?.getExtension('WEBGL_lose_context');
    });
    await extension.evaluate((one) => one?.loseContext());
    await expect
      .poll(() => page.locator('.view-note').allTextContents())
      .toEqual([expect.stringContaining('restored automatically')]);
    await extension.evaluate((one) => one?.restoreContext());
    await expect.poll(() => page.locator('.view-note').count()).toBe(0);
    await showsAgain(page, before, view);
    expect(await countColors(page, await view())).toBeGreaterThan(500);
  });

  test('refuses files with false headers, and keeps the previous data', LONG, async () => {
    await openLab(QUICK[lab]);
    await reach(page, 'done');
    const before = await measures(page);
    const states = await recordStates(page);
    for (const file of hostile(lab)) {
      await drop(page, [file]);
      await page.waitForSelector('[data-state=error]');
      expect(await banner().textContent()).toContain(`${file.name} could not be opened`);
      expect((await page.textContent('[data-error]'))?.length).toBeGreaterThan(20);
      expect(await measures(page)).toEqual(before);
      await page.click('.banner button');
      await reach(page, 'done');
    }
    expect(await states()).not.toContain('running');
  });

  test('survives random key presses and changes of the example', LONG, async () => {
    await openLab(QUICK[lab]);
    await reach(page, 'done');
    const keys = [' ', 's', 'd', 'r', 'Control+z', 'Control+y', 'Escape', ' ', 'ArrowLeft'];
    const quick = new URLSearchParams(QUICK[lab].split('?')[1]).get('example') ?? '';
    const all = await page
      .locator('.data select option')
      .evaluateAll((list) => list.map((one) => one.getAttribute('value') ?? ''));
    const others = all.filter((value) => value !== '' && value !== quick).slice(0, 3);
    const draw = randomNumbers(20261123);
    const random = (below: number) => Math.floor(below * draw());
    await page.locator('canvas[tabindex]').first().focus();
    for (let i = 0; i < 40; i++) {
      if (i % 20 === 15) await page.selectOption('.data select', others[random(others.length)] ?? '');
      await page
        .locator('canvas[tabindex]')
        .first()
        .press(keys[random(keys.length)] ?? ' ');
    }
    const states = await recordStates(page);
    await page.selectOption('.data select', quick);
    await expect.poll(states).toContain('done');
    // That may have been the example before, while this one was being opened: the address says what is open.
    await expect.poll(() => page.evaluate(() => location.hash)).toContain(`example=${quick}`);
    await reach(page, 'done');
    expect(await banner().filter({ visible: true }).allTextContents()).toEqual([]);
    // It has no run to reset.
    if (!RUNNING.includes(lab)) return;
    await page.locator('canvas[tabindex]').first().press('r');
    await expect.poll(() => iteration(page)).toBe(0);
    await reach(page, 'paused');
  });

  test('runs without WebGL 2 and without any storage, and says what is missing', LONG, async () => {
    await openLab(QUICK[lab], () => {
      const { getContext } = HTMLCanvasElement.prototype as { getContext: (...given: unknown[]) => unknown };
      Object.assign(HTMLCanvasElement.prototype, {
        getContext(this: HTMLCanvasElement, kind: string, ...more: unknown[]) {
          return kind.startsWith('webgl') ? null : getContext.call(this, kind, ...more);
        },
      });
      const refuse = {
        get(): never {
          throw new DOMException('The operation is insecure.', 'SecurityError');
        },
      };
      for (const name of ['localStorage', 'sessionStorage', 'caches', 'indexedDB'])
        Object.defineProperty(window, name, refuse);
      // Not on the blank page before.
      if ('serviceWorker' in navigator)
        Object.assign(ServiceWorkerContainer.prototype, {
          register: () => Promise.reject(new DOMException('The operation is insecure.', 'SecurityError')),
        });
    });
    await reach(page, 'done');
    expect(await page.textContent('.view-note')).toContain('needs WebGL 2');
    if (RUNNING.includes(lab)) expect(await measures(page)).toMatchObject({ closed: true });
    await page.locator('canvas[tabindex]').first().press('ArrowLeft');
  });

  // Segment, whose surfaces follow strokes alone, has a test of its own.
  test.runIf(RUNNING.includes(lab))(
    'keeps the last surface when its worker crashes during a run, and restarts',
    inOneLab(lab),
    async () => {
      // The two balls are done with the first surface that is shown.
      await openLab(lab === 'reconstruct' ? lab : QUICK[lab], () => {
        const { Worker } = window;
        let broken = false;
        const isUnderWay = () =>
          document.querySelector('[data-state=running]') !== null &&
          /[1-9]/.test(document.querySelector('[data-measure=vertices]')?.textContent ?? '');
        // Inside the page, because the run is short.
        class Breaking extends Worker {
          constructor(...given: ConstructorParameters<typeof Worker>) {
            super(...given);
            this.addEventListener('message', () => {
              if (broken || !isUnderWay()) return;
              broken = true;
              setTimeout(() =>
                this.dispatchEvent(new ErrorEvent('error', { message: 'out of memory', cancelable: true })),
              );
            });
          }
        }
        Object.assign(window, { Worker: Breaking });
      });
      await page.waitForSelector('[data-state=error]');
      expect(await banner().textContent()).toMatch(/Reset restarts the engine.*out of memory/);
      await expect.poll(async () => countColors(page, await view())).toBeGreaterThan(100);
      await page.getByRole('button', { name: 'Reset', exact: true }).click();
      await expect.poll(() => banner().isVisible()).toBe(false);
      await reach(page, 'paused', 'running', 'done');
      // The other labs run by themselves after opening.
      if (lab === 'extract') await page.click('.play');
      await reach(page, 'done');
      expect(await measures(page)).toMatchObject({ closed: true });
    },
  );

  test.runIf(RUNNING.includes(lab))(
    'continues or pauses in a hidden tab, and shows everything when it becomes visible',
    LONG,
    async () => {
      await openLab(QUICK[lab], () => {
        // As in a background tab, animation frames stop.
        const request = window.requestAnimationFrame.bind(window);
        const held: FrameRequestCallback[] = [];
        const state = { seen: true, shown: false, messages: 0 };
        window.requestAnimationFrame = (callback) => (state.seen ? request(callback) : held.push(callback));
        const { Worker } = window;
        class Counted extends Worker {
          constructor(...given: ConstructorParameters<typeof Worker>) {
            super(...given);
            // Inside the page, because the run is short.
            this.addEventListener('message', () => {
              if (!state.shown && document.querySelector('[data-state=running]')) state.seen = false;
              if (!state.seen) state.messages += 1;
            });
          }
        }
        const show = () => {
          Object.assign(state, { seen: true, shown: true });
          for (const callback of held.splice(0)) request(callback);
        };
        Object.assign(window, { Worker: Counted, tab: state, show });
      });
      // Until no more messages arrive: after a whole run, or when the worker waits for the page.
      const messages = () => page.evaluate(() => (window as unknown as { tab: { messages: number } }).tab.messages);
      await expect.poll(messages).toBeGreaterThan(0);
      let count = -1;
      await expect
        .poll(async () => {
          const before = count;
          await turns(100);
          count = await messages();
          return count === before;
        })
        .toBe(true);
      expect(count).toBeLessThan(60);
      await page.evaluate(() => (window as unknown as { show: () => void }).show());
      await reach(page, 'done');
      expect(await measures(page)).toMatchObject({ closed: true });
      expect(await countColors(page, await view())).toBeGreaterThan(500);
    },
  );
});

/** Returns files whose headers promise more than they contain. */
function hostile(lab: string): { name: string; bytes: Uint8Array }[] {
  const text = (words: string) => new TextEncoder().encode(words);
  if (lab === 'reconstruct' || lab === 'sculpt')
    return [
      {
        name: 'endless.ply',
        bytes: text(
          `ply\nformat binary_little_endian 1.0\nelement vertex 4294967295\nproperty float x\nproperty float y\nproperty float z\nend_header\nabc`,
        ),
      },
      { name: 'nothing.obj', bytes: new Uint8Array(0) },
    ];
  const whole = gzipSync(nifti([32, 32, 32, 1], ball()));
  return [
    { name: 'cut.nii.gz', bytes: whole.subarray(0, whole.length / 2) },
    { name: 'huge.nii', bytes: nifti([32767, 32767, 32767, 32767], new Uint8Array(8)) },
    { name: 'bomb.nii.gz', bytes: gzipSync(nifti([32, 32, 32, 1], new Uint8Array(3e8))) },
  ];
}

/** Returns a NIfTI-1 file of bytes: a header of 352 bytes, and the voxels. */
function nifti(dims: number[], data: Uint8Array): Uint8Array {
  const bytes = new Uint8Array(352 + data.length);
  const header = new DataView(bytes.buffer);
  header.setInt32(0, 348, true);
  for (const [i, n] of [4, ...dims].entries()) header.setInt16(40 + 2 * i, n, true);
  header.setInt16(70, 2, true);
  header.setInt16(72, 8, true);
  for (let i = 0; i < 8; i++) header.setFloat32(76 + 4 * i, 1, true);
  header.setFloat32(108, 352, true);
  bytes.set(new TextEncoder().encode('n+1'), 344);
  bytes.set(data, 352);
  return bytes;
}
