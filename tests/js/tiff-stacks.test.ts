// `vesicle/tiff`: which page is which slice, and how large voxels are.
import { describe, expect, test } from 'vitest';
import { type InputFile, openTiff, readTiff } from '../../pkg/tiff/index.js';
import { rejection } from './helpers.js';
import { EACH, HIGH, type Made, ome, pagesOf, stack, tiff, valuesOf, WIDE } from './tiff-files.js';

const imageJ = (...lines: string[]) => ['ImageJ=1.53t', ...lines, ''].join('\n');

const tiffData = (...places: [ifd: number, z: number, c: number, t: number][]) =>
  places.map(([ifd, z, c, t]) => `<TiffData IFD="${ifd}" FirstZ="${z}" FirstC="${c}" FirstT="${t}"/>`).join('');

/** Returns the pages that the slices of a channel are, and the texts of all warnings. */
async function pagesIn(files: InputFile | InputFile[], channel?: number) {
  const { data, dims, warnings } = await readTiff(files, channel === undefined ? {} : { channel });
  const pages = Array.from({ length: data.length / EACH }, (_, k) => Math.round((data[k * EACH] ?? 0) / 1000));
  expect([...data]).toEqual(valuesOf(...pages));
  return { pages, dims, warnings: (warnings ?? []).map(({ text }) => text).join('; ') };
}

/** Returns the world of a stack. */
async function worldOf(file: Made) {
  const { spacing, unit, frameSeconds, warnings } = await readTiff(file);
  return { spacing, unit, frameSeconds, warnings: (warnings ?? []).map(({ text }) => text).join('; ') };
}

describe('TiffData', () => {
  test('place pages in another order', async () => {
    const text = ome(
      'SizeZ="4" DimensionOrder="XYZCT"',
      tiffData([3, 0, 0, 0], [2, 1, 0, 0], [1, 2, 0, 0], [0, 3, 0, 0]),
    );
    expect(await pagesIn(stack(4, text))).toEqual({ pages: [3, 2, 1, 0], dims: [5, 3, 4], warnings: '' });
  });

  test('contradict DimensionOrder, and are right', async () => {
    const places = [0, 1].flatMap((c) => [0, 1, 2].map((z): [number, number, number, number] => [3 * c + z, z, c, 0]));
    const text = ome('SizeZ="3" SizeC="2" DimensionOrder="XYCZT"', tiffData(...places));
    expect((await pagesIn(stack(6, text), 0)).pages).toEqual([0, 1, 2]);
    expect((await pagesIn(stack(6, text), 1)).pages).toEqual([3, 4, 5]);
    expect((await openTiff(stack(6, text))).channels).toEqual([{ name: 'channel 1' }, { name: 'channel 2' }]);
  });

  test('of several pages continue in DimensionOrder', async () => {
    const content = '<TiffData IFD="2" FirstC="1" PlaneCount="2"/><TiffData IFD="0" PlaneCount="2"/>';
    const text = ome('SizeZ="2" SizeC="2" DimensionOrder="XYZCT"', content);
    expect((await pagesIn(stack(4, text), 1)).pages).toEqual([2, 3]);
  });

  test.each([
    ['XYZCT', [0, 1, 4, 5, 8, 9]],
    ['XYCZT', [0, 2, 4, 6, 8, 10]],
    ['XYTZC', [0, 3, 1, 4, 2, 5]],
    ['XYCTZ', [0, 6, 2, 8, 4, 10]],
  ])('that say nothing leave it to DimensionOrder %s', async (order, pages) => {
    const text = (content: string) => ome(`SizeZ="2" SizeC="2" SizeT="3" DimensionOrder="${order}"`, content);
    for (const content of ['', '<TiffData/>']) {
      expect(await pagesIn(stack(12, text(content)), 0)).toEqual({ pages, dims: [5, 3, 2, 3], warnings: '' });
    }
  });

  test('with a gap: the channel is refused, others are read', async () => {
    const text = ome(
      'SizeZ="3" SizeC="2"',
      tiffData([0, 0, 0, 0], [1, 2, 0, 0], [2, 0, 1, 0], [3, 1, 1, 0], [4, 2, 1, 0]),
    );
    const error = await rejection(readTiff(stack(5, text)));
    expect(error).toMatchObject({
      code: 'bad-file',
      message: expect.stringMatching(/slice 2 of frame 1 of channel 1 is missing/),
    });
    expect((await pagesIn(stack(5, text), 1)).pages).toEqual([2, 3, 4]);
  });

  test('that end early: complete frames are read, with a warning', async () => {
    const text = ome('SizeZ="2" SizeT="9" DimensionOrder="XYZCT"');
    const { pages, dims, warnings } = await pagesIn(stack(5, text));
    expect({ pages, dims }).toEqual({ pages: [0, 1, 2, 3], dims: [5, 3, 2, 2] });
    expect(warnings).toMatch(/9 frames are described, but only 2 are complete/);
  });

  test('that leave pages out: a warning', async () => {
    const text = ome('SizeZ="2"', tiffData([0, 0, 0, 0], [1, 1, 0, 0]));
    expect((await pagesIn(stack(5, text))).warnings).toMatch(/3 pages have no place in the OME description/);
  });

  test('that place a page, or a slice, twice or outside are refused', async () => {
    const refusal = async (...places: Parameters<typeof tiffData>) =>
      (await rejection(readTiff(stack(3, ome('SizeZ="3"', tiffData(...places)))))).message;
    expect(await refusal([0, 0, 0, 0], [0, 1, 0, 0])).toMatch(
      /page 1: TiffData: the page is at slice 2, .* another place/,
    );
    expect(await refusal([0, 0, 0, 0], [1, 0, 0, 0])).toMatch(
      /page 2: TiffData: slice 1, .* is this page, and another one/,
    );
    expect(await refusal([0, 3, 0, 0])).toMatch(/FirstZ is 3, SizeZ 3/);
    expect(await refusal([9, 0, 0, 0])).toMatch(/places no page/);
  });
});

describe('a data set of several OME-TIFF', () => {
  const uuid = (k: number) => `urn:uuid:0000000${k}`;
  const inFile = (name: string, k: number, places: string) =>
    places.replaceAll('/>', `><UUID FileName="${name}">${uuid(k)}</UUID></TiffData>`);
  const content =
    '<Channel ID="Channel:0" Name="DAPI &amp; more"/><Channel Name="GFP"/>' +
    inFile('c0.ome.tif', 0, tiffData([0, 0, 0, 0], [1, 1, 0, 0])) +
    inFile('c1.ome.tif', 1, tiffData([0, 0, 1, 0], [1, 1, 1, 0]));
  const text = (k: number) => ome('SizeZ="2" SizeC="2" DimensionOrder="XYCZT"', content, `UUID="${uuid(k)}"`);
  const pagesFrom = (from: number, k: number) =>
    tiff(
      pagesOf(from + 2, '')
        .slice(from)
        .map((page, z) => (z === 0 ? { ...page, tags: { ...page.tags, 270: text(k) } } : page)),
    );
  const files: Made[] = [0, 1].map((k) => ({ name: `c${k}.ome.tif`, bytes: pagesFrom(2 * k, k) }));

  test('has one file per channel', async () => {
    const opened = await openTiff(files);
    expect(opened.channels).toEqual([{ name: 'DAPI & more' }, { name: 'GFP' }]);
    expect((await pagesIn(files, 0)).pages).toEqual([0, 1]);
    expect((await pagesIn([...files].reverse(), 1)).pages).toEqual([2, 3]);
  });

  test('of which one file was opened has the channel that is in it', async () => {
    for (const [k, file] of files.entries()) {
      const opened = await openTiff(file);
      expect(opened.channels).toEqual([{ name: ['DAPI & more', 'GFP'][k] }]);
      const { pages, warnings } = await pagesIn(file);
      expect([pages, warnings]).toEqual([[2 * k, 2 * k + 1], '']);
      expect(opened.remarks.join()).toMatch(
        `1 of 2 channels are not in the files that were opened: ${['GFP (in "c1', 'DAPI & more (in "c0'][k]}`,
      );
    }
  });

  test('whose files have other names now is found by their identifiers', async () => {
    const renamed = files.map(({ bytes }, k) => ({ name: `renamed ${1 - k}.tif`, bytes }));
    expect((await pagesIn(renamed, 0)).pages).toEqual([0, 1]);
  });

  test('has a file that is missing in the middle', async () => {
    const parts = [0, 1, 2].map((z) => inFile(`z${z}.tif`, z, tiffData([0, z, 0, 0]))).join('');
    const one = (z: number) => stack(1, ome('SizeZ="3"', parts, `UUID="${uuid(z)}"`), `z${z}.tif`);
    expect((await pagesIn([one(0), one(1), one(2)])).pages).toEqual([0, 0, 0]);
    expect((await rejection(readTiff([one(0), one(2)]))).message).toMatch(/slice 2 of frame 1 .*"z1.tif" .*not opened/);
  });

  test('with a file of something else is refused', async () => {
    const error = await rejection(readTiff([...files, stack(1, '', 'other.tif')]));
    expect(error.message).toMatch(/other.tif: not one of the files that "c0.ome.tif" describes/);
  });

  test('is described by a file of its own, which is needed', async () => {
    const companion = { name: 'set.companion.ome', bytes: new TextEncoder().encode(text(9)) };
    const binaryOnly = (k: number) => {
      const root = `<?xml version="1.0"?><OME UUID="${uuid(k)}"><BinaryOnly MetadataFile="set.companion.ome" UUID="x"/></OME>`;
      return stack(2, root, `c${k}.ome.tif`);
    };
    expect((await pagesIn([binaryOnly(0), binaryOnly(1), companion], 1)).pages).toEqual([0, 1]);
    const error = await rejection(openTiff([binaryOnly(0), binaryOnly(1)]));
    expect(error.message).toMatch(
      /c0.ome.tif: described by the file "set.companion.ome", which has to be opened with it/,
    );
  });
});

describe('an OME description', () => {
  test('names a file that has another name now', async () => {
    const text = ome(
      'SizeZ="2"',
      '<TiffData IFD="0" PlaneCount="2"><UUID FileName="old.tif">urn:uuid:1</UUID></TiffData>',
    );
    expect((await pagesIn(stack(2, text, 'new.tif'))).pages).toEqual([0, 1]);
  });

  test('has several images: the first that has pages is read, with a warning', async () => {
    const image = (name: string, content: string) =>
      `<Image Name="${name}"><Pixels SizeX="5" SizeY="3" SizeZ="2">${content}</Pixels></Image>`;
    const elsewhere = '<TiffData><UUID FileName="else.tif">urn:uuid:7</UUID></TiffData>';
    const text = `<OME>${image('a', elsewhere)}${image('b', tiffData([2, 0, 0, 0], [1, 1, 0, 0]))}</OME>`;
    const { pages, warnings } = await pagesIn(stack(3, text));
    expect(pages).toEqual([2, 1]);
    expect(warnings).toMatch(/the file has 2 images: number 2 \("b"\) is read/);
  });

  test('has names with a prefix, comments and quotes', async () => {
    const text = `<?xml version='1.0'?><!-- <OME:Pixels SizeZ="9"/> --><OME:OME xmlns:OME="a>b"><OME:Image>
      <OME:Pixels SizeX = '5' SizeY='3'\n SizeZ='2' DimensionOrder='XYZCT'/></OME:Image></OME:OME>`;
    expect((await pagesIn(stack(2, text))).dims).toEqual([5, 3, 2]);
  });

  test('contradicts the pages: a warning', async () => {
    const warned = async (from: string, to: string) =>
      (await pagesIn(stack(2, ome('SizeZ="2"').replace(from, to)))).warnings;
    expect(await warned('SizeX="5"', 'SizeX="10"')).toMatch(/10 × 3 pixels are described, the pages have 5 × 3/);
    expect(await warned('Type="uint16"', 'Type="int16"')).toMatch(
      /described type is int16, but samples are read as unsigned/,
    );
  });

  test('counts the samples of a page as channels', async () => {
    const data = Uint8Array.from([1, 2, 3, 4, 5, 6]);
    const tags = {
      256: 2,
      258: [8, 8, 8],
      262: 2,
      277: 3,
      270: ome('SizeC="3"').replace('SizeX="5" SizeY="3"', 'SizeX="2" SizeY="1"'),
    };
    const file = { name: 'rgb.ome.tif', bytes: tiff([{ data, tags }]) };
    expect([...(await readTiff(file, { channel: 2 })).data]).toEqual([3, 6]);
  });

  test('counts the samples of colours that are not red, green and blue: refused', async () => {
    const tags = { 258: [8, 8, 8, 8], 262: 5, 277: 4, 270: ome('SizeC="4"') };
    const file = { name: 'cmyk.ome.tif', bytes: tiff([{ data: new Uint8Array(4), tags }]) };
    expect((await rejection(readTiff(file))).message).toMatch(/PhotometricInterpretation 5 with 4 samples/);
  });

  test('has coarser levels in pages of pages, which are not counted', async () => {
    const pages = pagesOf(2, ome('SizeZ="2"'), { 330: 8 });
    expect((await pagesIn({ name: 'pyramid.ome.tif', bytes: tiff(pages) })).pages).toEqual([0, 1]);
  });
});

describe('units', () => {
  const sized = (...axes: [number, string?][]) =>
    axes
      .map(([size, unit], k) => {
        const name = `PhysicalSize${'XYZ'[k]}`;
        return `${name}="${size}" ${unit ? `${name}Unit="${unit}"` : ''}`;
      })
      .join(' ');
  const omeWorld = (pixels: string, z = 2) => worldOf(stack(z, ome(`SizeZ="${z}" ${pixels}`)));

  test('of OME are micrometres by default, and per axis', async () => {
    expect(await omeWorld(sized([0.5], [0.5], [0.002, 'mm']))).toMatchObject({
      spacing: [0.5, 0.5, 2],
      unit: 'um',
      warnings: '',
    });
    expect(await omeWorld(sized([2], [2], [4]))).toMatchObject({ spacing: [2, 2, 4], unit: 'um' });
    const nm = await omeWorld(sized([200, 'nm'], [200, 'nm'], [1]));
    expect(nm).toMatchObject({ spacing: [0.2, 0.2, 1], unit: 'um' });
    expect(await omeWorld(sized([1, 'cm'], [1, 'cm'], [5, 'mm']))).toMatchObject({ spacing: [10, 10, 5], unit: 'mm' });
    expect(await omeWorld(sized([2, 'm'], [2, 'm'], [50, 'cm']))).toMatchObject({ spacing: [2, 2, 0.5], unit: 'm' });
  });

  test('of OME that are rare', async () => {
    const z = async (size: number, unit: string) => (await omeWorld(sized([1], [1], [size, unit]))).spacing?.[2];
    expect(await z(5000, 'Å')).toBeCloseTo(0.5, 12);
    expect(await z(0.00001, 'dm')).toBeCloseTo(1, 12);
    expect(await z(1, 'thou')).toBe(25.4);
  });

  test('that are not lengths: sizes as they are, without a unit', async () => {
    const none = await omeWorld(sized([2, 'pixel'], [2, 'pixel'], [3, 'pixel']));
    expect(none).toEqual({ spacing: [2, 2, 3], unit: undefined, frameSeconds: undefined, warnings: '' });
    const mixed = await omeWorld(sized([2], [2], [3, 'reference frame']));
    expect(mixed).toMatchObject({ spacing: [2, 2, 3], unit: undefined });
    expect(mixed.warnings).toMatch(/voxel sizes along x, y, z are 2 µm, 2 µm, 3 reference frame/);
    expect(await omeWorld('')).toMatchObject({ spacing: [1, 1, 1], unit: undefined, warnings: '' });
  });

  test('without a distance of slices: 1, with a warning if there are several', async () => {
    expect((await omeWorld(sized([0.5], [0.5]))).warnings).toMatch(/no voxel size is stated along z: 1 µm is assumed/);
    expect((await omeWorld(sized([0.5], [0.5]), 1)).warnings).toBe('');
  });

  test('of time', async () => {
    const times = async (attributes: string) =>
      (await worldOf(stack(4, ome(`SizeZ="2" SizeT="2" ${attributes}`)))).frameSeconds;
    expect(await times('TimeIncrement="2"')).toBe(2);
    expect(await times('TimeIncrement="250" TimeIncrementUnit="ms"')).toBe(0.25);
    expect(await times('TimeIncrement="1.5" TimeIncrementUnit="min"')).toBe(90);
    expect(await times('')).toBeUndefined();
    // One frame has no time to the next.
    expect((await omeWorld('TimeIncrement="2"')).frameSeconds).toBeUndefined();
  });

  test.each(['micron', 'um', 'µm', 'μm', '\\u00B5m'])('of ImageJ: %s', async (unit) => {
    const resolution = {
      282: { fraction: [2, 1] as [number, number] },
      283: { fraction: [4, 1] as [number, number] },
      296: 1,
    };
    const file = stack(2, imageJ('images=2', 'slices=2', `unit=${unit}`, 'spacing=0.7'), 'ij.tif', resolution);
    expect(await worldOf(file)).toMatchObject({ spacing: [0.5, 0.25, 0.7], unit: 'um', warnings: '' });
  });

  test('of ImageJ with the sign for micro in Latin-1', async () => {
    const { name, bytes } = stack(2, imageJ('images=2', 'slices=2', 'unit=~m', 'spacing=3'));
    bytes[bytes.indexOf('~'.charCodeAt(0))] = 0xb5;
    expect(await worldOf({ name, bytes })).toMatchObject({ unit: 'um' });
  });

  test('of ImageJ: others, per axis, times, and distances below 0', async () => {
    const world = (...lines: string[]) =>
      worldOf(
        stack(4, imageJ('images=4', 'slices=2', 'frames=2', ...lines), 'ij.tif', {
          282: { fraction: [10, 1] },
          283: { fraction: [10, 1] },
        }),
      );
    expect(await world('unit=cm', 'spacing=-0.2')).toMatchObject({ spacing: [1, 1, 2], unit: 'mm' });
    expect(await world('unit=mm', 'zunit=um', 'spacing=50')).toMatchObject({ spacing: [0.1, 0.1, 0.05], unit: 'mm' });
    expect(await world('unit=inch', 'spacing=1')).toMatchObject({ spacing: [2.54, 2.54, 25.4], unit: 'mm' });
    expect(await world('unit=pixel', 'spacing=2')).toMatchObject({ spacing: [0.1, 0.1, 2], unit: undefined });
    expect(await world('finterval=0.5')).toMatchObject({ frameSeconds: 0.5 });
    expect(await world('finterval=20', 'tunit=ms')).toMatchObject({ frameSeconds: 0.02 });
  });

  test('of a resolution without a description, which may be that of paper, are not used', async () => {
    const file = stack(2, '', 'scan.tif', { 282: { fraction: [300, 1] }, 283: { fraction: [300, 1] }, 296: 2 });
    expect(await worldOf(file)).toMatchObject({ spacing: [1, 1, 1], unit: undefined });
  });
});

describe('ImageJ', () => {
  test('stores channels before slices before frames', async () => {
    const file = stack(12, imageJ('images=12', 'channels=2', 'slices=3', 'frames=2', 'spacing=0.7'));
    expect(await pagesIn(file, 0)).toMatchObject({ pages: [0, 2, 4, 6, 8, 10], dims: [5, 3, 3, 2] });
    expect((await pagesIn(file, 1)).pages).toEqual([1, 3, 5, 7, 9, 11]);
  });

  test('has one directory for all slices above 4 GB', async () => {
    const [first] = pagesOf(1, imageJ('images=4', 'slices=4', 'spacing=1.5', 'unit=um'));
    const data = (count: number) => Uint8Array.from(pagesOf(count).flatMap((page) => [...(page.data ?? [])]));
    const made = (count: number) => ({
      name: 'large.tif',
      bytes: tiff([{ data: data(count), tags: { ...first?.tags, 279: 2 * EACH } }]),
    });
    expect(await pagesIn(made(4))).toEqual({ pages: [0, 1, 2, 3], dims: [5, 3, 4], warnings: '' });
    expect((await pagesIn(new File([made(4).bytes], 'large.tif'))).pages).toEqual([0, 1, 2, 3]);
    // Too short: what follows the data is the directory, or the end of the file.
    expect((await rejection(readTiff(made(3)))).message).toMatch(/4 images are described, but the file has fewer/);
    const [head] = pagesOf(1, imageJ('images=40', 'slices=40'));
    const cut = { name: 'cut.tif', bytes: tiff(head ? [head] : []) };
    expect((await rejection(readTiff(cut))).message).toMatch(/truncated: bytes 8 to 1208 are needed/);
  });

  test('with one page that is compressed, but described as several, is refused', async () => {
    const [page] = pagesOf(1, imageJ('images=4', 'slices=4'), { 259: 5 });
    const error = await rejection(readTiff({ name: 'one.tif', bytes: tiff(page ? [page] : []) }));
    expect(error.message).toMatch(/4 images are described, but only one is in the file/);
  });

  test('describes other numbers than there are: what is complete is read, with a warning', async () => {
    const described = (...lines: string[]) => imageJ('hyperstack=true', ...lines);
    const early = await pagesIn(stack(5, described('images=12', 'slices=2', 'frames=6')));
    expect(early).toMatchObject({ pages: [0, 1, 2, 3], dims: [5, 3, 2, 2] });
    expect(early.warnings).toMatch(
      /2 slices, 1 channels, 6 frames are described, but the file has 5 images: .* 2 frames are read/,
    );
    const more = await pagesIn(stack(5, described('images=3', 'slices=3')));
    expect(more).toMatchObject({ pages: [0, 1, 2, 3, 4], warnings: expect.stringMatching(/file has 5 images/) });
    const error = await rejection(readTiff(stack(2, described('images=9', 'channels=3', 'slices=3'))));
    expect(error.message).toMatch(/3 slices, 3 channels, 1 frames are described, but the file has 2 images/);
  });

  test('and SCIFIO, which states the order and the sizes', async () => {
    const lines = [
      'axes=X,Y,Z,Channel',
      'lengths=5,3,3,2',
      'scales=0.5,0.5,2,1',
      'units=\\u00B5m,\\u00B5m,\\u00B5m,null',
    ];
    const file = stack(6, ['SCIFIO=0.42', ...lines, 'images=6', 'channels=2', 'slices=3', ''].join('\n'));
    expect((await pagesIn(file, 1)).pages).toEqual([3, 4, 5]);
    expect(await worldOf(file)).toMatchObject({ spacing: [0.5, 0.5, 2], unit: 'um' });
  });

  test('has signed integers as unsigned ones with a calibration', async () => {
    const text = imageJ('images=1', 'cf=0', 'c0=-32768.0', 'c1=1.0', 'vunit=Gray Value');
    expect(await readTiff(stack(1, text))).toMatchObject({ slope: 1, intercept: -32768 });
    const curve = await readTiff(stack(1, imageJ('images=1', 'cf=3', 'c0=1', 'c1=2')));
    expect(curve.slope).toBeUndefined();
    expect(curve.warnings?.[0]?.text).toMatch(/not a straight line: stored values are given/);
  });
});

describe('pages without such a description', () => {
  test('are slices', async () => {
    for (const text of ['', 'MicroScope 5', '{"shape": [3, 3, 5]}', '{"broken', 'SCIFIO=0.4\nimages=3\n'])
      expect(await pagesIn(stack(3, text))).toMatchObject({ pages: [0, 1, 2], dims: [5, 3, 3], warnings: '' });
  });

  test('have the axes that tifffile states', async () => {
    const shaped = (axes: string, ...shape: number[]) =>
      JSON.stringify({ shape: [...shape, HIGH, WIDE], axes: `${axes}YX` });
    expect(await pagesIn(stack(6, shaped('TZ', 2, 3)))).toMatchObject({
      pages: [0, 1, 2, 3, 4, 5],
      dims: [5, 3, 3, 2],
    });
    expect((await pagesIn(stack(6, shaped('ZC', 3, 2)), 1)).pages).toEqual([1, 3, 5]);
    expect((await pagesIn(stack(6, shaped('ZT', 3, 2)))).pages).toEqual([0, 2, 4, 1, 3, 5]);
  });

  test('of tifffile with one directory for all', async () => {
    const data = Uint8Array.from(pagesOf(3).flatMap((page) => [...(page.data ?? [])]));
    const text = JSON.stringify({ shape: [3, HIGH, WIDE], truncated: true });
    const bytes = tiff([{ data, tags: { ...pagesOf(1, text)[0]?.tags } }]);
    expect((await pagesIn({ name: 'truncated.tif', bytes })).pages).toEqual([0, 1, 2]);
    const colours = { 258: [8, 8, 8], 262: 2, 277: 3, 270: '{"shape": [2, 1, 1, 3], "truncated": true}' };
    const rgb = tiff([{ data: Uint8Array.of(9, 9, 9, 4, 4, 4), tags: colours }]);
    expect([...(await readTiff({ name: 'rgb.tif', bytes: rgb })).data]).toEqual([9, 4]);
  });

  test('of MetaMorph with one directory for all, with a warning', async () => {
    const data = Uint8Array.from(pagesOf(3).flatMap((page) => [...(page.data ?? [])]));
    const bytes = tiff([{ data, tags: { ...pagesOf(1)[0]?.tags, 33629: [1, 2, 3] } }]);
    const { pages, warnings } = await pagesIn({ name: 'film.stk', bytes });
    expect({ pages, warnings }).toMatchObject({ pages: [0, 1, 2], warnings: expect.stringMatching(/MetaMorph/) });
  });

  test('are mirrored or rotated: a warning', async () => {
    for (const text of ['', imageJ('images=2', 'slices=2'), ome('SizeZ="2"')])
      expect((await pagesIn(stack(2, text, 'x.tif', { 274: 4 }))).warnings).toMatch(
        /orientation 4, which is not applied/,
      );
  });

  test('of several sizes: thumbnails and coarser levels are left out, with a warning', async () => {
    const small = { data: new Uint8Array(4), tags: { 256: 2, 257: 1, 258: 16 } };
    const flagged = { data: new Uint8Array(30), tags: { 256: WIDE, 257: HIGH, 258: 16, 254: 1 } };
    const [a, b] = pagesOf(2);
    if (!a || !b) throw new Error('no pages');
    const { pages, warnings } = await pagesIn({ name: 'slide.lsm', bytes: tiff([a, small, b, flagged, small]) });
    expect(pages).toEqual([0, 1]);
    expect(warnings).toMatch(/3 smaller pages are left out: only those of 5 × 3 pixels are read/);
  });

  test('that differ in one side, or in type, are refused', async () => {
    const [first] = pagesOf(1);
    const refusal = async (tags: Record<number, number>) => {
      const other = { data: new Uint8Array(64), tags: { ...first?.tags, ...tags } };
      return (await rejection(readTiff({ name: 'odd.tif', bytes: tiff([first ?? {}, other]) }))).message;
    };
    expect(await refusal({ 256: 4 })).toMatch(
      /page 2: the image has 4 × 3 pixels, unsigned, 16 bits, but the first one 5 × 3/,
    );
    expect(await refusal({ 258: 8 })).toMatch(
      /page 2: the image has 5 × 3 pixels, unsigned, 8 bits, but the first one/,
    );
  });
});

describe('several files', () => {
  const one = (k: number, text = '') => {
    const page = pagesOf(k + 1)[k];
    return { name: `slice${k}.tif`, bytes: tiff([{ ...page, tags: { ...page?.tags, ...(text && { 270: text }) } }]) };
  };

  test('have a slice each, in the order of the numbers in their names', async () => {
    const files = [10, 9, 11, 8].map((k) => one(k));
    expect(await pagesIn(files)).toEqual({ pages: [8, 9, 10, 11], dims: [5, 3, 4], warnings: '' });
  });

  test('of whose numbers one is missing, or which count two things, have a warning', async () => {
    const named = (...names: string[]) => pagesIn(names.map((name, k) => ({ ...one(k), name })));
    const every = await named('scan 1/a_05.tif', 'scan 1/a_10.tif', 'scan 1/a_15.tif');
    expect([every.pages, every.warnings]).toEqual([[0, 1, 2], '']);
    const gaps = await named('a_01.tif', 'a_02.tif', 'a_04.tif', 'a_05.tif', 'a_09.tif');
    expect(gaps.warnings).toMatch(/missing between the files numbered 2 and 4, and elsewhere \(2 places\): /);
    const channels = await named('a_z1_c1.tif', 'a_z1_c2.tif', 'a_z2_c1.tif', 'a_z2_c2.tif');
    expect(channels.warnings).toMatch(/differ in 2 numbers, of which one may count channels/);
    expect((await named('bottom.tif', 'middle.tif', 'top.tif')).warnings).toBe('');
  });

  test('have a slice each, each with a description of its own', async () => {
    const text = ome('SizeZ="1" PhysicalSizeX="2" PhysicalSizeY="2" PhysicalSizeZ="5"', '<TiffData/>');
    const files = [0, 1, 2].map((k) => one(k, text));
    expect(await pagesIn(files)).toEqual({ pages: [0, 1, 2], dims: [5, 3, 3], warnings: '' });
    expect((await readTiff(files)).spacing).toEqual([2, 2, 5]);
  });

  test('have several slices each, which are joined, with a warning', async () => {
    const files = [stack(2, '', 'a2.tif'), stack(1, '', 'a10.tif')];
    const { pages, warnings } = await pagesIn(files);
    expect(pages).toEqual([0, 1, 0]);
    expect(warnings).toMatch(/slices of 2 files are joined along z/);
  });

  test('of different sizes, channels or with frames are refused', async () => {
    const narrow = { name: 'z.tif', bytes: tiff([{ data: new Uint8Array(30), tags: { 256: 3, 257: 5, 258: 16 } }]) };
    expect((await rejection(readTiff([one(0), narrow]))).message).toMatch(/z.tif: page 1: the image has 3 × 5/);
    const channels = stack(2, imageJ('images=2', 'channels=2'), 'two.tif');
    expect((await rejection(readTiff([one(0), channels]))).message).toMatch(
      /two.tif: 2 channels, but the first file has 1/,
    );
    const frames = stack(2, imageJ('images=2', 'frames=2'), 'two.tif');
    expect((await rejection(readTiff([one(0), frames]))).message).toMatch(
      /two.tif: 2 frames: open one such file at a time/,
    );
  });
});
