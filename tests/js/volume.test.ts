import { gzipSync } from 'node:zlib';
import { expect, test } from 'vitest';
import { type Icosphere, Mesh, type Vec3, Volume, type VoxelArray } from '../../pkg/index.js';
import { ball, failure, wrong } from './helpers.js';

const ELEMENTS = [
  ...[Uint8Array, Int8Array, Uint16Array, Int16Array],
  ...[Uint32Array, Int32Array, Float32Array, Float64Array],
];

/** Returns 2 x 3 x 4 voxels whose values are their indices. */
const counted = () => Uint8Array.from({ length: 24 }, (_, index) => index);
const grid = (more: object = {}) => new Volume({ data: counted(), dims: [2, 3, 4], ...more });

test.each(ELEMENTS)('%o voxels keep their values', (Element) => {
  const data: VoxelArray = Element.from([1, 2, 3, 4, 5, 6, 7, 8]);
  const volume = new Volume({ data, dims: [2, 2, 2], slope: 2, intercept: -1 });
  expect([...volume.intensities()]).toEqual([1, 3, 5, 7, 9, 11, 13, 15]);
  expect(volume.range).toEqual([1, 15]);
});

test('the voxels are copied', () => {
  const data = counted();
  const volume = new Volume({ data, dims: [2, 3, 4] });
  data.fill(99);
  expect(volume.range).toEqual([0, 23]);
});

test('position in the world: spacing and origin, or an affine', () => {
  const placed = grid({ spacing: [1, 2, 3], origin: [10, 20, 30] });
  expect([...placed.affine]).toEqual([1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0, 10, 20, 30, 1]);
  expect(placed.spacing).toEqual([1, 2, 3]);
  expect(placed.sample([11, 22, 36])).toBe(1 + 2 * 1 + 6 * 2);
  const turned = grid({ affine: [0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 5, 6, 7, 1] });
  expect(turned.spacing).toEqual([2, 3, 4]);
  expect(turned.sample([5 - 3 * 2, 6 + 2, 7 + 4 * 3])).toBe(1 + 2 * 2 + 6 * 3);
});

test('dimensions, spacing, range and other properties', () => {
  const volume = grid({ space: 'LPS' });
  expect(volume.dims).toEqual([2, 3, 4]);
  expect(volume.frames).toBe(1);
  expect(volume.frameSeconds).toBe(0);
  expect(volume.space).toBe('LPS');
  expect(grid().space).toBe('RAS');
});

test('slices are row-major', () => {
  expect([...grid().slice(0, 1)]).toEqual([1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23]);
  expect([...grid().slice(1, 2)]).toEqual([4, 5, 10, 11, 16, 17, 22, 23]);
  expect([...grid().slice(2, 3)]).toEqual([18, 19, 20, 21, 22, 23]);
});

test('the histogram counts every voxel once', () => {
  const counts = ball(9, 3).histogram({ bins: 16 });
  expect(counts).toHaveLength(16);
  expect(counts.reduce((sum, count) => sum + count)).toBe(9 ** 3);
});

test('former calls, with arguments of their own, do the same as those with options', () => {
  const volume = grid();
  expect(volume.histogram(4, 0)).toEqual(volume.histogram({ bins: 4 }));
  expect(() => volume.histogram(4, 1)).toThrow(/frame/);
  const to: { dims: Vec3 } = { dims: [5, 4, 3] };
  expect(volume.resample(to, 'nearest').intensities()).toEqual(
    volume.resample({ ...to, interpolation: 'nearest' }).intensities(),
  );
  expect(volume.resample(to, 'nearest').intensities()).not.toEqual(volume.resample(to).intensities());
  const options: Icosphere = { center: [1, 2, 3], radius: 4, maxEdge: 2 };
  expect(Mesh.icosphere(options.center, 4, 2).arrays()).toEqual(Mesh.icosphere(options).arrays());
});

test('outside, the border is replicated', () => {
  expect(grid().sample([-5, -5, -5])).toBe(0);
  expect(grid().sample([9, 9, 9])).toBe(23);
});

test('frames', () => {
  const volume = Volume.fromFrames([grid(), grid({ intercept: 100 })], { frameSeconds: 0.5 });
  expect([volume.frames, volume.frameSeconds]).toEqual([2, 0.5]);
  expect(volume.sample([1, 0, 0], 1)).toBe(101);
  expect(volume.range).toEqual([0, 123]);
  const four = new Volume({ data: counted(), dims: [2, 3, 2, 2], frameSeconds: 1 });
  expect([four.frames, four.frameSeconds]).toEqual([2, 1]);
  expect(four.intensities(1)[0]).toBe(12);
  four.free();
  expect(failure(() => four.frameSeconds).code).toBe('freed');
});

test('all frames of 4D volumes are taken, in order', () => {
  const pair = (first: number, seconds: number) =>
    new Volume({ data: Uint8Array.of(first, first + 1), dims: [1, 1, 1, 2], frameSeconds: seconds });
  const still = new Volume({ data: Uint8Array.of(9), dims: [1, 1, 1] });
  const joined = Volume.fromFrames([pair(1, 0.04), still, pair(3, 0.5)]);
  expect(Array.from({ length: joined.frames }, (_, frame) => joined.intensities(frame)[0])).toEqual([1, 2, 9, 3, 4]);
  expect(joined.frameSeconds).toBe(0.04);
  expect(Volume.fromFrames([still, pair(3, 0.5)]).frameSeconds).toBe(0);
});

test('slices between thick ones follow motion from one to the next', () => {
  // A disc of radius 8 that is 6 pixels further along x in the next slice.
  const inside = (x: number, y: number, z: number) => Math.hypot(x - 14 - 6 * z, y - 16) < 8;
  const data = Uint8Array.from({ length: 40 * 32 * 2 }, (_, i) =>
    inside(i % 40, Math.floor(i / 40) % 32, Math.floor(i / 1280)) ? 200 : 20,
  );
  const thick = new Volume({ data, dims: [40, 32, 2], spacing: [1, 1, 2], origin: [5, 0, 0] });
  const flow = thick.enrichSlices({ factor: 2 });
  expect([flow.dims, flow.spacing, [...flow.affine.slice(12, 15)]]).toEqual([
    [40, 32, 3],
    [1, 1, 1],
    [5, 0, 0],
  ]);
  expect(flow.slice(2, 0)).toEqual(thick.slice(2, 0));
  expect(flow.slice(2, 2)).toEqual(thick.slice(2, 1));
  const wrongOnes = (volume: Volume) =>
    [...volume.slice(2, 1)].filter(
      (value, i) => Math.abs(value - (inside(i % 40, Math.floor(i / 40), 0.5) ? 200 : 20)) > 60,
    ).length;
  expect(wrongOnes(flow)).toBeLessThan(0.8 * wrongOnes(thick.enrichSlices({ factor: 2, method: 'linear' })));
  expect(thick.enrichSlices({ factor: 1 }).dims).toEqual(thick.dims);
  expect(thick.enrichSlices().dims).toEqual(thick.dims);
});

test('slices are interpolated with pauses, to the same bits, and that is aborted', async () => {
  const data = Uint8Array.from({ length: 64 * 64 * 3 * 2 }, (_, i) => (i * i) % 251);
  const thick = new Volume({ data, dims: [64, 64, 3, 2], spacing: [1, 1, 3] });
  let turns = 0;
  const count = () => {
    turns += 1;
    immediate = setImmediate(count);
  };
  let immediate = setImmediate(count);
  const short = { budgetMs: 1e-6 };
  const found = await thick.inSlices(short).enrichSlices();
  clearImmediate(immediate);
  expect(turns).toBeGreaterThan(5);
  expect([found.dims, found.frames, found.toNifti()]).toEqual([[64, 64, 5], 2, thick.enrichSlices().toNifti()]);
  const abort = new AbortController();
  const work = thick.inSlices({ ...short, signal: abort.signal }).enrichSlices({ factor: 2 });
  abort.abort('enough');
  await expect(work).rejects.toBe('enough');
  await expect(thick.inSlices().enrichSlices(wrong({ factor: 0 }))).rejects.toThrow('factor');
});

test('binned voxels are means of blocks, in the right position, in all frames', () => {
  const placed = { spacing: [1, 2, 3], origin: [10, 20, 30], slope: 2, intercept: -1, frameSeconds: 0.5, space: 'LPS' };
  const volume = grid({ dims: [3, 2, 2, 2], ...placed });
  const binned = volume.binned([2, 1, 2]);
  // The third voxel along x is left over.
  expect([binned.dims, binned.frames, binned.space]).toEqual([[1, 2, 1], 2, 'LPS']);
  expect(binned.spacing).toEqual([2, 2, 6]);
  expect([...binned.affine.slice(12, 15)]).toEqual([10.5, 20, 31.5]);
  // Means of 0, 1, 6, 7 and so on, stored as integers.
  const stored = [...binned.intensities(0), ...binned.intensities(1)].map((value) => (value + 1) / 2);
  for (const [i, mean] of [3.5, 6.5, 15.5, 18.5].entries())
    expect(Math.abs((stored[i] as number) - mean)).toBeLessThan(0.51);
  const exact = new Volume({ data: Float32Array.from(counted()), dims: [3, 2, 2, 2] }).binned([2, 1, 2]);
  expect([...exact.intensities(0), ...exact.intensities(1)]).toEqual([3.5, 6.5, 15.5, 18.5]);
});

test('binning by 1 changes nothing, by the size gives one voxel, and the volume is unchanged', () => {
  const volume = grid();
  const same = volume.binned([1, 1, 1]);
  expect([...same.intensities()]).toEqual([...counted()]);
  expect([...same.affine]).toEqual([...volume.affine]);
  expect(volume.binned(new Uint8Array([2, 3, 4]) as unknown as Vec3).dims).toEqual([1, 1, 1]);
  volume.free();
  expect(same.range).toEqual([0, 23]);
  expect(failure(() => volume.binned([1, 1, 1])).code).toBe('freed');
});

test('the pyramid starts with the volume itself and shrinks', () => {
  const levels = ball(30, 10).pyramid(3);
  expect(levels.map((level) => level.dims)).toEqual([
    [30, 30, 30],
    [17, 17, 17],
    [9, 9, 9],
  ]);
  const half = ball(16, 5).pyramid(2, { factor: 2 })[1] as Volume;
  expect(half.dims).toEqual([8, 8, 8]);
  expect(half.sample([0, 0, 0])).toBeGreaterThan(190);
  expect(half.sample([7, 7, 7])).toBe(0);
});

test('written as NIfTI and read back, also gzipped', () => {
  const volume = grid({ spacing: [1, 2, 3], origin: [-4, 5, 6], slope: 2, intercept: 1 });
  const bytes = volume.toNifti();
  for (const file of [bytes, new Uint8Array(gzipSync(bytes))]) {
    const back = Volume.parse(file);
    expect(back.dims).toEqual(volume.dims);
    expect([...back.affine]).toEqual([...volume.affine]);
    expect([...back.intensities()]).toEqual([...volume.intensities()]);
  }
});

test('a detached header takes its payload as data', () => {
  const header = [
    ...['ObjectType = Image', 'NDims = 3', 'DimSize = 2 3 4', 'ElementSpacing = 1 2 3'],
    ...['ElementType = MET_UCHAR', 'ElementDataFile = volume.raw', ''],
  ];
  const bytes = new TextEncoder().encode(header.join('\n'));
  const volume = Volume.parse(bytes, { data: counted() });
  expect(volume.dims).toEqual([2, 3, 4]);
  expect([...volume.intensities()]).toEqual([...counted()]);
  expect(failure(() => Volume.parse(bytes)).code).toBe('bad-file');
});

const DIMS: Vec3 = [2, 3, 4];
const REFUSED: [string, string, () => unknown][] = [
  ['no init', 'init', () => new Volume(wrong(null))],
  ['no data', 'data', () => new Volume(wrong({ dims: DIMS }))],
  ['data of another kind', 'data', () => new Volume({ data: wrong([1, 2]), dims: DIMS })],
  ['data of 64-bit integers', 'data', () => new Volume({ data: wrong(new BigInt64Array(24)), dims: DIMS })],
  ['data of the wrong length', 'data', () => grid({ data: new Uint8Array(23) })],
  ['no dims', 'dims', () => new Volume(wrong({ data: counted() }))],
  ['two dims', 'dims', () => grid({ dims: [4, 6] })],
  ['an empty axis', 'dims', () => grid({ dims: [24, 0, 1] })],
  ['a broken dim', 'dims', () => grid({ dims: [2.5, 3, 4] })],
  ['dims beyond counting', 'd', () => grid({ dims: [4e9, 4e9, 4e9] })],
  ['a short affine', 'affine', () => grid({ affine: [1, 0, 0, 0] })],
  ['a flat affine', 'affine', () => grid({ affine: [1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] })],
  ['an affine with perspective', 'affine', () => grid({ affine: [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] })],
  ['NaN in the affine', 'affine', () => grid({ affine: new Float64Array(16).fill(Number.NaN) })],
  ['affine and spacing', 'affine', () => grid({ affine: grid().affine, spacing: [1, 1, 1] })],
  ['no spacing', 'spacing', () => grid({ spacing: [1, 0, 1] })],
  ['an endless origin', 'origin', () => grid({ origin: [1, Number.POSITIVE_INFINITY, 1] })],
  ['slope 0', 'slope', () => grid({ slope: 0 })],
  ['a slope in words', 'slope', () => grid({ slope: 'steep' })],
  ['another space', 'space', () => grid({ space: 'LAS' })],
  ['a misspelled name', 'spacings', () => grid({ spacings: [1, 1, 1] })],
  ['a frame too far', 'frame', () => grid().intensities(1)],
  ['an axis too far', 'axis', () => grid().slice(wrong(3), 0)],
  ['a slice too far', 'index', () => grid().slice(2, 4)],
  ['no bins', 'bins', () => grid().histogram({ bins: 0 })],
  ['bins in words', 'options', () => grid().histogram(wrong('ten'))],
  ['a misspelled option', 'bin', () => grid().histogram(wrong({ bin: 3 }))],
  ['half a point', 'world', () => grid().sample(wrong([1, 2]))],
  ['NaN for a point', 'world', () => grid().sample([1, 2, Number.NaN])],
  ['a growing pyramid', 'factor', () => grid().pyramid(2, { factor: 0.5 })],
  ['too many levels', 'levels', () => grid().pyramid(50)],
  ['blocks of nothing', 'factors', () => grid().binned([1, 0, 1])],
  ['blocks larger than the volume', 'factors', () => grid().binned([3, 1, 1])],
  ['blocks of too many', 'factors', () => grid({ dims: [24, 1, 1] }).binned([17, 1, 1])],
  ['blocks of parts', 'factors', () => grid().binned([1.5, 1, 1])],
  ['blocks of NaN', 'factors', () => grid().binned([Number.NaN, 1, 1])],
  ['one number for blocks', 'factors', () => grid().binned(wrong(2))],
  ['two numbers for blocks', 'factors', () => grid().binned(wrong([2, 2]))],
  ['no slices for one', 'factor', () => grid().enrichSlices({ factor: 0 })],
  ['too many slices for one', 'factor', () => grid().enrichSlices({ factor: 17 })],
  [
    'a slice between one',
    'factor',
    () => new Volume({ data: counted(), dims: [4, 3, 1, 2] }).enrichSlices({ factor: 2 }),
  ],
  ['slices by magic', 'method', () => grid().enrichSlices({ method: wrong('magic') })],
  ['no frames', 'frames', () => Volume.fromFrames([])],
  ['frames of two sizes', 'frames', () => Volume.fromFrames([grid(), ball(4, 1)])],
  ['something else as a frame', 'frames[1]', () => Volume.fromFrames([grid(), wrong({})])],
  ['a file as text', 'bytes', () => Volume.parse(wrong('volume.nii'))],
];

test.each(REFUSED)('%s is refused, naming %s', (_, parameter, work) => {
  const error = failure(work);
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(parameter);
});

test('invalid files are refused', () => {
  const whole = grid().toNifti();
  const broken = [new Uint8Array(), new TextEncoder().encode('not a volume'), whole.slice(0, 200), whole.slice(0, -1)];
  for (const bytes of broken) expect(failure(() => Volume.parse(bytes)).code).toBe('bad-file');
});

test('more voxels than fit into memory are refused', () => {
  // Virtual memory only: the pages are never touched, because the size is refused before.
  const data = new Uint8Array(4_200_000_000);
  expect(failure(() => new Volume({ data, dims: [4_200_000_000, 1, 1] })).code).toBe('too-large');
});

test('use after free is refused', () => {
  const volume = grid();
  volume.free();
  volume.free();
  const uses = [() => volume.dims, () => volume.sample([0, 0, 0]), () => Volume.fromFrames([volume])];
  for (const use of uses) expect(failure(use).code).toBe('freed');
  const scoped = grid();
  scoped[Symbol.dispose]();
  expect(failure(() => scoped.frames).code).toBe('freed');
});
