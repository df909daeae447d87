/** The Extract lab beyond running: views, attractors, comparisons, undo, links. */
import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { PRESETS } from '../../www/src/labs/extract/presets';
import { type App, iteration, measures, openApp, reach } from './browser';
import { LONG } from './long';
import { changes, showsAgain } from './pixels';

let app: App;

beforeAll(async () => {
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

/** Reloads the page at an address of the lab and waits until the surface has converged. */
async function openAt(hash: string): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(app.address + hash);
  await reach(app.page, 'done');
}

/** Number of iterations of the chain of figure 7 until it converges. */
const CHAIN = PRESETS.find(({ id }) => id === 'figure-7')?.variants[0].expected.iterations;

const text = (selector: string) => app.page.locator(selector).textContent();
/** Takes a screenshot of a canvas. */
const picture = (selector: string) => app.page.locator(selector).first().screenshot();

describe('a figure of the paper', () => {
  test("opens from the list, runs until it converges, and shows the paper's result and its own", async () => {
    await reach(app.page, 'running', 'done');
    await app.page.selectOption('.data select', 'figure-15-16');
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('head phantom'));
    await reach(app.page, 'done');
    expect(await measures(app.page)).toMatchObject({ components: 1, genus: 5, closed: true });
    expect(await text('.figure')).toMatch(/Paper: On a head CT.*Here both runs end/);
    expect(await app.page.evaluate(() => location.hash)).toBe('#extract?example=figure-15-16&v=2');
  });

  test('shows the levels of the pyramid, and marks the current one', async () => {
    const levels = await app.page.locator('.pyramid button').evaluateAll((buttons) =>
      buttons.map((button) => ({
        label: button.getAttribute('aria-label'),
        width: button.querySelector('canvas')?.width ?? 0,
        inUse: button.classList.contains('in-use'),
      })),
    );
    expect(levels.map(({ width }) => width)).toEqual([20, 36, 64, 112]);
    expect(levels.map(({ inUse }) => inUse)).toEqual([false, false, false, true]);
    expect(levels[0]?.label).toBe('I₃: level 3, 20 × 20 × 20 voxels');
    expect(levels[3]?.label).toContain('present level of the model');
  });

  test('a selected level is shown in the slices, and the pictures follow the slice', async () => {
    const slice = '.slice canvas';
    const fine = await picture(slice);
    await app.page.click('.pyramid [data-level="3"]');
    expect(await app.page.getAttribute('.pyramid [data-level="3"]', 'aria-pressed')).toBe('true');
    await changes(app.page, fine, () => picture(slice), 0.1);
    const small = await picture('.pyramid [data-level="0"]');
    await app.page.locator('.slice input[type=range]').first().press('Home');
    await changes(app.page, small, () => picture('.pyramid [data-level="0"]'), 0.1);
    await app.page.locator('.slice input[type=range]').first().fill('55');
    await app.page.check('[data-pyramid=follow]');
    expect(await app.page.getAttribute('.pyramid [data-level="0"]', 'aria-pressed')).toBe('true');
    await showsAgain(app.page, fine, () => picture(slice));
    await app.page.uncheck('[data-pyramid=follow]');
  });

  test('describes level changes and topology changes in words', async () => {
    await expect
      .poll(() => text('[data-plot-events]'))
      .toMatch(
        /^Level 3 from iteration 1, level 2 from iteration \d+, level 1 from iteration \d+, level 0 from iteration \d+\. \d+ joins, \d+ cuts, \d+ parts vanished\.$/,
      );
    const [, vertices] = await app.page.locator('figcaption').allTextContents();
    expect(vertices).toMatch(/\d at the end of level 3, [\d,]+ at the end of level 2, [\d,]+ at the end of level 1\.$/);
  });

  test('shows the time of each part on each level, as in the paper', async () => {
    const table = app.page.getByRole('region', { name: 'Time by part and level' });
    const head = await table.locator('thead th').allTextContents();
    expect(head).toEqual(['Part', 'level 3', 'level 2', 'level 1', 'level 0', 'total']);
    const rows = await table.locator('tbody tr, tfoot tr').allTextContents();
    expect(rows.map((row) => row.replace(/[\d.]+/g, ''))).toEqual([
      'T topology',
      'N normals',
      'F dynamics',
      'topology',
      'embedding',
      'forces',
      'motion',
      'total',
    ]);
    const numbers = async (row: string) =>
      (await table.locator('tr', { hasText: row }).locator('td').allTextContents()).map(Number);
    const [forces, motion, dynamics] = [await numbers('forces'), await numbers('motion'), await numbers('F dynamics')];
    expect(forces.at(-1)).toBeGreaterThan(0);
    for (const [i, sum] of dynamics.entries())
      expect(Math.abs((forces[i] ?? 0) + (motion[i] ?? 0) - sum)).toBeLessThan(0.02);
  });

  test('by keyboard, coverage is measured and cancelled; the focus goes to Cancel and back', async () => {
    const start = app.page.locator('[data-coverage-action=start]');
    const focused = () => app.page.evaluate(() => (document.activeElement as HTMLElement).dataset.coverageAction);
    await start.press('Enter');
    await expect.poll(focused).toBe('cancel');
    await app.page.keyboard.press('Enter');
    await expect.poll(() => text('.coverage [role=status]')).toBe('Cancelled.');
    await expect.poll(focused).toBe('start');
  });

  test('compares direct with coarse to fine in a table, and keeps the surface', LONG, async () => {
    await openAt('#extract?example=figure-15-16&v=2');
    const before = await measures(app.page);
    await app.page.click('[data-compare=start]');
    await app.page.waitForFunction(() =>
      document.querySelector('[data-compare=cancel]')?.textContent?.includes('iteration'),
    );
    await app.page.waitForFunction(
      () => document.querySelector<HTMLElement>('[data-comparison]')?.dataset.comparison !== '{}',
    );
    const { direct, coarseToFine } = JSON.parse(
      (await app.page.getAttribute('[data-comparison]', 'data-comparison')) ?? '{}',
    );
    expect(direct).toMatchObject({ levels: 0, done: true, components: 1, genus: 5 });
    expect(coarseToFine).toMatchObject({ levels: 3, done: true, components: 1, genus: 5, vertices: before.vertices });
    // How fast each is depends on the machine; the sentence tells what was measured.
    const [faster, slower] = [coarseToFine, direct].toSorted((a, b) => a.milliseconds - b.milliseconds);
    const names = faster === direct ? ['Direct', 'coarse to fine'] : ['Coarse to fine', 'direct'];
    const factor = Number((slower.milliseconds / faster.milliseconds).toPrecision(2));
    expect(await text('.compare [role=status]')).toMatch(
      new RegExp(`^${names[0]} was ${factor} times as fast as ${names[1]}\\. Area differs by 0\\.\\d\\d %`),
    );
    const table = app.page.getByRole('region', { name: 'Times of both runs' });
    expect(await table.locator('thead th').allTextContents()).toEqual(['Part', 'I₃', 'I₂', 'I₁', 'I₀', 'total']);
    const steps = await table
      .locator('tbody tr', { hasText: 'steps' })
      .evaluateAll((rows) =>
        rows.map((row) => [...row.querySelectorAll('td')].map((cell) => Number(cell.textContent?.replace(/\D/g, '')))),
      );
    // On I₀, where a step costs most, coarse to fine has few left to do.
    expect(steps[1]?.slice(0, 3)).toEqual([0, 0, 0]);
    expect(steps[1]?.[3]).toBeGreaterThan(5 * (steps[0]?.[3] ?? Number.POSITIVE_INFINITY));
    expect(steps.map((row) => row.slice(0, 4).reduce((sum, n) => sum + n) - (row[4] ?? 0))).toEqual([0, 0]);
    const heads = await table.locator('tbody th').allTextContents();
    expect(heads).toEqual(['coarse to fine', 'T', 'N', 'F', '=', 'steps', 'direct', 'T', 'N', 'F', '=', 'steps']);
    expect(await measures(app.page)).toEqual(before);
  });

  test('a comparison can be cancelled', LONG, async () => {
    await app.page.click('[data-compare=start]');
    await app.page.click('[data-compare=cancel]');
    await expect.poll(() => text('.compare [role=status]')).toBe('Cancelled.');
    expect(await app.page.isVisible('[data-compare=start]')).toBe(true);
    expect(await app.page.getAttribute('[data-comparison]', 'data-comparison')).toBe('{}');
  });

  test('with several pictures leads from one to the next', LONG, async () => {
    await openAt('#extract?example=figure-24');
    const first = await iteration(app.page);
    expect(await measures(app.page)).toMatchObject({ components: 1 });
    await app.page.click('.figure button:has-text("0.75")');
    await expect.poll(() => text('[data-figure=came]')).toContain('three granules');
    await expect.poll(async () => (await measures(app.page)).components).toBe(3);
    await reach(app.page, 'done');
    expect(await iteration(app.page)).toBeGreaterThan(first);
    expect(await app.page.getAttribute('.figure button:has-text("0.75")', 'aria-pressed')).toBe('true');
  });
});

describe('attractors', LONG, () => {
  const items = () => app.page.locator('.attractors li');
  const pause = async () => {
    await app.page.locator('.scene > canvas').focus();
    if ((await reach(app.page, 'running', 'paused', 'done')) === 'running') await app.page.keyboard.press(' ');
    await reach(app.page, 'paused', 'done');
  };

  test('are placed at the crosshair by key, and pull the surface', async () => {
    await openAt('#extract?example=figure-7');
    // A position beside a ring: the right end of the volume, half way up.
    for (const slider of await app.page.locator('.slice input[type=range]').all()) await slider.fill('22');
    await app.page.getByLabel('Sagittal', { exact: true }).fill('58');
    const before = await measures(app.page);
    await app.page.locator('.scene > canvas').focus();
    await app.page.keyboard.press('a');
    await expect.poll(() => items().count()).toBe(1);
    expect(await items().first().textContent()).toContain('58, 22, 22');
    await reach(app.page, 'running', 'done');
    await expect.poll(async () => (await measures(app.page)).volume).toBeGreaterThan(1.0004 * before.volume);
    await pause();
  });

  test('are shown in the slices and in 3D', async () => {
    const before = [await picture('.slice canvas'), await picture('.scene > canvas')];
    await app.page.getByLabel('Radius of attractor 1').fill('11');
    await app.page.getByLabel('Radius of attractor 1').press('Enter');
    await pause();
    for (const [i, canvas] of ['.slice canvas', '.scene > canvas'].entries())
      await changes(app.page, before[i] ?? Buffer.of(), () => picture(canvas), 0.005, canvas);
  });

  test('are placed by clicking in a slice and on the surface', async () => {
    await app.page.click('[data-attractor=place]');
    const slice = app.page.locator('.slice canvas').first();
    const box = await slice.boundingBox();
    await slice.click({ position: { x: 0.5 * (box?.width ?? 0), y: 0.3 * (box?.height ?? 0) } });
    await expect.poll(() => items().count()).toBe(2);
    // Some click in a row across the middle hits the surface.
    const view = app.page.locator('.scene > canvas');
    const area = await view.boundingBox();
    for (let part = 0.35; part < 0.7 && (await items().count()) < 3; part += 0.04) {
      await view.click({ position: { x: part * (area?.width ?? 0), y: 0.5 * (area?.height ?? 0) } });
    }
    expect(await items().count()).toBe(3);
    await app.page.click('[data-attractor=place]');
    await slice.click();
    expect(await items().count()).toBe(3);
    await pause();
  });

  test('are part of the link, and are refused or removed one by one', async () => {
    expect(await app.page.evaluate(() => location.hash.match(/attractor=/g)?.length)).toBe(3);
    await app.page.getByLabel('Strength of attractor 2').fill('5000');
    await app.page.getByLabel('Strength of attractor 2').press('Enter');
    await app.page.waitForFunction(() => document.querySelector('.attractors + .field-error')?.textContent);
    expect(await app.page.getByLabel('Strength of attractor 2').inputValue()).toBe('0.1');
    await app.page.getByLabel('Remove attractor 2').click();
    await expect.poll(() => items().count()).toBe(2);
    await pause();
  });

  test('are restored by undo', async () => {
    await app.page.locator('.scene > canvas').focus();
    // The label appears with the saved state.
    await expect
      .poll(() => app.page.getAttribute('[data-transport=undo]', 'title'))
      .toBe('Undo: removal of attractor 2');
    await app.page.keyboard.press('Control+z');
    await expect.poll(() => items().count()).toBe(3);
    await reach(app.page, 'paused', 'done');
  });
});

describe('colour', LONG, () => {
  test('by speed has a legend with numbers, and colours the surface', async () => {
    await openAt('#extract?example=figure-7');
    // From here on the list is focused, and its ring is in every picture.
    await app.page.selectOption('[data-view=color]', 'plain');
    const plain = await picture('.scene > canvas');
    await app.page.selectOption('[data-view=color]', 'speed');
    const legend = app.page.getByRole('group', { name: 'Colour scale' });
    await legend.waitFor();
    expect(await legend.textContent()).toMatch(/^Speed along the normal, δ per iteration−([\d.]+)0\1inwardsoutwards$/);
    await changes(app.page, plain, () => picture('.scene > canvas'), 0.05);
    await app.page.selectOption('[data-view=color]', 'plain');
    await legend.waitFor({ state: 'hidden' });
    await showsAgain(app.page, plain, () => picture('.scene > canvas'));
  });

  test("by curvature has a legend in the volume's unit, and distinguishes convex from concave", async () => {
    await app.page.selectOption('[data-view=color]', 'mean curvature');
    const legend = app.page.locator('.color-legend:visible');
    await expect.poll(() => legend.textContent()).toMatch(/^Mean curvature, 1\/unit−([\d.]+)0\1concaveconvex$/);
    await app.page.selectOption('[data-view=color]', 'gaussian curvature');
    await expect
      .poll(() => legend.textContent())
      .toMatch(/^Gaussian curvature, 1\/unit²−.*hyperbolic \(saddle\)elliptic \(dome or cup\)$/);
  });

  test('shows no motion at the start, then inward motion everywhere', async () => {
    await app.page.selectOption('[data-view=color]', 'speed');
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    const legend = app.page.locator('.color-legend:visible');
    await expect.poll(() => legend.textContent()).toContain('−1.00e-4');
    await app.page.click('text=Step ×10');
    await expect.poll(() => legend.textContent()).toMatch(/−0\.[1-5]0/);
    await app.page.selectOption('[data-view=color]', 'plain');
  });
});

describe('undo', () => {
  const undo = () => app.page.click('[data-transport=undo]');
  const redo = () => app.page.click('[data-transport=redo]');
  const rigidity = () => app.page.locator('[data-param=rigidity] input[type=number]');

  test('reverts a reset with its surface, plots and state, and redo repeats it', async () => {
    await openAt('#extract?example=figure-7');
    const before = await measures(app.page);
    const captions = () => app.page.locator('figcaption').allTextContents();
    // They follow in the next frames, one after the other, with a delay on a busy machine.
    const ends = [`After ${CHAIN} iterations`, `now ${before.vertices};`, `now ${before.chi};`];
    await expect.poll(captions).toEqual(ends.map((end) => expect.stringContaining(end)));
    const told = await captions();
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    await expect.poll(() => app.page.getAttribute('[data-transport=undo]', 'title')).toBe('Undo: Reset');
    await undo();
    await reach(app.page, 'done');
    expect(await measures(app.page)).toEqual(before);
    expect(await iteration(app.page)).toBe(CHAIN);
    await expect.poll(captions).toEqual(told);
    await redo();
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBe(0);
    await undo();
    await reach(app.page, 'done');
  });

  test('by Ctrl+Z reverts a parameter and its effect', async () => {
    const before = await measures(app.page);
    await rigidity().fill('0.3');
    await rigidity().press('Enter');
    await expect.poll(() => iteration(app.page)).toBeGreaterThan(CHAIN ?? 0);
    await reach(app.page, 'done');
    // The focus is in the field, but nothing is being typed.
    await app.page.keyboard.press('Control+z');
    await expect.poll(() => rigidity().inputValue()).toBe('0.1');
    await reach(app.page, 'done');
    expect(await measures(app.page)).toEqual(before);
    await app.page.keyboard.press('Control+Shift+Z');
    await expect.poll(() => rigidity().inputValue()).toBe('0.3');
    await app.page.keyboard.press('Control+z');
    await expect.poll(() => rigidity().inputValue()).toBe('0.1');
  });

  test('does not affect a number that is being typed', async () => {
    const title = await app.page.getAttribute('[data-transport=undo]', 'title');
    await rigidity().click();
    await app.page.keyboard.type('9');
    await app.page.keyboard.press('Control+z');
    expect(await rigidity().inputValue()).toBe('0.1');
    expect(await app.page.getAttribute('[data-transport=undo]', 'title')).toBe(title);
    await rigidity().blur();
  });

  test('reverts steps, then a change of start and levels', async () => {
    await reach(app.page, 'done');
    const before = await measures(app.page);
    await app.page.getByLabel('Pyramid levels').fill('1');
    await app.page.getByLabel('Pyramid levels').press('Enter');
    await expect.poll(() => app.page.locator('.pyramid button').count()).toBe(2);
    await reach(app.page, 'done');
    await app.page.click('text=Reset');
    await reach(app.page, 'paused');
    await app.page.click('text=Step ×10');
    await expect.poll(() => iteration(app.page)).toBe(10);
    await undo();
    await expect.poll(() => iteration(app.page)).toBe(0);
    // The reset and the new start, in immediate succession.
    await app.page.evaluate(() => {
      for (let i = 0; i < 2; i++) document.querySelector<HTMLElement>('[data-transport=undo]')?.click();
    });
    await expect.poll(() => app.page.getByLabel('Pyramid levels').inputValue()).toBe('0');
    await reach(app.page, 'done');
    expect(await measures(app.page)).toEqual(before);
    await expect.poll(() => app.page.locator('.pyramid button').count()).toBe(1);
  });

  test('on a volume that was just opened only reverts its run', LONG, async () => {
    await app.page.selectOption('.data select', 'figure-8');
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('chain'));
    await expect.poll(() => app.page.getAttribute('[data-transport=undo]', 'title')).toBe('Undo: Play');
    await reach(app.page, 'done');
    await undo();
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBe(0);
    await expect.poll(() => app.page.isDisabled('[data-transport=undo]')).toBe(true);
  });
});

describe('a link', () => {
  test('restores example, start, parameters, attractors and colour', async () => {
    const hash =
      '#extract?example=linked-rings&start=bubbles&bubbles=9&levels=0&edge=2&color=speed&p.iso=130&p.rigidity=0.15&attractor=10,31,31,0.02,6&v=2';
    await app.page.goto('about:blank');
    await app.page.goto(app.address + hash);
    await reach(app.page, 'running', 'done');
    expect(await app.page.inputValue('.data select')).toBe('linked-rings');
    expect(await app.page.inputValue('.start select')).toBe('bubbles');
    expect(await app.page.getByLabel('Bubbles per axis').inputValue()).toBe('9');
    expect(await app.page.getByLabel('Mean edge length').inputValue()).toBe('2');
    expect(await app.page.inputValue('[data-param=iso] input[type=number]')).toBe('130');
    expect(await app.page.inputValue('[data-param=rigidity] input[type=number]')).toBe('0.15');
    expect(await app.page.locator('.attractors li').count()).toBe(1);
    expect(await app.page.inputValue('[data-view=color]')).toBe('speed');
    const parts = (address: string) => [...new URLSearchParams(address.split('?')[1])].sort();
    expect(parts(await app.page.evaluate(() => location.hash))).toEqual(parts(hash));
  });

  test('opens its settings when it is followed in the open page', async () => {
    await app.page.evaluate(() => {
      location.hash = '#extract?example=figure-8';
    });
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('chain'));
    await reach(app.page, 'done');
    expect(await measures(app.page)).toMatchObject({ components: 2, genus: 2 });
    expect(await app.page.locator('.attractors li').count()).toBe(0);
  });

  test('that is invalid shows a message, and the built-in example runs', LONG, async () => {
    await app.page.goto('about:blank');
    await app.page.goto(`${app.address}#extract?example=nowhere`);
    await app.page.waitForSelector('.banner:not([hidden])');
    expect(await text('.banner')).toContain('nowhere');
    await reach(app.page, 'running', 'done');
  });
});

describe('plot data', LONG, () => {
  test('can be saved as CSV', async () => {
    await openAt('#extract?example=figure-7');
    await reach(app.page, 'done');
    const [download] = await Promise.all([
      app.page.waitForEvent('download'),
      app.page.getByRole('button', { name: 'Plot data (CSV)' }).click(),
    ]);
    expect(download.suggestedFilename()).toBe('chain.csv');
    const lines = (await readFile(await download.path(), 'utf8')).trim().split('\n');
    expect(lines[0]).toMatch(/^iteration,phase,energy/);
    expect(lines).toHaveLength((await iteration(app.page)) + 1);
    expect(lines.at(-1)).toContain(`,${(await measures(app.page)).vertices},`);
  });
});
