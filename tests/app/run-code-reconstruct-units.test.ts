/** Runs of the Reconstruct lab's worker are repeated, to the same bits, by the code that the worker writes of them. */
import { expect, test } from 'vitest';
import init, { Mesh } from '../../pkg/index.js';
import { apply } from '../../www/src/engine/edits';
import { literal } from '../../www/src/engine/literal';
import type { Edit } from '../../www/src/engine/protocol';
import { uniform } from '../../www/src/engine/random';
import type {
  CameraView,
  CloudSource,
  Edits,
  ParamValues,
  Requests,
  Setup,
} from '../../www/src/labs/reconstruct/protocol';
import { asText, ballPoints, FAR } from './far';
import { pickFrom, programsIn } from './run-code';
import { startWorker } from './worker-in-node';

const worker = await startWorker<Requests>(() => import('../../www/src/labs/reconstruct/worker'));
await worker.request('hello', undefined);

await init();
const programs = await programsIn('reconstruct');

const NONE: Edits = { added: [], removed: [], outside: [] };
const SETUP: Setup = { params: { cell: 0.12 }, maxPoints: 300, keepComponents: undefined, edits: NONE };

const FAR_SETUP: Setup = { ...SETUP, params: { cell: 0.5 }, maxPoints: undefined };

/** Acts at random on opened points, and returns the surface. */
async function interactiveRun(seed: number, source: CloudSource, cameras: CameraView[]): Promise<Uint8Array> {
  const random = uniform(seed);
  const pick = pickFrom(random);
  const point = () => [0, 1, 2].map(() => 3 * random() - 1.5) as [number, number, number];
  const edits = (): Edits => ({
    added: random() < 0.5 ? [] : [point()],
    removed: Array.from({ length: Math.floor(4 * random()) }, () => Math.floor(1000 * random())),
    outside: random() < 0.5 ? [] : [point().map((x) => 3 * x) as [number, number, number]],
  });
  const params = (): ParamValues =>
    pick([
      { lambdaSurface: 0.01 * random() },
      { kernel: pick(['multi-order', 'thin-plate', 'biharmonic']) },
      { cell: 0.1 + 0.1 * random() },
      { level: pick(['zero', 'mean']), delta: 5 + 5 * random() },
    ]);
  await worker.request('load', { source, cameras, setup: SETUP });
  const can: (() => Promise<unknown>)[] = [
    () => worker.request('setParams', params()),
    () => worker.request('setEdits', edits()),
    () => worker.request('rebuild', { ...SETUP, params: { cell: 0.15, ...params() }, edits: edits() }),
    () => worker.request('setParams', { delta: -1, cell: 1 }),
    // While the model runs, at a step that only the worker knows.
    async () => {
      await worker.request('play', undefined);
      await worker.request('setParams', params());
      await worker.request('pause', undefined);
    },
    async () => {
      const saved = await worker.request('save', undefined);
      await worker.request('setParams', params());
      await worker.request('load', { source, cameras, setup: saved.setup, saved });
    },
  ];
  for (let i = 0; i < 10; i++) {
    await pick(can)().catch(() => undefined);
    await worker.request('step', { count: Math.floor(8 * random()) });
  }
  await worker.request('step', { count: 10_000 });
  return worker.request('export', { format: 'ply' });
}

const code = (edits: Edit[] = []) => worker.request('code', { stem: 'points', edits });

const SEEDS = [1, 2, 3, 4, 5, 6, 7, 8];

test('the code of random runs gives the same surfaces, of computed points and of a file', async () => {
  const source: CloudSource = { shape: 'two balls' };
  const made: Uint8Array[] = [];
  for (const seed of SEEDS) {
    made.push(await interactiveRun(seed, source, []));
    await programs.add(seed, await code());
  }
  const { extension, bytes } = await worker.request('data', undefined);
  await programs.expectSame(made, [{ name: `points.${extension}`, bytes }]);
  expect(new Set(made.map(({ length }) => length)).size).toBeGreaterThan(4);

  const name = 'balls "*/.xyz';
  const surface = await interactiveRun(1, { file: { name, bytes: bytes.slice() } }, []);
  await programs.add(1, await code());
  await programs.expectSame([surface], [{ name: 'balls.xyz', bytes }]);
  await expect(worker.request('data', undefined)).rejects.toThrow('no file but those');
});

test('the code of a survey far from the origin, with points added by hand, gives the same surface in place', async () => {
  const bytes = asText(ballPoints(FAR, 5, 1));
  await worker.request('load', { source: { file: { name: 'survey.xyz', bytes } }, cameras: [], setup: FAR_SETUP });
  const over = FAR.map((value, axis) => value + (axis === 2 ? 5.25 : 0.001)) as typeof FAR;
  await worker.request('setEdits', { added: [over], removed: [3, 4], outside: [] });
  await worker.request('step', { count: 10_000 });
  const surface = await worker.request('export', { format: 'ply' });
  expect((await code()).code).toContain(`added: new Float64Array([${over.join(', ')}])`);
  await programs.add(1, await code());
  await programs.expectSame([surface], [{ name: 'survey.xyz', bytes: asText(ballPoints(FAR, 5, 1)) }]);
  const { centroid } = Mesh.parse(surface).info();
  expect(Math.hypot(...centroid.map((value, axis) => value - (FAR[axis] ?? 0)))).toBeLessThan(0.1);
});

test('the code says what was chosen from the points', async () => {
  await worker.request('load', { source: { shape: 'two balls' }, cameras: [], setup: SETUP });
  await worker.request('step', { count: 10_000 });
  expect((await code()).code).toMatch(/^\/\/ Chosen .*noise [\d.e-]+, delta [\d.]+, lambdaSurface [\d.e-]+/m);
  const paper = { delta: 5, lambdaSurface: 0.001, lambdaExterior: 2, sides: 'outside' };
  await worker.request('rebuild', { ...SETUP, params: paper });
  await worker.request('step', { count: 10_000 });
  const plain = (await code()).code;
  expect(plain).not.toContain('Chosen');
  for (const [name, value] of Object.entries(paper)) expect(plain).toContain(`${name}: ${literal(value)}`);
});

test('the code has cameras, and says that it lacks their pictures', async () => {
  const projection = [100, 0, 0, 100, 0, 100, 0, 100, 0, 0, 1, 5].map((x) => x + 0.1);
  const camera: CameraView = { projection, width: 200, height: 200 };
  const source: CloudSource = { shape: 'two balls' };
  const plain = await interactiveRun(11, source, [camera]);
  const { note, ...rest } = await code();
  expect(note).toBeUndefined();
  await programs.add(11, rest);
  const { bytes } = await worker.request('data', undefined);
  await programs.expectSame([plain], [{ name: 'points.xyz', bytes }]);
  const image = new Uint8ClampedArray(4 * 200 * 200).fill(200);
  const coloured = await interactiveRun(11, source, [{ ...camera, image }]);
  expect((await code()).note).toContain('lacks the pictures');
  const shape = (ply: Uint8Array) => Mesh.parse(ply).arrays();
  expect(shape(coloured).positions).toEqual(shape(plain).positions);
  expect(shape(coloured).indices).toEqual(shape(plain).indices);
});

test('the code repeats edits of the finished surface after the run', async () => {
  await worker.request('load', { source: { shape: 'two balls' }, cameras: [], setup: SETUP });
  await worker.request('step', { count: 10_000 });
  const edits: Edit[] = [
    { op: 'keepComponents', indices: [0] },
    { op: 'smooth', iterations: 3, keepVolume: true },
    { op: 'decimate', targetTriangles: 300 },
  ];
  const mesh = Mesh.parse(await worker.request('export', { format: 'ply' }));
  for (const edit of edits) apply(mesh, edit);
  await programs.add(1, await code(edits));
  const { bytes } = await worker.request('data', undefined);
  await programs.expectSame([mesh.toBytes('ply')], [{ name: 'points.xyz', bytes }]);
});

test('a run whose beginning is not known has no code, until it is begun again', async () => {
  const source: CloudSource = { shape: 'two balls' };
  const { log: _, ...saved } = await worker.request('save', undefined);
  await worker.request('load', { source, cameras: [], setup: saved.setup, saved });
  await expect(code()).rejects.toThrow('not known how the run began');
  await worker.request('rebuild', SETUP);
  expect((await code()).code).toContain('new ImplicitSurface');
});
