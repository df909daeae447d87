import { expect, test } from 'vitest';
import { type Vec3, Volume, type VolumeInit, type VoxelArray } from '../../pkg/index.js';
import { ball, failure, wrong } from './helpers.js';

const DIMS: Vec3 = [3, 2, 2];
/** Returns a label map of 3 x 2 x 2 voxels with the labels 1, 2 and 7. */
const map = (more: object = {}) =>
  new Volume({ data: Uint16Array.of(0, 1, 1, 0, 2, 2, 0, 0, 2, 7, 7, 7), dims: DIMS, ...more });
const FORMATS = ['nifti', 'nrrd', 'mha'] as const;

test('labels ascend, with their numbers of voxels, without the background', () => {
  expect(map().labels()).toEqual([
    { value: 1, voxels: 2 },
    { value: 2, voxels: 3 },
    { value: 7, voxels: 3 },
  ]);
  expect(map({ slope: -1, intercept: 7 }).labels()).toEqual([
    { value: 5, voxels: 3 },
    { value: 6, voxels: 2 },
    { value: 7, voxels: 4 },
  ]);
  const two = Volume.fromFrames([map(), map({ data: new Uint16Array(12) })]);
  expect(two.labels(1)).toEqual([]);
  expect(two.label(7).frames).toBe(2);
});

test('masks of labels and of intensities have the grid of the volume', () => {
  const placed = { spacing: [1, 2, 3], origin: [10, 20, 30], space: 'LPS' };
  const volume = map(placed);
  for (const mask of [volume.label([7, 2]), volume.threshold(2, Number.POSITIVE_INFINITY)]) {
    expect([...mask.intensities()]).toEqual([0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 1, 1]);
    expect([mask.dims, mask.space, [...mask.affine]]).toEqual([DIMS, 'LPS', [...volume.affine]]);
  }
  expect([...volume.label(1).intensities()]).toEqual([0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
  expect([...ball(5, 1).threshold(-1, -0.5).range]).toEqual([0, 0]);
});

test('the Dice coefficient of masks and of labels', () => {
  const other = map({ data: Float32Array.of(0, 1, 0, 0, 0.5, 0, 0, 9, 0, 0, 0, 0) });
  expect(map().dice(other)).toBe((2 * 2) / (8 + 3));
  const moved = map({ data: Int8Array.of(0, 1, 2, 0, 2, 2, 0, 0, 0, 7, 7, 7) });
  expect(map().dice(moved, { label: 2 })).toBe((2 * 2) / (3 + 3));
  expect(map().dice(moved, { label: 7 })).toBe(1);
  expect(map().dice(moved, { label: 3 })).toBe(1);
});

test('a crop keeps positions, type and frames', () => {
  const volume = new Volume({
    data: Int16Array.from({ length: 24 }, (_, i) => i - 9),
    dims: [3, 2, 2, 2],
    spacing: [1, 2, 3],
    origin: [10, 20, 30],
    slope: 0.5,
    frameSeconds: 0.1,
  });
  const part = volume.crop({ min: [1, 0, 1], max: [3, 2, 2] });
  expect([part.dims, part.frames, part.frameSeconds]).toEqual([[2, 2, 1], 2, 0.1]);
  expect([...part.affine.slice(12, 15)]).toEqual([11, 20, 33]);
  expect([...part.intensities(1)]).toEqual([10, 11, 13, 14].map((value) => value / 2));
  const second = volume.frame(1);
  expect([second.frames, second.frameSeconds, second.dims]).toEqual([1, 0, DIMS]);
  expect(second.intensities()).toEqual(volume.intensities(1));
});

test('resampled to dimensions, to a spacing, and like another volume', () => {
  const ramp = new Volume({ data: Float32Array.of(0, 2, 4, 6), dims: [4, 1, 1], spacing: [2, 1, 1] });
  const fine = ramp.resample({ dims: [8, 1, 1] });
  expect([...fine.intensities()]).toEqual([0, 0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6]);
  expect([fine.spacing, [...fine.affine.slice(12, 15)]]).toEqual([
    [1, 1, 1],
    [-0.5, 0, 0],
  ]);
  expect([...ramp.resample({ dims: [8, 1, 1], interpolation: 'nearest' }).intensities()]).toEqual([
    0, 0, 2, 2, 4, 4, 6, 6,
  ]);
  expect(ramp.resample({ spacing: [1.1, 1, 1] }).dims).toEqual([7, 1, 1]);
  const like = new Volume({ data: new Uint8Array(5), dims: [5, 1, 1], spacing: [2, 1, 1], origin: [-5, 0, 0] });
  const there = like.resample({ like: ramp });
  expect(there.affine).toEqual(ramp.affine);
  const moved = ramp.resample({ like });
  expect([...moved.intensities()]).toEqual([0, 0, 0, 1, 3]);
  const lps = new Volume({
    data: new Uint8Array(4),
    dims: [4, 1, 1],
    spacing: [2, 1, 1],
    origin: [-6, 0, 0],
    space: 'LPS',
  });
  expect([...ramp.resample({ like: lps }).intensities()]).toEqual([6, 4, 2, 0]);
});

test('voxels are written in place, and objects made before keep theirs', () => {
  const volume = map();
  const before = volume.pyramid(1)[0] as Volume;
  volume.write({ min: [1, 1, 0], dims: [2, 1, 2], data: Uint16Array.of(9, 0, 0, 1) });
  expect([...volume.intensities()]).toEqual([0, 1, 1, 0, 9, 0, 0, 0, 2, 7, 0, 1]);
  expect(volume.range).toEqual([0, 9]);
  expect(volume.labels().map(({ value }) => value)).toEqual([1, 2, 7, 9]);
  expect([...before.intensities()]).toEqual([...map().intensities()]);
  volume.write({ min: [0, 0, 0], dims: DIMS, data: new Uint16Array(12).fill(3) });
  expect(volume.range).toEqual([3, 3]);
  const four = Volume.fromFrames([map(), map()]);
  four.write({ min: [0, 0, 0], dims: [1, 1, 1], data: Uint16Array.of(5) }, 1);
  expect([four.intensities(0)[0], four.intensities(1)[0]]).toEqual([0, 5]);
});

const ELEMENTS = [
  ...[Uint8Array, Int8Array, Uint16Array, Int16Array],
  ...[Uint32Array, Int32Array, Float32Array, Float64Array],
];

test.each(ELEMENTS)('%o voxels come back from every format, compressed or not', (Element) => {
  const data: VoxelArray = Element.from(Array.from({ length: 24 }, (_, i) => 3 * i + 1));
  const affine = [0.8, 0.6, 0, 0, -1.2, 1.6, 0, 0, 0, 0, 3, 0, -7, 8, 9, 1];
  for (const space of ['RAS', 'LPS'] as const) {
    const volume = new Volume({ data, dims: [3, 2, 2, 2], affine, frameSeconds: 0.5, space });
    for (const format of FORMATS) {
      for (const gzip of [false, true]) {
        const back = Volume.parse(volume.toBytes(format, { gzip }));
        expect([back.dims, back.frames, back.range]).toEqual([volume.dims, 2, volume.range]);
        for (const frame of [0, 1]) expect(back.intensities(frame)).toEqual(volume.intensities(frame));
        const flips = back.space === space ? 1 : -1;
        for (const [i, value] of back.affine.entries()) {
          expect(value * (i % 4 < 2 ? flips : 1)).toBeCloseTo(affine[i] as number, 5);
        }
        if (format !== 'mha') expect(back.frameSeconds).toBeCloseTo(0.5);
      }
    }
  }
});

test('files say what they are', () => {
  const volume = map({ slope: 0.5 });
  const start = (bytes: Uint8Array) => new TextDecoder('latin1').decode(bytes.slice(0, 20));
  expect(start(volume.toBytes('nrrd'))).toContain('NRRD0004');
  expect(start(volume.toBytes('mha'))).toContain('ObjectType = Image');
  expect(volume.toBytes('nifti')).toEqual(volume.toNifti());
  expect([...volume.toBytes('nifti', { gzip: true }).slice(0, 2)]).toEqual([0x1f, 0x8b]);
  for (const format of FORMATS) {
    expect([...Volume.parse(volume.toBytes(format)).intensities()]).toEqual([...volume.intensities()]);
  }
});

const FLOATS: Partial<VolumeInit> = { data: new Float32Array(12).fill(1) };
const REFUSED: [string, string, () => unknown][] = [
  ['labels of floats', 'integer type', () => map(FLOATS).labels()],
  ['labels between integers', 'integer intensities', () => map({ slope: 0.5 }).labels()],
  [
    'labels of an image',
    '65536',
    () => new Volume({ data: Uint32Array.from({ length: 65538 }, (_, i) => i), dims: [65538, 1, 1] }).labels(),
  ],
  ['labels of a frame too far', 'frame', () => map().labels(1)],
  ['a label that is not there', 'value: must be a label of the volume (1, 2, 7), got 3', () => map().label([1, 3])],
  ['the background as a label', 'value', () => map().label(0)],
  ['no label', 'value', () => map().label([])],
  ['a label in words', 'value', () => map().label(wrong('1'))],
  ['NaN as a threshold', 'low', () => map().threshold(Number.NaN, 1)],
  ['thresholds the wrong way round', 'low', () => map().threshold(2, 1)],
  ['a threshold in words', 'high', () => map().threshold(2, wrong('3'))],
  ['the overlap with nothing', 'other', () => map().dice(wrong(undefined))],
  ['the overlap with another grid', 'position', () => map().dice(map({ origin: [0.1, 0, 0] }))],
  ['the overlap with another size', 'dimensions', () => map().dice(map({ dims: [2, 3, 2] }))],
  ['the overlap in another space', 'space', () => map().dice(map({ space: 'LPS' }))],
  ['the overlap of the background', 'label', () => map().dice(map(), { label: 0 })],
  ['the overlap of a label of floats', 'integer type', () => map().dice(map(FLOATS), { label: 1 })],
  ['a box beyond the volume', 'box', () => map().crop({ min: [0, 0, 0], max: [3, 2, 3] })],
  ['an empty box', 'box', () => map().crop({ min: [1, 0, 0], max: [1, 2, 2] })],
  ['a box of parts', 'box.max', () => map().crop({ min: [0, 0, 0], max: [1.5, 2, 2] })],
  ['a box without an end', 'box.max', () => map().crop(wrong({ min: [0, 0, 0] }))],
  ['a misspelled box', 'size', () => map().crop(wrong({ min: [0, 0, 0], size: [1, 1, 1] }))],
  ['no grid', 'options', () => map().resample(wrong({}))],
  ['two grids', 'options', () => map().resample({ dims: DIMS, spacing: [1, 1, 1] })],
  ['dims of 0', 'dims', () => map().resample({ dims: [3, 0, 2] })],
  ['a spacing of 0', 'spacing', () => map().resample({ spacing: [1, 0, 1] })],
  ['a grid like nothing', 'like', () => map().resample({ like: wrong({}) })],
  ['interpolation by magic', 'interpolation', () => map().resample({ dims: DIMS, interpolation: wrong('magic') })],
  ['a frame too far', 'frame', () => map().frame(1)],
  ['another format', 'format', () => map().toBytes(wrong('nii'))],
  ['compression by number', 'gzip', () => map().toBytes('nrrd', { gzip: wrong(9) })],
];

test.each(REFUSED)('%s is refused, naming %s', (_, parameter, work) => {
  const error = failure(work);
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(parameter);
});

test('a grid larger than memory is refused', () => {
  for (const grid of [{ dims: [4e9, 4e9, 4e9] as Vec3 }, { spacing: [1e-12, 1e-12, 1e-12] as Vec3 }]) {
    expect(failure(() => map().resample(grid)).code).toBe('too-large');
  }
});

const detached = new Uint16Array(1);
structuredClone(detached.buffer, { transfer: [detached.buffer] });

const one = { min: [2, 1, 1] as Vec3, dims: [1, 1, 1] as Vec3 };
const NOT_WRITTEN: [string, string, Parameters<Volume['write']>][] = [
  ['a region beyond the volume', 'region', [{ ...one, dims: [2, 1, 1], data: new Uint16Array(2) }]],
  ['an empty region', 'region', [{ ...one, dims: [0, 1, 1], data: new Uint16Array(0) }]],
  ['a region of parts', 'region.min', [{ ...one, min: [0.5, 0, 0], data: Uint16Array.of(1) }]],
  ['data of another type', 'data: must be unsigned 16-bit', [{ ...one, data: Int16Array.of(1) }]],
  ['data of another length', 'data: must have 1 voxels', [{ ...one, data: Uint16Array.of(1, 2) }]],
  ['detached data', 'region.data', [{ ...one, data: detached }]],
  ['data in a list', 'region.data', [{ ...one, data: wrong([1]) }]],
  ['a frame too far', 'frame', [{ ...one, data: Uint16Array.of(1) }, 1]],
];

test.each(NOT_WRITTEN)('%s is not written, naming %s', (_, parameter, args) => {
  const volume = map();
  const error = failure(() => volume.write(...args));
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(parameter);
  expect([...volume.intensities()]).toEqual([...map().intensities()]);
});
