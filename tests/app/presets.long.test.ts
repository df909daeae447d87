/** The figures of the paper that run for long: results are as the page says. */
import { beforeAll, expect, test } from 'vitest';
import init from '../../pkg/index.js';
import { expectOutcome, figure, outcomeOf } from './figure-runs';

beforeAll(() => init());

test('figure 14 gives the result that the page states', async () => {
  const [preset, variant] = figure('figure-14');
  expectOutcome(await outcomeOf(preset, variant), variant.expected);
});

test('table 2: a direct run finds the separate vessels that coarse to fine loses', async () => {
  const [preset, variant] = figure('figure-20');
  const coarseToFine = await outcomeOf(preset, variant);
  const direct = await outcomeOf(preset, variant, 0);
  expect([coarseToFine.components, direct.components]).toEqual([1, 4]);
  expect(direct.volume / coarseToFine.volume).toBeGreaterThan(1.015);
  expect(direct.volume / coarseToFine.volume).toBeLessThan(1.025);
});
