// Long operations of meshes in slices of work: the same results, aborts, and what is refused meanwhile.
import { expect, test } from 'vitest';
import { Mesh, type MeshInSlices, Volume } from '../../pkg/index.js';
import { failure, rejection, wrong } from './helpers.js';

/** Returns a bumpy sphere as a list of triangles, on which each operation has many slices. */
function bumpy(): Mesh {
  const { positions, indices } = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.1 }).arrays();
  const at = (k: number) => positions[k] as number;
  const scale = (k: number) => 1 + 0.1 * Math.sin(5 * at(k)) * Math.cos(7 * at(k + 1)) + 0.004 * ((k * 7) % 5);
  const moved = positions.map((value, i) => value * scale(i - (i % 3)));
  return Mesh.fromArrays(moved, indices);
}

const EDGE = { min: 0.04, max: 0.12 };
const GRID = new Volume({
  data: new Uint8Array(30 ** 3),
  dims: [30, 30, 30],
  spacing: [0.1, 0.1, 0.1],
  origin: [-1.5, -1.5, -1.5],
});
const OTHER = Mesh.icosphere({ center: [0.1, 0, 0], radius: 1, maxEdge: 0.1 });

/** Each operation, which both kinds of objects have. */
const OPERATIONS: Record<keyof MeshInSlices, (mesh: Mesh | MeshInSlices) => unknown> = {
  remesh: (mesh) => mesh.remesh(EDGE),
  restructure: (mesh) => mesh.restructure(EDGE, ['split', 'flip', 'collapse', 'flip']),
  decimate: (mesh) => mesh.decimate(1000.5),
  decimateWithin: (mesh) => mesh.decimateWithin(0.01, { targetTriangles: 500 }),
  smooth: (mesh) => mesh.smooth({ iterations: 3 }),
  cut: (mesh) => mesh.cut({ origin: [0.1, 0, 0], normal: [1, 2, 3] }),
  removeCavities: (mesh) => mesh.removeCavities(),
  contains: (mesh) => mesh.contains(Float32Array.from({ length: 9000 }, (_, k) => (k * 0.618) % 1.5)),
  toVolume: async (mesh) => (await mesh.toVolume(GRID, { kind: 'distance' })).intensities(),
  check: (mesh) => mesh.check(),
  distanceTo: (mesh) => mesh.distanceTo(OTHER),
};

const NAMES = Object.keys(OPERATIONS) as (keyof MeshInSlices)[];
const READS: (keyof MeshInSlices)[] = ['contains', 'toVolume', 'check', 'distanceTo'];
const CHANGES = NAMES.filter((name) => !READS.includes(name));

/** Everything that may be seen of a mesh. */
const state = (mesh: Mesh) => [mesh.arrays(), mesh.topologyVersion, mesh.geometryVersion, mesh.origin];

/** A slice of work is as short as can be, so that what happens between slices does. */
const SHORT = { budgetMs: 1e-6 };

test.each(NAMES)('%s in slices: the same bits, and others have their turn meanwhile', async (name) => {
  // An editable mesh, and a list of triangles.
  const refined = bumpy();
  refined.refine();
  for (const mesh of [bumpy(), refined]) {
    const other = mesh.clone();
    const expected = await OPERATIONS[name](other);
    let turns = 0;
    const count = () => {
      turns += 1;
      immediate = setImmediate(count);
    };
    let immediate = setImmediate(count);
    const value = await OPERATIONS[name](mesh.inSlices(SHORT));
    clearImmediate(immediate);
    expect(value).toEqual(expected);
    expect(state(mesh)).toEqual(state(other));
    expect(turns).toBeGreaterThan(2);
  }
});

test.each(NAMES)('%s: an abort in the middle leaves the mesh as it was, and usable', async (name) => {
  const mesh = bumpy();
  const before = state(mesh);
  const abort = new AbortController();
  const slices = mesh.inSlices({ ...SHORT, signal: abort.signal });
  setImmediate(() => abort.abort('enough'));
  await expect(OPERATIONS[name](slices)).rejects.toBe('enough');
  expect(state(mesh)).toEqual(before);
  await expect(OPERATIONS[name](slices)).rejects.toBe('enough');
  const other = mesh.clone();
  OPERATIONS[name](other);
  await OPERATIONS[name](mesh.inSlices());
  expect(state(mesh)).toEqual(state(other));
});

/** Everything that changes a mesh. */
const EDITS: Record<string, (mesh: Mesh) => unknown> = {
  refine: (mesh) => mesh.refine(),
  restructure: (mesh) => mesh.restructure(EDGE),
  decimate: (mesh) => mesh.decimate(100),
  decimateWithin: (mesh) => mesh.decimateWithin(0.1),
  remesh: (mesh) => mesh.remesh(EDGE),
  smooth: (mesh) => mesh.smooth({ iterations: 1 }),
  transform: (mesh) => mesh.transform([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]),
  cut: (mesh) => mesh.cut({ origin: [0, 0, 0], normal: [0, 0, 1] }),
  keepComponents: (mesh) => mesh.keepComponents([0]),
  removeCavities: (mesh) => mesh.removeCavities(),
};

test('what would change a mesh is refused while an operation in slices does, and reading is not', async () => {
  const mesh = bumpy();
  const [before, after] = [mesh.clone(), mesh.clone()];
  after.decimate(500);
  const work = mesh.inSlices(SHORT).decimate(500);
  await new Promise((resolve) => setImmediate(resolve));
  for (const [name, edit] of Object.entries(EDITS)) {
    const { code, message } = failure(() => edit(mesh));
    expect([code, message]).toEqual(['invalid-argument', expect.stringContaining(`${name}: not allowed while`)]);
  }
  for (const name of CHANGES) {
    await expect(OPERATIONS[name](mesh.inSlices())).rejects.toThrow(`${name}: not allowed while`);
  }
  expect(state(mesh)).toEqual(state(before));
  expect(mesh.clone().triangleCount).toBe(before.triangleCount);
  expect(await mesh.inSlices(SHORT).distanceTo(before)).toMatchObject({ hausdorff: 0 });
  await work;
  expect(state(mesh)).toEqual(state(after));
  mesh.refine();
});

/** Returns a torus whose vertices are anywhere, so that all its triangles intersect. */
function tangle(side: number): Mesh {
  let seed = 7;
  const random = () => {
    seed = (seed * 1103515245 + 12345) & 0x7fffffff;
    return seed / 0x7fffffff;
  };
  const positions = Float32Array.from({ length: 3 * side * side }, random);
  const at = (i: number, j: number) => (i % side) * side + (j % side);
  const quads = Array.from({ length: side * side }, (_, k) => [Math.floor(k / side), k % side] as const);
  const indices = quads.flatMap(([i, j]) => {
    const [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
    return [a, b, c, a, c, d];
  });
  return Mesh.fromArrays(positions, Uint32Array.from(indices));
}

test.each(['check', 'toVolume'] as const)('%s pauses also where everything intersects', async (name) => {
  const mesh = tangle(30);
  let turns = 0;
  const count = () => {
    turns += 1;
    immediate = setImmediate(count);
  };
  let immediate = setImmediate(count);
  await OPERATIONS[name](mesh.inSlices(SHORT));
  clearImmediate(immediate);
  expect(turns).toBeGreaterThan(15);
});

test('a distance is that of the meshes at the call', async () => {
  const [mesh, other] = [bumpy(), OTHER.clone()];
  const expected = mesh.distanceTo(other);
  const work = mesh.inSlices(SHORT).distanceTo(other);
  mesh.decimate(100);
  other.free();
  expect(await work).toEqual(expected);
});

test('a mesh that is freed ends the operation', async () => {
  const mesh = bumpy();
  const work = mesh.inSlices(SHORT).remesh(EDGE);
  mesh.free();
  expect(await rejection(work)).toMatchObject({ code: 'freed' });
});

test('refusals are those of the methods, as rejections', async () => {
  const mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 });
  const { positions, indices } = mesh.arrays();
  const open = Mesh.fromArrays(positions, indices.slice(3));
  const refused: [string, () => Promise<unknown>][] = [
    ['edge.max', () => mesh.inSlices().remesh({ min: 1, max: 1 })],
    ['vertices', () => mesh.inSlices().restructure({ min: 1e-6, max: 1e-5 })],
    ['passes', () => mesh.inSlices().restructure({ min: 1, max: 3 }, wrong(['cut']))],
    ['targetTriangles', () => mesh.inSlices().decimate(0)],
    ['maxDistance', () => mesh.inSlices().decimateWithin(-1)],
    ['other', () => mesh.inSlices().distanceTo(wrong(3))],
    ['closed', () => open.inSlices().remesh(EDGE)],
    ['closed', () => open.inSlices().decimate(1e9)],
  ];
  for (const [what, work] of refused) expect((await rejection(work())).message).toContain(what);
  for (const options of [{ signal: 3 }, { budgetMs: 0 }, { budget: 1 }]) {
    expect(failure(() => mesh.inSlices(wrong(options))).code).toBe('invalid-argument');
  }
  await mesh.inSlices().decimate(1e9);
  expect(mesh.arrays().positions).toEqual(positions);
  expect(open.triangleCount).toBe(indices.length / 3 - 1);
});
