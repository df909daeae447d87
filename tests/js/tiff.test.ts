// `vesicle/tiff`: how the samples of pages are stored.
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { describe, expect, test } from 'vitest';
import { Volume } from '../../pkg/index.js';
import { openTiff, readTiff } from '../../pkg/tiff/index.js';
import { rejection } from './helpers.js';
import { pagesOf, stack, type Tags, tiff, valuesOf } from './tiff-files.js';

const folder = fileURLToPath(new URL('../data/tiff/', import.meta.url));
const written = (name: string) => ({ name, bytes: new Uint8Array(readFileSync(`${folder}${name}.tif`)) });

/** Value of voxel `i` in the files that tifffile wrote. */
const ramp = (i: number) => 7 * i + (i % 5) * i;

const VOXELS = 2 * 17 * 21;

/** A page with tags and bytes, as a file. */
const page = (tags: Tags, ...data: number[]) => ({
  name: 'page.tif',
  bytes: tiff([{ data: Uint8Array.from(data), tags }]),
});

describe('files by tifffile', () => {
  const FILES: [string, string, (i: number) => number][] = [
    ['u2-be-lzw-2', 'Uint16Array', ramp],
    ['i4-be-zlib-2', 'Int32Array', ramp],
    ['f4-be-zlib-3', 'Float32Array', (i) => ramp(i) / 8],
    ['f8-be-zstd-3', 'Float64Array', (i) => ramp(i) / 8],
    ['f4-le-lzw-3', 'Float32Array', (i) => ramp(i) / 8],
    ['i2-le-packbits', 'Int16Array', ramp],
    ['u1-be-zstd-2', 'Uint8Array', (i) => ramp(i) % 256],
    ['i8-be-zlib', 'Int32Array', ramp],
  ];

  test.each(FILES)('%s', async (name, kind, value) => {
    const { data, dims } = await readTiff(written(name));
    expect(data.constructor.name).toBe(kind);
    expect(dims).toEqual([21, 17, 2]);
    expect([...data]).toEqual(Array.from({ length: VOXELS }, (_, i) => value(i)));
  });

  test('floats of 16 bits', async () => {
    const { data } = await readTiff(written('f2-be'));
    expect(data).toBeInstanceOf(Float32Array);
    // They have 11 binary digits.
    for (const [i, value] of data.entries())
      expect(Math.abs(value - ramp(i) / 8)).toBeLessThanOrEqual(ramp(i) / 8 / 2048);
  });

  test.each(['u2-be-samples-2', 'u2-le-planes'])('samples are channels: %s', async (name) => {
    const file = written(name);
    const opened = await openTiff(file);
    expect(opened.channels.map((channel) => channel.name)).toEqual([1, 2, 3].map((k) => `channel 1 (sample ${k})`));
    for (const channel of [0, 1, 2]) {
      const { data, warnings } = await opened.read({ channel });
      // Sample after sample in each of two slices.
      const index = (i: number) => Math.floor(i / 357) * 3 * 357 + channel * 357 + (i % 357);
      expect([...data]).toEqual(Array.from({ length: VOXELS }, (_, i) => ramp(index(i))));
      expect(warnings).toBeUndefined();
    }
    expect((await readTiff(file)).warnings).toBeUndefined();
    expect(opened.channels).toHaveLength(3);
  });

  test('JPEG', async () => {
    const { data } = await readTiff(written('jpeg'));
    const exact = (i: number) => 3 * Math.floor(i / 40) + 2 * (i % 40);
    for (let i = 0; i < 960; i++) expect(Math.abs((data[i] ?? 0) - exact(i))).toBeLessThanOrEqual(2);
  });

  test('give the same from Blobs, of which only parts are read at a time', async () => {
    for (const [name] of FILES) {
      const { bytes } = written(name);
      expect(await readTiff(new File([bytes], name))).toEqual(await readTiff({ name, bytes }));
    }
  });

  test('are not changed', async () => {
    for (const [name] of FILES) {
      const file = written(name);
      const before = file.bytes.slice();
      await readTiff(file);
      expect(file.bytes).toEqual(before);
    }
  });
});

describe('samples', () => {
  test('of 1 to 7 bits become bytes, rows begin at whole bytes', async () => {
    const bits = async (size: number, width: number, ...data: number[]) => [
      ...(await readTiff(page({ 256: width, 257: 2, 258: size }, ...data))).data,
    ];
    expect(await bits(1, 10, 0b10110010, 0b01000000, 0b00000001, 0b11000000)).toEqual(
      [1, 0, 1, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1], // prettier-ignore
    );
    expect(await bits(2, 3, 0b00011000, 0b11100100)).toEqual([0, 1, 2, 3, 2, 1]);
    expect(await bits(4, 3, 0x12, 0x30, 0xfe, 0xd0)).toEqual([1, 2, 3, 15, 14, 13]);
  });

  test('of 12 bits, signed or not', async () => {
    const tags = { 256: 3, 257: 1, 258: 12 };
    expect((await readTiff(page(tags, 0x12, 0x3f, 0xff, 0x80, 0x00))).data).toEqual(
      Uint16Array.of(0x123, 0xfff, 0x800),
    );
    const signed = await readTiff(page({ ...tags, 339: 2 }, 0x12, 0x3f, 0xff, 0x80, 0x00));
    expect(signed.data).toEqual(Int16Array.of(0x123, -1, -0x800));
  });

  test('of 1 bit are bits where no number is stated, as by default', async () => {
    const bytes = tiff([{ data: Uint8Array.of(0b10100000), tags: { 256: 3, 258: [] } }]);
    expect([...(await readTiff({ name: 'mask.tif', bytes })).data]).toEqual([1, 0, 1]);
  });

  test('are given as they are stored, where 0 is white, too', async () => {
    const { data, warnings } = await readTiff(page({ 256: 4, 262: 0 }, 9, 8, 7, 6));
    expect({ data: [...data], warnings }).toEqual({ data: [9, 8, 7, 6], warnings: undefined });
  });

  test('in bytes whose first pixel is in the lowest bit', async () => {
    expect([...(await readTiff(page({ 256: 8, 258: 1, 266: 2 }, 0b00000111))).data]).toEqual([1, 1, 1, 0, 0, 0, 0, 0]);
  });

  test('of 64 bits: integers in 32 bits if they fit, as doubles if these are exact, else refused', async () => {
    const read = (format: number, ...values: bigint[]) => {
      const data = new Uint8Array(BigInt64Array.from(values).buffer);
      return readTiff(page({ 256: values.length, 258: 64, 339: format }, ...data));
    };
    expect((await read(2, -5n, 7n)).data).toEqual(Int32Array.of(-5, 7));
    expect((await read(1, 4294967295n)).data).toEqual(Uint32Array.of(4294967295));
    expect((await read(1, 4294967296n, 3n)).data).toEqual(Float64Array.of(4294967296, 3));
    expect((await read(2, -9007199254740992n)).data).toEqual(Float64Array.of(-9007199254740992));
    expect((await rejection(read(2, 9007199254740994n))).message).toMatch(
      /page 1: 64-bit samples must be at most 9007/,
    );
  });

  test('that are complex, of unequal size, of 24 bits or of unknown types are refused by name', async () => {
    const refusal = async (tags: Tags) => (await rejection(readTiff(page(tags, ...new Array(64).fill(0))))).message;
    expect(await refusal({ 258: 64, 339: 6 })).toMatch(/complex numbers/);
    expect(await refusal({ 258: [5, 6, 5], 277: 3 })).toMatch(/same number of bits, got 5, 6, 5/);
    expect(await refusal({ 258: 24 })).toMatch(/BitsPerSample is 24/);
    expect(await refusal({ 258: 8, 339: 3 })).toMatch(/BitsPerSample is 8; floats of 16, 32 and 64/);
    expect(await refusal({ 339: 9 })).toMatch(/SampleFormat 9/);
    expect(await refusal({ 259: 34712 })).toMatch(/unsupported compression JPEG 2000; supported: none/);
    expect(await refusal({ 259: 4 })).toMatch(/compression CCITT Group 4/);
    expect(await refusal({ 259: 12345 })).toMatch(/compression number 12345/);
    expect(await refusal({ 317: 2 })).toMatch(/unsupported predictor 2 for compression none/);
    expect(await refusal({ 262: 5, 277: 4 })).toMatch(/PhotometricInterpretation 5/);
  });
});

describe('colours', () => {
  const rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
  const LIGHT = [54, 182, 18, 255];

  test.each([1, 2])('are read as their luminance, with a warning, in planar configuration %i', async (planar) => {
    const planes = [0, 1, 2].flatMap((c) => [0, 1, 2, 3].map((i) => rgb[3 * i + c] ?? 0));
    const data = Uint8Array.from(planar === 1 ? rgb : planes);
    const strips: Tags = planar === 1 ? {} : { 273: [8, 12, 16], 279: [4, 4, 4] };
    const tags = { 256: 4, 258: [8, 8, 8], 262: 2, 277: 3, 284: planar, ...strips };
    const { data: light, warnings } = await readTiff({ name: 'rgb.tif', bytes: tiff([{ data, tags }]) });
    expect([...light]).toEqual(LIGHT);
    expect(warnings).toMatchObject([
      { code: 'reader', text: expect.stringMatching(/luminance, 0.2126 red \+ 0.7152 green \+ 0.0722 blue/) },
    ]);
  });

  test('of a palette are its indices, with a warning', async () => {
    const { data, warnings } = await readTiff(page({ 256: 3, 262: 3 }, 4, 2, 0));
    expect([...data]).toEqual([4, 2, 0]);
    expect(warnings?.[0]?.text).toMatch(/palette: the indices/);
  });

  test('opacity beside a grey value is left out, with a warning', async () => {
    const { data, warnings } = await readTiff(page({ 256: 2, 258: [8, 8], 277: 2, 338: 2 }, 10, 255, 20, 255));
    expect([...data]).toEqual([10, 20]);
    expect(warnings?.[0]?.text).toMatch(/opacity/);
  });
});

describe('compression', () => {
  test('PackBits: literals, runs, and a byte that does nothing', async () => {
    const tags = { 256: 7, 259: 32773 };
    expect([...(await readTiff(page(tags, 1, 5, 6, 128, 254, 9, 1, 3, 4))).data]).toEqual([5, 6, 9, 9, 9, 3, 4]);
  });

  test('LZW: a code for the string that it completes', async () => {
    const { data } = await readTiff(page({ 256: 3, 259: 5 }, 0x80, 0x02, 0xa0, 0x50, 0x10));
    // Clear, 10, 258 (twice 10), end.
    expect([...data]).toEqual([10, 10, 10]);
  });

  test('LZW without the code for the end, or with other bits there', async () => {
    // Clear, 10, 258.
    for (const rest of [[0x40], [0x5f, 0xff], [0x48, 0x08]])
      expect([...(await readTiff(page({ 256: 3, 259: 5 }, 0x80, 0x02, 0xa0, ...rest))).data]).toEqual([10, 10, 10]);
  });

  test('deflate with surplus bytes after the stream', async () => {
    const stream = new Blob([Uint8Array.of(1, 2, 3)]).stream().pipeThrough(new CompressionStream('deflate'));
    const stored = new Uint8Array(await new Response(stream).arrayBuffer());
    expect([...(await readTiff(page({ 256: 3, 259: 8 }, ...stored, 0, 0, 0))).data]).toEqual([1, 2, 3]);
  });

  test('Zstandard without the size of its content, as libtiff writes it, and damaged', async () => {
    const frame = [0x28, 0xb5, 0x2f, 0xfd, 0, 0x58, ...[(3 << 3) | 1, 0, 0], 7, 8, 9];
    expect([...(await readTiff(page({ 256: 3, 259: 50000 }, ...frame))).data]).toEqual([7, 8, 9]);
    // A compressed block whose content is nonsense, which the decoder itself would decode without end.
    const damaged = [0x28, 0xb5, 0x2f, 0xfd, 0, 0x58, ...[(3 << 3) | 5, 0, 0], 255, 255, 255];
    const error = await rejection(readTiff(page({ 256: 3, 259: 50000 }, ...damaged)));
    expect(error.message).toMatch(/page 1: truncated or damaged, or not compressed by Zstandard/);
  });

  test('strips and tiles that are not stored are 0, with a warning', async () => {
    const tags = { 256: 2, 257: 2, 278: 1, 259: 32773, 273: [8, 0], 279: [3, 0] };
    const { data, warnings } = await readTiff(page(tags, 1, 4, 5));
    expect([...data]).toEqual([4, 5, 0, 0]);
    expect(warnings?.[0]?.text).toMatch(/page 1: parts of the image are not stored/);
  });
});

describe('forms of a file', () => {
  test.each([
    [false, true],
    [false, false],
    [true, true],
    [true, false],
  ])('BigTIFF %s, little-endian %s', async (isBig, isLittle) => {
    const { data, dims } = await readTiff(stack(3, '', 'stack.tif', {}, { isBig, isLittle }));
    expect({ data: [...data], dims }).toEqual({ data: valuesOf(0, 1, 2), dims: [5, 3, 3] });
  });

  test('many strips, whose offsets are far from the directory, in both orders of bytes', async () => {
    const rows = 600;
    for (const isLittle of [true, false]) {
      const offsets = Array.from({ length: rows }, (_, k) => 8 + k);
      const tags = { 257: rows, 278: 1, 273: offsets, 279: offsets.map(() => 1) };
      const data = Uint8Array.from(offsets);
      const bytes = tiff([{ data, tags }], { isLittle });
      expect((await readTiff({ name: 'strips.tif', bytes })).data).toEqual(data);
    }
  });

  test('strips that are not in the order of the rows', async () => {
    const tags = { 256: 2, 257: 3, 278: 1, 273: [12, 8, 10], 279: [2, 2, 2] };
    expect([...(await readTiff(page(tags, 1, 2, 3, 4, 5, 6))).data]).toEqual([5, 6, 1, 2, 3, 4]);
  });

  test('a wrong number of bytes of a strip that is not compressed', async () => {
    const { data } = await readTiff(page({ 256: 4, 279: 1 }, 1, 2, 3, 4));
    expect([...data]).toEqual([1, 2, 3, 4]);
  });

  test('tags of unknown types and private tags are passed over', async () => {
    const bytes = tiff(pagesOf(1, '', { 65000: 'private', 50838: [12, 9], 50839: 'IJIJ' }));
    expect([...(await readTiff({ name: 'private.tif', bytes })).data]).toEqual(valuesOf(0));
  });

  test('a volume of what was read', async () => {
    const volume = new Volume(await readTiff(stack(4, 'ImageJ=1.53\nimages=4\nslices=4\nspacing=2\nunit=mm\n')));
    expect(volume.dims).toEqual([5, 3, 4]);
    volume.free();
  });
});
