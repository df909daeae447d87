// Files of volumes: several files, spaces that files do not tell, and units of length.
import { afterAll, expect, test } from 'vitest';
import initFiles, { parseVolume } from '../../pkg/import/index.js';
import { Volume } from '../../pkg/index.js';
import initWorker, * as worker from '../../pkg/worker.js';
import { failure, rejection, wrong } from './helpers.js';

await initFiles();
afterAll(() => worker.terminate());

const bytesOf = (text: string) => new TextEncoder().encode(text);

const HEADER = bytesOf(
  ['NDims = 3', 'DimSize = 2 2 3', 'ElementType = MET_UCHAR', 'ElementDataFile = s%d.raw 1 3 1', ''].join('\n'),
);

const slice = (k: number) => Uint8Array.of(k, k + 1, k + 2, k + 3);

const FILES = [3, 1, 2].map((k) => ({ name: `folder/S${k}.raw`, bytes: slice(10 * k) }));

const VALUES = [10, 11, 12, 13, 20, 21, 22, 23, 30, 31, 32, 33];

const UNNAMED = bytesOf(
  [
    ...['NRRD0004', 'type: uint8', 'dimension: 3', 'sizes: 2 1 1', 'encoding: raw', 'space dimension: 3'],
    ...['space directions: (1,0,0) (0,2,0) (0,0,3)', 'space units: "microns" "microns" "microns"', '', 'ab'],
  ].join('\n'),
);

test('voxels are read from the files beside a header', async () => {
  const files = [...FILES, { name: 'notes.txt', bytes: new Uint8Array(1) }];
  expect([...Volume.parse(HEADER, { files }).intensities()]).toEqual(VALUES);
  expect([...parseVolume(HEADER, { files }).data]).toEqual(VALUES);
  await initWorker();
  const remote = await worker.Volume.parse(HEADER, { files });
  expect([...(await remote.intensities())]).toEqual(VALUES);
});

test('files that are missing, or of the wrong size, are named', async () => {
  const tooShort = [...FILES.slice(1), { name: 's3.raw', bytes: new Uint8Array(3) }];
  for (const [files, message] of [
    [FILES.slice(1), "MetaImage: files: 1 of the 3 that the header names is missing: 's3.raw'"],
    [[], "MetaImage: files: 3 of the 3 that the header names are missing: 's1.raw', 's2.raw', 's3.raw'"],
    [tooShort, "MetaImage: file 's3.raw': has 3 bytes of voxels, the header accounts for 4"],
  ] as const) {
    expect(failure(() => Volume.parse(HEADER, { files }))).toMatchObject({ code: 'bad-file', message });
    expect(failure(() => parseVolume(HEADER, { files }))).toMatchObject({ code: 'bad-file', message });
  }
  expect(failure(() => Volume.parse(HEADER)).message).toContain('pass it in `files`');
});

test('wrong options are named', async () => {
  for (const [options, message] of [
    [{ file: [] }, 'file: unknown property of options; known: data, files, space'],
    [{ files: FILES[0] }, 'files: must be an array, got Object'],
    [{ files: [null] }, 'files[0]: must be an object, got null'],
    [{ files: [undefined] }, 'files[0]: must be an object, got null'],
    [{ files: [{ name: 1, bytes: slice(1) }] }, 'files[0].name: must be a string'],
    [{ files: [{ name: 'a', bytes: 'b' }] }, "files[0].bytes: must be a Uint8Array, got 'b'"],
    [{ files: FILES, data: slice(1) }, 'files: give either data or files'],
    [{ space: 'lps' }, "space: must be one of 'RAS', 'LPS', got 'lps'"],
  ] as const) {
    const code = 'invalid-argument';
    expect(failure(() => Volume.parse(HEADER, wrong(options)))).toMatchObject({ code, message });
    expect(failure(() => parseVolume(HEADER, wrong(options)))).toMatchObject({ code, message });
  }
  await initWorker();
  expect((await rejection(worker.Volume.parse(HEADER, wrong({ space: 'x' })))).code).toBe('invalid-argument');
});

test('a space that the file does not tell is assumed with a warning, or chosen', () => {
  const assumed = Volume.parse(UNNAMED);
  expect(assumed.space).toBe('LPS');
  expect(assumed.warnings).toMatchObject([{ code: 'reader', text: /does not name the space/ }]);
  for (const space of ['RAS', 'LPS'] as const) {
    const volume = Volume.parse(UNNAMED, { space });
    expect([volume.space, volume.warnings]).toEqual([space, []]);
    expect(parseVolume(UNNAMED, { space }).space).toBe(space);
  }
});

test('the unit of length is that of the file, and undefined without one', async () => {
  const init = { data: Uint8Array.from({ length: 64 }, (_, i) => i), dims: [4, 4, 4] as [number, number, number] };
  expect(new Volume(init).unit).toBeUndefined();
  expect(Volume.parse(new Volume(init).toNifti()).unit).toBeUndefined();
  expect(Volume.parse(UNNAMED).unit).toBe('um');
  for (const unit of ['m', 'mm', 'um'] as const) {
    const volume = new Volume({ ...init, unit });
    const made = [
      ...[volume, Volume.parse(volume.toNifti()), Volume.parse(volume.toBytes('nrrd'))],
      ...[
        Volume.parse(volume.toBytes('mha')),
        volume.binned([2, 2, 2]),
        volume.crop({ min: [0, 0, 0], max: [2, 2, 2] }),
      ],
      ...[volume.resample({ dims: [2, 2, 2] }), volume.threshold(1, 5), volume.label(3), volume.frame(0)],
      ...[...volume.pyramid(2, { factor: 2 }), Volume.fromFrames([volume, volume]), volume.enrichSlices({ factor: 2 })],
    ];
    expect(made.map((one) => one.unit)).toEqual(made.map(() => unit));
  }
  await initWorker();
  const remote = new worker.Volume({ ...init, unit: 'mm' });
  expect(await remote.unit).toBe('mm');
});

test('NaN is NaN in the intensities, and the lower end of the range where it is shown and interpolated', () => {
  const volume = new Volume({ data: Float32Array.of(Number.NaN, 2, 5, Number.NaN), dims: [4, 1, 1] });
  expect([...volume.intensities()]).toEqual([Number.NaN, 2, 5, Number.NaN]);
  expect([...volume.slice(2, 0)]).toEqual([2, 2, 5, 2]);
  expect(volume.sample([0, 0, 0])).toBe(2);
});
