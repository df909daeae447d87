/** Small DICOM files for the tests. */

/** A value of an element: text, numbers of 16 bits or doubles, bytes, or the items of a sequence. */
export type Value = string | readonly number[] | Buffer | readonly Elements[];

/** Elements of a data set, by tag `ggggeeee`, with their types. */
export type Elements = Record<string, readonly [kind: string, value: Value]>;

/** How a file is written. */
export interface Writing {
  syntax?: 'explicit' | 'implicit' | 'big';
  /** Whether there are a preamble and a meta header. */
  preamble?: boolean;
}

const SYNTAXES = { explicit: '1.2.840.10008.1.2.1', implicit: '1.2.840.10008.1.2', big: '1.2.840.10008.1.2.2' };
export const CT = '1.2.840.10008.5.1.4.1.1.2';

const LONG = ['OB', 'OW', 'OF', 'OD', 'SQ', 'UN', 'UT'];

/** Returns a file with elements, in the order of their tags, besides those that each file must have. */
export function dicomFile(elements: Elements, { syntax = 'explicit', preamble = true }: Writing = {}): Buffer {
  const body = dataSet(elements, syntax);
  if (!preamble) return body;
  const meta = dataSet(
    {
      '00020002': ['UI', CT],
      '00020003': ['UI', '1.2.3.4'],
      '00020010': ['UI', SYNTAXES[syntax]],
    },
    'explicit',
  );
  const length = dataSet({ '00020000': ['UL', [meta.length, 0]] }, 'explicit');
  return Buffer.concat([Buffer.alloc(128), Buffer.from('DICM'), length, meta, body]);
}

function dataSet(elements: Elements, syntax: keyof typeof SYNTAXES): Buffer {
  const sorted = Object.entries(elements).sort(([a], [b]) => (a < b ? -1 : 1));
  return Buffer.concat(sorted.map(([tag, [kind, value]]) => element(tag, kind, value, syntax)));
}

function element(tag: string, kind: string, value: Value, syntax: keyof typeof SYNTAXES): Buffer {
  const isBig = syntax === 'big';
  const short = (n: number) => (isBig ? Buffer.from([n >> 8, n & 255]) : Buffer.from([n & 255, n >> 8]));
  const long = (n: number) => {
    const bytes = Buffer.alloc(4);
    if (isBig) bytes.writeUInt32BE(n);
    else bytes.writeUInt32LE(n);
    return bytes;
  };
  const name = Buffer.concat([short(Number.parseInt(tag.slice(0, 4), 16)), short(Number.parseInt(tag.slice(4), 16))]);
  const isSequence = kind === 'SQ';
  const content = isSequence
    ? Buffer.concat(
        (value as Elements[]).flatMap((one) => [
          ...[short(0xfffe), short(0xe000), long(0xffffffff), dataSet(one, syntax)],
          ...[short(0xfffe), short(0xe00d), long(0)],
        ]),
      )
    : valueBytes(kind, value, isBig);
  const end = isSequence ? [short(0xfffe), short(0xe0dd), long(0)] : [];
  const length = isSequence ? 0xffffffff : content.length;
  if (syntax === 'implicit') return Buffer.concat([name, long(length), content, ...end]);
  const head = LONG.includes(kind) ? [Buffer.from(kind), short(0), long(length)] : [Buffer.from(kind), short(length)];
  return Buffer.concat([name, ...head, content, ...end]);
}

function valueBytes(kind: string, value: Value, isBig: boolean): Buffer {
  if (Buffer.isBuffer(value)) return value.length % 2 ? Buffer.concat([value, Buffer.alloc(1)]) : value;
  if (typeof value === 'string') {
    const filler = kind === 'UI' ? '\0' : ' ';
    return Buffer.from(value.length % 2 ? value + filler : value, 'latin1');
  }
  const numbers = value as number[];
  const bytes = Buffer.from(kind === 'FD' ? Float64Array.from(numbers).buffer : Uint16Array.from(numbers).buffer);
  return isBig ? (kind === 'FD' ? bytes.swap64() : bytes.swap16()) : bytes;
}

/** The grid of a made volume; positions in LPS, millimetres. */
export interface Grid {
  dims: [number, number, number];
  spacing: [number, number, number];
  /** Position of the first voxel. */
  origin: [number, number, number];
  /** Directions of x and y of the image. */
  along: [number, number, number, number, number, number];
}

export const AXIAL: Grid['along'] = [1, 0, 0, 0, 1, 0];

/** Returns the position of slice z of a grid. */
export function positionOf({ spacing, origin, along }: Grid, z: number): number[] {
  const [x1, x2, x3, y1, y2, y3] = along;
  const normal = [x2 * y3 - x3 * y2, x3 * y1 - x1 * y3, x1 * y2 - x2 * y1];
  return origin.map((start, axis) => start + z * spacing[2] * (normal[axis] ?? 0));
}

/** Returns the elements of slice z of a CT with the given voxels of 16 bits. */
export function sliceElements(grid: Grid, z: number, voxels: Uint16Array): Elements {
  const { dims, spacing, along } = grid;
  return {
    '00080016': ['UI', CT],
    '00080018': ['UI', `1.2.3.4.${z + 1}`],
    '00080060': ['CS', 'CT'],
    '0008103e': ['LO', 'Body'],
    '0020000d': ['UI', '1.2.3.5'],
    '0020000e': ['UI', '1.2.3.6'],
    '00200013': ['IS', String(z + 1)],
    '00200032': ['DS', positionOf(grid, z).join('\\')],
    '00200037': ['DS', along.join('\\')],
    '00280002': ['US', [1]],
    '00280004': ['CS', 'MONOCHROME2'],
    '00280010': ['US', [dims[1]]],
    '00280011': ['US', [dims[0]]],
    '00280030': ['DS', [spacing[1], spacing[0]].join('\\')],
    '00280100': ['US', [16]],
    '00280101': ['US', [16]],
    '00280102': ['US', [15]],
    '00280103': ['US', [0]],
    '7fe00010': ['OW', Buffer.from(voxels.slice().buffer)],
  };
}
