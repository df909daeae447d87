// `vesicle/dicom` with small files that would take much time or memory, or be read as something that they are not.
import { readFileSync } from 'node:fs';
import { deflateRawSync } from 'node:zlib';
import { describe, expect, test } from 'vitest';
import { type DicomListing, openDicom, readDicom } from '../../pkg/dicom/index.js';
import { rejection } from './helpers.js';
import { type Element, fileOf, shortElement, sorted, textElement } from './made-dicom.js';

/** Differences from a usual image of bytes. */
interface Image {
  rows?: number;
  columns?: number;
  bits?: number;
  frames?: number;
  position?: string;
  pixels?: Buffer;
  more?: Element[];
}

const short = (tag: string, ...values: number[]) => shortElement('explicit', tag, ...values);
const long = (tag: string, text: string): Element => textElement(tag, 'UT', text);
const sequence = (tag: string, ...items: Element[][]): Element => ({ tag, vr: 'SQ', value: items });

/** Returns the elements of an image, of which those in `more` replace others with the same tag. */
function image({
  rows = 1,
  columns = 1,
  bits = 8,
  frames = 1,
  position = '0\\0\\0',
  pixels,
  more = [],
}: Image): Element[] {
  const usual = [
    textElement('00080018', 'UI', '1.2.3'),
    textElement('00180088', 'DS', '2'),
    textElement('0020000e', 'UI', '1.9'),
    textElement('00200032', 'DS', position),
    textElement('00200037', 'DS', '1\\0\\0\\0\\1\\0'),
    textElement('00280008', 'IS', String(frames)),
    ...[short('00280010', rows), short('00280011', columns), short('00280100', bits)],
    textElement('00280030', 'DS', '1\\1'),
    { tag: '7fe00010', vr: 'OB', value: pixels ?? Buffer.alloc(Math.ceil((rows * columns * bits * frames) / 8)) },
  ];
  return sorted([...usual.filter(({ tag }) => !more.some((one) => one.tag === tag)), ...more]);
}

const file = (elements: Element[], k = 0, uid?: string) => ({
  name: `file ${k}`,
  bytes: new Uint8Array(fileOf(elements, 'explicit', uid)),
});

/** An image of 512 × 170 voxels, whose compressed bytes have the letters of a sequence in the place of a type. */
const LIKE_A_SEQUENCE = [
  '7c3NalNRFAbQL7dFQqkaEaQ4OsM7OpwTK8ZxIjSDNuBtcHIHvomvIz6VjyK5g76DsNaefPsH9jofcj5+TK/burtvtbfWdvVz7fW+',
  '9trrNuvc5Xy8WS4+1d571vmZ/TRk/1zyOufjq2X3NSVvXrpdSt7nOF2n915KtjlM67S5zb23UvIlh+k2fW5L9bmVMUPO05BVxlxn',
  'P93m8fR02j98Pz1+25Yxm2X7J2PeLSnDmJbD5cPcy5isLtNNxqxe0rCktxlztaTk769NTj+S/L50AAAAAAAAAAAAAAAAAAAAAAAA',
  'AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA',
  'AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA',
  '8P/6Bw==',
];

const DEFLATED = '1.2.840.10008.1.2.1.99';
/** Returns a file whose data set is compressed as a whole. */
function deflated(elements: Element[]) {
  const [meta, whole] = [fileOf([], 'explicit', DEFLATED), fileOf(elements, 'explicit', DEFLATED)];
  return {
    name: 'deflated',
    bytes: new Uint8Array(Buffer.concat([meta, deflateRawSync(whole.subarray(meta.length))])),
  };
}

/** Runs `work`, which must take less than `most` seconds of this process. */
async function within<Result>(most: number, work: () => Promise<Result>): Promise<Result> {
  const before = process.cpuUsage();
  const result = await work();
  const { user, system } = process.cpuUsage(before);
  expect((user + system) / 1e6).toBeLessThan(most);
  return result;
}

const reasons = ({ skipped }: DicomListing) => skipped.map(({ reason }) => reason);

const RLE = '1.2.840.10008.1.2.5';
/** Returns compressed pixel data of fragments, the last of which states its length. */
const fragments = (parts: Buffer[], stated?: number): Element => ({
  ...{ tag: '7fe00010', vr: 'OB', isOpen: true },
  value: Buffer.concat([
    Buffer.from('feff00e000000000', 'hex'),
    ...parts.flatMap((part, k) => {
      const head = Buffer.from('feff00e000000000', 'hex');
      head.writeUInt32LE(k === parts.length - 1 ? (stated ?? part.length) : part.length, 4);
      return [head, part];
    }),
  ]),
});
const refused = async (element: Element, size: Image, uid: string) => {
  const files = [0, 1].map((z) => {
    const more = [element, textElement('00080018', 'UI', `1.${z}`), ...(size.more ?? [])];
    return file(image({ ...size, position: `0\\0\\${z}`, more }), z, uid);
  });
  const error = await within(2, () => rejection(readDicom(files)));
  return `${error.code} ${error.message}`;
};

/** Reads images whose codestream of JPEG 2000 has a size, tiles of another one, and a header, and returns why they are refused. */
const refusedCodestream = (side: number, tile: [number, number], header: number[]) => {
  const size = Buffer.alloc(43);
  size.set([0xff, 0x51, 0, 41]);
  [side, side, 0, 0, ...tile].forEach((value, k) => {
    size.writeUInt32BE(value, 6 + 4 * k);
  });
  size.set([0, 1, 7, 1, 1], 38);
  const codestream = Buffer.concat([Buffer.from([0xff, 0x4f]), size, Buffer.from(header), Buffer.alloc(60)]);
  return refused(fragments([codestream]), { rows: side, columns: side }, '1.2.840.10008.1.2.4.90');
};

describe('files of very many', () => {
  test('frames are opened and read in little time', async () => {
    const { data } = await within(4, () => readDicom(file(image({ frames: 99_000 }))));
    expect(data).toHaveLength(99_000);
    const offsets = long('3004000c', Array.from({ length: 15_000 }, (_, k) => k).join('\\'));
    const { dims } = await within(4, () => readDicom(file(image({ frames: 15_000, more: [offsets] }))));
    expect(dims).toEqual([1, 1, 15_000]);
  });

  test('frames that they do not have are skipped', async () => {
    const lie = image({ frames: 100_000, pixels: Buffer.alloc(10) });
    const listing = await within(2, () => openDicom(Array.from({ length: 100 }, (_, k) => file(lie, k))));
    expect(reasons(listing)[99]).toMatch(/pixel data: 100000 images need 100000 bytes, it has 10/);
  });

  test('voxels that they do not have take no memory', async () => {
    const listing = await openDicom(
      [0, 1].map((z) => {
        const more = [textElement('00080018', 'UI', `1.${z}`)];
        const large = { rows: 11_008, columns: 24_415, pixels: Buffer.alloc(2) };
        return file(image({ ...large, position: `0\\0\\${z}`, more }), z);
      }),
    );
    const before = process.memoryUsage().arrayBuffers;
    const refusal = await rejection(listing.volumes[0]?.read() as Promise<unknown>);
    expect(refusal).toMatchObject({ code: 'bad-file', message: expect.stringMatching(/needs 268760320 bytes, has 2/) });
    expect(process.memoryUsage().arrayBuffers - before).toBeLessThan(1e6);
  });

  test('frames of a bit, several of them, are skipped', async () => {
    const bits = Array.from({ length: 7 }, (_, k) => {
      const uid = textElement('00080018', 'UI', `1.2.${k}`);
      return file(image({ bits: 1, frames: 100_000, position: `0\\0\\${k * 1e6}`, more: [uid] }), k);
    });
    const listing = await within(5, () => openDicom(bits));
    expect(reasons(listing)).toEqual(Array.from({ length: 6 }, () => 'too many images of very few voxels'));
    expect(listing.volumes[0]?.warnings[0]?.text).toMatch(/could not be read, and may be missing/);
  });

  test('nested sequences, or empty items', async () => {
    const open = Buffer.from('0800401153510000fffffffffeff00e0ffffffff', 'hex');
    const nested = {
      tag: '00081140',
      vr: 'OB',
      value: Buffer.concat(Array.from({ length: 10_000 }, () => open)),
      length: 0,
    };
    expect(reasons(await openDicom(file(image({ more: [nested] }))))[0]).toMatch(/sequences are nested too deeply/);
    const many = sequence('00081140', ...Array.from({ length: 100_000 }, () => []));
    expect(reasons(await within(3, () => openDicom(file(image({ more: [many] })))))[0]).toMatch(/a single image/);
  });

  test('none, although the first bytes of a compressed data set look like a sequence', async () => {
    const bytes = Buffer.concat([fileOf([], 'explicit', DEFLATED), Buffer.from(LIKE_A_SEQUENCE.join(''), 'base64')]);
    const listing = await openDicom({ name: 'deflated', bytes: new Uint8Array(bytes) });
    expect(reasons(listing)).toEqual([expect.stringMatching(/a single image/)]);
  });

  test('items or zeros in a compressed data set', async () => {
    const empty = Buffer.alloc(16e6, Buffer.from('feff00e000000000', 'hex'));
    const bomb = deflated(image({ more: [{ tag: '00081140', vr: 'SQ', value: empty }] }));
    expect(bomb.bytes.length).toBeLessThan(1e5);
    expect(reasons(await within(3, () => openDicom(bomb)))[0]).toMatch(/more elements than a file of its size/);
    const zeros = deflated(image({ rows: 60_000, columns: 6000, bits: 1, frames: 2, pixels: Buffer.alloc(1e7) }));
    expect(reasons(await openDicom(zeros))[0]).toMatch(/2 images need 90000000 bytes, it has 10000000/);
    const much = deflated(image({ rows: 6000, columns: 6000, pixels: Buffer.alloc(36e6) }));
    expect(reasons(await within(2, () => openDicom(much)))[0]).toMatch(
      /unpacks to too much; files of up to 128 KiB may unpack to 32 MiB: store the images uncompressed$/,
    );
    const cut = deflated(image({ more: [{ tag: '00081140', vr: 'OB', value: Buffer.alloc(2), length: 1e6 }] }));
    expect(reasons(await openDicom(cut))[0]).toMatch(
      /could not be read: it is cut off, or states a length beyond its end$/,
    );
  });

  test('digits, or signs that separate names', async () => {
    const digits = long('00180050', `${'1'.repeat(90_000)}x`);
    const names = long('00100010', `${'='.repeat(90_000)}\nx`);
    await within(1, () => openDicom(file(image({ more: [digits, names] }))));
  });

  test('characters in names and messages', async () => {
    const text = 'n'.repeat(30_000);
    const more = [
      ...[long('0008103e', text), long('00080060', text), long('00100010', text), long('00541001', text)],
      ...[long('00181210', text), long('00280004', `RGB${text}`)],
    ];
    const color = await openDicom(file(image({ more })));
    expect(color.skipped[0]?.reason.length).toBeLessThan(200);
    const slices = [0, 1, 2, 3].map((z) =>
      file(
        image({
          position: `0\\0\\${z}`,
          more: [...more.slice(0, 4), textElement('00080018', 'UI', `1.2.${z}`), long('00181210', `${z % 2}${text}`)],
        }),
        z,
      ),
    );
    const { volumes } = await openDicom(slices);
    expect(volumes).toHaveLength(2);
    for (const { name, patient, modality, remarks } of volumes)
      for (const one of [name, patient, modality, ...remarks]) expect(one.length).toBeLessThan(300);
    expect((await rejection(readDicom(slices))).message.length).toBeLessThan(2000);
    const broken = Array.from({ length: 300 }, (_, k) => ({ name: `${k}${text}.dcm`, bytes: new Uint8Array(9) }));
    expect((await rejection(readDicom(broken))).message.length).toBeLessThan(2000);
  });
});

describe('texts that are names of something else', () => {
  test('as character set and transfer syntax', async () => {
    const set = image({ more: [textElement('00080005', 'CS', 'constructor')] });
    expect(reasons(await openDicom(file(set)))).toEqual(['a single image, which is no volume']);
    const text = await refused(fragments([Buffer.alloc(80)]), {}, '1.2.840.10008.1.2.constructor');
    expect(text).toMatch(/^bad-file .*constructor is not supported/);
  });
});

describe('values are those of the file', () => {
  test("in Node's buffers, which may be parts of others", async () => {
    const bytes = fileOf(image({ frames: 2, pixels: Buffer.from([7, 9]) }), 'explicit');
    const part = Buffer.concat([Buffer.alloc(33, 5), bytes]).subarray(33);
    expect([...(await readDicom({ name: 'x', bytes: part })).data]).toEqual([7, 9]);
  });

  test('and not what follows the pixels', async () => {
    const after = { tag: 'fffcfffc', vr: 'OB', value: Buffer.alloc(100, 1) };
    const one = image({ columns: 9, pixels: Buffer.from([1, 2]), more: [after] });
    const files = [0, 1].map((z) =>
      file(
        [
          ...one.filter(({ tag }) => tag !== '00080018' && tag !== '00200032'),
          textElement('00080018', 'UI', `1.${z}`),
          textElement('00200032', 'DS', `0\\0\\${z}`),
        ].toSorted((a, b) => (a.tag < b.tag ? -1 : 1)),
        z,
      ),
    );
    expect((await rejection(readDicom(files))).message).toMatch(/pixel data: needs 9 bytes, has 2/);
  });

  test('if numbers are of another type, or no numbers', async () => {
    const two = (more: Element[]) => openDicom(file(image({ frames: 2, more })));
    const { volumes } = await two([textElement('00280010', 'IS', '1'), textElement('00280100', 'DS', '8')]);
    expect(volumes[0]?.dims).toEqual([1, 1, 2]);
    for (const text of ['NaN', 'Infinity', '1e999', '0x10', '1e31'])
      expect(reasons(await two([textElement('00200032', 'DS', `0\\0\\${text}`)]))[0]).toMatch(/without position/);
    const cut = { tag: '00280103', vr: 'US', value: Buffer.alloc(0) };
    expect((await two([cut])).volumes).toHaveLength(1);
  });

  test('if images between others are near both of them', async () => {
    const places = ['0\\0\\5', '0.095\\0\\0', '-0.095\\0\\0'];
    const files = places.map((position, k) =>
      file(image({ position, more: [textElement('00080018', 'UI', `1.${k}`)] }), k),
    );
    expect(reasons(await openDicom(files))).toContain(
      'several images at the same position, without any attribute that distinguishes them',
    );
  });
});

test('slices or pixels at a distance that no volume has are skipped', async () => {
  const slices = (far: string, more: Element[] = []) =>
    [`0\\0\\0`, `0\\0\\${far}`].map((position, z) =>
      file(image({ position, more: [textElement('00080018', 'UI', `1.${z}`), ...more] }), z),
    );
  const refusal = async (far: string, more?: Element[]) => (await rejection(readDicom(slices(far, more)))).message;
  expect(await refusal('1e13')).toMatch(/slices are 10000000000000 mm apart, which cannot be \(2 files\)/);
  expect(await refusal('1', [textElement('00280030', 'DS', '1\\1e-13')])).toMatch(/pixels are 1e-13 mm apart/);
});

describe('compressed images', () => {
  test('with fragments longer than their file', async () => {
    const text = await refused(fragments([Buffer.alloc(80), Buffer.alloc(80)], 0xfffffff0), {}, RLE);
    expect(text).toMatch(
      /^bad-file DICOM: file 0: could not be read: it is cut off, or states a length beyond its end$/,
    );
  });

  test('that cannot hold so many voxels', async () => {
    const large = { rows: 5000, columns: 4000, more: [long('00204000', ' '.repeat(2 ** 17))] };
    expect(await refused(fragments([Buffer.alloc(80)]), large, RLE)).toMatch(
      /voxels are more than 80 compressed bytes/,
    );
    const jpeg = await refused(fragments([Buffer.alloc(80)]), large, '1.2.840.10008.1.2.4.50');
    expect(jpeg).toMatch(/voxels are more than 80 compressed bytes/);
  });

  test('of another size than their file says, before they are decoded', async () => {
    for (const name of ['jpeg', 'jpeg-lossless', 'jpeg-ls', 'jpeg-2000', 'htj2k']) {
      const bytes = new Uint8Array(readFileSync(`tests/data/dicom/${name}.dcm`));
      const isWavelet = name === 'jpeg-2000' || name === 'htj2k';
      const markers = isWavelet ? [0x51] : [0xc0, 0xc3, 0xf7];
      const at = bytes.findIndex((byte, k) => k > 1000 && byte === 0xff && markers.includes(bytes[k + 1] ?? 0));
      // The high bytes of the height.
      bytes.set([0xff, 0xf0], isWavelet ? at + 10 : at + 5);
      const error = await within(2, () => rejection(readDicom({ name, bytes })));
      expect(error.message, name).toMatch(/the compressed image has .* the file states 16 × 12 of 1/);
    }
  });

  test('with fewer samples than pixels, for the rest of which a decoder would wait', async () => {
    for (const name of ['jpeg-2000', 'htj2k']) {
      const bytes = new Uint8Array(readFileSync(`tests/data/dicom/${name}.dcm`));
      const at = bytes.findIndex((byte, k) => k > 1000 && byte === 0xff && bytes[k + 1] === 0x51);
      bytes[at + 42] = 49;
      expect((await rejection(readDicom({ name, bytes }))).message).toMatch(/has 16 × 1 pixels of 1 samples/);
    }
  });

  test('of JPEG 2000 with a precinct for each voxel, which would take gigabytes', async () => {
    const coding = [0xff, 0x52, 0, 13, 1, 0, 0, 1, 0, 0, 4, 4, 0, 1];
    // In the main header, and in that of a part of a tile.
    const part = [0xff, 0x90, 0, 10, 0, 0, 0, 0, 0, 0, 0, 1];
    for (const header of [
      [...coding, 0],
      [...coding, 0xff, ...part, ...coding, 0],
    ]) {
      expect(await refusedCodestream(1024, [1024, 1024], header)).toMatch(/has 1048576 precincts; at most 65536/);
    }
  });

  test('of JPEG 2000 with thousands of layers, each of which has a packet in each precinct', async () => {
    const coding = (layers: number, exponents: number) => {
      return [0xff, 0x52, 0, 13, 1, 0, layers >> 8, layers & 255, 0, 0, 4, 4, 0, 1, exponents, 0];
    };
    const one = refusedCodestream(512, [512, 512], coding(65_535, 0x44));
    expect(await one).toMatch(/has 67107840 packets; at most 1048576/);
    // Tiles divide precincts, of which there would be one.
    const tiles = refusedCodestream(512, [512, 1], coding(60_000, 0xff));
    expect(await tiles).toMatch(/has 30720000 packets; at most 1048576/);
    // A few layers are decoded: this has no data.
    expect(await refusedCodestream(512, [512, 512], coding(1023, 0x44))).not.toMatch(/packets/);
  });

  test('of JPEG 2000 that are large for their bytes, of which each voxel may take a hundred steps', async () => {
    const coding = [0xff, 0x52, 0, 12, 0, 0, 0, 1, 0, 0, 4, 4, 0, 1];
    expect(await refusedCodestream(4090, [4090, 4090], coding)).toMatch(
      /4090 × 4090 voxels in \d+ bytes of JPEG 2000 could take long; at most 1500000 are decoded/,
    );
    expect(await refusedCodestream(1224, [1224, 1224], coding)).not.toMatch(/could take long/);
  });

  test('without an end are refused by JPEG-LS, whose decoder would search it for long', async () => {
    const bytes = new Uint8Array(readFileSync('tests/data/dicom/jpeg-ls.dcm'));
    bytes[bytes.lastIndexOf(0xd9)] = 0;
    expect((await rejection(readDicom({ name: 'x', bytes }))).message).toMatch(/could not be decoded: it has no end/);
  });

  test('that damaged the memory of a decoder do not damage later ones', async () => {
    for (const name of ['jpeg-ls', 'jpeg-2000', 'htj2k', 'jpeg', 'jpeg-lossless']) {
      const whole = new Uint8Array(readFileSync(`tests/data/dicom/${name}.dcm`));
      const { data } = await readDicom({ name, bytes: whole });
      for (let at = 1100; at < whole.length - 20; at += 7) {
        const bytes = whole.map((byte, k) => (k === at ? byte ^ 0x7f : byte));
        await readDicom({ name, bytes }).catch(() => {});
      }
      expect((await readDicom({ name, bytes: whole })).data, name).toEqual(data);
    }
  });
});

describe('segmentations', () => {
  const SEGMENTATION = textElement('00080016', 'UI', '1.2.840.10008.5.1.4.1.1.66.4');
  interface Frame {
    position: string;
    segment?: number;
    directions?: string;
  }

  /** Returns a segmentation of bytes that are 1 everywhere. */
  function segmentation(frames: Frame[], size: Image = {}, more: Element[] = []) {
    const groups = frames.map(({ position, segment, directions = '1\\0\\0\\0\\1\\0' }) => [
      sequence('00209113', [textElement('00200032', 'DS', position)]),
      sequence('00209116', [textElement('00200037', 'DS', directions)]),
      ...(segment === undefined ? [] : [sequence('0062000a', [short('0062000b', segment)])]),
    ]);
    const { rows = 1, columns = 1 } = size;
    const pixels = Buffer.alloc(rows * columns * frames.length, 1);
    return file(
      image({
        rows,
        columns,
        frames: frames.length,
        pixels,
        more: [SEGMENTATION, sequence('52009230', ...groups), ...more],
      }),
    );
  }

  test('with numbers above 255 that are not described keep them, with a warning', async () => {
    const { data, warnings } = await readDicom(
      segmentation([0, 1].map((z) => ({ position: `0\\0\\${z}`, segment: 300 + z }))),
    );
    expect([...data]).toEqual([300, 301]);
    expect(warnings?.map(({ text }) => text)).toEqual(['Segments that the file does not describe: 300, 301.']);
  });

  test('whose frames name no segment have the only one, or a warning', async () => {
    const frames = [{ position: '0\\0\\0' }, { position: '0\\0\\1' }];
    const one = sequence('00620002', [short('00620004', 7)]);
    const described = await readDicom(segmentation(frames, {}, [one]));
    expect([[...described.data], described.warnings?.[0]?.text]).toEqual([
      [7, 7],
      expect.stringMatching(/^2 frames name no segment: their voxels have label 7/),
    ]);
  });

  test('whose stated distance of slices is far larger than that of frames', async () => {
    const frames = [0, 1, 2].map((z) => ({ position: `0\\0\\${z}`, segment: 1 }));
    const { dims } = await readDicom(segmentation(frames, {}, [textElement('00180088', 'DS', '50')]));
    expect(dims).toEqual([1, 1, 3]);
  });

  test('whose frames are no stack are skipped', async () => {
    const turned = [
      { position: '0\\0\\0', segment: 1 },
      { position: '0\\0\\1', segment: 1, directions: '0\\1\\0\\0\\0\\1' },
    ];
    expect(reasons(await openDicom(segmentation(turned)))[0]).toMatch(/frames of several orientations/);
    const tiles = [0, 1].map((x) => ({ position: `${x}\\0\\0`, segment: 1 }));
    expect(reasons(await openDicom(segmentation(tiles)))[0]).toMatch(/shifted sideways/);
  });

  test('of few frames far apart take no more memory than there is', async () => {
    const frames = [0, 1, 60_000].map((z) => ({ position: `0\\0\\${z}`, segment: 1 }));
    const step = textElement('00180088', 'DS', '1');
    const error = await within(2, () =>
      rejection(readDicom(segmentation(frames, { rows: 150, columns: 150 }, [step]))),
    );
    const reason = /^DICOM: file 0: would unpack to 1287.5 MiB .* 32 MiB: add the slices that have no image$/;
    expect([error.code, error.message]).toEqual(['too-large', expect.stringMatching(reason)]);
  });

  test('of frames between which there are too many slices, or at uneven distances, are skipped for that', async () => {
    const at = (...positions: number[]) => positions.map((z) => ({ position: `0\\0\\${z}`, segment: 1 }));
    const gaps = segmentation(at(0, 60, 120), {}, [textElement('00180088', 'DS', '0.001')]);
    expect(reasons(await openDicom(gaps))[0]).toMatch(
      /gaps of up to 60 mm between its frames: these are 120001 slices of 0.001 mm, and at most 65536 are possible/,
    );
    expect(reasons(await openDicom(segmentation(at(0, 1, 2.5))))[0]).toMatch(/uneven distances, 1 mm to 1.5 mm/);
  });

  test('of slices at a distance that no volume has are skipped', async () => {
    const far = ['0\\0\\0', '0\\0\\1e12'].map((position) => ({ position, segment: 1 }));
    const error = await rejection(readDicom(segmentation(far, {}, [textElement('00180088', 'DS', '0')])));
    expect(`${error.code} ${error.message}`).toMatch(/^bad-file .*slices are 1000000000000 mm apart, which cannot be/);
  });

  test('with names of any characters and any length, of which the first of a number counts', async () => {
    const name = (text: string) => textElement('00620005', 'UT', text, 'utf8');
    const segments = sequence(
      '00620002',
      [short('00620004', 1), name('Größe 漢')],
      [short('00620004', 1), name('b')],
      [...[short('00620004', 2), name('🫀'.repeat(10_000))]],
    );
    const utf8 = textElement('00080005', 'CS', 'ISO_IR 192');
    const frames = [
      { position: '0\\0\\0', segment: 1 },
      { position: '0\\0\\1', segment: 2 },
    ];
    const { volumes } = await openDicom(segmentation(frames, {}, [segments, utf8]));
    const [first, second] = volumes[0]?.segments ?? [];
    expect([first?.name, volumes[0]?.segments.length]).toEqual(['Größe 漢', 2]);
    expect(second?.name).toMatch(/^🫀{90,100}…$/u);
  });
});
