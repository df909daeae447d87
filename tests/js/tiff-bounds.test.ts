// `vesicle/tiff` with small files that would take much time or memory, or be read as something that they are not.
import { describe, expect, test } from 'vitest';
import { openTiff, readTiff } from '../../pkg/tiff/index.js';
import { rejection } from './helpers.js';
import { COMPRESS, dataStart, type Entry, text, tiffOf } from './made-tiff.js';
import { isWhole } from './properties.js';
import { ome, stack } from './tiff-files.js';

const FORM = { isBig: false, isLittle: true };
const START = dataStart(FORM);

/** Tags as numbers of 32 bits, unless they are complete entries. */
type Tags = Record<number, number | number[] | Entry>;

/** Returns a page of 8 bits, whose only strip is at the beginning, unless the tags say otherwise. */
function page(tags: Tags = {}): Entry[] {
  const all: Tags = { 256: 1, 257: 1, 258: 8, 259: 1, 262: 1, 273: START, 279: 1, ...tags };
  return Object.entries(all).map(([tag, value]) =>
    typeof value === 'object' && !Array.isArray(value) ? value : { tag: Number(tag), type: 4, values: [value].flat() },
  );
}

const file = (data: Uint8Array[], ...pages: Entry[][]) => ({ name: 'x.tif', bytes: tiffOf(data, pages, FORM) });

const described = (description: string, data: Uint8Array, tags: Tags = {}) =>
  file([data], page({ ...tags, 270: { tag: 270, type: 2, values: text(description) } }));

const refusal = async (files: Parameters<typeof readTiff>[0], channel = 0) => {
  const { code, message } = await rejection(readTiff(files, { channel }));
  expect(message.length).toBeLessThan(1500);
  return `${code}: ${message}`;
};

/** Runs `work`, which must take less than `most` seconds of this process. */
async function within<Result>(most: number, work: () => Promise<Result>): Promise<Result> {
  const before = process.cpuUsage();
  const result = await work();
  const { user, system } = process.cpuUsage(before);
  expect((user + system) / 1e6).toBeLessThan(most);
  return result;
}

const zeros = (count: number) => new Uint8Array(count);
/** Bytes that make a file larger than small ones, which have bounds of their own. */
const padding = zeros(2 ** 17);
const lzw = COMPRESS[5] as (bytes: Uint8Array) => Uint8Array;

/** Returns tags of strips of one row each that have the same bytes. */
const sharing = (count: number, bytes: number): Tags => ({
  ...{ 257: count, 259: 5, 278: 1 },
  273: Array.from({ length: count }, () => START),
  279: Array.from({ length: count }, () => bytes),
});

describe('numbers of a type that cannot be', () => {
  const pageWith = (tag: number, type: number, ...values: number[]) => page({ [tag]: { tag, type, values } });

  test('are refused', async () => {
    for (const tag of [258, 259, 262, 266, 277, 278, 284, 317])
      expect(await refusal(file([zeros(9)], pageWith(tag, 11, 1.5)))).toMatch(
        /^bad-file: .*must be a whole number, got 1.5/,
      );
    expect(await refusal(file([zeros(9)], pageWith(277, 11, Number.NaN)))).toMatch(/must be a whole number, got NaN/);
    // As 32-bit integers with a sign.
    expect(await refusal(file([zeros(9)], pageWith(273, 9, -4)))).toMatch(/must be a whole number, got -4/);
    expect(await refusal(file([lzw(zeros(9))], page({ 259: 5, 279: { tag: 279, type: 9, values: [-4] } })))).toMatch(
      /must be a whole number, got -4/,
    );
  });

  test('and names of other things in a description by SCIFIO', async () => {
    const text = 'SCIFIO=1\naxes=X,Y,constructor,Z\nlengths=1,1,1,2\nimages=2\nslices=2\n';
    const made = described(text, Uint8Array.of(5, 6));
    expect([...(await readTiff(made)).data]).toEqual([5, 6]);
  });
});

describe('strips that share their bytes', () => {
  test('are refused before more is decoded than the file can hold', async () => {
    const data = lzw(zeros(100_000));
    const shared = file([data], page({ 256: 1000, ...sharing(5000, data.length) }));
    expect(await within(3, () => refusal(shared))).toMatch(/^too-large: .*share their bytes/);
    const samples = file([data], page({ 256: 100, 277: 1000, ...sharing(5000, data.length) }));
    expect(await within(3, () => refusal(samples))).toMatch(/^too-large: .*the images have 500000000 bytes/);
  });

  test('may do so now and then, as equal tiles do', async () => {
    const data = lzw(zeros(10));
    const { data: found } = await readTiff(file([data], page({ 256: 10, ...sharing(40, data.length) })));
    expect(found).toEqual(zeros(400));
  });

  test('of many pages with many strips each', async () => {
    const data = lzw(zeros(5));
    const [offsets, count] = [START + data.length, 9000];
    const numbers = Uint32Array.from({ length: 2 * count }, (_, k) => (k < count ? START : data.length));
    const tags: Tags = {
      ...{ 256: 1, 257: count, 259: 5, 278: 1 },
      273: { tag: 273, type: 4, values: [], count, at: offsets },
      279: { tag: 279, type: 4, values: [], count, at: offsets + 4 * count },
    };
    const pages = Array.from({ length: 200 }, () => page(tags));
    const made = file([data, new Uint8Array(numbers.buffer)], ...pages);
    expect(made.bytes.length).toBeLessThan(1e5);
    expect(await within(6, () => refusal(made))).toMatch(/^too-large: .*share their bytes/);
  });
});

describe('small files of large images', () => {
  test('numbers of few bits are unpacked in little time', async () => {
    const packed = lzw(zeros(12e6));
    const { data } = await within(4, () =>
      readTiff(file([packed, padding], page({ 256: 32_000, 257: 3000, 258: 1, 259: 5, 279: packed.length }))),
    );
    expect(data).toHaveLength(96e6);
  });

  test('numbers of 1 to 31 bits, with and without a sign', async () => {
    for (const bits of [1, 3, 7, 12, 17, 23, 25, 31]) {
      const numbers = Array.from({ length: 9 }, (_, k) => (k * 2_654_435_761 + 5) % 2 ** bits);
      const stream = numbers
        .map((number) => number.toString(2).padStart(bits, '0'))
        .join('')
        .padEnd(Math.ceil((9 * bits) / 8) * 8, '0');
      const bytes = Uint8Array.from(stream.match(/.{8}/g) ?? [], (byte) => Number.parseInt(byte, 2));
      const read = async (format: number) => [
        ...(await readTiff(file([bytes], page({ 256: 9, 258: bits, 339: format })))).data,
      ];
      expect(await read(1)).toEqual(numbers);
      expect(await read(2)).toEqual(numbers.map((number) => (number >= 2 ** (bits - 1) ? number - 2 ** bits : number)));
    }
  });

  test('are refused before memory is allocated', async () => {
    const packed = lzw(zeros(1e8));
    const bits = page({ 256: 32_000, 257: 25_000, 258: 1, 259: 5, 279: packed.length });
    expect(await within(2, () => refusal(file([packed, padding.subarray(packed.length)], bits)))).toMatch(
      /^too-large: .*800000000 bytes of voxels/,
    );
    const frame = [0x28, 0xb5, 0x2f, 0xfd, 0xa0, 0, 0x65, 0xcd, 0x1d];
    for (let k = 0; k < 3815; k++) frame.push(k === 3814 ? 3 : 2, 0xff, 0x0f, 0);
    const zstandard = page({ 256: 20_000, 257: 25_000, 259: 50_000, 279: frame.length });
    expect(await within(2, () => refusal(file([Uint8Array.from(frame), padding], zstandard)))).toMatch(
      /Zstandard are too many/,
    );
  });

  test('that are at most 128 KiB may unpack to 32 MiB, all channels, pages and frames together', async () => {
    const strip = (rows: number, tags: Tags = {}) => {
      const data = lzw(zeros(4096 * rows));
      return [data, page({ 256: 4096, 257: rows, 259: 5, 279: data.length, ...tags })] as const;
    };
    const most =
      /^too-large: TIFF: x.tif: would unpack to 32.1 MiB of voxels; .*up to 128 KiB .* 32 MiB: store the images/;
    const [all, one] = strip(8192);
    expect((await readTiff(file([all], one))).data).toHaveLength(2 ** 25);
    const [more, larger] = strip(8193);
    expect(await within(1, () => refusal(file([more], larger)))).toMatch(most);
    expect((await readTiff(file([more, padding], larger))).data).toHaveLength(4096 * 8193);
    const [half, slice] = strip(4097);
    const [, other] = strip(4097, { 273: START + half.length });
    expect(await within(1, () => refusal(file([half, half], slice, other)))).toMatch(most);
    const description = `<OME><Image><Pixels SizeC="2"><TiffData/></Pixels></Image></OME>`;
    const [, first] = strip(4097, { 270: { tag: 270, type: 2, values: text(description) } });
    for (const channel of [0, 1])
      expect(await within(1, () => refusal(file([half], first, slice), channel))).toMatch(most);
    const tile = file(
      [lzw(zeros(5e6))],
      [
        ...page({ 259: 5, 258: 1, 322: 8192, 323: 4104, 324: START, 325: 4000 }).filter(
          ({ tag }) => tag !== 273 && tag !== 279,
        ),
      ],
    );
    expect(await within(1, () => refusal(tile))).toMatch(most);
  });

  test('of several with very many channels each', async () => {
    const packed = COMPRESS[8] as (bytes: Uint8Array) => Uint8Array;
    const data = packed(zeros(60_000));
    const one = page({ 259: 8, 277: 60_000, 279: data.length });
    const files = Array.from({ length: 100 }, (_, k) => ({ ...file([data], one), name: `x${k}.tif` }));
    expect(await within(3, () => refusal(files))).toMatch(/too many channels in files that are joined/);
  });

  test('a JPEG of very many scans', async () => {
    const refused = (scans: number, side: number, empty = 60_000) => {
      const [high, low] = [side >> 8, side & 255];
      const start = [0xff, 0xd8, 0xff, 0xc2, 0, 11, 8, high, low, high, low, 1, 1, 0x11, 0];
      const scan = [0xff, 0xda, 0, 8, 1, 1, 0, 0, 0, 0];
      const scanned = Array.from({ length: scans }, () => scan).flat();
      const bytes = [...start, ...scanned, ...zeros(empty)];
      const one = page({ 256: side, 257: side, 259: 7, 279: bytes.length });
      return within(1, () => refusal(file([Uint8Array.from(bytes), padding], one)));
    };
    expect(await refused(5000, 768)).toMatch(/more than 20 scans/);
    // Fewer of a larger image.
    expect(await refused(20, 4000)).toMatch(
      /or 134 million pixels in all of them and 1000 for each byte, is not decoded/,
    );
    expect(await refused(8, 4000)).not.toMatch(/not decoded/);
    // As it is in many bytes.
    expect(await refused(20, 4000, 400_000)).not.toMatch(/not decoded/);
  });
});

test('reading is aborted by a timer, however much there is to do', async () => {
  const data = Uint8Array.from({ length: 60_000 }, (_, k) => k);
  const slices = described('ImageJ=1\nimages=60000\nslices=60000\n', data);
  const [signal, start] = [AbortSignal.timeout(30), performance.now()];
  await expect(readTiff(slices, { signal })).rejects.toThrow(/timeout/);
  expect(performance.now() - start).toBeLessThan(1000);
});

test('channels whose images have another size are refused', async () => {
  const description = `<OME><Image><Pixels SizeC="2"><TiffData/></Pixels></Image></OME>`;
  const first = page({ 270: { tag: 270, type: 2, values: text(description) } });
  const made = file([zeros(9)], first, page({ 256: 3, 257: 2, 279: 6 }));
  expect((await readTiff(made)).dims).toEqual([1, 1, 1]);
  expect(await refusal(made, 1)).toMatch(/the image has 3 × 2 pixels.*other channels 1 × 1 pixels/);
});

describe('text of any length', () => {
  const long = 'n'.repeat(30_000);

  test('in names, warnings and remarks', async () => {
    const channels = `<Channel Name="${long}"/><Channel Name="${'🫀'.repeat(200)}"/>`;
    const attributes = `SizeC="2" PhysicalSizeX="2" PhysicalSizeXUnit="mm" PhysicalSizeY="2" PhysicalSizeYUnit="${long}"`;
    const opened = await openTiff(
      stack(
        2,
        ome(attributes, channels).replace('uint16', `int${long}`).replace('<Image ID', `<Image Name="${long}" ID`),
      ),
    );
    expect(opened.channels.map(({ name }) => name.length <= 200 && isWhole(name))).toEqual([true, true]);
    for (const { text } of opened.warnings) expect(text.length).toBeLessThanOrEqual(1000);
    const absent = `<TiffData FirstC="1"><UUID FileName="${long}">urn:uuid:2</UUID></TiffData><TiffData IFD="0"/>`;
    const other = await openTiff(stack(2, ome('SizeC="2"', absent)));
    for (const remark of other.remarks) expect(remark.length).toBeLessThanOrEqual(1000);
  });

  test('in names of files', async () => {
    expect(await refusal({ name: long, bytes: zeros(9) })).toMatch(/^bad-file: TIFF: n{249}…: not a TIFF file/);
    expect(await refusal({ ...file([zeros(1)], page({ 256: 0 })), name: long })).toMatch(
      /^bad-file: TIFF: n{199}…: page 1: /,
    );
  });

  test('sizes beyond any microscope are not read', async () => {
    const { spacing, warnings } = await openTiff(
      stack(
        2,
        ome('SizeZ="2" PhysicalSizeX="1e300" PhysicalSizeXUnit="km" PhysicalSizeY="0.5" PhysicalSizeZ="1e-300"'),
      ),
    );
    expect([spacing, warnings[0]?.text]).toEqual([
      [1, 0.5, 1],
      expect.stringMatching(/no voxel size is stated along x and z/),
    ]);
  });
});
