/** Parts of the app that are plain functions. */
import { describe, expect, test } from 'vitest';
import type { StepReport } from '../../www/src/engine/protocol';
import { quantize } from '../../www/src/engine/quantize';
import { otsu, quantiles } from '../../www/src/engine/threshold';
import { lengths } from '../../www/src/kit/format';
import { History } from '../../www/src/kit/history';
import { initialOptions } from '../../www/src/kit/view';
import { toCsv } from '../../www/src/lab/run-table';
import { UndoStack } from '../../www/src/lab/undo';
import { EXAMPLES } from '../../www/src/labs/extract/examples';
import { fromHash, linkOf, toHash } from '../../www/src/labs/extract/link';
import { EXTRACT_VIEW } from '../../www/src/labs/extract/view';
import { anatomyOf, type Grid, invert, sliceOrientations, slicePlane, toWorld } from '../../www/src/scene/anatomy';
import { componentRoots } from '../../www/src/scene/components';
import { diverging, quantityTitle, robustRange, shadeColors } from '../../www/src/scene/shading';
import { ballSection, levelIndex, paintSlice, projectSegments } from '../../www/src/scene/slicing';

/** Returns a grid with the given columns as voxel axes. */
function grid(columns: [number, number, number][], space: 'RAS' | 'LPS' = 'RAS'): Grid {
  const affine = new Float64Array(16);
  for (const [i, column] of columns.entries()) affine.set(column, 4 * i);
  affine.set([5, -7, 11, 1], 12);
  return { dims: [4, 5, 6], spacing: columns.map((c) => Math.hypot(...c)) as [number, number, number], affine, space };
}
const STRAIGHT: [number, number, number][] = [
  [1, 0, 0],
  [0, 2, 0],
  [0, 0, 3],
];
const TILTED: [number, number, number][] = [
  [0.2, 1.9, 0.3],
  [-1.4, 0.1, 0.2],
  [0.1, -0.3, 2.5],
];

test('in RAS the first voxel axis runs to the right, in LPS to the left', () => {
  expect(anatomyOf(grid(STRAIGHT))[0]).toEqual({ anatomical: 0, positive: true });
  expect(anatomyOf(grid(STRAIGHT, 'LPS'))[0]).toEqual({ anatomical: 0, positive: false });
});

test('slices are oriented by radiological convention, whatever the order of the voxel axes', () => {
  for (const columns of [STRAIGHT, TILTED]) {
    for (const space of ['RAS', 'LPS'] as const) {
      const frames = sliceOrientations(grid(columns, space));
      const axial = frames.find((frame) => frame.name === 'Axial');
      const sagittal = frames.find((frame) => frame.name === 'Sagittal');
      expect(axial?.labels).toEqual({ left: 'R', right: 'L', top: 'A', bottom: 'P' });
      expect(sagittal?.labels).toEqual({ left: 'A', right: 'P', top: 'S', bottom: 'I' });
    }
  }
});

test('a picture shows each voxel on the side that its labels say', () => {
  const voxels = Uint8Array.from({ length: 4 * 5 * 6 }, (_, i) => i);
  const volume = { ...grid(STRAIGHT), voxels, window: [0, 255] as [number, number] };
  const axial = sliceOrientations(volume)[2];
  if (!axial) throw new Error('no axial slice');
  const out = new Uint8ClampedArray(4 * 4 * 5);
  paintSlice(volume, axial, 1, out);
  // The top left is right and anterior: the largest x and y of the slice.
  expect(out[0]).toBe(1 * 20 + 4 * 4 + 3);
  expect(out[out.length - 4]).toBe(1 * 20);
});

test('the inverse reverts the affine, also an oblique one', () => {
  const { affine } = grid(TILTED);
  const back = toWorld(invert(affine), toWorld(affine, [1.5, -2, 3]));
  expect(back[0]).toBeCloseTo(1.5, 10);
  expect(back[1]).toBeCloseTo(-2, 10);
  expect(back[2]).toBeCloseTo(3, 10);
});

test('the plane of a slice contains its voxels', () => {
  const { affine } = grid(TILTED);
  const { origin, normal } = slicePlane(affine, invert(affine), 1, 3);
  const point = toWorld(affine, [2, 3, -4]);
  const distance = normal.reduce((sum, n, i) => sum + n * ((point[i] ?? 0) - (origin[i] ?? 0)), 0);
  expect(distance).toBeCloseTo(0, 10);
  expect(Math.hypot(...normal)).toBeCloseTo(1, 10);
});

test('an outline lies over the voxels it passes through', () => {
  const volume = grid(STRAIGHT);
  const axial = sliceOrientations(volume)[2];
  if (!axial) throw new Error('no axial slice');
  const segment = new Float32Array([...toWorld(volume.affine, [3, 4, 0]), ...toWorld(volume.affine, [0, 0, 0])]);
  const [x1, y1, x2, y2] = projectSegments(segment, invert(volume.affine), volume, axial);
  expect([x1, y1]).toEqual([0.5, 0.5]);
  expect([x2, y2]).toEqual([3.5, 4.5]);
});

test('the threshold is in the middle of the gap between two peaks', () => {
  const histogram = new Array(100).fill(0);
  histogram[20] = 50;
  histogram[60] = 50;
  expect(otsu(histogram, [0, 100])).toBeCloseTo(40.5, 5);
});

test('quantiles find the range of common values', () => {
  const histogram = [0, 10, 80, 10, 0];
  expect(quantiles(histogram, [0, 5], [0.05, 0.5, 0.95])).toEqual([1.5, 2.5, 3.5]);
});

test('voxels for display are clamped to the window, and NaN is black', () => {
  const out = new Uint8Array(5);
  quantize(new Float32Array([-5, 0, 5, 20, Number.NaN]), [0, 10], out, 0);
  expect([...out]).toEqual([0, 0, 127, 255, 0]);
});

test('two separate triangles are two components', () => {
  expect([...componentRoots(Uint32Array.from([4, 5, 3, 2, 1, 0]), 6, 6)]).toEqual([0, 0, 0, 3, 3, 3]);
});

describe('undo', () => {
  const stack = (limits = { entries: 10, bytes: 1000 }) => new UndoStack<string>(limits);
  const at = (state: string, bytes = 1) => ({ state, bytes });

  test('moves back and forth through the history', () => {
    const done = stack();
    done.push({ label: 'one', ...at('before one') });
    done.push({ label: 'two', ...at('before two') });
    expect(done.undoable).toBe('two');
    expect(done.undo(at('after two'))).toBe('before two');
    expect([done.undoable, done.redoable]).toEqual(['one', 'two']);
    expect(done.redo(at('before two'))).toBe('after two');
    expect(done.redoable).toBeUndefined();
    expect(done.undo(at('after two'))).toBe('before two');
    expect(done.undo(at('before two'))).toBe('before one');
    expect(done.undo(at('before one'))).toBeUndefined();
  });

  test('a new action discards what could be redone', () => {
    const done = stack();
    done.push({ label: 'one', ...at('before one') });
    done.undo(at('after one'));
    done.push({ label: 'other', ...at('before one') });
    expect(done.redoable).toBeUndefined();
  });

  test('keeps as many states as fit, but always the last', () => {
    const done = stack({ entries: 10, bytes: 100 });
    for (let i = 0; i < 5; i++) done.push({ label: String(i), ...at(`before ${i}`, 40) });
    expect(done.undo(at('after 4', 0))).toBe('before 4');
    expect(done.undo(at('before 4', 0))).toBe('before 3');
    expect(done.undoable).toBeUndefined();
    done.push({ label: 'large', ...at('before large', 1e6) });
    expect(done.undoable).toBe('large');
  });
});

/** Returns a report with the fields of the model's. */
function report(iteration: number, more: Partial<StepReport> = {}): StepReport {
  const events = { creations: 0, deletions: 0, inversions: 0, axial: 0, annular: 0, vanished: 0, seeds: 0 };
  const counts = { vertices: 10, triangles: 16, components: 1, euler: 2 };
  const end = { progress: 0, residual: 0.5, tolerance: 1e-6, done: false, warnings: [] };
  return { iteration, phase: 'level 1', events, times: { forces: 2, topology: 1 }, ...counts, ...end, ...more };
}

describe('the history', () => {
  test('returns to an iteration, and forth to those that followed it', () => {
    const history = new History();
    history.add([report(1), report(2)]);
    const early = history.marker();
    history.add([report(3, { phase: 'level 0' })]);
    const late = history.marker();
    history.rewind(early(2));
    expect(history.reports.map(({ iteration }) => iteration)).toEqual([1, 2]);
    expect(history.phases).toEqual([{ iteration: 1, phase: 'level 1' }]);
    history.add([report(3, { vertices: 99 })]);
    history.rewind(late(3));
    expect(history.reports.at(-1)).toMatchObject({ iteration: 3, vertices: 10, phase: 'level 0' });
  });

  test('sums times by level and part; the last report counts to the last level', () => {
    const history = new History();
    history.add([report(1), report(2), report(3, { phase: 'level 0' }), report(4, { phase: 'done', done: true })]);
    expect([...history.times.keys()]).toEqual(['level 1', 'level 0']);
    expect(history.times.get('level 0')?.get('forces')).toBe(4);
  });

  test('as CSV has a line per iteration and a column for each plotted value', () => {
    const history = new History();
    history.add([report(1), report(2, { residual: 0.25 })]);
    const [head, first, second, end] = toCsv(history).split('\n');
    expect(head).toMatch(
      /^iteration,phase,energy,tolerance,vertices,.*axial,annular,vanished,seeds,forces \(ms\),topology \(ms\)$/,
    );
    expect(first).toBe('1,level 1,0.5,0.000001,10,16,1,2,0,0,0,0,0,0,0,2,1');
    expect(second).toContain('2,level 1,0.25,');
    expect(end).toBe('');
  });
});

describe('a link', () => {
  const tooth = EXAMPLES.find(({ id }) => id === 'tooth');
  const settings = {
    example: tooth,
    file: 'tooth.nrrd',
    frame: 0,
    choice: { kind: 'bubbles', bubbles: 7, levels: 2, edge: 1.5 } as const,
    sphere: { center: [0, 0, 0] as [number, number, number], radius: 1 },
    params: { ...tooth?.params, iso: 700, damping: 0.4, restLength: 'mean' },
    defaults: { damping: 0.4, restLength: 'zero' },
    attractors: [{ point: [1, -2.5, 3] as [number, number, number], strength: 0.1, radius: 8 }],
    view: { ...initialOptions(EXTRACT_VIEW), color: 'speed' as const },
  };

  test('contains the differences from the example, and is read back unchanged', () => {
    const linked = linkOf(settings);
    expect(linked).toEqual({
      example: 'tooth',
      start: 'bubbles',
      bubbles: 7,
      edge: 1.5,
      params: { iso: 700, restLength: 'mean' },
      attractors: settings.attractors,
      view: { color: 'speed' },
    });
    expect(fromHash(toHash(linked))).toEqual(linked);
  });

  test('contains the frame of a 4D volume, unless it is the first', () => {
    expect(linkOf({ ...settings, frame: 3 })).toMatchObject({ frame: 3 });
    expect(fromHash(toHash(linkOf({ ...settings, frame: 3 })))).toMatchObject({ frame: 3 });
  });

  test('is the bare address if nothing differs', () => {
    const [first] = EXAMPLES;
    if (!first) throw new Error('no example');
    const choice = { kind: 'contour', bubbles: 5, levels: first.levels, edge: first.edge } as const;
    const plain = { ...settings, example: first, choice, attractors: [], view: initialOptions(EXTRACT_VIEW) };
    expect(toHash(linkOf({ ...plain, params: { ...first.params, damping: 0.4 } }))).toBe('#extract');
  });

  test('of another lab, or with invalid parts, does no harm, and says which parts', () => {
    expect(fromHash('#track?example=tooth')).toBeUndefined();
    expect(fromHash('#extract')).toBeUndefined();
    expect(fromHash('#extract?levels=many&attractor=1,2&p.iso=&start=&v=2')).toEqual({
      params: { iso: '' },
      attractors: [],
      view: {},
      unread: ['start=', 'levels=many', 'attractor=1,2'],
    });
  });
});

describe('lengths', () => {
  test('that are small are given in a smaller unit, not with a power of ten', () => {
    expect(lengths([0.0003, 0.0003, 0.002], 'mm')).toBe('0.3 × 0.3 × 2 µm');
    expect(lengths([4e-7], 'mm')).toBe('0.4 nm');
    expect(lengths([3e-4], 'mm', 3)).toBe('300,000 µm³');
    expect(lengths([5e-4], 'm', 2)).toBe('500 mm²');
  });

  test('that are not small, zero, or of no unit of length stay', () => {
    expect(lengths([0.5, 0.25], 'mm')).toBe('0.5 × 0.25 mm');
    expect(lengths([0], 'mm')).toBe('0 mm');
    expect(lengths([0.0003], '')).toBe('3.00e-4');
    expect(lengths([2e-5], 'nm')).toBe('2.00e-5 nm');
  });
});

describe('numbers as colours', () => {
  test('are blue below zero, red above, pale at zero, and the same sRGB at both ends of the range', () => {
    const [low, middle, high] = [diverging(-1), diverging(0), diverging(1)];
    expect(low[2]).toBeGreaterThan(low[0] + 100);
    expect(high[0]).toBeGreaterThan(high[2] + 100);
    expect(Math.min(...middle)).toBeGreaterThan(240);
    expect(diverging(5)).toEqual(high);
  });

  test('have a range that a few outliers do not widen', () => {
    const values = Float32Array.from({ length: 1000 }, (_, i) => (i % 2 ? 0.011 : -0.015));
    values.set([50, -80], 10);
    expect(robustRange(values, 1e-4)).toBe(0.02);
    expect(robustRange(new Float32Array(10), 1e-4)).toBe(1e-4);
  });

  test('have a title with the reciprocal unit', () => {
    expect(quantityTitle('mean curvature', 'mm')).toBe('Mean curvature, 1/mm');
    expect(quantityTitle('gaussian curvature', '')).toBe('Gaussian curvature, 1/unit²');
  });

  test('reach the GPU as linear light, and NaN as zero', () => {
    const out = new Float32Array(9);
    shadeColors(Float32Array.of(-2, 0, Number.NaN), 1, out);
    expect(out[2]).toBeCloseTo((172 / 255) ** 2.2, 2);
    expect(out[3]).toBeCloseTo((247 / 255) ** 2.2, 2);
    expect([...out.slice(6)]).toEqual([...out.slice(3, 6)]);
  });
});

test("a slice of a coarser level is at the position of the volume's slice", () => {
  const fine = { dims: [9, 9, 9] as [number, number, number], voxels: new Uint8Array() };
  const coarse = { dims: [3, 3, 3] as [number, number, number], voxels: new Uint8Array() };
  const [frame] = sliceOrientations({ ...grid(STRAIGHT), dims: [9, 9, 9] });
  if (!frame) throw new Error('no slice');
  expect([0, 2, 3, 8].map((index) => levelIndex(fine, coarse, frame, index))).toEqual([0, 0, 1, 2]);
});

test('the radius of an attractor is a disc in the slices it intersects', () => {
  const { dims, ...rest } = grid(STRAIGHT);
  const volume = { ...rest, dims };
  const axial = sliceOrientations(volume)[2];
  if (!axial) throw new Error('no axial slice');
  const attractor = { point: toWorld(rest.affine, [1, 2, 3]), strength: 1, radius: 5 };
  const disc = (slice: number) => ballSection(attractor, slice, invert(rest.affine), volume, axial);
  // Slices are 3 apart, rows 2: in the next slice the disc has a radius of 4.
  expect(disc(3)).toMatchObject({ radiusX: 5, radiusY: 2.5, near: true });
  expect(disc(4)?.radiusX).toBeCloseTo(4, 5);
  expect(disc(4)?.near).toBe(false);
  expect(disc(5)).toBeUndefined();
});
