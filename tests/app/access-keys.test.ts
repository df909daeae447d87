import type { Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, LABS, open, openApp, QUICK, RUNNING, reach, unfold } from './browser';
import { inOneLab } from './long';
import { changes, showsAgain } from './pixels';

const SLICED = ['extract', 'track', 'segment'];

let app: App;

beforeAll(async () => {
  // Small, so that software rendering is fast.
  app = await openApp({ width: 900, height: 640 }, 'bench.html');
  // Pauses the playback of Track's frames.
  await app.page.emulateMedia({ reducedMotion: 'reduce' });
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

/**
 * Numbers all elements that can be operated, in document order, and returns their descriptions; of a toolbar's buttons,
 * only the one in the tab order.
 */
function numberControls(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const all = document.querySelectorAll<HTMLElement>(
      'a[href], button, input, select, textarea, summary, canvas[tabindex], [tabindex="0"]',
    );
    const radio = (one: HTMLElement) => one instanceof HTMLInputElement && one.type === 'radio' && !one.checked;
    const along = (one: HTMLElement) => one.tabIndex < 0 && one.closest('[role=toolbar]') !== null;
    const usable = [...all].filter(
      (one) => one.checkVisibility() && !one.matches(':disabled') && !radio(one) && !along(one),
    );
    for (const [i, one] of usable.entries()) one.dataset.number = String(i);
    return usable.map((one, i) => `${i} ${one.outerHTML.slice(0, 100)}`);
  });
}

/** Returns the number of the focused element, and width and contrast of its focus ring. */
function focused(page: Page): Promise<{ number: string; width: number; contrast: number }> {
  return page.evaluate(() => {
    const active = document.activeElement as HTMLElement;
    // The ring of a file chooser is drawn around its label.
    const seen = active.matches('[type=file]') ? (active.nextElementSibling ?? active) : active;
    const { outlineWidth, outlineStyle, outlineColor } = getComputedStyle(seen);
    const context = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true });
    const luminance = (color: string) => {
      context?.clearRect(0, 0, 1, 1);
      if (context) context.fillStyle = color;
      context?.fillRect(0, 0, 1, 1);
      const [r = 0, g = 0, b = 0, a = 0] = [...(context?.getImageData(0, 0, 1, 1).data ?? [])].map((x) => x / 255);
      const [red, green, blue] = [r, g, b].map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
      return { value: 0.2126 * (red ?? 0) + 0.7152 * (green ?? 0) + 0.0722 * (blue ?? 0), solid: a === 1 };
    };
    let behind = luminance('#0000');
    for (let one: Element | null = seen.parentElement; one && !behind.solid; one = one.parentElement)
      behind = luminance(getComputedStyle(one).backgroundColor);
    const [low = 0, high = 0] = [behind.value, luminance(outlineColor).value].sort((a, b) => a - b);
    const width = outlineStyle === 'none' ? 0 : Number.parseFloat(outlineWidth);
    return { number: active.dataset.number ?? active.tagName, width, contrast: (high + 0.05) / (low + 0.05) };
  });
}

/** Presses a key as often as there are controls; returns the numbers of the elements that receive the focus. */
async function walk(key: string, controls: string[]): Promise<string[]> {
  const stops: string[] = [];
  for (const _ of controls) {
    await app.page.keyboard.press(key);
    const { number, width, contrast } = await focused(app.page);
    stops.push(number);
    expect(width, controls[Number(number)]).toBeGreaterThanOrEqual(2);
    expect(contrast, controls[Number(number)]).toBeGreaterThanOrEqual(3);
  }
  return stops;
}

for (const lab of LABS) {
  describe(`the ${lab} lab`, inOneLab(lab), () => {
    beforeAll(async () => {
      await open(app, QUICK[lab]);
      await reach(app.page, 'done');
      await unfold(app.page);
    });

    test('can be traversed with Tab in light and dark mode, with a visible focus at each stop', async () => {
      const controls = await numberControls(app.page);
      expect(controls.length).toBeGreaterThan(20);
      const all = controls.map((_, i) => String(i));
      await app.page.emulateMedia({ colorScheme: 'light' });
      expect(await walk('Tab', controls)).toEqual(all);
      // No keyboard trap at the end: the focus leaves the page and enters it again.
      await app.page.keyboard.press('Tab');
      expect(['BODY', '0']).toContain((await focused(app.page)).number);
      await app.page.locator(`[data-number="${controls.length - 1}"]`).focus();
      await app.page.emulateMedia({ colorScheme: 'dark' });
      expect(await walk('Shift+Tab', controls.slice(1))).toEqual(all.slice(0, -1).reverse());
    });

    test('returns the focus when the keyboard shortcuts are closed', async () => {
      for (const opener of ['#help', 'canvas[tabindex]']) {
        await app.page.locator(opener).focus();
        await app.page.keyboard.press(opener === '#help' ? 'Enter' : '?');
        await app.page.waitForSelector('dialog[open]');
        expect(await app.page.evaluate(() => document.activeElement?.closest('dialog') !== null)).toBe(true);
        await app.page.keyboard.press('Escape');
        await expect.poll(() => app.page.locator('dialog').isVisible()).toBe(false);
        expect(await app.page.evaluate((one) => document.activeElement?.matches(one), opener)).toBe(true);
      }
    });

    test('rotates, zooms and resets its view by keys', async () => {
      const view = app.page.locator('canvas[tabindex]').first();
      await view.press('Home');
      const picture = () => view.screenshot();
      const home = await picture();
      for (const key of ['ArrowLeft', 'ArrowUp', '+']) {
        await view.press(key);
        await changes(app.page, home, picture, 0.02, key);
        await view.press('Home');
        await showsAgain(app.page, home, picture, `Home after ${key}`);
      }
    });

    test.runIf(SLICED.includes(lab))('moves its slices by keys, and announces their positions', async () => {
      for (const name of ['Axial', 'Coronal', 'Sagittal']) {
        const slider = app.page.locator('.slice').getByLabel(name, { exact: true });
        const before = Number(await slider.inputValue());
        await slider.press('ArrowRight');
        const picture = app.page.locator(`.slice canvas[aria-label^="${name} slice ${before + 1} of"]`);
        await expect.poll(() => picture.count()).toBe(1);
      }
    });

    test.runIf(lab === 'track')('changes the frame by keys, the alternative to clicking the curve', async () => {
      await app.page.locator('canvas[tabindex]').first().focus();
      const shown = () => app.page.textContent('[data-frames]');
      const [before = 0, frames = 0] = ((await shown()) ?? '').split(' of ').map(Number);
      await app.page.keyboard.press('.');
      await expect.poll(shown).toBe(`${(before % frames) + 1} of ${frames}`);
    });

    test.runIf(lab === 'reconstruct')('adds a point in the centre of the view with Enter', async () => {
      await app.page.locator('[data-tool=add]').focus();
      await app.page.keyboard.press(' ');
      await app.page.locator('canvas[tabindex]').first().press('Enter');
      await expect.poll(() => app.page.textContent('.edit-tools [role=status]')).toContain('1 point added');
    });

    // Segment has no run.
    test.runIf(RUNNING.includes(lab))('can be run by keys: reset, a step, ten steps', async () => {
      // The globe has converged after a step.
      if (lab === 'sculpt') await open(app, 'sculpt?example=lava');
      await reach(app.page, 'running', 'paused', 'done');
      await app.page.locator('canvas[tabindex]').first().focus();
      await app.page.keyboard.press('r');
      await reach(app.page, 'paused');
      await app.page.keyboard.press('s');
      await expect.poll(() => app.page.textContent('.iteration')).toBe('Iteration 1');
      await app.page.keyboard.press('d');
      await expect.poll(() => app.page.textContent('.iteration')).toBe('Iteration 11');
    });

    // A system of equations has no earlier steps to return to, and Segment no steps.
    test.runIf(RUNNING.includes(lab) && lab !== 'reconstruct')('undoes steps by keys', async () => {
      await app.page.keyboard.press('Control+z');
      await expect.poll(() => app.page.textContent('.iteration')).toBe('Iteration 1');
    });
  });
}
