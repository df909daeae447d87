// `vesicle/tiff` with damaged and malicious files, and work that is aborted.
import { describe, expect, test } from 'vitest';
import { VesicleError } from '../../pkg/index.js';
import { type InputFile, openTiff, readTiff, type TiffOptions } from '../../pkg/tiff/index.js';
import { rejection } from './helpers.js';
import { ome, pagesOf, stack, type Tags, tiff, valuesOf } from './tiff-files.js';

const bytesOf = (...bytes: number[]) => ({ name: 'x.tif', bytes: Uint8Array.from(bytes) });

const page = (tags: Tags, ...data: number[]) => ({
  name: 'x.tif',
  bytes: tiff([{ data: Uint8Array.from(data), tags }]),
});

const refusal = async (files: InputFile | InputFile[]) => {
  const { code, message } = await rejection(readTiff(files));
  return `${code}: ${message}`;
};

describe('a file that is', () => {
  test('no TIFF, empty or cut is refused in words', async () => {
    expect(await refusal(bytesOf())).toMatch(/^bad-file: TIFF: x.tif: not a TIFF file: it must begin with II or MM/);
    expect(await refusal(bytesOf(0x89, 0x50, 0x4e, 0x47, 0, 0, 0, 0, 0))).toMatch(/not a TIFF file/);
    expect(await refusal(bytesOf(0x49, 0x49, 42, 0, 0, 0, 0, 0))).toMatch(/the file has no pages/);
    const { bytes } = stack(3);
    for (const end of [9, 60, 120, 200, bytes.length - 1])
      expect(await refusal({ name: 'x.tif', bytes: bytes.slice(0, end) })).toMatch(/^bad-file: TIFF: x.tif: truncated/);
  });

  test('a cycle of directories is refused', async () => {
    for (const next of [0, 1, 2]) {
      const bytes = tiff(pagesOf(3), { next });
      expect(await refusal({ name: 'x.tif', bytes })).toMatch(/^bad-file: TIFF: x.tif: the directories form a cycle/);
    }
  });

  test('a chain of empty directories is refused', async () => {
    // As many as bytes, each beginning within the one before.
    const bytes = new Uint8Array(2000);
    bytes.set([0x49, 0x49, 42, 0, 8, 0, 0, 0]);
    const view = new DataView(bytes.buffer);
    for (let at = 8; at + 20 < bytes.length; at += 4) view.setUint32(at + 2, at + 4, true);
    expect(await refusal({ name: 'x.tif', bytes })).toMatch(/^bad-file: TIFF: x.tif: the directory of page 1 is empty/);
  });

  test('small, but says that it is large, is refused before memory is allocated', async () => {
    const large = { 256: 2 ** 30, 257: 2 ** 30, 273: 8, 279: 4, 278: 1 };
    expect(await refusal(page(large, 1, 2, 3, 4))).toMatch(
      /^too-large: TIFF: x.tif: the images have 11529215\d+ bytes/,
    );
    for (const compression of [5, 7, 8, 32773, 50000])
      expect(await refusal(page({ ...large, 259: compression }, 1, 2, 3, 4))).toMatch(/^too-large: /);
    const tile = { 256: 2, 257: 2, 322: 2 ** 30, 323: 2 ** 30, 324: 8, 325: 4, 273: [], 279: [] };
    expect(await refusal(page(tile, 1, 2, 3, 4))).toMatch(/^bad-file: /);
    expect(await refusal(page({ 270: 'ImageJ=1\nimages=4000000000\nslices=4000000000\n' }, 7))).toMatch(
      /truncated: bytes 8 to 4000000008/,
    );
    expect(await refusal(page({ 277: 4e9 }, 7))).toMatch(/SamplesPerPixel must be 1 to 65535, got 4000000000/);
    const channels = { 258: 1, 270: 'ImageJ=1\nimages=70000\nchannels=70000\n', 273: 2 ** 12 };
    const sparse = { name: 'x.tif', bytes: tiff([{ tags: channels }], { after: new Uint8Array(80_000) }) };
    expect(await refusal(sparse)).toMatch(/70000 channels; at most 65535/);
    expect(await refusal(page({ 256: 0 }, 7))).toMatch(/ImageWidth must be from 1 to 2147483647, got 0/);
    expect(await refusal(page({ 256: 4, 259: 5, 279: 0 }, 7))).toMatch(
      /offset or number of bytes of strips is missing/,
    );
    expect(await refusal(page({ 256: 4, 273: 0 }, 7))).toMatch(/offset or number of bytes of strips is missing/);
    expect(await refusal(page({ 256: 4, 278: 0, 259: 5, 279: [] }, 7))).toMatch(
      /offset or number of bytes of strips is missing/,
    );
  });

  test('small, with a strip that decodes to much', async () => {
    const zeros = new Blob([new Uint8Array(5e7)]).stream().pipeThrough(new CompressionStream('deflate'));
    const stored = new Uint8Array(await new Response(zeros).arrayBuffer());
    const { data } = await readTiff({ name: 'x.tif', bytes: tiff([{ data: stored, tags: { 256: 100, 259: 8 } }]) });
    expect(data).toEqual(new Uint8Array(100));
  });

  test('of many pages that share a strip is refused', async () => {
    const shared = Array.from({ length: 200 }, () => ({ tags: { 256: 1000, 257: 100, 273: 8, 279: 1e5 } }));
    const bytes = tiff([{ data: new Uint8Array(1e5), tags: { 256: 1000, 257: 100 } }, ...shared]);
    expect(await refusal({ name: 'x.tif', bytes })).toMatch(/^too-large: .* more than \d+ bytes of files can hold/);
  });

  test('damaged in its compressed data', async () => {
    for (const compression of [5, 7, 8, 32773, 50000]) {
      const text = await refusal(page({ 256: 9, 259: compression }, 1, 255, 3, 4));
      expect(text).toMatch(/^bad-file: TIFF: x.tif: page 1: truncated or damaged, or not compressed by/);
    }
    expect(await refusal(page({ 256: 9, 259: 5 }, 0, 1, 3, 4))).toMatch(/codes with the lowest bit first/);
  });

  test('an OME description with absurd numbers, or of great length', async () => {
    const sizes = 'SizeZ="1000000000" SizeC="1000000000" SizeT="1000000000"';
    expect(await refusal(stack(1, ome(sizes)))).toMatch(/SizeZ, SizeC, SizeT .* are too large/);
    const far = ome('SizeZ="100000000" SizeT="1000000"', '<TiffData IFD="0" FirstZ="99999999" FirstT="999999"/>');
    expect(await refusal(stack(1, far))).toMatch(/slice 1 of frame 1 of channel 1 is missing/);
    const many = ome('SizeC="1000000000"', '<TiffData IFD="0" FirstC="999999999"/>');
    expect((await openTiff(stack(1, many))).remarks[0]).toMatch(/999999999 of 1000000000 channels/);
    const again = '<TiffData IFD="0" PlaneCount="100"/>'.repeat(20_000);
    expect(await refusal(stack(4, ome('SizeZ="100"', again)))).toMatch(/placed again and again/);
    const longest = [
      '<',
      '<a '.repeat(1e5),
      `<a ${'b'.repeat(1e6)}`,
      `<a b="${'c'.repeat(1e6)}`,
      '<!-- '.repeat(1e5),
      '<?',
    ];
    for (const text of longest)
      expect(await refusal(stack(1, `<OME >${text}`))).toMatch(/its OME description has no image/);
  });

  test('changed at random is read, or refused in words', async () => {
    const pages = pagesOf(3, ome('SizeZ="3"'), { 317: 1, 339: 1, 266: 1, 284: 1 });
    const whole = tiff(pages);
    let state = 7;
    const random = (limit: number) => {
      state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
      return Math.floor((state / 2 ** 32) * limit);
    };
    for (let round = 0; round < 1000; round++) {
      const bytes = whole.slice();
      for (let k = random(4); k >= 0; k--) bytes[random(bytes.length)] = random(256);
      const found = await readTiff({ name: 'x.tif', bytes }).catch((error: unknown) => error);
      if (found instanceof Error) {
        expect(found).toBeInstanceOf(VesicleError);
        expect((found as VesicleError).code).toMatch(/^(bad-file|too-large)$/);
      }
    }
  });
});

describe('arguments', () => {
  test('are checked', async () => {
    const file = stack(2);
    const refused = async (files: unknown, options?: unknown) =>
      (await rejection(readTiff(files as InputFile, options as TiffOptions))).message;
    expect(await refused([])).toMatch(/^files: must be one or several TIFF files/);
    expect(await refused(undefined)).toMatch(/^files: /);
    expect(await refused([file, 'x.tif'])).toMatch(/^files\[1\]: must be a File, a Blob, or \{ name, bytes \}/);
    expect(await refused({ name: 'x', bytes: [1, 2] })).toMatch(/^files: must be a File/);
    expect(await refused(file, { chanel: 1 })).toMatch(/^chanel: unknown property of options/);
    expect(await refused(file, { channel: -1 })).toMatch(/^channel: must be an integer/);
    expect(await refused(file, { channel: 1 })).toMatch(/^channel: must be an integer from 0 to 0, got 1/);
    expect(await refused(file, { signal: 1 })).toMatch(/^signal: /);
    expect(await refused(file, { onProgress: 1 })).toMatch(/^onProgress: /);
  });

  test('may be a Blob without a name, or a list like that of an input', async () => {
    const { bytes } = stack(2);
    expect([...(await readTiff(new Blob([bytes]))).data]).toEqual(valuesOf(0, 1));
    const list = { length: 1, 0: new File([bytes], 'a.tif') };
    expect([...(await readTiff(list)).data]).toEqual(valuesOf(0, 1));
  });

  test('a Blob that cannot be read', async () => {
    class Lost extends Blob {
      override slice(): Blob {
        return Object.assign(new Blob(), { arrayBuffer: () => Promise.reject(new Error('the file has changed')) });
      }
    }
    expect(await refusal(new Lost([stack(2).bytes]))).toMatch(
      /^bad-file: TIFF: file: cannot be read: the file has changed/,
    );
  });
});

describe('reading', () => {
  /** A stack of 40 MB that is not compressed. */
  const large = () => {
    const [wide, high, count] = [1024, 1024, 20];
    const data = new Uint8Array(2 * wide * high * count);
    const text = `ImageJ=1.53\nimages=${count}\nslices=${count}\n`;
    const header = stack(1, text, '', { 256: wide, 257: high, 258: 16, 273: 4096, 279: 2 * wide * high }).bytes;
    return new Blob([header, new Uint8Array(4096 - header.length), data]);
  };

  test('reports its progress', async () => {
    const shares: number[] = [];
    await readTiff(stack(4), { onProgress: (share) => shares.push(share) });
    expect(shares).toEqual([0.25, 0.5, 0.75, 1]);
    const error = new Error('enough');
    await expect(
      readTiff(stack(4), {
        onProgress: () => {
          throw error;
        },
      }),
    ).rejects.toBe(error); // prettier-ignore
  });

  test('ends when it is aborted: before, and soon after', async () => {
    const reason = new Error('no longer');
    const signal = AbortSignal.abort(reason);
    await expect(readTiff(stack(2), { signal })).rejects.toBe(reason);
    await expect(openTiff(stack(2), { signal })).rejects.toBe(reason);
    const bytes = new Uint8Array(await large().arrayBuffer());
    for (const file of [large(), { name: 'x.tif', bytes }]) {
      const controller = new AbortController();
      let last = 0;
      const work = readTiff(file, {
        signal: controller.signal,
        onProgress: (share) => {
          last = share;
        },
      }); // prettier-ignore
      setTimeout(() => controller.abort(reason), 1);
      await expect(work).rejects.toBe(reason);
      expect(last).toBeLessThan(1);
    }
  });

  test('of a Blob holds little of it at a time', async () => {
    let largest = 0;
    class Watched extends Blob {
      override slice(start = 0, end = this.size): Blob {
        largest = Math.max(largest, end - start);
        return super.slice(start, end);
      }
    }
    const { data } = await readTiff(new Watched([large()]));
    expect(data.length).toBe(20 * 2 ** 20);
    expect(largest).toBeLessThanOrEqual(2 ** 22);
  });
});
