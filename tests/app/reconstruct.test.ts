/** The Reconstruct lab: a closed surface from points. */
import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { computedCloud } from '../../www/src/labs/reconstruct/clouds';
import {
  type App,
  afterRun,
  drop,
  iteration,
  openApp,
  overflow,
  reach,
  recordStates,
  unnamedControls,
} from './browser';
import { LONG } from './long';
import { blackPng } from './made-png';
import { countPixels } from './pixels';

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

async function openAt(hash: string, ...states: string[]): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(app.address + hash);
  await reach(app.page, ...states);
}

/** Returns measures of the surface and of the fit. */
async function measured(): Promise<Record<string, number | boolean>> {
  return JSON.parse((await app.page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
}

const text = (selector: string) => app.page.locator(selector).first().textContent();

async function setParam(name: string, value: string): Promise<void> {
  const field = app.page.locator(`[data-param=${name}] input[type=number]`);
  await field.fill(value);
  await field.press('Enter');
}

/** Returns points of a shape as text, one per line. */
function asText(shape: Parameters<typeof computedCloud>[0]): Uint8Array {
  const { points } = computedCloud(shape);
  const lines: string[] = [];
  for (let i = 0; i < points.length; i += 3) lines.push(points.subarray(i, i + 3).join(' '));
  return new TextEncoder().encode(`${lines.join('\n')}\n`);
}

/** Presses the space bar as soon as a run begins, from inside the page: from outside it might come after its end. */
async function pauseAtOnce(): Promise<void> {
  await app.page.evaluate(() => {
    const lab = document.querySelector<HTMLElement>('[data-state]');
    const press = () => {
      if (lab?.dataset.state !== 'running') return;
      watch.disconnect();
      document.activeElement?.dispatchEvent(new KeyboardEvent('keydown', { key: ' ', bubbles: true }));
    };
    const watch = new MutationObserver(press);
    if (lab) watch.observe(lab, { attributeFilter: ['data-state'] });
  });
}

describe('the built-in example', () => {
  test('runs to the end by itself: one closed surface without self-intersections, in the colours of the photographs', async () => {
    await openAt('#reconstruct', 'done');
    expect(await measured()).toMatchObject({ components: 1, genus: 0, closed: true, oriented: true, crossings: 0 });
    const { fitMean, surfaceConstraints, exteriorConstraints, residual } = await measured();
    expect(fitMean).toBeLessThan(0.03);
    expect(surfaceConstraints).toBeGreaterThan(7000);
    expect(exteriorConstraints).toBeGreaterThan(500);
    expect(residual).toBeLessThan(1e-5);
    expect(await app.page.title()).toBe('Vesicle: Reconstruct');
    expect(await app.page.getAttribute('[data-lab=reconstruct]', 'aria-current')).toBe('page');
  });

  test('is rendered with white, black and brown', async () => {
    await app.page.uncheck('[data-view=points]');
    const png = await app.page.locator('.scene > canvas').screenshot();
    const dark = await countPixels(app.page, png, (r, g, b) => r < 70 && g < 70 && b < 70);
    const brown = await countPixels(app.page, png, (r, _g, b) => r > b + 60);
    expect(dark).toBeGreaterThan(500);
    expect(brown).toBeGreaterThan(100);
    await app.page.check('[data-view=points]');
  });

  test('reports the time of each phase, and describes the plots in words', async () => {
    const times = await app.page.locator('.phases .time').allTextContents();
    expect(times).toHaveLength(5);
    for (const time of times) expect(time).toMatch(/^[\d.,]+ m?s$/);
    const captions = await app.page.locator('.plots figcaption, [data-plot=kernel]').allTextContents();
    expect(captions[0]).toMatch(/^After \d+ iterations of the solver the residual is .* below the tolerance of/);
    expect(captions[1]).toMatch(/^Decays to half at r = 0\.\d+; at 0\.5, [\d.]+ % remain/);
  });

  test.each(['ply', 'stl', 'glb', 'obj'])('exports a closed mesh as %s', async (format) => {
    const [download] = await Promise.all([
      app.page.waitForEvent('download'),
      app.page.click(`[data-export=${format}]`),
    ]);
    const mesh = Mesh.parse(await readFile(await download.path()));
    const { triangles } = await measured();
    expect(mesh.triangleCount).toBe(triangles);
    expect(mesh.check()).toMatchObject({ closed: true, oriented: true });
    mesh.free();
  });

  test.each([
    ['vtp', '<?xml'],
    ['mz3', 'MZ'],
  ])('exports %s', async (format, start) => {
    const [download] = await Promise.all([
      app.page.waitForEvent('download'),
      app.page.click(`[data-export=${format}]`),
    ]);
    expect((await readFile(await download.path())).toString('latin1', 0, start.length)).toBe(start);
  });

  test('a photograph is shown beside the view from its camera, until the view is rotated', async () => {
    const view = app.page.locator('.scene > canvas');
    await app.page.click('[data-photo="3"]');
    expect(await app.page.locator('.photograph').isVisible()).toBe(true);
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?photo=4');
    await view.press('ArrowLeft');
    await expect.poll(() => app.page.locator('.photograph').isVisible()).toBe(false);
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct');
  });
});

describe('running', () => {
  beforeAll(() => openAt('#reconstruct?example=torus', 'done'));

  test('changed smoothness solves again, and the surface is kept until the new one is ready', async () => {
    const before = await measured();
    const seen = await app.page.evaluateHandle(() => {
      const list: string[] = [];
      const element = document.querySelector<HTMLElement>('[data-measures]');
      const note = () => list.push(element?.dataset.measures ?? '');
      if (element) new MutationObserver(note).observe(element, { attributeFilter: ['data-measures'] });
      return list;
    });
    await afterRun(app.page, () => setParam('lambdaSurface', '0.01'));
    const after = await measured();
    expect(after).toMatchObject({ components: 1, genus: 1, closed: true });
    expect(after.meanCurvature).toBeLessThan(Number(before.meanCurvature));
    for (const values of await seen.jsonValue()) expect(JSON.parse(values).vertices).toBeGreaterThan(0);
    expect(await app.page.evaluate(() => location.hash)).toContain('p.lambdaSurface=0.01');
  });

  test('undo restores the previous value and surface, redo the later', async () => {
    const field = app.page.locator('[data-param=lambdaSurface] input[type=number]');
    const later = await measured();
    await afterRun(app.page, () => app.page.click('[data-transport=undo]'));
    expect(await field.inputValue()).toBe('0.001');
    expect((await measured()).meanCurvature).toBeGreaterThan(Number(later.meanCurvature));
    await afterRun(app.page, () => app.page.click('[data-transport=redo]'));
    expect(await field.inputValue()).toBe('0.01');
    expect((await measured()).vertices).toBe(later.vertices);
  });

  test('reset, step, ten steps, play and pause by keyboard', async () => {
    await app.page.locator('.scene > canvas').focus();
    await app.page.keyboard.press('r');
    await reach(app.page, 'paused');
    expect(await iteration(app.page)).toBe(0);
    expect(await measured()).toEqual({});
    await app.page.keyboard.press('s');
    await expect.poll(() => iteration(app.page)).toBe(1);
    await app.page.keyboard.press('d');
    await expect.poll(() => iteration(app.page)).toBe(11);
    await pauseAtOnce();
    const states = await recordStates(app.page);
    await app.page.keyboard.press(' ');
    await expect.poll(states).toEqual(['running', 'paused']);
    expect(await iteration(app.page)).toBeGreaterThan(10);
    await app.page.keyboard.press(' ');
    await reach(app.page, 'done');
  });

  test('the width of the Gaussian is shown only for the Gaussian', LONG, async () => {
    const shown = (name: string) => app.page.locator(`[data-param=${name}]`).isVisible();
    expect([await shown('sigma'), await shown('delta')]).toEqual([false, true]);
    await afterRun(app.page, () => app.page.selectOption('[data-param=kernel] select', 'gaussian'));
    expect([await shown('sigma'), await shown('delta')]).toEqual([true, false]);
    await afterRun(app.page, () => app.page.selectOption('[data-param=kernel] select', 'multi-order'));
  });

  test('a parameter out of range is refused beside it, and the previous value is kept', async () => {
    await setParam('tau', '-1');
    await expect.poll(() => text('[data-param=tau] .field-error')).toMatch(/\w/);
    expect(await app.page.inputValue('[data-param=tau] input[type=number]')).toBe('0.025');
  });

  test('a smaller limit uses fewer points', async () => {
    await afterRun(app.page, () => setParam('maxPoints', '500'));
    const { surfaceConstraints, components, genus } = await measured();
    expect(surfaceConstraints).toBeLessThanOrEqual(500);
    expect({ components, genus }).toEqual({ components: 1, genus: 1 });
  });
});

describe('edits of points', () => {
  beforeAll(() => openAt('#reconstruct?example=two-balls', 'done'));

  test('a point added in the centre of the view is one more constraint until it is undone', async () => {
    const before = await measured();
    await app.page.check('[data-tool=add]');
    await afterRun(app.page, () => app.page.locator('.scene > canvas').press('Enter'));
    expect((await measured()).surfaceConstraints).toBe(Number(before.surfaceConstraints) + 1);
    expect(await app.page.evaluate(() => location.hash)).toMatch(/add=[-\d.e]+,[-\d.e]+,[-\d.e]+/);
    await afterRun(app.page, () => app.page.click('[data-edit=clear]'));
    const { surfaceConstraints, vertices } = await measured();
    expect(surfaceConstraints).toBe(before.surfaceConstraints);
    // Solved from another start, so equal within the tolerance only.
    expect(Math.abs(Number(vertices) / Number(before.vertices) - 1)).toBeLessThan(0.002);
  });

  test('a click removes the points around it, and a click adds an exterior point', async () => {
    const before = await measured();
    const view = app.page.locator('.scene > canvas');
    const { width = 0, height = 0 } = (await view.boundingBox()) ?? {};
    // There is a ball right of the centre.
    const position = { x: 0.68 * width, y: 0.5 * height };
    await app.page.check('[data-tool=remove]');
    await afterRun(app.page, () => view.click({ position }));
    const { surfaceConstraints } = await measured();
    expect(surfaceConstraints).toBeLessThan(Number(before.surfaceConstraints));
    await app.page.check('[data-tool=outside]');
    const { exteriorConstraints } = await measured();
    await afterRun(app.page, () => view.click({ position }));
    expect((await measured()).exteriorConstraints).toBe(Number(exteriorConstraints) + 1);
    expect(await measured()).toMatchObject({ components: 2, closed: true });
    await app.page.check('[data-tool=none]');
  });
});

describe('many edits of points', LONG, () => {
  test('two clicks at once are two points; each can be undone and redone', async () => {
    await openAt('#reconstruct?example=two-balls', 'done');
    await app.page.check('[data-tool=add]');
    const told = () => text('.edit-tools [role=status]');
    await app.page.evaluate(() => {
      const view = document.querySelector('.scene > canvas');
      for (let i = 0; i < 2; i++) view?.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true }));
    });
    await expect.poll(told).toBe('2 points added.');
    await app.page.keyboard.press('Control+z');
    await expect.poll(told).toBe('1 point added.');
    await app.page.keyboard.press('Control+z');
    await expect.poll(told).toBe('No edits.');
    await app.page.keyboard.press('Control+Shift+Z');
    await expect.poll(told).toBe('1 point added.');
    // Each of these started a run; the measures tell that the last one has ended.
    await expect.poll(async () => (await measured()).surfaceConstraints).toBe(1601);
    await reach(app.page, 'done');
  });

  test('an edit only changes the solution: points are not sampled again, and the surface is kept until the next', async () => {
    const times = () => app.page.locator('.phases .time').allTextContents();
    await afterRun(app.page, () => app.page.locator('.scene > canvas').press('Enter'));
    const [subsample, constraints, solve, extract] = await times();
    expect([subsample, constraints]).toEqual(['', '']);
    for (const time of [solve, extract]) expect(time).toMatch(/^[\d.,]+ m?s$/);
    await afterRun(app.page, () => app.page.keyboard.press('Control+z'));
    expect((await times())[0]).toBe('');
    expect(await text('.edit-tools [role=status]')).toBe('1 point added.');
    expect((await measured()).surfaceConstraints).toBe(1601);
  });

  test('many clicks at once are all applied; an invalid one is refused, and the others are kept', async () => {
    const before = await measured();
    const address = () => app.page.evaluate(() => location.hash);
    const view = app.page.locator('.scene > canvas');
    const { x = 0, y = 0, width = 0, height = 0 } = (await view.boundingBox()) ?? {};
    for (const right of [0.66, 0.68, 0.7]) await app.page.mouse.click(x + right * width, y + 0.5 * height);
    await app.page.check('[data-tool=outside]');
    // A point was added in the centre before.
    await view.press('Enter');
    // A run may have ended between two of the clicks.
    await expect.poll(() => text('[data-error]')).toMatch(/exterior.*also a surface point/);
    await expect.poll(() => text('.edit-tools [role=status]')).toBe('4 points added.');
    await expect.poll(measured).toMatchObject({ surfaceConstraints: 1604, closed: true });
    expect(await address()).not.toContain('outside');
    for (let i = 0; i < 3; i++) await app.page.keyboard.press('Control+z');
    await expect.poll(() => text('.edit-tools [role=status]')).toBe('1 point added.');
    expect(await app.page.locator('.banner').isVisible()).toBe(false);
    await expect.poll(async () => (await measured()).surfaceConstraints).toBe(before.surfaceConstraints);
    await reach(app.page, 'done');
  });

  test('where no point is near, none is removed, and the lab says so', async () => {
    await app.page.check('[data-tool=remove]');
    await app.page.locator('.scene > canvas').click({ position: { x: 12, y: 12 } });
    await expect.poll(() => text('.status')).toBe('There are no points within this distance.');
    expect(await text('.edit-tools [role=status]')).toBe('1 point added.');
  });

  test('an invalid distance is refused beside it', async () => {
    const field = app.page.locator('.edit-tools input[type=number]');
    await field.fill('900');
    await field.press('Enter');
    expect(await text('.edit-tools .field-error')).toContain('from −50 to 50');
    expect(await field.inputValue()).toBe('5');
    await field.fill('-3');
    await field.press('Enter');
    expect(await text('.edit-tools .field-error')).toBe('');
  });

  test('not all points can be removed: the previous ones are kept', async () => {
    const before = await measured();
    const view = app.page.locator('.scene > canvas');
    const { width = 0, height = 0 } = (await view.boundingBox()) ?? {};
    await app.page.fill('.edit-tools input[type=number]', '50');
    // One ball after the other; together they would be refused together.
    await afterRun(app.page, () => view.click({ position: { x: 0.3 * width, y: 0.5 * height } }));
    await view.click({ position: { x: 0.7 * width, y: 0.5 * height } });
    await expect.poll(() => text('[data-error]')).toContain('at least 4');
    expect((await measured()).vertices).toBeLessThan(Number(before.vertices));
    expect((await measured()).closed).toBe(true);
  });

  test('Escape closes the message, then the tool', async () => {
    await app.page.keyboard.press('Escape');
    await reach(app.page, 'done');
    expect(await app.page.isChecked('[data-tool=remove]')).toBe(true);
    await app.page.keyboard.press('Escape');
    expect(await app.page.isChecked('[data-tool=none]')).toBe(true);
    expect(await app.page.locator('[data-placing]').count()).toBe(0);
  });
});

describe('files', () => {
  test('dropped points replace the example', async () => {
    await openAt('#reconstruct?example=torus', 'done');
    await afterRun(app.page, () => drop(app.page, [{ name: 'balls.xyz', bytes: asText('two balls') }]));
    expect(await measured()).toMatchObject({ components: 2, genus: 0, closed: true });
    expect(await text('.facts')).toContain('balls.xyz');
  });

  test('a parameter changed while they are loaded is not theirs, and its field shows so', async () => {
    await app.page.evaluate(() => {
      const lab = document.querySelector<HTMLElement>('[data-state]');
      const field = document.querySelector<HTMLInputElement>('[data-param=lambdaSurface] input[type=number]');
      const changeInEachFrame = () => {
        if (!field || lab?.dataset.state !== 'loading') return;
        watch.disconnect();
        field.value = '0.05';
        field.dispatchEvent(new Event('change', { bubbles: true }));
        requestAnimationFrame(changeInEachFrame);
      };
      const watch = new MutationObserver(changeInEachFrame);
      if (lab) watch.observe(lab, { attributeFilter: ['data-state'] });
    });
    await afterRun(app.page, () => drop(app.page, [{ name: 'balls.xyz', bytes: asText('two balls') }]));
    expect(await app.page.isChecked('[data-param=lambdaSurface] .automatic input')).toBe(true);
    expect(await app.page.inputValue('[data-param=lambdaSurface] input[type=number]')).toMatch(/^0\.00\d+$/);
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?file=balls.xyz&v=2');
  });

  test.each([
    ['notes.txt', 'no points at all'],
    ['few.xyz', '0 0 0\n1 0 0\n0 1 0\n'],
    ['broken.ply', 'ply\nformat ascii 1.0\nelement vertex 5\n'],
    ['flat.xyz', Array.from({ length: 60 }, (_, i) => `${Math.cos(i)} ${Math.sin(3 * i)} 0`).join('\n')],
    ['same.xyz', '1 2 3\n'.repeat(40)],
    ['unmeasured.xyz', '0 0 0\n1 0 0\n0 1 0\n0 0 1\nnan 0 1\n'],
  ])('%s is refused with a message, and nothing is lost', async (name, content) => {
    const before = await measured();
    await drop(app.page, [{ name, bytes: new TextEncoder().encode(content) }]);
    await reach(app.page, 'error');
    expect(await text('.banner')).toContain(`${name} could not be opened`);
    expect((await text('[data-error]'))?.length).toBeGreaterThan(20);
    expect(await measured()).toEqual(before);
    await app.page.click('.banner button');
    await reach(app.page, 'done');
    expect(await text('.facts')).toContain('balls.xyz');
  });

  test(
    "a file does not inherit an example's settings: both balls are kept after the cow, of which one cluster is kept",
    LONG,
    async () => {
      await openAt('#reconstruct?p.lambdaSurface=0.002', 'done');
      await afterRun(app.page, () => drop(app.page, [{ name: 'balls.xyz', bytes: asText('two balls') }]));
      expect(await measured()).toMatchObject({ components: 2 });
      expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?file=balls.xyz&v=2');
      await afterRun(app.page, () => setParam('lambdaSurface', '0.003'));
      await afterRun(app.page, () => drop(app.page, [{ name: 'again.xyz', bytes: asText('two balls') }]));
      expect(await app.page.evaluate(() => location.hash)).toBe(
        '#reconstruct?file=again.xyz&v=2&p.lambdaSurface=0.003',
      );
    },
  );

  test('a link to a file waits for it and then applies its settings', LONG, async () => {
    await openAt('#reconstruct?file=balls.xyz&p.delta=9', 'done');
    expect(await text('.banner')).toContain('Open balls.xyz from your disk');
    await afterRun(app.page, () => drop(app.page, [{ name: 'balls.xyz', bytes: asText('two balls') }]));
    // It is from before parameters were chosen from the points, and relies on the values of then.
    expect(await app.page.evaluate(() => location.hash)).toBe(
      '#reconstruct?file=balls.xyz&v=2&p.delta=9&p.lambdaSurface=0.001&p.lambdaExterior=2&p.sides=outside',
    );
    expect(await measured()).toMatchObject({ components: 2, delta: 9, interiorConstraints: 0 });
  });

  test('parameters of a dropped file are chosen, shown, and may be set from there', LONG, async () => {
    await openAt('#reconstruct?file=balls.xyz&v=2', 'done');
    await afterRun(app.page, () => drop(app.page, [{ name: 'balls.xyz', bytes: asText('two balls') }]));
    const automatic = await measured();
    expect(automatic).toMatchObject({ components: 2, outliers: 0 });
    expect(automatic.interiorConstraints).toBeGreaterThan(100);
    for (const name of ['noise', 'delta', 'lambdaSurface', 'lambdaExterior'])
      expect(automatic[name], name).toBeGreaterThan(0);
    const tick = app.page.locator('[data-param=lambdaSurface] .automatic input');
    const field = app.page.locator('[data-param=lambdaSurface] input[type=number]');
    expect(await tick.isChecked()).toBe(true);
    expect(Number(await field.inputValue()) / Number(automatic.lambdaSurface)).toBeCloseTo(1, 2);
    await afterRun(app.page, () => tick.uncheck());
    expect(await measured()).toEqual(automatic);
    expect(await app.page.evaluate(() => location.hash)).toContain('p.lambdaSurface=0.00');
    await afterRun(app.page, () => setParam('lambdaSurface', '0.05'));
    expect(await measured()).toMatchObject({ lambdaSurface: 0.05, delta: automatic.delta });
    await afterRun(app.page, () => tick.check());
    expect(await measured()).toEqual(automatic);
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?file=balls.xyz&v=2');
  });

  test('a far outlier gives a warning, and keeping the largest cluster discards it', LONG, async () => {
    await openAt('#reconstruct?file=torus.xyz&v=2', 'done');
    const far = new Uint8Array([...asText('torus'), ...new TextEncoder().encode('900 0 0\n')]);
    await afterRun(app.page, () => drop(app.page, [{ name: 'torus.xyz', bytes: far }]));
    expect(await text('[data-warning-list]')).toContain('a few points are so far away');
    await afterRun(app.page, () => setParam('keepComponents', '1'));
    expect(await measured()).toMatchObject({ components: 1, genus: 1, outliers: 1 });
    expect(Number((await measured()).fitMax)).toBeLessThan(0.2);
    expect(await app.page.getAttribute('[data-warning-list]', 'data-warning-list')).toBe('[]');
  });

  test('points given twice count once', LONG, async () => {
    await openAt('#reconstruct?file=twice.xyz&v=2', 'done');
    const points = asText('two balls');
    const twice = new Uint8Array([...points, ...points]);
    await afterRun(app.page, () => drop(app.page, [{ name: 'twice.xyz', bytes: twice }]));
    expect(await measured()).toMatchObject({ components: 2, duplicates: 1600, surfaceConstraints: 1600 });
  });

  test('four points give no surface with the settings of the paper, and the lab says what may help', async () => {
    await openAt('#reconstruct?file=four.xyz', 'done');
    const bytes = new TextEncoder().encode('0 0 0\n1 0 0\n0 1 0\n0 0 1\n');
    await drop(app.page, [{ name: 'four.xyz', bytes }]);
    await expect
      .poll(() => text('.banner'))
      .toContain('There is no surface. f does not exceed the iso-value anywhere.');
    expect(await app.page.isDisabled('[data-export=ply]')).toBe(true);
    await app.page.keyboard.press('Escape');
    expect(await app.page.locator('.banner').isVisible()).toBe(false);
  });

  test('photographs with a cameras.json colour the user’s own points', LONG, async () => {
    const folder = at('www/public/data/spot');
    const list = JSON.parse(await readFile(`${folder}/cameras.json`, 'utf8'));
    const two = { ...list, cameras: [list.cameras[3], list.cameras[8]] };
    const files = await Promise.all(
      ['carved.ply', 'view03.png', 'view08.png'].map(async (name) => ({
        name,
        bytes: new Uint8Array(await readFile(`${folder}/${name}`)),
      })),
    );
    files.push({ name: 'cameras.json', bytes: new TextEncoder().encode(JSON.stringify(two)) });
    await afterRun(app.page, () => drop(app.page, files));
    expect(await measured()).toMatchObject({ components: 1, genus: 0, closed: true });
    expect(await app.page.locator('.strip button').count()).toBe(2);
    expect(await app.page.inputValue('[data-view=color]')).toBe('own');
  });

  test('photographs of far more pixels than their files have bytes are not decoded', async () => {
    const cameras = (count: number) =>
      JSON.stringify({ cameras: Array(count).fill({ P: Array(12).fill(1), image: 'a.png' }) });
    const message = async (size: number, count: number) => {
      const files = { 'cameras.json': new TextEncoder().encode(cameras(count)), 'a.png': blackPng(size, size) };
      await drop(
        app.page,
        Object.entries(files).map(([name, bytes]) => ({ name, bytes })),
      );
      await reach(app.page, 'error');
      const shown = await text('.banner');
      await app.page.keyboard.press('Escape');
      return shown;
    };
    expect(await message(5000, 1)).toContain('25 million pixels');
    expect(await message(1000, 17)).toContain('17 million pixels');
    // These are decoded, and what is wrong with their cameras is found.
    expect(await message(1000, 16)).toContain('cameras: the left 3×3 block');
  });
});

describe('passing on to Extract', () => {
  beforeAll(() => openAt('#reconstruct?example=torus', 'done'));

  test('the volume saved as NIfTI is above the level inside', LONG, async () => {
    const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click('[data-action=volume]')]);
    const volume = Volume.parse(await readFile(await download.path()));
    expect(Math.max(...volume.dims)).toBe(96);
    expect(volume.sample([1, 0, 0])).toBeGreaterThan(0);
    expect(volume.sample([0, 0, 0])).toBeLessThan(0);
    volume.free();
  });

  test('the volume is passed on within the page, and the way back leads to the same points', async () => {
    const { volume: inside } = await measured();
    await app.page.click('[data-action=extract]');
    await expect.poll(() => app.page.title()).toBe('Vesicle: Extract');
    await reach(app.page, 'done');
    const found = await measured();
    expect(found).toMatchObject({ components: 1, genus: 1, closed: true });
    expect(Math.abs(Number(found.volume) / Number(inside) - 1)).toBeLessThan(0.03);
    await app.page.click('[data-lab=reconstruct]');
    await expect.poll(() => app.page.title()).toBe('Vesicle: Reconstruct');
    await reach(app.page, 'done');
    expect(await measured()).toMatchObject({ components: 1, genus: 1 });
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?example=torus');
  });
});

describe('the timing curve', LONG, () => {
  test('is measured point by point, can be cancelled, and keeps the surface', async () => {
    await openAt('#reconstruct?example=two-balls', 'done');
    const before = await measured();
    await app.page.click('summary:has-text("Solve time versus number of constraints")');
    await app.page.click('[data-timing=start]');
    const timings = async () => JSON.parse((await app.page.getAttribute('[data-timings]', 'data-timings')) ?? '[]');
    await expect.poll(async () => (await timings()).length).toBeGreaterThanOrEqual(2);
    await app.page.click('[data-timing=cancel]');
    await expect.poll(() => app.page.locator('[data-timing=start]').isVisible()).toBe(true);
    const [first, second] = await timings();
    expect([first.kernel, second.kernel]).toEqual(['multi-order', 'thin-plate']);
    expect(first.milliseconds).toBeGreaterThan(0);
    expect(await measured()).toEqual(before);
    await reach(app.page, 'done');
  });
});

describe('a link', () => {
  test('restores example, parameters, edits and colour', async () => {
    const hash = '#reconstruct?example=two-balls&maxPoints=800&color=distance&p.delta=8&add=1.6,0,0';
    await openAt(hash, 'done');
    expect(await app.page.evaluate(() => location.hash)).toBe(hash);
    expect(await app.page.inputValue('[data-param=delta] input[type=number]')).toBe('8');
    expect(await app.page.inputValue('[data-view=color]')).toBe('distance');
    expect(await text('.color-legend .title')).toBe('Distance to the nearest point');
    expect(await text('.edit-tools')).toContain('1 point added.');
    expect((await measured()).surfaceConstraints).toBeLessThanOrEqual(800);
  });

  test("to a figure shows the paper's result; selecting another of its pictures solves again", LONG, async () => {
    await openAt('#reconstruct?example=figure-7', 'done');
    expect(await text('.figure')).toMatch(
      /Paper: A surface from 477 of 3,173 points.*Here the mean distance of all 6,930 points/,
    );
    await afterRun(app.page, () => app.page.click('.figure button:has-text("a subset")'));
    expect(await text('[data-figure=came]')).toContain('812');
    expect(await measured()).toMatchObject({ surfaceConstraints: 812, components: 1, genus: 0 });
  });

  test("to a figure with another of its pictures states that one's result", LONG, async () => {
    await openAt('#reconstruct?example=figure-8&p.lambdaSurface=0.001', 'done');
    const pressed = () => text('.figure button[aria-pressed=true]');
    expect([await pressed(), (await measured()).genus]).toEqual(['λ = 0.001', 1]);
    expect(await text('[data-figure=came]')).toContain('a spurious handle');
    await afterRun(app.page, () => app.page.click('.figure button:has-text("2,168 points")'));
    expect([await pressed(), (await measured()).genus]).toEqual(['2,168 points', 0]);
    expect(await text('[data-figure=came]')).toContain('genus 0');
    expect(await app.page.evaluate(() => document.activeElement?.textContent)).toBe('2,168 points');
    await afterRun(app.page, () => setParam('tau', '0.02'));
    expect(await app.page.locator('.figure button[aria-pressed=true]').count()).toBe(0);
    expect(await text('[data-figure=came]')).toBe('The settings differ from those of the figure.');
  });

  test('that is invalid shows a message, and the first example opens', LONG, async () => {
    await openAt('#reconstruct?example=nowhere', 'done');
    expect(await text('.banner')).toContain('no example “nowhere”');
    expect(await measured()).toMatchObject({ components: 1, genus: 0 });
  });

  test('with settings that are unknown, or cannot be read, say which, and apply the others', async () => {
    await openAt('#reconstruct?example=two-balls&keepComponents=1.5&colour=red&p.tau=0.03', 'done');
    expect(await text('.banner')).toMatch(/left out.*keepComponents=1\.5, colour=red\. All others apply/);
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?example=two-balls&p.tau=0.03');
  });

  for (const [settings, why, options] of [
    ['p.delta=-1', 'delta', {}],
    ['p.kernel=cubic', 'kernel', LONG],
    ['p.nonsense=3', 'nonsense', LONG],
    ['maxPoints=2', 'maxPoints', LONG],
    ['add=1e30,0,0', 'added', LONG],
    ['outside=0,0,1e30', 'exterior', LONG],
  ] as const) {
    test(`with ${settings} opens its example without the settings, and gives the reason`, options, async () => {
      await openAt(`#reconstruct?example=two-balls&${settings}`, 'done');
      expect(await text('.banner')).toMatch(new RegExp(`settings were ignored.*${why}`));
      expect(await measured()).toMatchObject({ components: 2, closed: true });
      expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?example=two-balls');
    });
  }

  test('warns beside the view if δ is too large for gaps', LONG, async () => {
    await openAt('#reconstruct?example=torus&p.delta=30', 'done');
    expect(await app.page.locator('.stage [data-warning]').textContent()).toContain('≥ 25');
  });

  test('without an example, followed in the open page, keeps the open data and its address', LONG, async () => {
    await app.page.evaluate(() => {
      location.hash = '#reconstruct?example=nowhere';
    });
    await expect.poll(() => text('.banner')).toContain('no example “nowhere”');
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?example=torus&p.delta=30');
  });

  test('that removes missing points, or one twice, removes the existing ones', LONG, async () => {
    await openAt('#reconstruct?example=two-balls&remove=1,1,999999', 'done');
    expect(await text('.edit-tools [role=status]')).toBe('1 point removed.');
    expect((await measured()).surfaceConstraints).toBe(1599);
  });

  test.each(['maxPoints=abc', 'add=1,2', 'remove=1,-4', '%E0%A4%A'])(
    'leaves out %s, and says so',
    LONG,
    async (one) => {
      await openAt(`#reconstruct?example=two-balls&${one}`, 'done');
      expect(await text('.banner')).toContain('Some of the link’s settings were left out.');
      expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?example=two-balls');
    },
  );

  test.each(['photo=99', '&&'])('ignores %s', LONG, async (nonsense) => {
    await openAt(`#reconstruct?example=two-balls&${nonsense}`, 'done');
    expect(await app.page.locator('.banner').isVisible()).toBe(false);
    expect(await app.page.evaluate(() => location.hash)).toBe('#reconstruct?example=two-balls');
  });
});

describe('the page', () => {
  test('photographs are one tab stop; arrow keys move between them', LONG, async () => {
    await openAt('#reconstruct?example=figure-9', 'done');
    const strip = app.page.locator('.strip');
    expect(await strip.locator('button[tabindex="0"]').getAttribute('data-photo')).toBe('3');
    await strip.locator('[data-photo="3"]').focus();
    await app.page.keyboard.press('ArrowRight');
    await app.page.keyboard.press('Enter');
    expect(await app.page.evaluate(() => location.hash)).toContain('photo=5');
    await app.page.keyboard.press('End');
    expect(await app.page.evaluate(() => document.activeElement?.getAttribute('data-photo'))).toBe('23');
    expect(await strip.locator('button[tabindex="0"]').count()).toBe(1);
    await app.page.keyboard.press('Escape');
    expect(await app.page.locator('.photograph').isVisible()).toBe(false);
  });

  test('nothing covers the pictures but the legend', LONG, async () => {
    await openAt('#reconstruct?example=figure-2', 'done');
    const box = async (selector: string) => app.page.locator(selector).boundingBox();
    const [bar, scene, legend] = [await box('.view-options'), await box('.scene'), await box('.color-legend:visible')];
    expect((bar?.y ?? 0) + (bar?.height ?? 0)).toBeLessThanOrEqual((scene?.y ?? 0) + 1);
    expect(legend?.y).toBeGreaterThan(scene?.y ?? 0);
  });

  test.each([
    [320, 640],
    [390, 844],
    [1024, 768],
    [1440, 900],
  ])('fits a page of %i by %i', async (width, height) => {
    expect(await overflow(app.page, width, height)).toBeLessThanOrEqual(0);
  });

  test('every control has a name', async () => {
    expect(await unnamedControls(app.page)).toEqual([]);
  });
});
