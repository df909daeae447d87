/** `vesicle/tiff` with generated, damaged and malicious files: the stack that was written, or a refusal in words. */
import { readdirSync, readFileSync } from 'node:fs';
import fc from 'fast-check';
import { expect, test } from 'vitest';
import { type InputFile, openTiff } from '../../pkg/tiff/index.js';
import { DAMAGE, damaged } from './made-dicom.js';
import {
  COMPRESS,
  dataStart,
  type Entry,
  type Form,
  numbersIn,
  TAG_FAULTS,
  text,
  tiffOf,
  withTagFaults,
} from './made-tiff.js';
import { bounded, expectInit, expectTexts, holds, isName, isSize, LIMITS, REPORT } from './properties.js';

/** A stack as it is written. */
interface Made {
  form: Form;
  dims: [number, number, number];
  channels: string[];
  spacing: [number, number, number];
  type: 'uint8' | 'int16' | 'uint16' | 'float' | 'double';
  compression: number;
  rows: number;
  isTiled: boolean;
  seed: number;
}

const TYPES = {
  ...{ uint8: { bytes: 1, format: 1 }, int16: { bytes: 2, format: 2 }, uint16: { bytes: 2, format: 1 } },
  ...{ float: { bytes: 4, format: 3 }, double: { bytes: 8, format: 3 } },
};

const size = fc.integer({ min: 1, max: 999 }).map((value) => value / 100);
const NAME = fc
  .string({ unit: fc.constantFrom(...'abc <>&"-äµ漢🫀'), minLength: 1, maxLength: 30 })
  .filter((name) => name.trim() === name);

const STACK: fc.Arbitrary<Made> = fc.record({
  form: fc.record({ isBig: fc.boolean(), isLittle: fc.boolean() }),
  dims: fc.tuple(fc.integer({ min: 1, max: 9 }), fc.integer({ min: 1, max: 9 }), fc.integer({ min: 1, max: 4 })),
  channels: fc.array(NAME, { minLength: 1, maxLength: 3 }),
  spacing: fc.tuple(size, size, size),
  type: fc.constantFrom<Made['type'][]>('uint8', 'int16', 'uint16', 'float', 'double'),
  compression: fc.constantFrom(...Object.keys(COMPRESS).map(Number)),
  rows: fc.integer({ min: 1, max: 10 }),
  isTiled: fc.boolean(),
  seed: fc.nat(0xffff),
});

/** Returns the value of pixel `k` of a page. */
function valueAt({ type, seed }: Made, k: number, page: number): number {
  const value = (seed + 17 * k + 1009 * page) % (type === 'uint8' ? 256 : 65_536);
  return type === 'int16' && value >= 32_768 ? value - 65_536 : value;
}

/** Returns the first pixels of the blocks of a page, and their sizes. */
function blocksOf({ dims, rows, isTiled }: Made): { x: number; y: number; width: number; height: number }[] {
  const [width, height] = dims;
  const block = isTiled ? { width: 16, height: 16 } : { width, height: rows };
  const count = Math.ceil(height / block.height);
  return Array.from({ length: count }, (_, k) => {
    const y = k * block.height;
    return { x: 0, y, width: block.width, height: isTiled ? block.height : Math.min(rows, height - y) };
  });
}

function compressedBlocks(made: Made, page: number): Uint8Array[] {
  const { dims, type, compression, form } = made;
  const compress = COMPRESS[compression] as (bytes: Uint8Array) => Uint8Array;
  return blocksOf(made).map(({ y, width, height }) => {
    const values = Array.from({ length: width * height }, (_, i) => {
      const [column, row] = [i % width, y + Math.floor(i / width)];
      return column < dims[0] && row < dims[1] ? valueAt(made, row * dims[0] + column, page) : 0;
    });
    return compress(numbersIn(values, TYPES[type].bytes, form.isLittle, TYPES[type].format === 3));
  });
}

const escaped = (name: string) => name.replace(/[<>&"]/g, (sign) => `&#${sign.charCodeAt(0)};`);

function descriptionOf({ dims, channels, spacing, type }: Made): string {
  const sizes = `SizeX="${dims[0]}" SizeY="${dims[1]}" SizeZ="${dims[2]}" SizeC="${channels.length}" SizeT="1"`;
  const physical = ['X', 'Y', 'Z'].map((axis, k) => `PhysicalSize${axis}="${spacing[k]}"`).join(' ');
  const list = channels.map((name) => `<Channel Name="${escaped(name)}"/>`).join('');
  const pixels = `<Pixels Type="${type}" DimensionOrder="XYZCT" ${sizes} ${physical}>${list}<TiffData/></Pixels>`;
  return `<?xml version="1.0"?><OME><Image>${pixels}</Image></OME>`;
}

/** Returns the data of a stack, and the directories of its pages. */
function partsOf(made: Made, description = descriptionOf(made)): { data: Uint8Array[]; pages: Entry[][] } {
  const { form, dims, channels, type, compression, rows, isTiled } = made;
  const data: Uint8Array[] = [];
  let at = dataStart(form);
  const long = (tag: number, ...values: number[]): Entry => ({ tag, type: form.isBig ? 16 : 4, values });
  const short = (tag: number, ...values: number[]): Entry => ({ tag, type: 3, values });
  const pages = Array.from({ length: dims[2] * channels.length }, (_, page) => {
    const blocks = compressedBlocks(made, page);
    const offsets = blocks.map(({ length }) => {
      at += length;
      return at - length;
    });
    data.push(...blocks);
    const lengths = blocks.map(({ length }) => length);
    const { bytes, format } = TYPES[type];
    const basic = [
      short(256, dims[0]),
      short(257, dims[1]),
      short(258, 8 * bytes),
      short(259, compression),
      short(262, 1),
    ];
    const described = page === 0 && description ? [{ tag: 270, type: 2, values: text(description) }] : [];
    const strips = [long(273, ...offsets), short(277, 1), short(278, rows), long(279, ...lengths)];
    const tiles = [short(277, 1), short(322, 16), short(323, 16), long(324, ...offsets), long(325, ...lengths)];
    return [...basic, ...described, ...(isTiled ? tiles : strips), short(339, format)];
  });
  return { data, pages };
}

function fileOf(made: Made): Buffer {
  const { data, pages } = partsOf(made);
  return tiffOf(data, pages, made.form);
}

const file = (bytes: Uint8Array, k = 0): InputFile => ({ name: `stack${k}.tif`, bytes });

/** Opens files, reads the first and the last channel, and tests what holds for any. */
async function readAny(files: InputFile | InputFile[]): Promise<void> {
  const stack = await bounded(() => openTiff(files));
  if (stack instanceof Error) return;
  const { channels, dims, frames, spacing, warnings, remarks, frameSeconds } = stack;
  holds([...dims, frames].every(isSize), `${dims} ${frames}`);
  holds(
    [...spacing, frameSeconds ?? 1].every((one) => one > 0 && Number.isFinite(one)),
    `${spacing} ${frameSeconds}`,
  );
  holds(
    channels.length > 0 && channels.every(({ name }) => name !== '' && isName(name)),
    `${channels.length} channels`,
  );
  expectTexts([...warnings.map((warning) => warning.text), ...remarks]);
  for (const channel of new Set([0, channels.length - 1])) {
    const init = await bounded(() => stack.read({ channel }));
    if (init instanceof Error) continue;
    expectInit(init);
    holds(String(init.dims?.slice(0, 3)) === String(dims), `${init.dims} of ${dims}`);
  }
}

test('stacks are read as they were written', LIMITS, async () => {
  const property = fc.asyncProperty(STACK, async (made) => {
    const stack = await openTiff(file(fileOf(made)));
    const names = stack.channels.map(({ name }) => name);
    expect([stack.dims, names, stack.spacing, stack.unit]).toEqual([made.dims, made.channels, made.spacing, 'um']);
    expect(stack.warnings).toEqual([]);
    const [each, slices] = [made.dims[0] * made.dims[1], made.dims[2]];
    for (const channel of made.channels.keys()) {
      const init = await stack.read({ channel });
      expectInit(init);
      const value = (_: unknown, i: number) => valueAt(made, i % each, channel * slices + Math.floor(i / each));
      expect([...init.data]).toEqual(Array.from({ length: each * slices }, value));
    }
  });
  await fc.assert(property, REPORT);
});

test('any faults in directories are survived', LIMITS, async () => {
  const property = fc.asyncProperty(STACK, TAG_FAULTS, DAMAGE, fc.boolean(), async (made, faults, damage, isPlain) => {
    const { data, pages } = isPlain ? partsOf(made, '') : partsOf(made);
    await readAny(file(damaged(tiffOf(data, withTagFaults(pages, faults), made.form), damage)));
  });
  await fc.assert(property, REPORT);
});

test('any damage of real files is survived', LIMITS, async () => {
  const samples = readdirSync('tests/data/tiff').map((name) => readFileSync(`tests/data/tiff/${name}`));
  const property = fc.asyncProperty(fc.constantFrom(...samples), DAMAGE, async (sample, damage) => {
    await readAny(file(damaged(sample, damage)));
  });
  await fc.assert(property, REPORT);
});

const ODD = fc.constantFrom(
  ...[
    '',
    '0',
    '-1',
    '1',
    '2',
    '3',
    '1.5',
    '1e9',
    '1e300',
    '1e-300',
    '99999999999999999999',
    'NaN',
    'Infinity',
    'µm',
    'km',
    'XYCZT',
  ],
  ...[
    'x'.repeat(20_000),
    '&lt;',
    '&#xD800;',
    '&#1114112;',
    '&b;',
    '🫀'.repeat(150),
    'constructor',
    'uint16',
    'urn:uuid:1',
    'stack1.tif',
  ],
);
const ATTRIBUTES = [
  ...[
    'SizeX',
    'SizeY',
    'SizeZ',
    'SizeC',
    'SizeT',
    'DimensionOrder',
    'Type',
    'PhysicalSizeX',
    'PhysicalSizeZ',
    'PhysicalSizeXUnit',
  ],
  ...[
    'TimeIncrement',
    'TimeIncrementUnit',
    'IFD',
    'PlaneCount',
    'FirstZ',
    'FirstC',
    'FirstT',
    'Name',
    'UUID',
    'FileName',
    'MetadataFile',
  ],
];
const ATTRIBUTE = fc.tuple(fc.constantFrom(...ATTRIBUTES), ODD).map(([name, value]) => ` ${name}="${value}"`);
const ELEMENT = fc.constantFrom(
  'OME',
  'Image',
  'Image',
  'Pixels',
  'Pixels',
  'Channel',
  'TiffData',
  'TiffData',
  'UUID',
  'Plane',
  'BinaryOnly',
  'a',
);
const NOISE = fc.constantFrom(
  ...[
    '<!-- <Image> -->',
    '<![CDATA[<Pixels>]]>',
    '<!DOCTYPE x [<!ENTITY b "&b;&b;">]>',
    '<',
    '>',
    '"',
    "'",
    '<?',
    '</',
    '&amp;',
    '<!--',
  ],
  ...['<a>'.repeat(500), '</OME>', 'text'],
);
const XML = fc
  .array(
    fc.oneof(
      {
        weight: 6,
        arbitrary: fc
          .tuple(ELEMENT, fc.array(ATTRIBUTE, { maxLength: 6 }))
          .map(([name, given]) => `<${name}${given.join('')}>`),
      },
      { weight: 1, arbitrary: NOISE },
    ),
    { maxLength: 14 },
  )
  .map((parts) => `<OME>${parts.join('')}`);

test('descriptions of any shape, in one file and in several', LIMITS, async () => {
  const property = fc.asyncProperty(
    STACK,
    fc.array(XML, { minLength: 1, maxLength: 3 }),
    async (made, descriptions) => {
      const files = descriptions.map((description, k) => {
        const { data, pages } = partsOf(made, description);
        return file(tiffOf(data, pages, made.form), k);
      });
      const companion = { name: 'set.companion.ome', bytes: Buffer.from(descriptions[0] ?? '') };
      await readAny(made.isTiled ? files : [...files, companion]);
    },
  );
  await fc.assert(property, REPORT);
});

test('descriptions of ImageJ, SCIFIO and tifffile with any numbers', LIMITS, async () => {
  const keys = fc.constantFrom(
    ...'images channels slices frames spacing unit yunit tunit finterval cf c0 c1 axes lengths scales units SCIFIO'.split(
      ' ',
    ),
  );
  const values = fc.oneof(ODD, fc.constantFrom('X,Y,Z', 'X,Y,constructor', '3,3,2', 'pixel', '\\u00B5m', '0'));
  const line = fc.tuple(keys, values).map((pair) => pair.join('='));
  const lines = fc.array(line, { maxLength: 8 }).map((list) => `ImageJ=1\n${list.join('\n')}\n`);
  const scifio = lines.map((list) => list.replace('ImageJ', 'SCIFIO'));
  const sizes = fc.array(fc.constantFrom(0, 1, 2, 3, 1e9, 2 ** 53, -1, 1.5), { maxLength: 5 });
  const shape = fc.tuple(sizes, fc.constantFrom('ZYX', 'ZCYX', 'TZCYXS', 'YX', ''), fc.boolean());
  const shaped = shape.map(([shape, axes, truncated]) => JSON.stringify({ shape, axes, truncated }));
  const property = fc.asyncProperty(STACK, fc.oneof(lines, scifio, shaped), async (made, description) => {
    const { data, pages } = partsOf(made, description);
    await readAny(file(tiffOf(data, made.isTiled ? pages : pages.slice(0, 1), made.form)));
  });
  await fc.assert(property, REPORT);
});

test('blocks that decode to far more than they should, or share their bytes', LIMITS, async () => {
  const lie = fc.record({
    factor: fc.constantFrom(1, 2, 100, 4000),
    count: fc.integer({ min: 1, max: 60 }),
    bits: fc.constantFrom(1, 8, 12, 32),
  });
  const property = fc.asyncProperty(STACK, lie, async ({ form, compression }, { factor, count, bits }) => {
    const compress = COMPRESS[compression] as (bytes: Uint8Array) => Uint8Array;
    const data = compress(new Uint8Array(1000));
    const offsets = Array.from({ length: count }, () => dataStart(form));
    const tags: [number, ...number[]][] = [
      ...([
        [256, 10 * factor],
        [257, count],
        [258, bits],
        [259, compression],
        [262, 1],
      ] as [number, number][]),
      ...([
        [273, ...offsets],
        [278, 1],
        [279, ...offsets.map(() => data.length)],
      ] as [number, ...number[]][]),
    ];
    const page = tags.map(([tag, ...values]): Entry => ({ tag, type: 4, values }));
    await readAny(file(tiffOf([data], [page, page], form)));
  });
  await fc.assert(property, { ...REPORT, numRuns: Math.ceil(REPORT.numRuns / 10) });
});
