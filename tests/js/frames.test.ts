// Volumes of several frames, in one file or as a series of files.
import { gzipSync } from 'node:zlib';
import { expect, test } from 'vitest';
import { SurfaceTracker, type Vec3, Volume } from '../../pkg/index.js';
import { beating, SECONDS } from './beating.js';
import { failure, wrong } from './helpers.js';

/** 2 x 3 x 4 voxels in two frames, whose values are their indices. */
const DATA = Uint8Array.from({ length: 48 }, (_, index) => index);
const FRAME = 24;
const SPACING: Vec3 = [2, 3, 4];

const bytesOf = (lines: string[]) => new TextEncoder().encode(lines.join('\n'));
const joined = (...parts: Uint8Array[]) => new Uint8Array(Buffer.concat(parts));
const nifti = (volume: Volume) => volume.toNifti();
const view = (bytes: Uint8Array) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
/** Returns the seconds per frame as stored in a NIfTI file. */
const seconds = (volume: Volume) => view(nifti(volume)).getFloat32(76 + 4 * 4, true);

function expectCounted(volume: Volume, spacing = SPACING): void {
  expect([volume.dims, volume.frames, volume.spacing]).toEqual([[2, 3, 4], 2, spacing]);
  expect([...volume.intensities(0), ...volume.intensities(1)]).toEqual([...DATA]);
}

/** Header fields of a NIfTI-1 file of bytes. */
interface Header {
  dim?: number[];
  /** Spacing of the frames; the other axes have `SPACING`. */
  step?: number;
  units?: number;
  slope?: number;
  big?: boolean;
}

function niftiFile({ dim = [4, 2, 3, 4, 2], step = 0, units = 0, slope = 0, big = false }: Header = {}): Uint8Array {
  const bytes = new Uint8Array(352);
  const header = view(bytes);
  header.setInt32(0, 348, !big);
  for (const [i, n] of dim.entries()) header.setInt16(40 + 2 * i, n, !big);
  // One byte per voxel.
  header.setInt16(70, 2, !big);
  header.setInt16(72, 8, !big);
  for (const [i, length] of [1, ...SPACING, step].entries()) header.setFloat32(76 + 4 * i, length, !big);
  header.setFloat32(108, 352, !big);
  header.setFloat32(112, slope, !big);
  bytes[123] = units;
  bytes.set(bytesOf(['n+1']), 344);
  return joined(bytes, DATA);
}

const [MM, SECOND, MILLISECOND, MICROSECOND, HERTZ] = [2, 8, 16, 24, 32];
test.each([
  ['seconds', 0.04, { step: 0.04, units: MM + SECOND }],
  ['milliseconds', 0.04, { step: 40, units: MM + MILLISECOND }],
  ['microseconds, big-endian', 0.04, { step: 40_000, units: MM + MICROSECOND, big: true }],
  ['no unit', 0.04, { step: 0.04 }],
  ['no time', 0, {}],
  ['another kind of step', 0, { step: 25, units: MM + HERTZ }],
  ['axes of one after them', 0.04, { step: 0.04, dim: [7, 2, 3, 4, 2, 1, 1, 1] }],
])('NIfTI frames, %s', (_, time, header) => {
  const file = niftiFile(header);
  for (const bytes of [file, new Uint8Array(gzipSync(file))]) {
    const volume = Volume.parse(bytes);
    expectCounted(volume);
    expect(seconds(volume)).toBeCloseTo(time, 6);
  }
});

test('NIfTI frames with a slope, and a fourth axis that is not time', () => {
  expect(Volume.parse(niftiFile({ slope: 2 })).intensities(1)[0]).toBe(2 * FRAME);
  expect(Volume.parse(niftiFile({ slope: Number.NaN })).intensities(1)[0]).toBe(FRAME);
  const three = Volume.parse(niftiFile({ dim: [3, 2, 3, 8, 9] }));
  expect([three.dims, three.frames]).toEqual([[2, 3, 8], 1]);
});

test.each([
  ['vectors', 'dim[5]', { dim: [5, 2, 3, 4, 1, 2] }],
  ['another number of frames', 'voxel data', { dim: [4, 2, 3, 4, 0] }],
  ['NaN for a time', 'pixdim[4]', { step: Number.NaN }],
  ['fewer frames than there should be', 'voxel data', { dim: [4, 2, 3, 4, 3] }],
])('a NIfTI file of %s is refused, naming %s', (_, field, header) => {
  const error = failure(() => Volume.parse(niftiFile(header)));
  expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining(field)]);
});

function nrrdFile(...fields: string[]): Uint8Array {
  return joined(bytesOf(['NRRD0005', 'type: uint8', 'encoding: raw', ...fields, '', '']), DATA);
}

const LAST = ['dimension: 4', 'sizes: 2 3 4 2'];
const DIRECTIONS = 'space directions: (2,0,0) (0,3,0) (0,0,4) none';
const UNITS = 'units: "mm" "mm" "mm" "s"';
test.each([
  ['a list', 0, ['space: left-posterior-superior', DIRECTIONS, 'kinds: domain domain domain list']],
  ['times', 0, ['space: RAS', DIRECTIONS, 'kinds: space space space time']],
  ['of no kind', 0, ['space dimension: 3', DIRECTIONS]],
  ['of unknown kinds', 0, ['spacings: 2 3 4 NaN', 'kinds: ??? ??? ??? ???']],
  ['seconds', 0.04, ['spacings: 2 3 4 0.04', UNITS]],
  ['milliseconds', 0.04, ['spacings: 2 3 4 40', UNITS.replace('"s"', '"ms"')]],
  ['times without a unit', 0, ['spacings: 2 3 4 0.04']],
  ['times of 0', 0, ['spacings: 2 3 4 0', UNITS]],
  ['directions, and times beside them', 0.04, ['space: RAS', DIRECTIONS, 'spacings: NaN NaN NaN 0.04', UNITS]],
])('NRRD frames as the last axis, %s', (_, time, fields) => {
  const volume = Volume.parse(nrrdFile(...LAST, ...fields));
  expectCounted(volume);
  expect(seconds(volume)).toBeCloseTo(time, 6);
});

test('NRRD frames with unknown spacings, and frames of one slice', () => {
  expectCounted(Volume.parse(nrrdFile(...LAST, 'spacings: NaN NaN NaN NaN')), [1, 1, 1]);
  const sizes = ['dimension: 3', 'sizes: 4 6 2', 'space: RAS', 'space directions: (1,0,0) (0,1,0) none'];
  const flat = Volume.parse(nrrdFile(...sizes, 'kinds: domain domain list'));
  expect([flat.dims, flat.frames, flat.intensities(1)[0]]).toEqual([[4, 6, 1], 2, FRAME]);
});

/** Returns the same file with the axis of frames at another position, in header and voxels. */
function moved(at: number, ...fields: string[]): Uint8Array {
  const order = [0, 1, 2];
  order.splice(at, 0, 3);
  const reordered = (line: string) => {
    const [, name, text] = /^(.*?: )(.*)$/.exec(line) as RegExpExecArray;
    const words = (text as string).match(/\([^)]*\)|\S+/g) as string[];
    return `${name}${order.map((axis) => words[axis]).join(' ')}`;
  };
  const perAxis = (line: string) => /^(sizes|spacings|units|kinds|space directions)/.test(line);
  const lines = [...LAST, ...fields].map((line) => (perAxis(line) ? reordered(line) : line));
  const header = bytesOf(['NRRD0005', 'type: uint8', 'encoding: raw', ...lines, '', '']);
  const [sizes, steps] = [
    [2, 3, 4, 2],
    [1, 2, 6, 24],
  ];
  // Returns the index in `DATA` of a voxel of the file.
  const place = (index: number) => {
    let [rest, sum] = [index, 0];
    for (const axis of order) {
      sum += (rest % (sizes[axis] as number)) * (steps[axis] as number);
      rest = Math.floor(rest / (sizes[axis] as number));
    }
    return sum;
  };
  return joined(
    header,
    DATA.map((_, index) => place(index)),
  );
}

const ROWS = '(2,0,0) (0,3,0) (0,0,4)';
const TIMED = 'space directions: (2,0,0,0) (0,3,0,0) (0,0,4,0) (0,0,0,0.04)';
test.each([
  ['by its kind', 0, ['spacings: 2 3 4 NaN', 'kinds: domain domain domain list']],
  ['as time', 0.04, ['spacings: 2 3 4 0.04', 'kinds: space space space time']],
  ['by its unit', 0.04, ['spacings: 2 3 4 40', UNITS.replace('"s"', '"ms"')]],
  ['by its unknown spacing', 0, ['spacings: 2 3 4 NaN']],
  ['by directions', 0, ['space: RAS', DIRECTIONS]],
  ['by both', 0, ['space: left-posterior-superior', DIRECTIONS, 'kinds: domain domain domain list']],
  ['by a direction of zeros', 0, ['space: RAS', `space directions: ${ROWS} (0,0,0)`]],
  ['by a direction of nothing', 0, ['space: RAS', `space directions: ${ROWS} (nan,nan,nan)`]],
  ['in a world with time', 0.04, ['space: right-anterior-superior-time', TIMED, 'space origin: (0,0,0,9)']],
  ['in a scanner with time', 0.04, ['space: scanner-xyz-time', TIMED, 'kinds: space space space time']],
  ['in a world of four dimensions', 0, ['space dimension: 4', TIMED, 'kinds: domain domain domain domain']],
])('NRRD frames as any axis, %s', (_, time, fields) => {
  for (const at of [0, 1, 2, 3]) {
    const volume = Volume.parse(moved(at, ...fields));
    expectCounted(volume);
    expect(volume.frameSeconds).toBeCloseTo(time, 9);
  }
});

test('NRRD frames of one slice, without directions', () => {
  const flat = Volume.parse(nrrdFile('dimension: 3', 'sizes: 4 6 2', 'kinds: domain domain time'));
  expect([flat.dims, flat.frames, flat.intensities(1)[0]]).toEqual([[4, 6, 1], 2, FRAME]);
});

/** Components of one voxel are refused, and never read as frames. */
test.each([
  ['of vectors', 'kinds', [...LAST, 'space: RAS', DIRECTIONS, 'kinds: domain domain domain vector']],
  ['of colours', 'kinds', [...LAST, 'space: RAS', DIRECTIONS, 'kinds: domain domain domain RGB-color']],
  ['of vectors, first', 'more than one number', [...LAST, 'kinds: vector domain domain domain']],
  ['of colours, first', 'more than one number', [...LAST, 'kinds: 3-color domain domain domain']],
  ['of time beside a list', 'kinds', [...LAST, 'kinds: list domain domain time']],
  ['in space and time', 'spacedirections', [...LAST, 'space: RAST', TIMED.replace('(2,0,0,0)', '(2,0,0,1)')]],
  ['of a fourth direction', 'spacedirections', [...LAST, 'space: RAS', DIRECTIONS.replace('none', '(1,1,1)')]],
  ['like another', 'kinds', [...LAST, 'spacings: NaN NaN 3 4']],
  ['beside a fifth', 'dimension', ['dimension: 5', 'sizes: 2 3 4 2 1']],
])('a NRRD axis %s is refused, naming %s', (_, field, fields) => {
  const error = failure(() => Volume.parse(nrrdFile(...fields)));
  expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining(field)]);
});

test('MetaImage frames', () => {
  const header = [
    ...['ObjectType = Image', 'NDims = 4', 'DimSize = 2 3 4 2', 'ElementSpacing = 2 3 4 0.04', 'Offset = 5 6 7 0'],
    ...['TransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1', 'ElementType = MET_UCHAR', 'ElementDataFile = LOCAL', ''],
  ];
  const volume = Volume.parse(joined(bytesOf(header), DATA));
  expectCounted(volume);
  expect([...volume.affine.slice(12, 15)]).toEqual([5, 6, 7]);
});

/** Returns a file for each frame. */
function series(volume: Volume): Uint8Array[] {
  const { dims, affine } = volume;
  return Array.from({ length: volume.frames }, (_, frame) =>
    nifti(new Volume({ data: volume.intensities(frame), dims, affine })),
  );
}

test('a series of files gives the frames of one volume', () => {
  const whole = Volume.parse(niftiFile());
  const volume = Volume.fromFrames(
    series(whole).map((bytes) => Volume.parse(bytes)),
    { frameSeconds: 0.04 },
  );
  expectCounted(volume);
  expect([...volume.affine]).toEqual([...whole.affine]);
  expect(seconds(volume)).toBeCloseTo(0.04, 6);
  // All frames of a file with several are taken.
  const longer = Volume.fromFrames([volume, Volume.parse(series(whole)[0] as Uint8Array)]);
  expect([longer.frames, longer.intensities(1)[0], longer.intensities(2)[0]]).toEqual([3, FRAME, 0]);
  expect(seconds(longer)).toBeCloseTo(0.04, 6);
});

const still = (more: object = {}) =>
  new Volume({ data: DATA.slice(0, FRAME), dims: [2, 3, 4], spacing: SPACING, ...more });

test('frames keep their intensities, whatever type and slope each has', () => {
  const volume = Volume.fromFrames([
    still({ data: new Int16Array(FRAME).fill(-5) }),
    still({ data: new Uint16Array(FRAME).fill(65535) }),
    still({ slope: 2, intercept: 1 }),
  ]);
  expect([0, 1, 2].map((frame) => volume.intensities(frame)[FRAME - 1])).toEqual([-5, 65535, 2 * (FRAME - 1) + 1]);
  expect(volume.range).toEqual([-5, 65535]);
});

test('grids that differ by header rounding are the same', () => {
  expect(Volume.fromFrames([still(), still({ origin: [1e-6, 0, 0] })]).frames).toBe(2);
});

test.each([
  ['of another size', 'frame 1', () => Volume.fromFrames([still(), still({ dims: [3, 2, 4] })])],
  ['of another spacing', 'frame 2', () => Volume.fromFrames([still(), still(), still({ spacing: [2, 3, 5] })])],
  ['elsewhere', 'frame 1', () => Volume.fromFrames([still(), still({ origin: [0.1, 0, 0] })])],
  ['in another space', 'frame 1', () => Volume.fromFrames([still(), still({ space: 'LPS' })])],
  ['that is none', 'frames[0]', () => Volume.fromFrames([wrong(DATA)])],
  ['without time', 'frameSeconds', () => Volume.fromFrames([still()], { frameSeconds: 0 })],
  ['by no list', 'frames', () => Volume.fromFrames(wrong(still()))],
  ['with a misspelled option', 'seconds', () => Volume.fromFrames([still()], wrong({ seconds: 1 }))],
])('a frame %s is refused, naming %s', (_, named, work) => {
  const error = failure(work);
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining(named)]);
});

test('a sequence is tracked alike from memory, one file, and a series of files', () => {
  const given = beating({ frames: 2 });
  const file = Volume.parse(nifti(given));
  const files = Volume.fromFrames(
    series(given).map((bytes) => Volume.parse(bytes)),
    { frameSeconds: SECONDS },
  );
  expect(seconds(file)).toBeCloseTo(SECONDS, 6);
  const surfaces = [given, file, files].map((volume) => {
    const tracker = new SurfaceTracker({ volume });
    tracker.step(4);
    const bytes = Buffer.from(tracker.toGlb());
    tracker.free();
    return bytes;
  });
  for (const bytes of surfaces) expect(bytes.equals(surfaces[0] as Buffer)).toBe(true);
});
