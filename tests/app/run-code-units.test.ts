/** Runs of the Extract lab's worker are repeated, to the same bits, by the code that the worker writes of them. */
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { describe, expect, test } from 'vitest';
import init, { Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { bytesOf, callsOf, type Program, toCode } from '../../www/src/engine/code';
import { literal } from '../../www/src/engine/literal';
import type { Attractor, VolumeSource } from '../../www/src/engine/protocol';
import { uniform } from '../../www/src/engine/random';
import { programOf } from '../../www/src/labs/extract/code';
import type { Requests, SavedRun, Setup, StartShape } from '../../www/src/labs/extract/protocol';
import { filesOf, serveImage, zipOf } from '../js/zarr-stores';
import { LONG } from './long';
import { pickFrom, programsIn } from './run-code';
import { ball, ring } from './volumes';
import { startWorker } from './worker-in-node';

const worker = await startWorker<Requests>(() => import('../../www/src/labs/extract/worker'));
await worker.request('hello', undefined);

/** Returns a file with a tooth, of few voxels, and the source that the lab opens. */
async function tooth() {
  const volume = Volume.parse(new Uint8Array(await readFile(at('www/public/data/tooth.nrrd'))));
  const bytes = volume.pyramid(4).at(-1)?.toBytes('nrrd') ?? new Uint8Array();
  return { name: 'tooth.nrrd', bytes, source: (): VolumeSource => ({ files: [{ name: 'tooth.nrrd', bytes }] }) };
}

/** Returns linked rings, which the lab computes, as the file that the lab saves. */
async function rings() {
  const source = (): VolumeSource => ({ shape: 'linked rings' });
  await worker.request('load', { name: 'linked rings', source: source(), setup: SETUP, frame: 0 });
  return { name: 'rings.nii', bytes: (await worker.request('data', undefined)).bytes, source };
}

/** Returns a 4D file with a ball and a ring, of which the second frame is opened. */
async function secondFrame() {
  const data = new Uint8Array([...ball(), ...ring()]);
  const bytes = new Volume({ data, dims: [32, 32, 32, 2] }).toNifti();
  const source = (): VolumeSource => ({ files: [{ name: 'frames.nii', bytes }] });
  return { name: 'frames.nii', bytes, source, frame: 1 };
}

await init();
const programs = await programsIn('extract');

const SETUP: Setup = { start: { kind: 'contour' }, levels: 1, edge: undefined, params: {}, attractors: [] };

/** Returns the actions of a user between two steps, each with random values. */
function actions(random: () => number, bounds: { middle: number[]; size: number }) {
  const pick = pickFrom(random);
  const point = () => bounds.middle.map((x) => x + (random() - 0.5) * bounds.size) as [number, number, number];
  const saves: SavedRun[] = [];
  const attractor = (): Attractor => ({ point: point(), strength: random(), radius: (0.1 + random()) * bounds.size });
  const setParams = () =>
    worker.request(
      'setParams',
      pick([
        { rigidity: random() },
        { stiffness: 0.1 * random(), damping: random() },
        { isoForce: -0.5 - 2 * random() },
        { restLength: pick(['zero', 'mean']) },
        { integrator: pick(['implicit', 'euler', 'runge-kutta']) },
        { adaptivity: pick([0, 0.5, 1]) },
        { gradientTangent: random() - 0.5 },
      ]),
    );
  const start = (): StartShape =>
    pick<() => StartShape>([
      () => ({ kind: 'contour' }),
      () => ({ kind: 'enclosing' }),
      () => ({ kind: 'isosurface' }),
      () => ({ kind: 'bubbles', count: 2 }),
      () => ({ kind: 'sphere', center: point(), radius: 0.2 * bounds.size }),
    ])();
  return {
    step: () => worker.request('step', { count: 1 + Math.floor(4 * random()) }),
    setParams,
    setAttractors: () => worker.request('setAttractors', random() < 0.3 ? [] : [attractor(), attractor()]),
    seed: () => worker.request('seed', undefined),
    save: async () => saves.push(await worker.request('save', undefined)),
    restore: async () => saves.length > 0 && worker.request('restore', pick(saves)),
    rebuild: () =>
      worker.request('rebuild', {
        ...{ start: start(), levels: Math.floor(2 * random()), edge: undefined },
        ...{ params: { rigidity: random() }, attractors: random() < 0.5 ? [] : [attractor()] },
      }),
    refused: () => worker.request('setParams', { rigidity: -1, isoForce: 1 }).catch(() => undefined),
    // While the model runs, at an iteration that only the worker knows.
    setParamsOfRun: async () => {
      await worker.request('play', undefined);
      await setParams();
      await worker.request('pause', undefined);
    },
  };
}

/** Opens a volume, acts at random, and writes code of the run; returns the surface. */
async function interactiveRun(seed: number, source: VolumeSource, file: string, frame?: number): Promise<Uint8Array> {
  const random = uniform(seed);
  const { volume } = await worker.request('load', { name: file, source, setup: SETUP, frame: frame ?? 0 });
  const size = Math.min(...volume.dims.map((n, axis) => n * (volume.spacing[axis] ?? 1)));
  const middle = [0, 1, 2].map((row) =>
    [0, 1, 2, 3].reduce(
      (sum, column) => sum + (volume.affine[4 * column + row] ?? 0) * (column < 3 ? (volume.dims[column] ?? 0) / 2 : 1),
      0,
    ),
  );
  const can = Object.values(actions(random, { middle, size }));
  for (let i = 0; i < 14; i++) {
    await can[Math.floor(random() * can.length)]?.();
    await can[0]?.();
  }
  await programs.add(seed, await worker.request('code', { stem: 'rings', edits: [] }));
  return worker.request('export', { format: 'ply' });
}

interface Opened {
  name: string;
  bytes: Uint8Array;
  source: () => VolumeSource;
  frame?: number;
}

const SEEDS = Array.from({ length: 10 }, (_, index) => index + 1);

async function expectSameByCode(open: () => Promise<Opened>): Promise<void> {
  const { name, bytes, source, frame } = await open();
  const made: Uint8Array[] = [];
  for (const seed of SEEDS) made.push(await interactiveRun(seed, source(), name, frame));
  await programs.expectSame(made, [{ name, bytes }]);
  expect(new Set(made.map(({ length }) => length)).size).toBeGreaterThan(5);
}

describe('the code of random runs gives the same surfaces', () => {
  test('on a file', () => expectSameByCode(tooth));
  test('on a computed volume', LONG, () => expectSameByCode(rings));
  test('on a frame of a 4D file', LONG, () => expectSameByCode(secondFrame));
});

test('values are written so that they are read as the same, whatever they contain', () => {
  const value = { a: [0.1 + 0.2, -0, 1e-300, 5], 'b*/': "it's\n`#{x}`", c: true, d: Number.NaN, e: {} };
  // biome-ignore lint/security/noGlobalEval: what the user does with the code
  expect(eval(`(${literal(value)})`)).toStrictEqual(value);
});

test('a log, which may come from anyone, cannot choose what the code does', () => {
  const program: Program = { names: ['DeformableModel'], begin: [], calls: callsOf('step') };
  const code = (call: string, given: unknown) =>
    toCode({ setup: {}, calls: [{ call, given }] }, () => program, []).code;
  for (const call of ['constructor', 'free(); evil', 'toString', '__proto__', 'seed'])
    expect(() => code(call, 1)).toThrow('which this app does not know');
  const given = { 'x: evil(), y': "`'\n'); evil(); //" };
  const [line = ''] = code('step', given)
    .split('\n')
    .filter((one) => one.includes('model.step'));
  const taken: unknown[] = [];
  new Function('model', line)({ step: (value: unknown) => taken.push(value) });
  expect(taken).toEqual([given]);
  const files = bytesOf(['a.nii */ evil(); /*'], ['bytes']);
  const named = toCode({ setup: {}, calls: [] }, () => ({ ...program, ...files }), []).code;
  expect(named.match(/\*\//g)).toHaveLength(1);
});

describe('the code of runs on an image larger than memory', () => {
  const LARGE: Setup = { ...SETUP, levels: 1, params: { isoForce: -1 } };

  /** Opens an image, acts at random, and returns the surface. */
  async function largeRun(seed: number, zarr: string | Blob): Promise<Uint8Array> {
    const random = uniform(seed);
    await worker.request('load', { name: 'image.zip', source: { zarr }, setup: LARGE, frame: 0 });
    const point = (): [number, number, number] => [10 * random(), 10 * random(), 10 * random()];
    const can = [
      () => worker.request('setParams', { rigidity: random() }),
      () => worker.request('setAttractors', [{ point: point(), strength: random(), radius: 5 }]),
      () => worker.request('seed', undefined).catch(() => 0),
      () => worker.request('rebuild', { ...LARGE, box: { min: [0, 0, 0], max: point() } }),
    ];
    for (let i = 0; i < 4; i++) {
      await pickFrom(random)(can)();
      await worker.request('step', { count: 1 + Math.floor(4 * random()) });
    }
    return worker.request('export', { format: 'ply' });
  }
  const code = () => worker.request('code', { stem: 'image', edits: [] });

  test('gives the same surfaces, of an archive', async () => {
    const made: Uint8Array[] = [];
    for (const seed of [1, 2, 3]) {
      made.push(await largeRun(seed, zipOf('v3-scaled-zyx')));
      await programs.add(seed, await code());
    }
    const bytes = new Uint8Array(await zipOf('v3-scaled-zyx').arrayBuffer());
    await programs.expectSame(made, [{ name: 'image.zip', bytes }]);
  });

  test('gives the same surface, of an address', LONG, async () => {
    const images = await serveImage('v3-scaled-zyx');
    try {
      const made = await largeRun(4, images.url);
      await programs.add(4, await code());
      await programs.expectSame([made], []);
    } finally {
      await images.close();
    }
  });

  test('gives the same surface, of a folder', LONG, async () => {
    for (const [key, bytes] of await filesOf('v3-scaled-zyx')) {
      await mkdir(dirname(join(programs.folder, 'image', key)), { recursive: true });
      await writeFile(join(programs.folder, 'image', key), bytes);
    }
    await worker.request('load', { name: '', source: { zarr: zipOf('v3-scaled-zyx') }, setup: LARGE, frame: 0 });
    await worker.request('step', { count: 5 });
    // No folder of a browser can be sent to a worker of Node.
    const data = { source: { zarr: {} as FileSystemDirectoryHandle }, name: 'image', coarserLevels: 1 };
    const iso = Number(/iso: ([\d.]+)/.exec((await code()).code)?.[1]);
    const log = { setup: { ...LARGE, params: { ...LARGE.params, iso } }, calls: [{ call: 'step', given: 5 }] };
    const program = toCode(log, (setup) => programOf(setup, data, ''), []);
    expect(program).toMatchObject({ needs: 'folder', name: 'image' });
    await programs.add(5, program);
    await programs.expectSame([await worker.request('export', { format: 'ply' })], ['image']);
  });
});
