// The measures of `npm run real -- --clouds` and `--sequences`, on tiny computed data.
import { beforeAll, expect, test } from 'vitest';
import init, * as library from '../../pkg/index.js';
import { surfaceOf } from '../../scripts/made-shapes.mjs';
import { hasTopology, isSound, reconstructed, sampled } from '../../scripts/real-clouds.mjs';
import { isSound as isSoundSequence, sequenceOf, tracked } from '../../scripts/real-sequences.mjs';

beforeAll(() => init());

const torus = (x, y, z) => Math.hypot(Math.hypot(x, y) - 0.7, z) - 0.3;

test.each([0, 0.02])('a torus of a thousand points with noise %f keeps its topology', (noise) => {
  const reference = surfaceOf(library, torus, 48);
  const cloud = sampled(reference, { count: 1000, noise });
  const row = reconstructed(library, { ...cloud, noise, reference });
  expect(row).toSatisfy(isSound);
  expect(row).toSatisfy(hasTopology);
  // Per mille of the side; the noise is 10.
  expect(row.mean).toBeLessThan(noise > 0 ? 5 : 2);
  expect(Math.abs(row.choice.noise - noise)).toBeLessThan(0.005);
  reference.free();
});

test('sampled points lie on the mesh, have its normals, and noise has the given deviation', () => {
  const reference = surfaceOf(library, torus, 48);
  const [exact, noisy] = [0, 0.02].map((noise) => sampled(reference, { count: 2000, noise, seed: 4 }));
  const off = (points, i) => torus(...points.subarray(3 * i, 3 * i + 3));
  const offs = (points) => Array.from({ length: points.length / 3 }, (_, i) => off(points, i));
  expect(Math.max(...offs(exact.points).map(Math.abs))).toBeLessThan(0.01);
  const deviation = Math.sqrt(offs(noisy.points).reduce((sum, x) => sum + x * x, 0) / 2000);
  expect(deviation).toBeGreaterThan(0.018);
  expect(deviation).toBeLessThan(0.022);
  const outwards = offs(exact.points.map((x, i) => x + 0.1 * exact.normals[i])).map((x) => Math.abs(x - 0.1));
  expect(Math.max(...outwards)).toBeLessThan(0.02);
  reference.free();
});

/** A ball that fills and empties. */
const ball = {
  ...{ dims: [32, 30, 28], spacing: [1, 1, 1], frames: 4, noise: 5, point: [1, 0, 0], seed: 3 },
  frame(number) {
    const radius = [9, 7.5, 6.5, 8][number];
    const object = (x, y, z) => Math.hypot(x, y, z) - radius;
    return { object, shade: (x, y, z) => 40 + 110 * Math.min(Math.max(0.5 - object(x, y, z), 0), 1) };
  },
};

test('a ball that fills and empties is found by one click and measured', async () => {
  const row = await tracked(library, sequenceOf(library, 'ball', ball));
  expect(row).toSatisfy(isSoundSequence);
  expect(row).toMatchObject({ frames: 4, components: 1, genus: 0 });
  expect(row.trueEjection).toBeCloseTo(1 - (6.5 / 9) ** 3, 2);
  expect(Math.abs(row.ejection - row.trueEjection)).toBeLessThan(0.02);
  expect(row.ofLargest).toBeLessThan(0.02);
  expect(row.error).toBeLessThan(0.5);
});
