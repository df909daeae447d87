/** Edits of a surface after a run: the program that repeats them, and distances from a reference. */
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import init, { Mesh, Volume } from 'vesicle';
import { beforeAll, expect, test } from 'vitest';
import { apply, callOf, toCode } from '../../www/src/engine/edits';
import type { Edit } from '../../www/src/engine/protocol';
import { uniform } from '../../www/src/engine/random';
import { distancesBetween, gridAround, summary } from '../../www/src/finish/distances';
import { checkSize } from '../../www/src/finish/size';

beforeAll(async () => {
  await init();
});

/** Returns a noisy ball of several components, as the bytes of a PLY file. */
function noisyBall(): Uint8Array {
  const size = 16;
  const noise = (i: number) => (Math.imul(i ^ 0x5bd1e995, 0x9e3779b1) >>> 24) / 255;
  const data = Float32Array.from({ length: size ** 3 }, (_, i) => {
    const at = [i % size, Math.floor(i / size) % size, Math.floor(i / size ** 2)];
    return 6 - Math.hypot(...at.map((x) => x - 7.3)) + 2 * noise(i);
  });
  return Mesh.marchingCubes(new Volume({ data, dims: [size, size, size] }), 1).toBytes('ply');
}

/** Returns the surfaces that the programs for some edits write, run by Node one after the other in a folder of their own. */
function repeated(logs: Edit[][], bytes: Uint8Array): Buffer[] {
  const folder = mkdtempSync(join(tmpdir(), 'edits-'));
  const write = (name: string, content: string | Uint8Array) => writeFileSync(join(folder, name), content);
  mkdirSync(join(folder, 'node_modules'));
  symlinkSync(fileURLToPath(new URL('../../pkg', import.meta.url)), join(folder, 'node_modules/vesicle'));
  write('surface.ply', bytes);
  for (const [k, log] of logs.entries()) write(`program-${k}.mjs`, toCode(log, 'surface.ply'));
  const all = `import { renameSync } from 'node:fs';
    for (let k = 0; k < ${logs.length}; k++) {
      await import('./program-' + k + '.mjs');
      renameSync('edited.ply', k + '.ply');
    }`;
  write('all.mjs', all);
  execFileSync(process.execPath, ['all.mjs'], { cwd: folder });
  return logs.map((_, k) => readFileSync(join(folder, `${k}.ply`)));
}

/** Returns a random edit that a mesh of this size accepts. */
function randomEdit(random: () => number, mesh: Mesh): Edit {
  const { triangles, bounds, edge } = mesh.info();
  const vector = () => [0, 1, 2].map(() => random() - 0.5) as [number, number, number];
  const inside = bounds.min.map((low, k) => low + (0.2 + 0.6 * random()) * ((bounds.max[k] ?? 0) - low));
  const edits: Edit[] = [
    { op: 'decimate', targetTriangles: Math.ceil((0.3 + 0.5 * random()) * triangles) },
    { op: 'decimateWithin', maxDistance: 0.3 * random() * edge.mean },
    { op: 'remesh', min: edge.mean * (0.6 + 0.3 * random()), max: edge.mean * (1.9 + random()) },
    { op: 'smooth', iterations: Math.floor(8 * random()), keepVolume: random() < 0.5 },
    { op: 'cut', origin: inside as [number, number, number], normal: vector() },
    { op: 'removeCavities' },
    { op: 'keepComponents', indices: [Math.floor(random() * mesh.components().length)] },
  ];
  return edits[Math.floor(random() * edits.length)] as Edit;
}

test('the program makes the same surface, bit for bit, after random edits', () => {
  const bytes = noisyBall();
  const logs: Edit[][] = [];
  const surfaces: Uint8Array[] = [];
  for (let seed = 1; seed <= 20; seed++) {
    const random = uniform(seed);
    const mesh = Mesh.parse(bytes);
    const log: Edit[] = [{ op: 'keepComponents', indices: [0] }];
    apply(mesh, log[0] as Edit);
    for (let k = 0; k < 5; k++) {
      const edit = randomEdit(random, mesh);
      try {
        apply(mesh, edit);
      } catch {
        // Refused, as in the app, which does not list it.
        continue;
      }
      log.push(edit);
    }
    expect(mesh.check(), `seed ${seed}`).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
    logs.push(log);
    surfaces.push(mesh.toBytes('ply'));
    mesh.free();
  }
  expect(logs.flat().length).toBeGreaterThan(90);
  const same = repeated(logs, bytes).map((surface, k) => surface.equals(Buffer.from(surfaces[k] ?? [])));
  expect(same).toEqual(logs.map(() => true));
});

test('an edit reads as a call of the package', () => {
  expect(callOf({ op: 'smooth', iterations: 3, keepVolume: true })).toBe('smooth({ iterations: 3, keepVolume: true })');
  expect(callOf({ op: 'cut', origin: [0, -1.5, 2], normal: [0, 0, 1] })).toBe(
    'cut({ origin: [0, -1.5, 2], normal: [0, 0, 1] })',
  );
  expect(callOf({ op: 'keepComponents', indices: [0, 2] })).toBe('keepComponents([0, 2])');
});

test('distances in each direction agree with those of both together', () => {
  const [small, large] = [
    Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 }),
    Mesh.icosphere({ center: [0.5, 0, 0], radius: 2, maxEdge: 0.7 }),
  ];
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
  const [one, other] = [
    Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.1 }),
    Mesh.icosphere({ center: [1, 0, 0], radius: 1, maxEdge: 0.1 }),
  ];
  const grid = gridAround(one, other);
  const [a, b] = [one, other].map((mesh) => mesh.toVolume(grid)) as [Volume, Volume];
  // Two balls of radius 1 whose centres are 1 apart share 5/16 of their volume.
  expect(a.dice(b)).toBeCloseTo(5 / 16, 2);
  expect(a.dice(a)).toBe(1);
});

test('a program has nothing of an edit but its arguments, however they are written', () => {
  const more = { 'a"b': 0, c: ' : run() }); //' };
  const hostile = { op: 'keepComponents', indices: [0], more } as unknown as Edit;
  expect(callOf(hostile)).toBe('keepComponents([0])');
  const odd = { op: 'keepComponents', indices: [{ '"]); run(); //': 0 }] } as unknown as Edit;
  expect(
    new Function(`return ((mesh) => mesh.${callOf(odd)})`)()({ keepComponents: (given: unknown) => given }),
  ).toEqual(odd.op === 'keepComponents' ? odd.indices : []);
});

test('a remeshed surface has about as many vertices as were estimated', () => {
  for (const max of [0.3, 0.9, 2]) {
    const mesh = Mesh.parse(noisyBall());
    const edit: Edit = { op: 'remesh', min: max / 2.25, max };
    apply(mesh, { op: 'keepComponents', indices: [0] });
    const before = mesh.clone();
    apply(mesh, edit);
    expect(() => checkSize(before, edit, 2 * mesh.vertexCount)).not.toThrow();
    expect(() => checkSize(before, edit, 0.5 * mesh.vertexCount)).toThrow(/^remesh.* would give about [\d,]+ vertices/);
  }
});
