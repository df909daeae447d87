import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, LABS, open, openApp, overflow, QUICK, RUNNING, reach, unfold } from './browser';
import { inOneLab, LONG } from './long';

let app: App;

beforeAll(async () => {
  app = await openApp(undefined, 'bench.html');
  await app.page.emulateMedia({ reducedMotion: 'reduce' });
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

/** Counts the draw calls of the page's canvases within some animation frames. */
function drawings(frames: number): Promise<number> {
  return app.page.evaluate(async (frames) => {
    const { prototype } = WebGL2RenderingContext;
    const { drawElements } = prototype;
    let count = 0;
    prototype.drawElements = function (...given) {
      count += 1;
      return drawElements.apply(this, given);
    };
    for (let i = 0; i < frames; i++) await new Promise((drawn) => requestAnimationFrame(drawn));
    prototype.drawElements = drawElements;
    return count;
  }, frames);
}

/** Returns all visible texts without numbers, since numbers may keep changing. */
function words(): Promise<string[]> {
  return app.page.evaluate(() => {
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const found: string[] = [];
    while (walker.nextNode()) {
      const text = walker.currentNode.textContent?.trim() ?? '';
      const seen = walker.currentNode.parentElement?.checkVisibility() === true;
      if (/[a-z]{3}/i.test(text) && !/\d/.test(text) && text !== 'Vesicle' && seen) found.push(text);
    }
    return found;
  });
}

/** Returns the elements whose content overflows and is hidden. */
function cut(): Promise<string[]> {
  return app.page.evaluate(() => {
    const hides = (one: Element) => /hidden|clip/.test(getComputedStyle(one).overflowX);
    return [...document.querySelectorAll('main *, header *')]
      .filter((one) => one.checkVisibility() && one.clientWidth > 1 && hides(one))
      .filter((one) => one.scrollWidth > one.clientWidth + 1 && !one.matches('select, input, .plot, .plot *'))
      .map((one) => one.outerHTML.slice(0, 120));
  });
}

for (const lab of LABS) {
  describe(`the ${lab} lab`, inOneLab(lab), () => {
    test('does not animate with reduced motion when its example is done', async () => {
      await open(app, QUICK[lab]);
      await reach(app.page, 'done');
      // Pending frames are drawn first.
      await expect.poll(() => drawings(5)).toBe(0);
      expect(await drawings(60)).toBe(0);
      const animations = await app.page.evaluate(() => document.getAnimations().length);
      expect(animations).toBe(0);
    });

    test('shows pressed buttons, the current lab and colour legends in forced colours', async () => {
      await app.page.emulateMedia({ forcedColors: 'active' });
      const styles = await app.page.evaluate(() => {
        const all = (selector: string) =>
          [...document.querySelectorAll<HTMLElement>(selector)].filter((one) => one.checkVisibility());
        const outlined = (one: HTMLElement) => getComputedStyle(one).outlineStyle !== 'none';
        const color = (one: HTMLElement) => getComputedStyle(one).backgroundColor;
        return {
          forced: matchMedia('(forced-colors: active)').matches,
          current: all('.labs a').map((one) => outlined(one) === one.hasAttribute('aria-current')),
          pressed: all('button[aria-pressed]').map(
            (one) => outlined(one) === (one.getAttribute('aria-pressed') === 'true'),
          ),
          swatches: new Set(all('.swatch').map(color)).size,
        };
      });
      await app.page.emulateMedia({ forcedColors: null });
      expect(styles.forced).toBe(true);
      expect(styles.current).toEqual(LABS.map(() => true));
      // Two balls have neither photographs nor figures to choose from.
      expect(styles.pressed.length > 0).toBe(lab !== 'reconstruct');
      expect(styles.pressed.every(Boolean)).toBe(true);
      expect(styles.swatches).toBe(['extract', 'track', 'segment'].includes(lab) ? 3 : 0);
    });

    test('describes all its pictures in words', async () => {
      await unfold(app.page);
      const untold = await app.page.evaluate(() => {
        const shown = [...document.querySelectorAll('canvas')].filter((one) => one.checkVisibility());
        const named = (one: Element) => (one.getAttribute('aria-label') ?? '').length > 10;
        const caption = (one: Element) => one.closest('figure')?.querySelector('figcaption')?.textContent ?? '';
        // A picture on a button is described by the button's label.
        const button = (one: Element) => (one.closest('button')?.getAttribute('aria-label') ?? '').length > 10;
        return shown
          .filter((one) => !named(one) && !button(one) && caption(one).length < 20)
          .map((one) => one.outerHTML);
      });
      expect(untold).toEqual([]);
    });

    test.runIf(RUNNING.includes(lab) && lab !== 'track')('has the numbers of its plots in a table', async () => {
      const table = app.page.locator('[data-plot-table]');
      const last = table.locator('tbody tr:not([hidden])').last();
      await expect.poll(() => last.locator('th').textContent()).toMatch(/^\d/);
      const iteration = (await app.page.textContent('.iteration'))?.replace('Iteration ', '');
      await expect.poll(() => last.locator('th').textContent()).toBe(iteration);
      const heads = await table.locator('thead th').count();
      expect(await last.locator('td').count()).toBe(heads - 1);
    });

    test.each([
      [640, 400],
      [320, 256],
    ])('shows all its texts at %i by %i, as when zoomed in', async (width, height) => {
      await app.page.setViewportSize({ width: 1280, height: 800 });
      const wide = await words();
      expect(wide).toContain('How it works');
      expect(await overflow(app.page, width, height)).toBeLessThanOrEqual(0);
      const narrow = await words();
      expect(wide.filter((word) => !narrow.includes(word))).toEqual([]);
      expect(await cut()).toEqual([]);
    });
  });
}

describe('with reduced motion', LONG, () => {
  test('Track plays on request; without it, it plays by itself', async () => {
    const beat = () => app.page.textContent('[data-frame=beat]');
    await open(app, QUICK.track);
    await reach(app.page, 'done');
    expect(await beat()).toBe('Loop');
    await app.page.locator('canvas[tabindex]').first().press('b');
    expect(await beat()).toBe('Stop');
    await expect.poll(() => drawings(5)).toBeGreaterThan(0);
    await app.page.emulateMedia({ reducedMotion: 'no-preference' });
    await open(app, QUICK.track);
    await expect.poll(beat).toBe('Stop');
    await app.page.emulateMedia({ reducedMotion: 'reduce' });
  });

  test('an endless animation in Sculpt only plays on request', async () => {
    await open(app, 'sculpt?loop=true');
    await reach(app.page, 'done', 'paused');
    await expect.poll(() => drawings(5)).toBe(0);
    await app.page.locator('canvas[tabindex]').first().press(' ');
    await reach(app.page, 'running');
  });
});

describe('with a screen reader', LONG, () => {
  test.each(['extract?example=tooth&levels=0', 'sculpt?example=lava'])(
    'progress of %s is announced now and then, not with each step',
    async (address) => {
      // A clock a hundred times as fast; otherwise the test would take minutes, and the tooth would be done.
      const page = await (app.page.context().browser() as Browser).newPage();
      await page.addInitScript(() => {
        const now = performance.now.bind(performance);
        performance.now = () => 100 * now();
        // From the start on, because the run may be short.
        const said: { time: number; text: string }[] = [];
        const note = (changes: MutationRecord[]) => {
          const line = document.querySelector('.status');
          const text = line?.textContent ?? '';
          if (changes.some(({ target }) => line?.contains(target))) said.push({ time: performance.now(), text });
        };
        new MutationObserver(note).observe(document, { childList: true, characterData: true, subtree: true });
        Object.assign(window, { said });
      });
      await page.goto(`${app.address}#${address}`);
      const said = () => page.evaluate<{ time: number; text: string }[]>('window.said');
      const isReport = ({ text }: { text: string }) => /^Running\. Iteration [\d,]+, .+ vertices/.test(text);
      await expect.poll(async () => (await said()).filter(isReport).length).toBeGreaterThan(2);
      // From the first report to the last, nothing else is said either.
      const all = await said();
      const times = all.slice(all.findIndex(isReport), all.findLastIndex(isReport) + 1).map(({ time }) => time);
      const pauses = times.slice(1).map((time, i) => time - (times[i] ?? 0));
      expect(Math.min(...pauses)).toBeGreaterThan(9000);
      await page.close();
    },
  );
});
