/** Runs of the Track lab's worker are repeated, to the same bits, by the code that the worker writes of them. */
import { expect, test } from 'vitest';
import init, { Volume } from '../../pkg/index.js';
import { uniform } from '../../www/src/engine/random';
import { cineVoxels } from '../../www/src/labs/track/cine';
import type {
  CineSpec,
  ImageSource,
  ParamValues,
  Requests,
  SavedTrack,
  Setup,
} from '../../www/src/labs/track/protocol';
import { LONG } from './long';
import { pickFrom, programsIn } from './run-code';
import { startWorker } from './worker-in-node';

const worker = await startWorker<Requests>(() => import('../../www/src/labs/track/worker'));
await worker.request('hello', undefined);

await init();
const programs = await programsIn('track');

/** Voxel sizes that single precision rounds. */
const CINE: CineSpec = { dims: [20, 20, 8], spacing: [3.3, 3.3, 8.1], frames: 4, noise: 4, size: 22, papillary: false };
const PLAIN: Setup['preparation'] = { binning: 1, enrichment: 'none', factor: 0 };
const SETUP: Setup = { preparation: PLAIN, box: undefined, at: undefined, params: { windowFrames: 1 } };

/** Opens an image, acts at random, and writes code of the run; returns the surface of a random frame. */
async function interactiveRun(seed: number, source: ImageSource): Promise<Uint8Array> {
  const random = uniform(seed);
  const pick = pickFrom(random);
  await worker.request('open', { name: 'cine', source, setup: SETUP, isSmall: false });
  const saves: SavedTrack[] = [];
  const params = (): ParamValues =>
    pick([
      { damping: 0.7 + 0.3 * random() },
      { prediction: pick([true, false]) },
      { radius: 8 + 4 * random() },
      { threshold: 20 + 10 * random() },
      { edgeMax: 1.4 + 0.4 * random(), cyclic: pick([true, false]) },
    ]);
  const setup = (): Setup => ({
    preparation: pick([PLAIN, { ...PLAIN, enrichment: 'linear' }, { binning: 2, enrichment: 'flow', factor: 2 }]),
    box: pick([undefined, { min: [3, 3, 0.1], max: [58, 57, 55] }]),
    at: pick([undefined, [31, 31, 28]]),
    cavity: pick([undefined, 'closed']),
    params: { windowFrames: 1, ...params() },
  });
  const can: (() => Promise<unknown>)[] = [
    () => worker.request('setParams', params()),
    () => worker.request('rebuild', setup()),
    async () => saves.push(await worker.request('save', undefined)),
    async () => saves.length > 0 && worker.request('restore', pick(saves)),
    () => worker.request('setParams', { damping: -1 }),
    // While the tracker runs, at a step that only the worker knows.
    async () => {
      await worker.request('play', undefined);
      await worker.request('setParams', params());
    },
  ];
  for (let i = 0; i < 8; i++) {
    await pick(can)().catch(() => undefined);
    await worker.request('step', { count: Math.floor(5 * random()) });
  }
  await worker.request('step', { count: 20 });
  const frame = Math.floor(4 * random());
  await programs.add(seed, await worker.request('code', { stem: 'cine', edits: [], frame }));
  return worker.request('export', { frame, format: 'ply' });
}

test('the code of random runs gives the same surfaces, of a computed image', LONG, async () => {
  const made: Uint8Array[] = [];
  for (let seed = 1; seed <= 6; seed++) made.push(await interactiveRun(seed, { cine: CINE }));
  const { extension, bytes } = await worker.request('data', undefined);
  await programs.expectSame(made, [{ name: `cine.${extension}`, bytes }]);
  expect(new Set(made.map(({ length }) => length)).size).toBeGreaterThan(3);
});

test('the code of random runs gives the same surfaces, of a file', async () => {
  const { dims, spacing, frames } = CINE;
  const file = new Volume({ data: cineVoxels(CINE), dims: [...dims, frames], spacing }).toBytes('nrrd');
  const source = () => ({ files: [{ name: 'cine.nrrd', bytes: file.slice() }] });
  const surfaces = [await interactiveRun(7, source()), await interactiveRun(8, source())];
  await programs.expectSame(surfaces, [{ name: 'cine.nrrd', bytes: file }]);
});

test('the code says that cavities are closed, and nothing of those that are open', async () => {
  const codeOf = async (cavity: Setup['cavity']) => {
    await worker.request('open', { name: 'cine', source: { cine: CINE }, setup: { ...SETUP, cavity }, isSmall: false });
    return (await worker.request('code', { stem: 'cine', edits: [] })).code;
  };
  expect(await codeOf('closed')).toContain("cavity: 'closed'");
  expect(await codeOf('open')).not.toContain('cavity');
});
