/** `vesicle/dicom`: which images of a folder are of one volume, where it lies, and what its voxels are. */
import { readFile } from 'node:fs/promises';
import { beforeAll, describe, expect, test } from 'vitest';
import { type DicomVolume, openDicom, readDicom } from '../../pkg/dicom/index.js';
import init, { Volume, type VolumeInit } from '../../pkg/index.js';
import { AXIAL, dicomFile, type Elements, type Grid, sliceElements, type Writing } from './dicom-files.js';

beforeAll(() => init());

const GRID: Grid = { dims: [5, 4, 6], spacing: [0.5, 0.75, 2], origin: [10, 20, 30], along: AXIAL };
const SIZE = 20;

/** Stored value of a voxel. */
const stored = (x: number, y: number, z: number) => 100 * z + 10 * y + x + 1;

const voxels = (z: number) => Uint16Array.from({ length: SIZE }, (_, i) => stored(i % 5, Math.floor(i / 5), z));

interface Given {
  name: string;
  bytes: Uint8Array;
}

/** Returns the slices of a series as files, in another order than that of their positions. */
function series(
  change: (z: number) => Elements = () => ({}),
  { grid = GRID, slices = [3, 0, 5, 1, 4, 2], writing = {} as Writing } = {},
): Given[] {
  return slices.map((z, k) => ({
    name: `IM${k}`,
    bytes: new Uint8Array(dicomFile({ ...sliceElements(grid, z, voxels(z)), ...change(z) }, writing)),
  }));
}

/** Returns the intensities of a volume, by slices. */
function slicesOf(init: VolumeInit): number[][] {
  const volume = new Volume(init);
  try {
    const all = [...volume.intensities()];
    return Array.from({ length: volume.dims[2] }, (_, z) => all.slice(z * SIZE, (z + 1) * SIZE));
  } finally {
    volume.free();
  }
}

const expected = (z: number) => [...voxels(z)];
const ALL = [0, 1, 2, 3, 4, 5];

async function only(files: Given[]): Promise<DicomVolume> {
  const { volumes } = await openDicom(files);
  expect(volumes).toHaveLength(1);
  return volumes[0] as DicomVolume;
}

const texts = (volume: DicomVolume) => volume.warnings.map(({ text }) => text);
const moved = (z: number, by: (z: number) => [number, number, number]): Elements => ({
  '00200032': ['DS', [0, 1, 2].map((k) => ([10, 20, 30 + 2 * z][k] ?? 0) + (by(z)[k] ?? 0)).join('\\')],
});
const refused = (text: RegExp) => ({ code: 'bad-file', message: expect.stringMatching(text) });

describe('a series', () => {
  test.each<[string, Writing]>([
    ['explicit', {}],
    ['implicit', { syntax: 'implicit' }],
    ['big-endian', { syntax: 'big' }],
    ['implicit without preamble', { syntax: 'implicit', preamble: false }],
    ['explicit without preamble', { preamble: false }],
  ])('%s: slices are sorted and placed by their positions', async (_, writing) => {
    const change = () => (writing.syntax === 'big' ? { '7fe00010': ['OW', Buffer.alloc(0)] as const } : {});
    const files =
      writing.syntax === 'big'
        ? series((z) => ({ ...change(), '7fe00010': ['OW', Buffer.from(voxels(z).buffer).swap16()] }), { writing })
        : series(undefined, { writing });
    const volume = await only(files);
    expect(volume).toMatchObject({ kind: 'image', dims: [5, 4, 6], spacing: [0.5, 0.75, 2], frames: 1, images: 6 });
    expect([volume.warnings, volume.remarks, volume.uneven]).toEqual([[], [], undefined]);
    const init = await volume.read();
    expect(init).toMatchObject({ space: 'LPS', unit: 'mm', slope: 1, intercept: 0, dims: [5, 4, 6] });
    expect(init.affine).toEqual([0.5, 0, 0, 0, 0, 0.75, 0, 0, 0, 0, 2, 0, 10, 20, 30, 1]);
    expect(slicesOf(init)).toEqual(ALL.map(expected));
  });

  test('oblique, and numbered in the other direction than that of its normal', async () => {
    const along: Grid['along'] = [0.8, 0.6, 0, 0, 0, -1];
    const grid = { ...GRID, along };
    const init = await readDicom(series((z) => ({ '00200013': ['IS', String(9 - z)] }), { grid }));
    const normal = [-0.6, 0.8, 0];
    for (const [k, x] of [0.4, 0.3, 0, 0, 0, 0, -0.75, 0, ...normal.map((x) => 2 * x), 0, 10, 20, 30, 1].entries())
      expect(init.affine?.[k]).toBeCloseTo(x, 12);
    expect(slicesOf(init)).toEqual(ALL.map(expected));
  });

  test('files that are given as blobs are read in parts', async () => {
    const files = series().map(({ name, bytes }) => ({ name, bytes: new Blob([bytes as Uint8Array<ArrayBuffer>]) }));
    expect(slicesOf(await readDicom(files))).toEqual(ALL.map(expected));
    const whole = series().map(({ name, bytes }) => new File([bytes as Uint8Array<ArrayBuffer>], name));
    expect(slicesOf(await readDicom(whole))).toEqual(ALL.map(expected));
  });

  test('one slope and intercept for all slices are those of the volume; others are applied', async () => {
    const scale = (slope: number, intercept: number): Elements => ({
      '00281052': ['DS', String(intercept)],
      '00281053': ['DS', String(slope)],
    });
    const one = await readDicom(series(() => scale(2, -1000)));
    expect(one).toMatchObject({ slope: 2, intercept: -1000, data: expect.any(Uint16Array) });
    const several = await readDicom(series((z) => scale(0.25 * (z + 1), z)));
    expect(several.data).toBeInstanceOf(Float32Array);
    expect(slicesOf(several)).toEqual(ALL.map((z) => expected(z).map((value) => value * 0.25 * (z + 1) + z)));
    // The first slices have whole numbers, as in series whose type other programs take from the first.
    const late = await readDicom(series((z) => scale(z < 3 ? 1 : 0.37, 0)));
    expect(slicesOf(late)[4]?.[7]).toBeCloseTo((voxels(4)[7] ?? 0) * 0.37, 3);
  });

  test('of 8 bits in words, big-endian', async () => {
    const values = Buffer.from(Uint8Array.from({ length: SIZE }, (_, i) => i));
    const bits = { '00280100': ['US', [8]], '00280101': ['US', [8]], '00280102': ['US', [7]] } as const;
    const files = series(() => ({ ...bits, '7fe00010': ['OW', Buffer.from(values).swap16()] }), {
      writing: { syntax: 'big' },
    });
    expect(slicesOf(await readDicom(files))[0]).toEqual([...values]);
  });

  test('of 12 bits, signed, in 16: the other bits do not count', async () => {
    const values = Uint16Array.from({ length: SIZE }, (_, i) => ((i - 10) & 0xfff) | (i % 2 ? 0xf000 : 0));
    const bits = { '00280101': ['US', [12]], '00280102': ['US', [11]], '00280103': ['US', [1]] } as const;
    const init = await readDicom(series(() => ({ ...bits, '7fe00010': ['OW', Buffer.from(values.buffer)] })));
    expect(init.data).toBeInstanceOf(Int16Array);
    expect(slicesOf(init)[0]).toEqual(Array.from({ length: SIZE }, (_, i) => i - 10));
  });

  test('that a table maps to intensities are as stored, with a warning', async () => {
    const volume = await only(series(() => ({ '00283000': ['SQ', [{ '00283003': ['LO', 'table'] }]] })));
    expect(texts(volume).join()).toMatch(/table in the file, which is not applied/);
  });

  test('MONOCHROME1 keeps stored values and says so; units, padding and loss are said', async () => {
    const volume = await only(series(() => ({ '00280004': ['CS', 'MONOCHROME1'] })));
    expect(volume.inverted).toBe(true);
    expect(volume.remarks.join()).toContain('MONOCHROME1');
    expect(slicesOf(await volume.read())).toEqual(ALL.map(expected));
    const other = await only(
      series(() => ({
        '00280120': ['US', [63]],
        '00282110': ['CS', '01'],
        '00541001': ['CS', 'BQML'],
      })),
    );
    expect(other.remarks.join(' ')).toMatch(/BQML.*not standardised uptake.*measured: 63/);
    expect(texts(other).join()).toMatch(/compressed with loss/);
  });
});

describe('slices', () => {
  test('of a tilted gantry are sheared', async () => {
    const [cos, sin] = [Math.cos(Math.PI / 9), Math.sin(Math.PI / 9)];
    const tilted: Elements = { '00200037': ['DS', `1\\0\\0\\0\\${cos}\\${-sin}`] };
    const files = series((z) => ({ ...tilted, '00200032': ['DS', `10\\20\\${30 + 2 * z}`] }));
    const volume = await only(files);
    expect(volume.warnings).toEqual([]);
    const { affine } = await volume.read();
    for (const [k, x] of [0.5, 0, 0, 0, 0, 0.75 * cos, -0.75 * sin, 0, 0, 0, 2, 0, 10, 20, 30, 1].entries())
      expect(affine?.[k]).toBeCloseTo(x, 12);
  });

  test('that are missing are said; the volume is refused, or resampled with a warning', async () => {
    const volume = await only(series(undefined, { slices: [0, 5, 1, 4] }));
    expect(volume).toMatchObject({ dims: [5, 4, 6], uneven: '2 of 6 slices are missing: between 2 and 5' });
    await expect(volume.read()).rejects.toMatchObject(refused(/Body: 2 of 6 slices are missing.*resample/));
    const init = await volume.read({ uneven: 'resample' });
    expect(init.warnings?.[0]?.text).toMatch(/^2 of 6 slices are missing.*interpolated/);
    // Intensities are linear along z.
    expect(slicesOf(init)).toEqual(ALL.map(expected));
    expect(init.data).toBeInstanceOf(Uint16Array);
  });

  test('at distances that differ are refused, or resampled between their ends', async () => {
    const at = [0, 1, 2.5, 3.1, 5, 6];
    const volume = await only(series((z) => moved(z, () => [0, 0, (at[z] ?? 0) - 2 * z])));
    expect(volume.uneven).toMatch(/distances between slices differ: 0.6 mm to 1.9 mm/);
    await expect(volume.read()).rejects.toMatchObject(refused(/distances/));
    const init = await volume.read({ uneven: 'resample' });
    const step = 6 / (volume.dims[2] - 1);
    for (const [k, slice] of slicesOf(init).entries()) {
      const after = at.findIndex((z) => z >= k * step - 1e-9);
      const before = Math.max(0, after - 1);
      const t = after === before ? 0 : (k * step - (at[before] ?? 0)) / ((at[after] ?? 0) - (at[before] ?? 0));
      expect(Math.abs((slice[0] ?? 0) - (1 + 100 * (before + t)))).toBeLessThan(2.1);
    }
  });

  test('a little off are taken for even with a warning; far off the line they are skipped', async () => {
    const volume = await only(series((z) => moved(z, (z) => [0, 0, z === 2 ? 0.1 : 0])));
    expect(texts(volume)).toEqual([expect.stringMatching(/0.1 mm off equal distances of 2 mm/)]);
    const { volumes, skipped } = await openDicom(series((z) => moved(z, (z) => [z % 2, 0, 0])));
    expect(volumes).toEqual([]);
    expect(skipped[0]?.reason).toMatch(/shifted sideways/);
  });

  test('with positions that are rounded to a thousandth are even', async () => {
    const step = 5 / 3;
    const files = series((z) => ({ '00200032': ['DS', `10\\20\\${(30 + z * step).toFixed(3)}`] }));
    expect((await only(files)).warnings).toEqual([]);
  });
});

describe('a folder', () => {
  test('with a localiser in the series: it is no part of the volume', async () => {
    const [localiser] = series(() => ({
      '00080018': ['UI', '1.2.3.9'],
      '00200037': ['DS', '0\\1\\0\\0\\0\\-1'],
    })) as [Given];
    const { volumes, skipped } = await openDicom([...series(), { ...localiser, name: 'scout' }]);
    expect(volumes.map(({ dims }) => dims)).toEqual([[5, 4, 6]]);
    expect(skipped).toEqual([{ name: 'scout', reason: 'a single image, which is no volume' }]);
    expect(volumes.map((volume) => [texts(volume), volume.remarks.length])).toEqual([[[], 1]]);
  });

  test('with a slice of another size: the volume says that one is not part of it', async () => {
    const files = series((z) =>
      z < 5 ? {} : { '00280010': ['US', [3]], '7fe00010': ['OW', Buffer.from(voxels(z).slice(0, 15).buffer)] },
    );
    const volume = await only(files);
    expect(volume.dims).toEqual([5, 4, 5]);
    expect(texts(volume)).toEqual([expect.stringMatching(/^One image of the series is not part.*5 × 3/)]);
  });

  test('with a file twice: it counts once, and that is said', async () => {
    const files = series();
    const [first] = files as [Given];
    const volume = await only([...files, { ...first, name: 'copy' }]);
    expect(texts(volume)).toEqual(['One file was there twice and counted once.']);
    expect(slicesOf(await volume.read())).toEqual(ALL.map(expected));
  });

  test('of two series has two volumes, and other files; reading one without choosing is refused', async () => {
    const other = series(() => ({ '0020000e': ['UI', '1.2.9'], '0008103e': ['LO', 'Head'] }), { slices: [0, 1, 2] });
    const notes = { name: 'notes.txt', bytes: new TextEncoder().encode('x'.repeat(300)) };
    const index = { name: 'DICOMDIR', bytes: new Uint8Array(dicomFile({ '00041220': ['SQ', [{}]] })) };
    const files = [...other, notes, index, ...series()];
    const { volumes, skipped } = await openDicom(files);
    expect(volumes.map(({ name, dims }) => [name, dims[2]])).toEqual([
      ['Body', 6],
      ['Head', 3],
    ]);
    expect(skipped.map(({ reason }) => reason)).toEqual(['no DICOM file', 'an index of files (DICOMDIR)']);
    await expect(readDicom(files)).rejects.toMatchObject({ code: 'invalid-argument', message: /Body.*Head/ as never });
  });

  test('whose series have the same name: volumes have names of their own', async () => {
    const other = series(() => ({ '0020000e': ['UI', '1.2.9'] }));
    const third = series(() => ({ '0020000e': ['UI', '1.2.8'] }), { slices: [0, 1, 2] });
    const { volumes } = await openDicom([...series(), ...other, ...third]);
    expect(new Set(volumes.map(({ name }) => name)).size).toBe(3);
  });

  test('with a damaged file: volumes say that it may be missing', async () => {
    const [first, ...others] = series() as [Given];
    const { volumes, skipped } = await openDicom([...others, { name: 'cut.dcm', bytes: first.bytes.slice(0, 260) }]);
    expect(volumes.map(texts).join()).toMatch(/cut.dcm could not be read, and may be missing/);
    expect(skipped).toMatchObject([{ name: 'cut.dcm', damaged: true }]);
  });

  test('without a volume is refused with the reasons', async () => {
    await expect(readDicom(series(undefined, { slices: [2] }))).rejects.toMatchObject(refused(/single image.*IM0/));
    const color = series(() => ({ '00280002': ['US', [3]], '00280004': ['CS', 'RGB'] }));
    await expect(readDicom(color)).rejects.toMatchObject(refused(/in colour \(RGB\).*6 files/));
    const unplaced = series(() => ({ '00200032': ['DS', ''] }));
    await expect(readDicom(unplaced)).rejects.toMatchObject(refused(/without position and orientation/));
    await expect(readDicom([])).rejects.toMatchObject(refused(/no files/));
  });

  test('a file whose pixels are cut off is refused by name', async () => {
    const [first, ...others] = series() as [Given];
    const files = [{ ...first, bytes: first.bytes.slice(0, -7) }, ...others];
    await expect(readDicom(files)).rejects.toMatchObject(refused(/IM0: pixel data: needs 40 bytes, has 33/));
  });

  test('the names of patients are in no volume, warning or message', async () => {
    const named = series(() => ({ '00100010': ['PN', 'Doe^Jane'], '00100020': ['LO', 'ID-4711'] }), {
      slices: [0, 5, 1, 4],
    });
    const volume = await only(named);
    expect(volume.patient).toBe('Doe Jane');
    const error = await volume.read().catch((error: Error) => error.message);
    const init = await volume.read({ uneven: 'resample' });
    expect(JSON.stringify([error, init, volume.warnings, volume.remarks, volume.name])).not.toMatch(/Doe|Jane|4711/);
  });
});

describe('images of one series', () => {
  test.each<[string, Elements, Elements]>([
    ['kernel', { '00181210': ['SH', 'B30f'] }, { '00181210': ['SH', 'B70f'] }],
    ['echo time', { '00180081': ['DS', '10'] }, { '00180081': ['DS', '90'] }],
    ['thickness', { '00180050': ['DS', '1'] }, { '00180050': ['DS', '5'] }],
    ['flip angle', { '00181314': ['DS', '2'] }, { '00181314': ['DS', '15'] }],
    ['b-value', { '0019100c': ['IS', '0'] }, { '0019100c': ['IS', '1000'] }],
  ])('of which every second one has another %s are two volumes', async (name, one, other) => {
    const { volumes } = await openDicom(series((z) => (z % 2 ? other : one)));
    expect(volumes.map((volume) => [volume.dims[2], volume.spacing[2]])).toEqual([
      [3, 4],
      [3, 4],
    ]);
    for (const volume of volumes) expect(volume.name).toMatch(`Body, ${name} `);
  });

  test('with the same distance but beside each other are several volumes', async () => {
    const beside = series((z) => ({ ...moved(z, () => [50, 0, 0]), '00080018': ['UI', `1.2.3.5.${z}`] }));
    const { volumes } = await openDicom([...series(), ...beside]);
    expect(volumes.map(({ dims, frames }) => [...dims, frames])).toEqual([
      [5, 4, 6, 1],
      [5, 4, 6, 1],
    ]);
    const firsts = await Promise.all(volumes.map(async (volume) => (await volume.read()).affine?.[12]));
    expect(firsts.sort()).toEqual([10, 60]);
  });

  test('of two patients, whose identifiers were removed, are two volumes', async () => {
    const of = (patient: string, slices: number[]) =>
      series(() => ({ '0020000e': ['UI', ''], '00080018': ['UI', ''], '00100020': ['LO', patient] }), { slices });
    const { volumes } = await openDicom([...of('1', [0, 1, 2]), ...of('2', ALL)]);
    expect(volumes.map(({ dims }) => dims[2])).toEqual([6, 3]);
  });

  test('with directions that are rounded differently are one volume; with others, each volume says so', async () => {
    const rounded = series((z) => (z === 5 ? { '00200037': ['DS', '1\\0.001\\0\\-0.001\\1\\0'] } : {}));
    expect((await only(rounded)).dims[2]).toBe(6);
    const flipped = series((z) => (z % 2 ? { '00200037': ['DS', '-1\\0\\0\\0\\-1\\0'] } : {}));
    const { volumes } = await openDicom(flipped);
    expect(volumes).toHaveLength(2);
    for (const volume of volumes) expect(texts(volume).join()).toMatch(/Other images of the series differ/);
  });

  test('without pixels or position may be missing: the volume says so', async () => {
    for (const gone of [{ '7fe00010': ['OW', Buffer.alloc(0)] }, { '00200032': ['DS', ''] }] as Elements[]) {
      const { volumes } = await openDicom(series((z) => (z === 5 ? gone : {})));
      const [volume] = volumes as [DicomVolume];
      const read = await volume.read().catch((error: Error) => error);
      expect(read instanceof Error ? read.message : texts(volume).join()).toMatch(/may be missing|needs 40 bytes/);
    }
  });
});

describe('images at the same position', () => {
  const twice = (mark: (time: number, z: number) => Elements) =>
    [0, 1].flatMap((time) =>
      series((z) => ({
        ...mark(time, z),
        '00080018': ['UI', `1.2.3.4.${time}.${z + 1}`],
        '7fe00010': ['OW', Buffer.from(voxels(z).map((value) => value + 1000 * time).buffer)],
      })),
    );

  test.each<[string, (time: number, z: number) => Elements, number]>([
    ['temporal position', (time) => ({ '00200100': ['IS', String(time + 1)] }), 0],
    ['trigger time', (time) => ({ '00181060': ['DS', String(40 * time)] }), 0.04],
    [
      'trigger times that differ from slice to slice',
      (time, z) => ({ '00181060': ['DS', String(50 * time + z)] }),
      0.05,
    ],
    ['acquisition time', (time, z) => ({ '00080032': ['TM', `1011${10 + 2 * time}.${z}`] }), 2],
    [
      'acquisition time, across midnight',
      (time) => ({ '00080022': ['DA', `2024013${time}`], '00080032': ['TM', time ? '000010' : '235950'] }),
      20,
    ],
    ['acquisition', (time) => ({ '00200012': ['IS', String(4 + time)] }), 0],
  ])('are frames of a volume with time: %s', async (_, mark, seconds) => {
    const volume = await only(twice(mark));
    expect(volume).toMatchObject({ frames: 2, dims: [5, 4, 6], warnings: [] });
    const init = await volume.read();
    expect(init.dims).toEqual([5, 4, 6, 2]);
    expect(init.frameSeconds ?? 0).toBeCloseTo(seconds, 9);
    expect([init.data[0], init.data[6 * SIZE]]).toEqual([1, 1001]);
  });

  test('that only their numbers tell apart are frames, with a warning', async () => {
    const volume = await only(twice((time, z) => ({ '00200013': ['IS', String(1 + z + 6 * time)] })));
    expect(volume.frames).toBe(2);
    expect(texts(volume).join()).toMatch(/numbers of the images only/);
  });

  test.each<[string, (time: number) => Elements]>([
    ['echo time 10, echo time 40', (time) => ({ '00180081': ['DS', String(10 + 30 * time)] })],
    ['image type', (time) => ({ '00080008': ['CS', `ORIGINAL\\PRIMARY\\${'MP'[time]}`] })],
  ])('are different volumes: %s', async (names, mark) => {
    const { volumes } = await openDicom(twice(mark));
    expect(volumes).toHaveLength(2);
    for (const name of names.split(', ')) expect(volumes.some((volume) => volume.name.includes(name))).toBe(true);
    const firsts = await Promise.all(volumes.map(async (volume) => (await volume.read()).data[0]));
    expect(firsts.sort()).toEqual([1, 1001]);
  });

  test('that nothing tells apart are not read', async () => {
    const files = twice(() => ({ '00200013': ['IS', '1'] }));
    await expect(readDicom(files)).rejects.toMatchObject(refused(/same position, without any attribute/));
  });

  test('of which the last time was stopped early: frames of those that are complete, with a warning', async () => {
    const third = series((z) => ({ '00200100': ['IS', '3'], '00080018': ['UI', `1.2.3.4.9.${z}`] }), {
      slices: [0, 1],
    });
    const volume = await only([...twice((time) => ({ '00200100': ['IS', String(time + 1)] })), ...third]);
    expect(volume).toMatchObject({ frames: 2, dims: [5, 4, 6] });
    expect(texts(volume)).toEqual(['1 of 3 frames lacks slices, and was left out.']);
  });

  test('of which one time lacks a slice: two volumes, of which one is uneven', async () => {
    const files = twice((time) => ({ '00200100': ['IS', String(time + 1)] }));
    const { volumes } = await openDicom(files.filter((_, k) => k !== 3));
    expect(volumes.map(({ uneven }) => uneven).sort()).toEqual([
      '1 of 6 slices is missing: between 1 and 3',
      undefined,
    ]);
  });
});

describe('multi-frame files', () => {
  const file = async (name: string) => [{ name, bytes: new Uint8Array(await readFile(`tests/data/dicom/${name}`)) }];

  test.each(['plain', 'deflated', 'rle', 'jpeg', 'jpeg-lossless', 'jpeg-ls', 'jpeg-2000', 'htj2k'])(
    '%s: frames are placed by their positions',
    async (name) => {
      const init = await readDicom(await file(`${name}.dcm`));
      expect(init).toMatchObject({ dims: [16, 12, 3], slope: 2, intercept: -1000 });
      expect(init.warnings ?? []).toHaveLength(name === 'jpeg' ? 1 : 0);
      for (const [k, x] of [0, 0.75, 0, 0, 0, 0, -0.5, 0, -1.5, 0, 0, 0, -7, 20, 30, 1].entries())
        expect(init.affine?.[k]).toBeCloseTo(x, 12);
      const value = (x: number, y: number, z: number) =>
        name === 'jpeg' ? 40 + 8 * x + 5 * y + 10 * z : (37 * x + 101 * y + 53 * z + ((x * y) % 17) * 11) % 4096;
      // The normal points from the last frame to the first.
      const found = Array.from(
        init.data,
        (one, i) => one - value(i % 16, Math.floor(i / 16) % 12, 2 - Math.floor(i / 192)),
      );
      expect(Math.max(...found.map(Math.abs))).toBeLessThanOrEqual(name === 'jpeg' ? 1 : 0);
    },
  );

  test('a compressed image that is damaged is refused by name', async () => {
    for (const name of ['rle', 'jpeg', 'jpeg-lossless', 'jpeg-ls', 'jpeg-2000', 'htj2k']) {
      const [{ bytes }] = (await file(`${name}.dcm`)) as [Given];
      const start = bytes.length - 700;
      const broken = bytes.map((byte, k) => (k > start && k < start + 300 ? 0xff : byte));
      const result = await readDicom([{ name, bytes: broken }]).catch((error: unknown) => error);
      // A decoder may return something else for a damaged image; it must not crash.
      if (result instanceof Error) expect(result).toMatchObject({ code: expect.stringMatching(/bad-file/) });
    }
  });

  test('a compressed image that is cut off carries a warning, if its decoder does not refuse it', async () => {
    for (const name of ['jpeg-lossless', 'jpeg-2000', 'htj2k']) {
      const [{ bytes }] = (await file(`${name}.dcm`)) as [Given];
      // Zeroes in place of the end of the last image, before the item that ends the sequence.
      const cut = bytes.map((byte, k) => (k > bytes.length - 60 && k < bytes.length - 8 ? 0 : byte));
      const found = await readDicom([{ name, bytes: cut }]).catch((error: { code: string }) => error);
      if ('code' in found) expect(found.code).toBe('bad-file');
      else expect(found.warnings?.map(({ text }) => text).join()).toMatch(/may be cut off or damaged/);
    }
  });

  test('several grids of doses in one series are volumes of their own', async () => {
    const dose = (number: number) =>
      dicomFile({
        ...sliceElements(GRID, 0, voxels(0)),
        '00080018': ['UI', `1.2.3.4.${number}`],
        '00280008': ['IS', '3'],
        '3004000c': ['DS', '0\\2.5\\5'],
        '7fe00010': ['OW', Buffer.concat([0, 1, 2].map((z) => Buffer.from(voxels(z + number).buffer)))],
      });
    const { volumes } = await openDicom([1, 2].map((n) => ({ name: `dose ${n}`, bytes: new Uint8Array(dose(n)) })));
    expect(volumes.map(({ name }) => name)).toEqual(['Body, file dose 1', 'Body, file dose 2']);
  });

  test.each([
    ['several times', { '00280009': ['AT', [0x0054, 0x0070, 0x0054, 0x0080]] }],
    ['time alone', { '00280009': ['AT', [0x0018, 0x1063]] }],
    ['angles', { '00280009': ['AT', [0x0054, 0x0090]] }],
  ] as [string, Elements][])('frames that are counted by %s, without positions, are no volume', async (_, pointer) => {
    const bytes = dicomFile({
      ...sliceElements(GRID, 0, voxels(0)),
      ...pointer,
      '00180088': ['DS', '2.5'],
      '00280008': ['IS', '3'],
    });
    await expect(readDicom([{ name: 'nm', bytes: new Uint8Array(bytes) }])).rejects.toMatchObject(
      refused(/several times, angles or windows/),
    );
  });

  test('a mosaic of slices is no volume', async () => {
    const files = series(() => ({ '00080008': ['CS', 'ORIGINAL\\PRIMARY\\M\\MOSAIC'] }));
    await expect(readDicom(files)).rejects.toMatchObject(refused(/mosaic of slices/));
  });

  test('a grid of doses is placed by its offsets', async () => {
    const frames = Buffer.concat([0, 1, 2].map((z) => Buffer.from(voxels(z).buffer)));
    const bytes = dicomFile({
      ...sliceElements(GRID, 0, voxels(0)),
      '00080016': ['UI', '1.2.840.10008.5.1.4.1.1.481.2'],
      '00280008': ['IS', '3'],
      '3004000c': ['DS', '0\\2.5\\5'],
      '3004000e': ['DS', '0.001'],
      '7fe00010': ['OW', frames],
    });
    const init = await readDicom([{ name: 'dose', bytes: new Uint8Array(bytes) }]);
    expect(init).toMatchObject({ dims: [5, 4, 3], slope: 0.001 });
    expect(init.affine?.[10]).toBe(2.5);
  });

  test('frames of which only the first has a position follow at the stated distance, with a warning', async () => {
    const bytes = dicomFile({
      ...sliceElements(GRID, 0, voxels(0)),
      '00180088': ['DS', '2.5'],
      '00280008': ['IS', '3'],
      '7fe00010': ['OW', Buffer.concat([0, 1, 2].map((z) => Buffer.from(voxels(z).buffer)))],
    });
    const init = await readDicom([{ name: 'nm', bytes: new Uint8Array(bytes) }]);
    expect(slicesOf(init)).toEqual([0, 1, 2].map(expected));
    expect(init.affine?.[10]).toBe(2.5);
    expect(init.warnings?.[0]?.text).toMatch(/^Only the first slice has a position/);
  });

  test('frames without positions are no volume', async () => {
    const bytes = dicomFile({ ...sliceElements(GRID, 0, voxels(0)), '00280008': ['IS', '3'] });
    await expect(readDicom([{ name: 'cine', bytes: new Uint8Array(bytes) }])).rejects.toMatchObject(
      refused(/without positions of their own/),
    );
  });
});

describe('segmentations', () => {
  /** Returns a segmentation with one segment of a voxel on each of some slices, at multiples of 2.5 mm. */
  function sparse(slices: number[], spacing?: string): Given[] {
    const bytes = dicomFile({
      ...sliceElements(GRID, 0, voxels(0)),
      '00080016': ['UI', '1.2.840.10008.5.1.4.1.1.66.4'],
      '00280008': ['IS', String(slices.length)],
      '00280100': ['US', [8]],
      '00280101': ['US', [8]],
      '00280102': ['US', [7]],
      '00620002': ['SQ', [{ '00620004': ['US', [1]], '00620005': ['LO', 'Lesion'] }]],
      '52009229': ['SQ', [spacing ? { '00289110': ['SQ', [{ '00180088': ['DS', spacing] }]] } : {}]],
      '52009230': [
        'SQ',
        slices.map(
          (z): Elements => ({
            '00209113': ['SQ', [{ '00200032': ['DS', `10\\20\\${30 + 2.5 * z}`] }]],
            '0062000a': ['SQ', [{ '0062000b': ['US', [1]] }]],
          }),
        ),
      ],
      '7fe00010': ['OB', Buffer.from(slices.flatMap(() => [1, ...new Array(SIZE - 1).fill(0)]))],
    });
    return [{ name: 'seg', bytes: new Uint8Array(bytes) }];
  }

  test.each([[[0, 4]], [[0, 2, 4]], [[1, 4, 6]], [[3]]])(
    'leave out slices without segments: frames on slices %j of 2.5 mm',
    async (slices) => {
      const [first = 0] = slices;
      const count = (slices.at(-1) ?? 0) - first + 1;
      const volume = await only(sparse(slices, '2.5'));
      expect(volume).toMatchObject({ dims: [5, 4, count], spacing: [0.5, 0.75, 2.5] });
      const { data } = await volume.read();
      const filled = Array.from({ length: count }, (_, z) => data[z * SIZE]);
      expect(filled).toEqual(Array.from({ length: count }, (_, z) => (slices.includes(first + z) ? 1 : 0)));
    },
  );

  /** Returns the labels of the files, computed as by the script that made them; those of slices 2 to 10. */
  const labels = Array.from({ length: 20 * 16 * 9 }, (_, i) => {
    const [x, y, z] = [i % 20, Math.floor(i / 20) % 16, Math.floor(i / 320) + 2];
    const squared = (x - 9) ** 2 + (y - 8) ** 2 + 2 * (z - 6) ** 2;
    if (squared < 36) return squared < 9 ? 2 : 1;
    return x >= 15 && x < 19 && y >= 2 && y < 13 && z >= 2 && z < 10 ? 3 : 0;
  });

  test.each(['binary', 'overlap', 'fractional', 'labelmap'])('%s: labels with names and colours', async (name) => {
    const bytes = new Uint8Array(await readFile(`tests/data/volumes/segmentation/${name}.dcm`));
    const volume = await only([{ name, bytes }]);
    expect(volume).toMatchObject({ kind: 'segmentation', dims: [20, 16, 9] });
    expect(volume.segments).toEqual([
      { value: 1, name: 'Liver', color: '#dc8264' },
      { value: 2, name: 'Left kidney', color: '#b96653' },
      { value: 3, name: 'Spleen', color: '#9d6ca2' },
    ]);
    const init = await volume.read();
    expect([...init.data]).toEqual(labels);
    const shared = labels.filter((label) => label === 2).length;
    expect(init.warnings?.[0]?.text ?? '').toBe(
      name === 'overlap' ? `${shared} voxels are in several segments; each has the label of the last one.` : '',
    );
  });
});

describe('arguments', () => {
  test('that are wrong are refused by name', async () => {
    const wrong = (message: RegExp) => ({ code: 'invalid-argument', message: expect.stringMatching(message) });
    await expect(openDicom(5 as never)).rejects.toMatchObject(wrong(/^files: /));
    await expect(openDicom([{ name: 'x' }] as never)).rejects.toMatchObject(wrong(/^files\[0\]: must be a File/));
    await expect(openDicom([], { foo: 1 } as never)).rejects.toMatchObject(wrong(/foo/));
    const volume = await only(series());
    await expect(volume.read({ uneven: 'guess' } as never)).rejects.toMatchObject(wrong(/^uneven/));
    await expect(volume.read({ signal: 1 } as never)).rejects.toMatchObject(wrong(/^signal/));
  });

  test('a signal aborts opening and reading; progress is told', async () => {
    const stop = new AbortController();
    const files = series();
    const seen: number[] = [];
    await openDicom(files, { onProgress: ({ done, total }) => seen.push(done / total) });
    expect(seen.at(-1)).toBe(1);
    const opening = openDicom(files, { signal: stop.signal, onProgress: () => stop.abort(new Error('enough')) });
    await expect(opening).rejects.toThrow('enough');
    const volume = await only(files);
    await expect(volume.read({ signal: stop.signal })).rejects.toThrow('enough');
  });

  test('any bytes are read or skipped', async () => {
    const [{ bytes }] = series() as [Given];
    let seed = 1;
    const random = () => {
      seed = (seed * 1103515245 + 12345) % 2147483648;
      return seed / 2147483648;
    };
    for (let k = 0; k < 300; k++) {
      const broken = bytes.slice(0, random() < 0.3 ? Math.floor(random() * bytes.length) : undefined);
      for (let n = 0; n < 1 + 4 * random(); n++)
        broken[Math.floor(random() * broken.length)] = Math.floor(256 * random());
      const { volumes } = await openDicom([{ name: 'a', bytes: broken }, ...series(undefined, { slices: [1, 2] })]);
      for (const volume of volumes)
        await volume.read({ uneven: 'resample' }).catch((error: { code?: string }) => {
          expect(error.code, `${k}: ${error}`).toMatch(/bad-file|too-large/);
        });
    }
  });
});
