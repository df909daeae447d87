/** Parts of the benchmark page that need no browser. */
import { describe, expect, test } from 'vitest';
import { scaleOf } from '../../www/src/bench/scale';
import { sectionsOf } from '../../www/src/bench/sections';
import { atLeast, atMost, type Figure, formatTarget, shortHost, verdict, withUnit } from '../../www/src/bench/targets';

describe('scales', () => {
  test.each([0.3, 1, 9.7, 276, 1038])('from 0 to %d: a few round ticks, and everything fits', (most) => {
    const { at, base, ticks } = scaleOf('linear', [most / 3, most]);
    expect(base).toBe(0);
    expect(at(most)).toBeGreaterThan(0.8);
    expect(at(most)).toBeLessThanOrEqual(1);
    expect(at(most / 2)).toBeCloseTo(at(most) / 2);
    expect(ticks.length).toBeGreaterThanOrEqual(2);
    expect(ticks.length).toBeLessThanOrEqual(7);
    expect(at(ticks.at(-1) ?? 2)).toBeLessThanOrEqual(1);
  });

  test('on a logarithmic scale equal ratios are equal lengths', () => {
    const { at, base, ticks } = scaleOf('log', [0.4, 126]);
    expect(ticks.map((tick) => Math.round(10 * tick) / 10)).toEqual([0.1, 1, 10, 100, 1000]);
    expect(base).toBe(0);
    expect(at(40) - at(4)).toBeCloseTo(at(4) - at(0.4));
  });

  test('ratios extend to both sides of 1', () => {
    const { at, base } = scaleOf('ratio', [0.02, 1.3]);
    expect(base).toBe(at(1));
    expect(at(0.02)).toBeLessThan(base);
    expect(at(1.3)).toBeGreaterThan(base);
    expect(scaleOf('ratio', [0.5]).base).toBe(1);
  });

  test('no values give a valid scale', () => {
    for (const kind of ['linear', 'log', 'ratio'] as const) expect(scaleOf(kind, []).ticks.length).toBeGreaterThan(1);
  });
});

describe('bounds', () => {
  const figure = (values: number[], target?: Figure['target']): Figure => ({
    name: '',
    bars: values.map((value, k) => ({ label: ['native', 'Node 20'][k] ?? '', value })),
    target,
  });

  test('the worst bar decides', () => {
    expect(verdict(figure([1, 2], atMost(2)))).toBe('met');
    expect(verdict(figure([1, 2.1], atMost(2)))).toBe('not met');
    expect(verdict(figure([9, 30], atLeast(10)))).toBe('not met');
  });

  test('a bound can apply to one host only', () => {
    expect(verdict(figure([4, 20], atMost(5, 'native')))).toBe('met');
    expect(verdict({ ...figure([4, 20], atMost(5, 'native')), bars: [{ label: 'Node 20', value: 4 }] })).toBe(
      'not measured',
    );
  });

  test('texts and units', () => {
    expect(withUnit(9.735, 's')).toBe('9.74 s');
    expect(withUnit(0.0353, 's')).toBe('35.3 ms');
    expect(withUnit(275.9, '×')).toBe('276×');
    expect(formatTarget(atMost(5, 'native'), 'µs')).toBe('≤ 5 µs native');
    expect(shortHost('Chromium 156.0.8078.79')).toBe('Chromium 156');
    expect(shortHost('native')).toBe('native');
  });
});

describe('sections', () => {
  test('parts missing in a report are left out', () => {
    expect(sectionsOf({ bestOf: 3 })).toEqual([]);
  });

  test('a missing package is skipped with its reason', () => {
    const row = { task: 'a', name: 'A', unit: 'ms', package: 'vtk', ours: { host: 'Node 20', figure: 3 } };
    const [section] = sectionsOf({ bestOf: 3, peers: { bestOf: 3, rows: [{ ...row, skipped: 'not installed' }] } });
    expect(section?.charts[0]?.figures).toEqual([{ name: 'A', bars: [{ label: 'vtk', skipped: 'not installed' }] }]);
  });

  test('the app has a section if it was measured', () => {
    const start = { interactive: 700, surface: 1500 };
    const turning = { fps: 24, triangles: 100_000 };
    const page = {
      ...{ host: 'Chromium 156.0', cold: start, warm: start, runs: [{ name: 'head', longest: 40 }] },
      motion: { resting: turning, running: turning },
      memory: { heap: 1e7, arrays: 2e7, gpu: 5e6 },
    };
    const [section] = sectionsOf({ bestOf: 3, page });
    const verdicts = section?.charts.map(({ figures }) => figures[0] && verdict(figures[0]));
    expect(verdicts).toEqual(['met', 'met', 'not met', 'not measured']);
  });
});
