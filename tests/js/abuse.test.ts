// Calls every method of every class with invalid arguments, and after its object is freed. Each call must return, throw
// a VesicleError, or throw what the argument itself throws; the instance must neither crash nor be damaged.
import { execFileSync } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { afterAll, beforeAll, expect, test } from 'vitest';
import * as vesicle from '../../pkg/index.js';
import { ball, HEALTHY } from './helpers.js';

const {
  DeformableModel,
  ImplicitSurface,
  LabelSurfaces,
  Mesh,
  MultiresolutionModel,
  SurfaceTracker,
  VesicleError,
  Volume,
} = vesicle;

const root = fileURLToPath(new URL('../..', import.meta.url));

/** The error thrown by the getters of hostile arguments, which callers must receive unchanged. */
class Trap extends Error {}

const trap = () => {
  throw new Trap('a trap');
};

const detached = new Float32Array(12);
structuredClone(detached.buffer, { transfer: [detached.buffer] });

// More recent than the library types that these tests are compiled with.
const Resizable = ArrayBuffer as unknown as new (
  length: number,
  options: { maxByteLength: number },
) => ArrayBuffer & { resize(length: number): void };
const buffer = new Resizable(96, { maxByteLength: 96 });
const shrinking = new Float32Array(buffer, 24);
buffer.resize(16);

const HOSTILE: [string, unknown][] = [
  ['undefined', undefined],
  ['null', null],
  ['NaN', Number.NaN],
  ['Infinity', Number.POSITIVE_INFINITY],
  ['-1', -1],
  ['0', 0],
  ['2^53', 2 ** 53],
  ['1e300', 1e300],
  ['5e-324', 5e-324],
  ['a BigInt', 10n ** 30n],
  ['a symbol', Symbol('s')],
  ['a function', () => 1],
  ['true', true],
  ['an empty text', ''],
  ['a text', '__proto__'],
  ['half a letter', '\ud800'],
  ['an empty list', []],
  ['a list of holes', new Array(3)],
  ['a list of nothing', [undefined, null]],
  ['a list of numbers', [0, 0, 0]],
  ['a list of NaN', [Number.NaN, Number.NaN, Number.NaN]],
  ['a list of lists', [[[[]]]]],
  ['an empty object', {}],
  ['an object without a prototype', Object.create(null)],
  ['a date', new Date(Number.NaN)],
  ['bytes', new Uint8Array(64).fill(255)],
  ['floats', new Float32Array(12).fill(Number.NaN)],
  ['doubles', new Float64Array([1e308, -1e308, 5e-324, 0, 0, 0])],
  ['64-bit integers', new BigInt64Array(4)],
  ['a detached array', detached],
  ['an array out of its bounds', shrinking],
  ['a shared array', new Float32Array(new SharedArrayBuffer(48))],
  ['a buffer', new ArrayBuffer(48)],
  ['a DataView', new DataView(new ArrayBuffer(48))],
  ['an object that lies about its length', { length: 2 ** 31, 0: 1 }],
  ['an object whose fields throw', new Proxy({}, { get: trap, ownKeys: trap, has: trap, getPrototypeOf: trap })],
  ['a number that throws', { valueOf: trap, toString: trap, [Symbol.toPrimitive]: trap }],
  ['an aborted signal', AbortSignal.abort()],
];

/** All option names of all methods; hostile options have the same value for each. */
const NAMES = [
  ...[
    'volume',
    'points',
    'start',
    'params',
    'levels',
    'seeds',
    'radius',
    'iso',
    'frame',
    'component',
    'at',
    'box',
    'data',
    'dims',
  ],
  ...[
    'min',
    'max',
    'cell',
    'format',
    'signal',
    'onStep',
    'steps',
    'voxels',
    'method',
    'factor',
    'affine',
    'spacing',
    'normals',
  ],
  ...[
    'detail',
    'ellipsoids',
    'base',
    'positions',
    'triangles',
    'indices',
    'colors',
    'uvs',
    'texture',
    'cameras',
    'confidence',
    'label',
    'like',
    'gzip',
  ],
];

let volume: vesicle.Volume;
let mesh: vesicle.Mesh;
let film: vesicle.Volume;

beforeAll(() => {
  volume = ball(12, 4);
  mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 4, maxEdge: 2 });
  const two = [ball(12, 4), ball(12, 4.5)];
  film = Volume.fromFrames(two, { frameSeconds: 1 });
  for (const one of two) one.free();
});

afterAll(() => {
  for (const one of [volume, mesh, film]) one.free();
});

const AXES: [vesicle.Vec3, vesicle.Vec3, vesicle.Vec3] = [
  [4, 0, 0],
  [0, 4, 0],
  [0, 0, 4],
];
const BALL = [{ center: [0, 0, 0] as vesicle.Vec3, axes: AXES }];

const points = () => mesh.arrays().positions.slice();

/** Makes a small object of each class. */
const MAKERS: Record<string, () => { free(): void }> = {
  Volume: () => volume.binned([1, 1, 1]),
  Mesh: () => mesh.clone(),
  DeformableModel: () => new DeformableModel({ volume, params: { iso: 100 } }),
  ImplicitSurface: () => new ImplicitSurface({ points: points() }),
  SurfaceTracker: () => new SurfaceTracker({ volume: film }),
  LabelSurfaces: () => new LabelSurfaces({ volume, labels: [200] }),
  MultiresolutionModel: () =>
    new MultiresolutionModel({ base: mesh, ellipsoids: BALL, params: { edgeMin: 2, edgeMax: 5 } }),
};

/** Returns the names of an object's methods and fields, including inherited ones, except `free`. */
function members(object: object): { methods: string[]; fields: string[] } {
  const [methods, fields]: [string[], string[]] = [[], []];
  for (let p = Object.getPrototypeOf(object); p !== Object.prototype; p = Object.getPrototypeOf(p)) {
    for (const [name, { get, value }] of Object.entries(Object.getOwnPropertyDescriptors(p))) {
      if (name === 'constructor' || name === 'free') continue;
      if (get) fields.push(name);
      else if (typeof value === 'function') methods.push(name);
    }
  }
  return { methods, fields };
}

/** Returns `answer` if a call returns, or the error that it throws. Frees returned objects. */
async function outcome(work: () => unknown): Promise<unknown> {
  try {
    const answer = await work();
    if (answer instanceof Mesh || answer instanceof Volume) answer.free();
    return 'answer';
  } catch (error) {
    return error;
  }
}

const isForeseen = (came: unknown) =>
  came === 'answer' || (came instanceof VesicleError && came.code !== 'crash') || came instanceof Trap;

// biome-ignore lint/suspicious/noExplicitAny: what a caller without types may do
const loose = (object: unknown): any => object;

describeEach('%s: invalid arguments do no harm', async (make) => {
  const bad: string[] = [];
  for (const name of members(make()).methods) {
    for (const [what, value] of HOSTILE) {
      const named = Object.fromEntries(NAMES.map((key) => [key, value]));
      for (const args of [[value], [value, value, value], [named], [[0, 0, 0], named]]) {
        const object = make();
        const came = await outcome(() => loose(object)[name](...args));
        if (!isForeseen(came)) bad.push(`${name}(${what}): ${came}`);
        if (loose(came) instanceof vesicle.VesicleCrash) await vesicle.default();
        object.free();
      }
    }
  }
  expect(bad).toEqual([]);
  expect(mesh.check()).toMatchObject(HEALTHY);
});

describeEach('%s: a freed object reports that it is freed', async (make) => {
  const object = make();
  object.free();
  const { methods, fields } = members(object);
  for (const name of fields) {
    // The mesh of a model is a view, so only reading from it fails.
    const read = () => (/mesh/i.test(name) ? loose(object)[name].vertexCount : loose(object)[name]);
    expect(await outcome(read), name).toMatchObject({ code: 'freed' });
  }
  for (const name of methods) expect(await outcome(() => loose(object)[name]()), name).toBeInstanceOf(VesicleError);
  object.free();
});

test('invalid arguments of constructors, static methods and functions do no harm', async () => {
  const bad: string[] = [];
  const functions = { animationGlb: vesicle.animationGlb, paramSpecs: vesicle.paramSpecs, version: vesicle.version };
  for (const [name, work] of Object.entries(functions)) {
    for (const [what, value] of HOSTILE) {
      const came = await outcome(() => loose(work)(value, value));
      if (!isForeseen(came)) bad.push(`${name}(${what}): ${came}`);
    }
  }
  for (const type of Object.keys(MAKERS)) {
    const made = loose(vesicle)[type];
    const statics = Object.getOwnPropertyNames(made).filter((name) => typeof made[name] === 'function');
    for (const [what, value] of HOSTILE) {
      const named = Object.fromEntries(NAMES.map((key) => [key, value]));
      for (const args of [[value], [value, value], [named]]) {
        const calls: [string, () => unknown][] = statics.map((name) => [name, () => made[name](...args)]);
        for (const [name, work] of [['new', () => new made(...args)] as [string, () => unknown], ...calls]) {
          const came = await outcome(work);
          if (!isForeseen(came)) bad.push(`${type}.${name}(${what}): ${came}`);
        }
      }
    }
  }
  expect(bad).toEqual([]);
  expect(mesh.check()).toMatchObject(HEALTHY);
});

function describeEach(title: string, work: (make: () => { free(): void }) => Promise<void>): void {
  test.each(Object.entries(MAKERS))(title, async (_, make) => {
    await work(make);
  });
}

test('with memory nearly full, calls fail with a named error and succeed again once memory is freed', {
  tags: ['long'],
}, () => {
  // Runs in a separate process, which uses all 4 GiB that wasm can have.
  const script = `
    const vesicle = await import('./pkg/index.js');
    await vesicle.default();
    const { DeformableModel, Mesh, Volume, VesicleError, VesicleCrash } = vesicle;
    const held = [];
    const fill = (bytes) => {
      const data = new Uint8Array(bytes);
      for (;;) {
        try {
          held.push(new Volume({ data, dims: [1024, 1024, bytes / 2 ** 20] }));
        } catch (error) {
          return error;
        }
      }
    };
    for (const bytes of [2 ** 30, 2 ** 27, 2 ** 24]) {
      const error = fill(bytes);
      if (error.code !== 'too-large') throw error;
    }
    const size = 256;
    const voxels = Uint8Array.from({ length: size ** 3 }, (_, i) => (Math.sin(i) > 0 ? 255 : 0));
    const work = {
      voxels: () => new Volume({ data: voxels, dims: [size, size, size] }).pyramid(2),
      model: () => {
        const model = new DeformableModel({ volume: held.at(-1), params: { iso: 100 }, start: Mesh.icosphere({ center: [0, 0, 0], radius: 9, maxEdge: 1 }) });
        model.step(20);
      },
      sphere: () => Mesh.icosphere({ center: [0, 0, 0], radius: 100, maxEdge: 1 }),
    };
    const came = {};
    for (const [name, make] of Object.entries(work)) {
      try {
        make();
        came[name] = 'made';
      } catch (error) {
        if (error instanceof VesicleCrash) await vesicle.default();
        came[name] = error instanceof VesicleError ? error.code : error.name;
      }
    }
    for (const volume of held) volume.free();
    const again = new Volume({ data: voxels, dims: [size, size, size] });
    came.afterwards = again.dims.join();
    console.log(JSON.stringify({ count: held.length, came }));`;
  const args = ['--input-type=module', '--eval', script];
  const { count, came } = JSON.parse(execFileSync(process.execPath, args, { cwd: root, encoding: 'utf8' }));
  expect(count).toBeGreaterThan(4);
  expect(came.afterwards).toBe('256,256,256');
  expect(came.voxels).toBe('too-large');
  for (const what of ['sphere', 'model']) expect(['made', 'too-large', 'crash']).toContain(came[what]);
});
