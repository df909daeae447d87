/** Gestures in the Sculpt lab are repeated, to the same bits, by the code that its worker writes of them. */
import { expect, test } from 'vitest';
import { decompressGltf } from '../../pkg/gltf/index.js';
import init, { Mesh, MultiresolutionModel } from '../../pkg/index.js';
import { toCode } from '../../www/src/engine/code';
import { uniform } from '../../www/src/engine/random';
import { originsOf, programOf } from '../../www/src/labs/sculpt/code';
import { ball, moved, turned, withLengths } from '../../www/src/labs/sculpt/ellipsoids';
import type { Film } from '../../www/src/labs/sculpt/film';
import type {
  FrameEvent,
  Pose,
  PoseMessage,
  Requests,
  SavedPose,
  SceneSource,
  Support,
} from '../../www/src/labs/sculpt/protocol';
import { globeAsObj } from '../../www/src/labs/sculpt/shapes';
import { dracoGlb, dracoStream, ball as roundMesh } from '../js/made-gltf';
import { LONG } from './long';
import { pickFrom, programsIn } from './run-code';
import { startWorker } from './worker-in-node';

/** Called at each event of the worker; frames are drawn at once. */
let heard: () => void = () => undefined;
let state = 'paused';
let last: FrameEvent | undefined;
const worker = await startWorker<Requests>(
  () => import('../../www/src/labs/sculpt/worker'),
  (event) => {
    if ('serial' in event) {
      last = event as FrameEvent;
      queueMicrotask(() => worker.post({ kind: 'shown', serial: last?.serial }));
    } else if ('state' in event) state = String(event.state);
    heard();
  },
);
await worker.request('hello', undefined);

await init();
const programs = await programsIn('sculpt');

/** Waits until something holds after an event of the worker. */
const until = (holds: () => boolean) =>
  new Promise<void>((resolve) => {
    heard = () => holds() && resolve();
    heard();
  });

const START: Pose = [ball(-0.6, 0, 0, 0.5), ball(0.6, 0.1, 0, 0.45)];
const PARAMS = { edgeMin: 0.12, edgeMax: 0.3, levels: 1 };
const FILM: Film = { keys: [START, [ball(-0.7, 0.1, 0, 0.5), ball(0.7, 0.2, 0, 0.4)]], between: 3, loop: false };

/** Begins as an image does; nothing decodes it. */
const PNG = Uint8Array.of(137, 80, 78, 71, 13, 10, 26, 10);

let poses = 0;
/** Sends a pose, as the page does, and waits until a frame follows it. */
async function pose(target: Pose, dragging: boolean): Promise<void> {
  const message: PoseMessage = { kind: 'pose', pose: target, poseId: ++poses, dragging };
  worker.post(message);
  await until(() => last?.poseId === message.poseId);
}

/** Opens a scene, acts at random, and writes code of it; returns the surface. */
async function interactiveRun(
  seed: number,
  source: SceneSource,
  params: object = PARAMS,
  support: Support = 'membrane',
): Promise<Uint8Array> {
  const held = { pose: undefined, support };
  const random = uniform(seed);
  const pick = pickFrom(random);
  const off = () => 0.3 * (random() - 0.5);
  const saves: SavedPose[] = [];
  const changed = (one: Pose[number]) => turned(moved(one, [off(), off(), off()]), [0, 0, 1], off());
  const target = () => (last?.pose ?? START).map((one) => (random() < 0.5 ? one : changed(one)));
  await worker.request('open', { source, setup: { start: START, params: { ...params }, ...held } });
  await worker.request('show', { layout: 'result', quantity: undefined, textured: false });
  const can: (() => Promise<unknown>)[] = [
    () => pose(target(), false),
    // A drag of some frames, after which the surface may follow for some more.
    async () => {
      for (let i = 0; i < 4; i++) await pose(target(), true);
      await pose(target(), false);
      const serial = (last?.serial ?? 0) + 5;
      if (random() < 0.5) await until(() => state !== 'running' || (last?.serial ?? 0) >= serial);
    },
    // Another ellipsoid, or one less.
    () => pose(random() < 0.5 ? [...target(), ball(off(), 0.8, off(), 0.3)] : target().slice(0, 2), false),
    // Tips too sharp are refused.
    () => pose([withLengths(START[0] as Pose[number], [0.9, 1e-3, 1e-3]), ...START.slice(1)], false),
    () => worker.request('setParams', pick([{ supersample: 1 }, { distribute: 2 }, { energy: 'thin-plate' }])),
    () => worker.request('setParams', { edgeMin: 5 }),
    async () => saves.push(await worker.request('save', undefined)),
    async () => saves.length > 0 && worker.request('restore', pick(saves)),
    async () => {
      await worker.request('film', { film: FILM, frame: 0 });
      await worker.request('play', undefined);
    },
    () => worker.request('rebuild', { start: undefined, params: { ...params }, ...held }),
    async () => {
      await worker.request('film', { film: FILM, frame: 0 });
      await worker.request('record', { frameSeconds: 0.1 });
    },
  ];
  for (let i = 0; i < 9; i++) {
    await pick(can)().catch(() => undefined);
    if (random() < 0.5) await worker.request('step', { count: 1 + Math.floor(3 * random()) });
  }
  await worker.request('pause', undefined);
  await programs.add(seed, await worker.request('code', { stem: 'mesh', edits: [] }));
  return worker.request('export', { format: 'ply' });
}

test('the code of random gestures gives the same surfaces, of a membrane', async () => {
  const made: Uint8Array[] = [];
  for (let seed = 1; seed <= 4; seed++) made.push(await interactiveRun(seed, {}));
  await programs.expectSame(made, []);
  expect(new Set(made.map(({ length }) => length)).size).toBeGreaterThan(2);
  await expect(worker.request('data', undefined)).rejects.toThrow('no file but those');
});

test('the code of random gestures gives the same surfaces, of a mesh in a file on a computed base', LONG, async () => {
  const bytes = globeAsObj();
  const texture = { type: 'image/png', bytes: PNG } as const;
  const made: Uint8Array[] = [];
  const source = (): SceneSource => ({
    detail: { file: { name: 'globe.obj', bytes: bytes.slice() }, texture },
    base: { shape: 'ball' },
  });
  for (const seed of [5, 6])
    made.push(await interactiveRun(seed, source(), { ...PARAMS, edgeMin: 0.15, edgeMax: 0.4 }));
  await programs.expectSame(made, [
    { name: 'globe.obj', bytes },
    { name: 'texture.png', bytes: PNG },
  ]);
});

test('the code of random gestures gives the same surfaces, of a surface that holds itself', LONG, async () => {
  const source = (): SceneSource => ({ detail: { shape: 'ball' } });
  const made: Uint8Array[] = [];
  for (const seed of [7, 8, 9])
    made.push(await interactiveRun(seed, source(), { edgeMin: 0.1, edgeMax: 0.3 }, 'surface'));
  await programs.expectSame(made, []);
  // Recomputed with the other support, and back.
  const setup = { start: undefined, params: PARAMS, pose: undefined };
  const membrane = await worker.request('rebuild', { ...setup, support: 'membrane' });
  const surface = await worker.request('rebuild', { ...setup, support: 'surface' });
  expect(surface.start).not.toEqual(membrane.start);
  await programs.add(9, await worker.request('code', { stem: 'mesh', edits: [] }));
  await programs.expectSame([await worker.request('export', { format: 'ply' })], []);
});

test('a session keeps the log of the present model', async () => {
  const setup = { start: START, params: PARAMS, pose: undefined, support: 'membrane' } as const;
  await worker.request('open', { source: {}, setup });
  await worker.request('setParams', { edgeMin: 0.1 });
  await pose([moved(START[0] as Pose[number], [0.1, 0, 0.2]), ...START.slice(1)], false);
  await worker.request('pause', undefined);
  const saved = await worker.request('save', undefined);
  const log = await worker.request('log', undefined);
  await worker.request('open', { source: {}, setup, saved: { ...saved, log: 'as in a new worker' }, log });
  await worker.request('restore', { ...saved, log: 'as in a new worker' });
  await worker.request('step', { count: 2 });
  await programs.add(1, await worker.request('code', { stem: 'mesh', edits: [] }));
  await programs.expectSame([await worker.request('export', { format: 'ply' })], []);
  await worker.request('open', { source: {}, setup, saved });
  await expect(worker.request('code', { stem: 'mesh', edits: [] })).rejects.toThrow('not known how the run began');
});

test('code of a run with a compressed mesh decodes it', async () => {
  const bytes = dracoGlb([dracoStream(roundMesh())]);
  const origins = originsOf({ detail: { file: { name: 'ball.glb', bytes } } });
  const setup = { start: [ball(0, 0, 0, 0.5)], params: {}, support: 'surface' as const };
  const program = (given: typeof setup) => programOf(given, origins, 'run');
  await programs.add(0, toCode({ setup, calls: [] } as never, program as never, []));
  const mesh = Mesh.parse(await decompressGltf(bytes));
  const model = new MultiresolutionModel({ detail: mesh, ellipsoids: setup.start });
  await programs.expectSame([model.mesh.toBytes('ply')], [{ name: 'ball.glb', bytes }]);
});
