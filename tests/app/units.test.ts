/** The parts of the app that are plain functions. */
import { expect, test } from 'vitest';
import { quantize } from '../../www/src/quantize';
import { otsu, quantiles } from '../../www/src/threshold';
import { anatomyOf, type Grid, invert, sliceFrames, slicePlane, toWorld } from '../../www/src/view/anatomy';
import { componentRoots } from '../../www/src/view/components';
import { paintSlice, projectSegments } from '../../www/src/view/slicing';

/** A grid with the given columns as voxel axes. */
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

test('slices lie as in a reading room, whatever the order of the voxel axes', () => {
  for (const columns of [STRAIGHT, TILTED]) {
    for (const space of ['RAS', 'LPS'] as const) {
      const frames = sliceFrames(grid(columns, space));
      const axial = frames.find((frame) => frame.name === 'Axial');
      const sagittal = frames.find((frame) => frame.name === 'Sagittal');
      expect(axial?.labels).toEqual({ left: 'R', right: 'L', top: 'A', bottom: 'P' });
      expect(sagittal?.labels).toEqual({ left: 'A', right: 'P', top: 'S', bottom: 'I' });
    }
  }
});

test('a picture shows each voxel where its labels say', () => {
  const { dims, ...rest } = grid(STRAIGHT);
  const voxels = Uint8Array.from({ length: 4 * 5 * 6 }, (_, i) => i);
  const volume = { ...rest, dims, voxels } as Parameters<typeof paintSlice>[0];
  const axial = sliceFrames(volume)[2];
  if (!axial) throw new Error('no axial slice');
  const out = new Uint8ClampedArray(4 * 4 * 5);
  paintSlice(volume, axial, 1, out);
  // Top left is right and anterior: the largest x and y of the slice.
  expect(out[0]).toBe(1 * 20 + 4 * 4 + 3);
  expect(out[out.length - 4]).toBe(1 * 20);
});

test('the inverse undoes the affine, also a tilted one', () => {
  const { affine } = grid(TILTED);
  const back = toWorld(invert(affine), toWorld(affine, [1.5, -2, 3]));
  expect(back[0]).toBeCloseTo(1.5, 10);
  expect(back[1]).toBeCloseTo(-2, 10);
  expect(back[2]).toBeCloseTo(3, 10);
});

test('the plane of a slice holds its voxels', () => {
  const { affine } = grid(TILTED);
  const { origin, normal } = slicePlane(affine, invert(affine), 1, 3);
  const point = toWorld(affine, [2, 3, -4]);
  const distance = normal.reduce((sum, n, i) => sum + n * ((point[i] ?? 0) - (origin[i] ?? 0)), 0);
  expect(distance).toBeCloseTo(0, 10);
  expect(Math.hypot(...normal)).toBeCloseTo(1, 10);
});

test('an outline lies over the voxels it goes through', () => {
  const { dims, ...rest } = grid(STRAIGHT);
  const volume = { ...rest, dims } as Parameters<typeof projectSegments>[2];
  const axial = sliceFrames(volume)[2];
  if (!axial) throw new Error('no axial slice');
  const segment = new Float32Array([...toWorld(rest.affine, [3, 4, 0]), ...toWorld(rest.affine, [0, 0, 0])]);
  const [x1, y1, x2, y2] = projectSegments(segment, invert(rest.affine), volume, axial);
  expect([x1, y1]).toEqual([0.5, 0.5]);
  expect([x2, y2]).toEqual([3.5, 4.5]);
});

test('the threshold falls between two peaks, in the middle of the gap', () => {
  const histogram = new Array(100).fill(0);
  histogram[20] = 50;
  histogram[60] = 50;
  expect(otsu(histogram, [0, 100])).toBeCloseTo(40.5, 5);
});

test('quantiles find the ends of what is common', () => {
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
