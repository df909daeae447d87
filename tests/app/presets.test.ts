/** The figures of the paper: results are as the page says. Run with the package in Node, which gives the same bits. */
import { beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh } from '../../pkg/index.js';
import { PRESETS } from '../../www/src/labs/extract/presets';
import { CASES, expectOutcome, figure, outcomeOf, volumeOf } from './figure-runs';
import { LONG } from './long';

beforeAll(() => init());

/** Pictures that take at most two seconds each. */
const isQuick = (id: string) => ['7', '8', '20'].includes(id);

// Figure 14 runs for long: see `presets.long.test.ts`.
describe.each(CASES.filter(([id]) => id !== '14'))('figure %s', (id, preset, variant) => {
  test('gives the result that the page states', isQuick(id) ? {} : LONG, async () => {
    expectOutcome(await outcomeOf(preset, variant), variant.expected);
  });
});

test("every figure has an id of its own, and states the paper's result and its own", () => {
  expect(new Set(PRESETS.map(({ id }) => id)).size).toBe(PRESETS.length);
  for (const [, { paperResult }, { ourResult }] of CASES) {
    for (const text of [paperResult, ourResult]) expect(text).toMatch(/^[A-Z].{40,}\.$/);
    expect(ourResult).toMatch(/^Here/);
  }
});

test('table 1: both runs give the same result, within the bounds of the paper', LONG, async () => {
  const [preset, variant] = figure('figure-15-16');
  const coarseToFine = await outcomeOf(preset, variant);
  const direct = await outcomeOf(preset, variant, 0);
  expect([direct.components, direct.genus]).toEqual([coarseToFine.components, coarseToFine.genus]);
  expect(Math.abs(coarseToFine.area / direct.area - 1)).toBeLessThan(0.003);
  expect(Math.abs(coarseToFine.volume / direct.volume - 1)).toBeLessThan(0.002);
  expect(direct.work).toBeGreaterThan(3 * coarseToFine.work);
});

test('figure 23: marching cubes have as many components and holes as stated', async () => {
  const [preset] = figure('figure-23');
  const volume = await volumeOf(preset);
  const mesh = Mesh.marchingCubes(volume, preset.params.iso);
  expect(mesh.info()).toMatchObject({ components: 372, genus: 383 });
  mesh.free();
  volume.free();
});
