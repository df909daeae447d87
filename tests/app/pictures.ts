/** Small DICOM and TIFF files for the tests. */

/** A file in the form that Playwright passes to an input. */
export interface Given {
  name: string;
  mimeType: string;
  buffer: Buffer;
}

const even = (text: string, filler: string) => (text.length % 2 ? text + filler : text);

/** Returns an element of explicit little-endian DICOM, with a value of text or of 16-bit integers. */
function element(group: number, number: number, kind: string, value: string | number[] | Buffer): Buffer {
  const bytes = valueBytes(kind, value);
  const long = ['OB', 'OW'].includes(kind);
  const head = Buffer.alloc(long ? 12 : 8);
  head.writeUInt16LE(group, 0);
  head.writeUInt16LE(number, 2);
  head.write(kind, 4, 'latin1');
  if (long) head.writeUInt32LE(bytes.length, 8);
  else head.writeUInt16LE(bytes.length, 6);
  return Buffer.concat([head, bytes]);
}

function valueBytes(kind: string, value: string | number[] | Buffer): Buffer {
  if (Buffer.isBuffer(value)) return value;
  if (typeof value === 'string') return Buffer.from(even(value, kind === 'UI' ? '\0' : ' '), 'latin1');
  return Buffer.concat(value.map((number) => Buffer.from(Uint16Array.of(number).buffer)));
}

/** Returns a sequence of undefined length with one item, of undefined length, too. */
function sequence(group: number, number: number, content: Buffer): Buffer {
  const head = Buffer.alloc(12);
  head.writeUInt16LE(group, 0);
  head.writeUInt16LE(number, 2);
  head.write('SQ', 4, 'latin1');
  head.writeUInt32LE(0xffffffff, 8);
  const mark = (tag: number, length: number) => Buffer.from(Uint32Array.of((tag << 16) | 0xfffe, length).buffer);
  return Buffer.concat([head, mark(0xe000, 0xffffffff), content, mark(0xe00d, 0), mark(0xe0dd, 0)]);
}

const CT = '1.2.840.10008.5.1.4.1.1.2';
const EXPLICIT = '1.2.840.10008.1.2.1';

export interface Grid {
  /** x fastest. */
  data: Uint16Array;
  dims: [number, number, number];
  spacing: [number, number, number];
  /** Position of the first voxel, in LPS. */
  origin: [number, number, number];
  /** Directions of x and y of the image, in LPS. */
  along: [number, number, number, number, number, number];
}

/** Series of the files: the last number of its identifier, and its description. */
export interface SeriesName {
  number: number;
  description: string;
}

/** Returns slice z of a grid as a CT slice. */
function slice(grid: Grid, z: number, { number, description }: SeriesName): Buffer {
  const { data, dims, spacing, origin, along } = grid;
  const [x1 = 0, x2 = 0, x3 = 0, y1 = 0, y2 = 0, y3 = 0] = along;
  const normal = [x2 * y3 - x3 * y2, x3 * y1 - x1 * y3, x1 * y2 - x2 * y1];
  const place = origin.map((start, axis) => start + z * spacing[2] * (normal[axis] ?? 0));
  const count = dims[0] * dims[1];
  const pixels = Buffer.from(data.slice(z * count, (z + 1) * count).buffer);
  const meta = Buffer.concat([
    element(2, 2, 'UI', CT),
    element(2, 3, 'UI', `1.2.3.4.${z + 1}`),
    element(2, 0x10, 'UI', EXPLICIT),
    element(2, 0x12, 'UI', '1.2.3.9'),
  ]);
  return Buffer.concat([
    Buffer.alloc(128),
    Buffer.from('DICM'),
    element(2, 0, 'UL', [meta.length, 0]),
    meta,
    element(8, 0x16, 'UI', CT),
    element(8, 0x18, 'UI', `1.2.3.4.${z + 1}`),
    element(8, 0x60, 'CS', 'CT'),
    element(8, 0x103e, 'LO', description),
    // A sequence of undefined length that names another series.
    sequence(8, 0x1115, element(0x20, 0xe, 'UI', '9.9.9')),
    element(0x20, 0xd, 'UI', '1.2.3.5'),
    element(0x20, 0xe, 'UI', `1.2.3.${number}`),
    element(0x20, 0x13, 'IS', String(z + 1)),
    element(0x20, 0x32, 'DS', place.join('\\')),
    element(0x20, 0x37, 'DS', along.join('\\')),
    element(0x28, 2, 'US', [1]),
    element(0x28, 4, 'CS', 'MONOCHROME2'),
    element(0x28, 0x10, 'US', [dims[1]]),
    element(0x28, 0x11, 'US', [dims[0]]),
    element(0x28, 0x30, 'DS', [spacing[1], spacing[0]].join('\\')),
    element(0x28, 0x100, 'US', [16]),
    element(0x28, 0x101, 'US', [16]),
    element(0x28, 0x102, 'US', [15]),
    element(0x28, 0x103, 'US', [0]),
    element(0x28, 0x1052, 'DS', '-1000'),
    element(0x28, 0x1053, 'DS', '1'),
    element(0x7fe0, 0x10, 'OW', pixels),
  ]);
}

/**
 * Returns a series of files in an order other than that of the slices, with stored values 1000 above the intensities.
 */
export function dicomSeries(grid: Grid, name: SeriesName = { number: 6, description: '' }): Given[] {
  const order = Array.from({ length: grid.dims[2] }, (_, z) => (z * 7) % grid.dims[2]);
  return order.map((z, k) => ({ name: `IM${k}`, mimeType: 'application/dicom', buffer: slice(grid, z, name) }));
}

/** Returns 8-bit pages as a little-endian TIFF file, with a description on the first page. */
export function tiffStack(pages: Uint8Array[], [wide, high]: [number, number], description: string): Buffer {
  const text = Buffer.from(`${description}\0`, 'utf8');
  const parts: Uint8Array[] = [Buffer.from([0x49, 0x49, 42, 0, 0, 0, 0, 0]), text];
  let end = 8 + text.length;
  const directories = pages.map((page, k) => {
    parts.push(Buffer.from(page));
    const entries = [
      ...[
        entry(256, 4, 1, wide),
        entry(257, 4, 1, high),
        entry(258, 3, 1, 8),
        entry(259, 3, 1, 1),
        entry(262, 3, 1, 1),
      ],
      ...(k === 0 ? [entry(270, 2, text.length, 8)] : []),
      ...[entry(273, 4, 1, end), entry(277, 3, 1, 1), entry(278, 4, 1, high), entry(279, 4, 1, page.length)],
    ];
    end += page.length;
    return entries;
  });
  // The offset of each directory is at the end of the previous one, that of the first in the file header.
  const written = directories.map((entries) => {
    const at = end;
    end += 2 + 12 * entries.length + 4;
    return { at, entries };
  });
  for (const [k, { entries }] of written.entries()) {
    const count = Buffer.from(Uint16Array.of(entries.length).buffer);
    parts.push(count, ...entries, Buffer.from(Uint32Array.of(written[k + 1]?.at ?? 0).buffer));
  }
  const file = Buffer.concat(parts);
  file.writeUInt32LE(written[0]?.at ?? 0, 4);
  return file;
}

function entry(tag: number, kind: number, count: number, value: number): Buffer {
  const bytes = Buffer.alloc(12);
  bytes.writeUInt16LE(tag, 0);
  bytes.writeUInt16LE(kind, 2);
  bytes.writeUInt32LE(count, 4);
  bytes.writeUInt32LE(value, 8);
  return bytes;
}
