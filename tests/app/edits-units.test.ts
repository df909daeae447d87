/** Edits of a surface after a run: the program that repeats them, and distances from a reference. */
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import init, { Mesh, Volume } from 'vesicle';
import { beforeAll, expect, test } from 'vitest';
import { apply, callOf, toCode } from '../../www/src/finish/code';
import { distancesBetween, gridAround, summary } from '../../www/src/finish/distances';
import type { Edit } from '../../www/src/finish/protocol';

beforeAll(async () => {
  await init();
});

/** Returns a noisy ball of several components, as the bytes of a PLY file. */
function noisyBall(): Uint8Array {
  const size = 24;
  const noise = (i: number) => (Math.imul(i ^ 0x5bd1e995, 0x9e3779b1) >>> 24) / 255;
  const data = Float32Array.from({ length: size ** 3 }, (_, i) => {
    const at = [i % size, Math.floor(i / size) % size, Math.floor(i / size ** 2)];
    return 9 - Math.hypot(...at.map((x) => x - 11.3)) + 3 * noise(i);
  });
  return Mesh.marchingCubes(new Volume({ data, dims: [size, size, size] }), 1).toBytes('ply');
}

test('the program makes the same surface, bit for bit', () => {
  const log: Edit[] = [
    { op: 'removeCavities' },
    { op: 'keepComponents', indices: [0] },
    { op: 'smooth', iterations: 3, keepVolume: false },
    { op: 'cut', origin: [11.3, 11.3, 11.37], normal: [0.1, -2, 3] },
    { op: 'remesh', min: 0.7, max: 1.6 },
    { op: 'decimate', targetTriangles: 500 },
    { op: 'cut', origin: [8.123456, 0, 0], normal: [-1, 0, 0] },
  ];
  const bytes = noisyBall();
  const mesh = Mesh.parse(bytes);
  for (const edit of log) apply(mesh, edit);
  const folder = mkdtempSync(join(tmpdir(), 'edits-'));
  mkdirSync(join(folder, 'node_modules'));
  symlinkSync(fileURLToPath(new URL('../../pkg', import.meta.url)), join(folder, 'node_modules/vesicle'));
  writeFileSync(join(folder, 'surface.ply'), bytes);
  writeFileSync(join(folder, 'edits.mjs'), toCode(log, 'surface.ply'));
  execFileSync(process.execPath, ['edits.mjs'], { cwd: folder });
  expect(Buffer.from(mesh.toBytes('ply')).equals(readFileSync(join(folder, 'edited.ply')))).toBe(true);
  expect(mesh.check()).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
  expect(mesh.triangleCount).toBeGreaterThan(100);
});

test('an edit reads as a call of the package', () => {
  expect(callOf({ op: 'smooth', iterations: 3, keepVolume: true })).toBe('smooth({ iterations: 3, keepVolume: true })');
  expect(callOf({ op: 'cut', origin: [0, -1.5, 2], normal: [0, 0, 1] })).toBe(
    'cut({ origin: [0, -1.5, 2], normal: [0, 0, 1] })',
  );
  expect(callOf({ op: 'keepComponents', indices: [0, 2] })).toBe('keepComponents([0, 2])');
});

test('distances in each direction agree with those of both together', () => {
  const [small, large] = [Mesh.icosphere([0, 0, 0], 1, 0.2), Mesh.icosphere([0.5, 0, 0], 2, 0.7)];
  const { toReference: there, fromReference: back, both } = distancesBetween(small, large);
  expect((there.mean + back.mean) / 2).toBeCloseTo(both.mean, 5);
  expect(Math.sqrt((there.rms ** 2 + back.rms ** 2) / 2)).toBeCloseTo(both.rms, 5);
  expect(Math.max(there.p95, back.p95)).toBeCloseTo(both.p95, 5);
  expect(Math.max(there.max, back.max)).toBeCloseTo(both.max, 5);
  expect(back.max).toBeCloseTo(1.5, 1);
  expect(there.max).not.toBeCloseTo(back.max, 2);
});

test('summaries are weighted', () => {
  const { mean, rms, p95, max } = summary(Float32Array.of(4, 1, 2), Float64Array.of(0, 3, 1));
  expect([mean, rms, p95, max]).toEqual([1.25, Math.sqrt(7 / 4), 2, 4]);
});

test('the grid for the Dice coefficient holds both meshes', () => {
  const [one, other] = [Mesh.icosphere([0, 0, 0], 1, 0.1), Mesh.icosphere([1, 0, 0], 1, 0.1)];
  const grid = gridAround(one, other);
  const [a, b] = [one, other].map((mesh) => mesh.toVolume(grid)) as [Volume, Volume];
  // Two balls of radius 1 whose centres are 1 apart share 5/16 of their volume.
  expect(a.dice(b)).toBeCloseTo(5 / 16, 2);
  expect(a.dice(a)).toBe(1);
});
