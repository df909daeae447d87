/** Scale bars of pictures, and plots as SVG, without a browser. */
import { describe, expect, test } from 'vitest';
import { type PlotDrawing, plotSvg } from '../../www/src/kit/plot-svg';
import { barLength } from '../../www/src/scene/scale-bar';

describe('a scale bar', () => {
  test.each([
    [1, 1],
    [1.99, 1],
    [2, 2],
    [47, 20],
    [50, 50],
    [0.07, 0.05],
    [12_345, 10_000],
    [3e-7, 2e-7],
  ])('of at most %d is %d long', (most, length) => {
    expect(barLength(most)).toBe(length);
  });
});

const PLOT: PlotDrawing = {
  title: 'a < b & "c"',
  across: 'x',
  x: { min: 0, max: 4, ticks: [{ at: 2, label: 'two' }] },
  y: { min: 1e-4, max: 1, log: true, ticks: [{ at: 0.01, label: '1e-2' }] },
  curves: [
    { label: 'broken', color: 'red', values: [1, 1e-2, null, 1e-4, 1] },
    { label: 'absent', color: 'blue', values: [null, null, null, null, null] },
  ],
  positions: [0, 1, 2, 3, 4],
  marks: [{ at: 2, color: 'grey', name: 'level 0' }],
  keys: Array.from({ length: 9 }, (_, i) => ({ label: `a rather long entry ${i}`, color: 'green' })),
  colors: { background: 'white', text: 'black', lines: 'silver' },
};

describe('a plot as SVG', () => {
  const svg = plotSvg(PLOT);
  const path = /<path d="([^"]*)"/.exec(svg)?.[1] ?? '';
  const points = [...path.matchAll(/([ML])([\d.]+) ([\d.]+)/g)].map(([, command, x, y]) => ({
    command,
    x: Number(x),
    y: Number(y),
  }));

  test('escapes texts', () => {
    expect(svg).toContain('<title>a &lt; b &amp; &quot;c&quot;</title>');
  });

  test('interrupts a curve where values are missing, and omits one without any', () => {
    expect(points.map(({ command }) => command).join('')).toBe('MLML');
    expect(svg.match(/<path/g)).toHaveLength(1);
    expect(svg).not.toContain('absent');
  });

  test('draws values where the axes say, also on a logarithmic axis', () => {
    const [top, middle, low, end] = points.map(({ y }) => y);
    expect(end).toBe(top);
    expect(middle).toBeCloseTo(((top ?? 0) + (low ?? 0)) / 2, 0);
    const tick = /<text x="([\d.]+)"[^>]*>two</.exec(svg)?.[1];
    expect(Number(tick)).toBeCloseTo(((points[0]?.x ?? 0) + (points[3]?.x ?? 0)) / 2, 0);
  });

  test('has a legend of as many rows as it needs', () => {
    const [, width, height] = /viewBox="0 0 (\d+) (\d+)"/.exec(svg)?.map(Number) ?? [];
    for (const [, x, y] of svg.matchAll(/<text x="([\d.]+)" y="([\d.]+)"/g)) {
      expect(Number(x)).toBeLessThan(width ?? 0);
      expect(Number(y)).toBeLessThan(height ?? 0);
    }
  });
});
