// DICOM data sets for the property tests: a writer of its own, and generators of images and of faults in them.
import fc from 'fast-check';

/** An element: its value, or the items of a sequence; how it is written, and what is wrong with it. */
export interface Element {
  tag: string;
  vr: string;
  value: Buffer | Element[][];
  /** Length that is stated, if it is not the right one. */
  length?: number;
  /** Whether the sequence and its items end by delimiters. */
  isOpen?: boolean;
}

export type Syntax = 'explicit' | 'implicit' | 'big';

const UIDS = { explicit: '1.2.840.10008.1.2.1', implicit: '1.2.840.10008.1.2', big: '1.2.840.10008.1.2.2' };
const LONG = ['OB', 'OD', 'OF', 'OL', 'OW', 'SQ', 'UC', 'UN', 'UR', 'UT'];
const OPEN = 0xffffffff;

/** Writes numbers in the order of a syntax. */
class Writer {
  readonly #isBig: boolean;

  constructor(readonly syntax: Syntax) {
    this.#isBig = syntax === 'big';
  }

  short(value: number): Buffer {
    const [low, high] = [value & 255, (value >> 8) & 255];
    return Buffer.from(this.#isBig ? [high, low] : [low, high]);
  }

  long(value: number): Buffer {
    const [low, high] = [this.short(value & 0xffff), this.short(value >>> 16)];
    return Buffer.concat(this.#isBig ? [high, low] : [low, high]);
  }

  tag(tag: string): Buffer {
    return Buffer.concat([0, 4].map((at) => this.short(Number.parseInt(tag.slice(at, at + 4), 16))));
  }

  element(element: Element): Buffer {
    const { tag, vr, isOpen = false, length } = element;
    const value = this.#value(element);
    const stated = length ?? (isOpen ? OPEN : value.length);
    const head = [this.tag(tag)];
    if (this.syntax === 'implicit') head.push(this.long(stated));
    else if (LONG.includes(vr)) head.push(Buffer.from(vr, 'latin1'), this.short(0), this.long(stated));
    else head.push(Buffer.from(vr, 'latin1'), this.short(Math.min(stated, 0xffff)));
    return Buffer.concat([...head, value]);
  }

  #value({ value, isOpen = false }: Element): Buffer {
    if (Buffer.isBuffer(value)) return value;
    const end = (tag: string) => (isOpen ? [this.tag(tag), this.long(0)] : []);
    const items = value.map((elements) => {
      const content = Buffer.concat(elements.map((one) => this.element(one)));
      const length = this.long(isOpen ? OPEN : content.length);
      return Buffer.concat([this.tag('fffee000'), length, content, ...end('fffee00d')]);
    });
    return Buffer.concat([...items, ...end('fffee0dd')]);
  }
}

/** Returns the bytes of a file with a preamble, and elements in their order. */
export function fileOf(elements: readonly Element[], syntax: Syntax, uid = UIDS[syntax]): Buffer {
  const [little, body] = [new Writer('explicit'), new Writer(syntax)];
  const meta = little.element(textElement('00020010', 'UI', uid));
  const length = little.element({ tag: '00020000', vr: 'UL', value: little.long(meta.length) });
  const all = elements.map((one) => body.element(one));
  return Buffer.concat([Buffer.alloc(128), Buffer.from('DICM'), length, meta, ...all]);
}

export function textElement(tag: string, vr: string, text: string, encoding: BufferEncoding = 'latin1'): Element {
  const bytes = Buffer.from(text, encoding);
  const filler = Buffer.from(vr === 'UI' ? '\0' : ' ');
  return { tag, vr, value: bytes.length % 2 ? Buffer.concat([bytes, filler]) : bytes };
}

export const shortElement = (syntax: Syntax, tag: string, ...values: number[]): Element => {
  const writer = new Writer(syntax);
  return { tag, vr: 'US', value: Buffer.concat(values.map((value) => writer.short(value))) };
};

export const sorted = (elements: Element[]) => elements.toSorted((a, b) => (a.tag < b.tag ? -1 : 1));

/** Directions of an image, whose normals are exact. */
export const DIRECTIONS = ['1\\0\\0\\0\\1\\0', '0\\1\\0\\0\\0\\-1', '0.6\\0.8\\0\\0\\0\\1', '-1\\0\\0\\0\\-1\\0'];

/** Texts that are wrong nearly everywhere. */
const ODD_TEXT = fc.constantFrom(
  ...[
    '',
    '\\',
    '\\\\\\',
    '0',
    '-1',
    '1e999',
    'NaN',
    'Infinity',
    '0x10',
    '1,5',
    '  7  ',
    '1'.repeat(300),
    'x'.repeat(20_000),
  ],
  ...[
    '100000',
    '99999999999',
    '1\\0\\0\\0\\1\\0',
    '1e30\\1e30\\1e30',
    '\ud800',
    'constructor',
    '__proto__',
    'ISO_IR 192',
  ],
  ...['=', 'A=B=C', 'DERIVED\\PRIMARY\\MOSAIC', '20240131', '235959.999', 'ISO 2022 IR 87\\', '\0', 'a\0b', '1.2.3'],
);
const ODD_BYTES = fc.oneof(
  ODD_TEXT.map((text) => Buffer.from(text, 'latin1')),
  fc.uint8Array({ maxLength: 24 }).map((bytes) => Buffer.from(bytes)),
);
const VRS = [
  'UI',
  'US',
  'SS',
  'UL',
  'FD',
  'FL',
  'DS',
  'IS',
  'LO',
  'CS',
  'SQ',
  'UN',
  'OB',
  'OW',
  'UT',
  'AT',
  'PN',
  'XX',
  '\0\0',
];
const LENGTHS = [0, 1, 3, 7, 8, 65_534, 65_535, 2 ** 31, OPEN - 1, OPEN];

/** A fault in a data set: a change of the element, counted among all, that `at` selects. */
export interface Fault {
  at: number;
  change: (element: Element) => Element[];
}

const nested = (levels: number): Element[][] =>
  Array.from({ length: levels }).reduce<Element[][]>(
    (items) => [[{ tag: '00081140', vr: 'SQ', value: items, isOpen: true }]],
    [],
  );

const CHANGE: fc.Arbitrary<Fault['change']> = fc.oneof(
  ODD_BYTES.map((value) => (one: Element) => [{ ...one, value }]),
  fc.constantFrom(...VRS).map((vr) => (one: Element) => [{ ...one, vr }]),
  fc.constantFrom(...LENGTHS).map((length) => (one: Element) => [{ ...one, length }]),
  fc.constant(() => []),
  ODD_BYTES.map((value) => (one: Element) => [one, { ...one, value }]),
  fc.constant((one: Element) => [one, one]),
  fc.constantFrom(0, 1, 40, 300).map((levels) => (one: Element) => [{ ...one, vr: 'SQ', value: nested(levels) }]),
  fc.nat(300).map((count) => (one: Element) => [{ ...one, vr: 'SQ', value: Array.from({ length: count }, () => []) }]),
  ODD_BYTES.map((value) => (one: Element) => [one, { tag: '00091001', vr: 'UN', value, isOpen: true }]),
  fc.boolean().map((isOpen) => (one: Element) => [{ ...one, isOpen }]),
  fc
    .nat(0xffff)
    .map((element) => (one: Element) => [{ ...one, tag: one.tag.slice(0, 4) + element.toString(16).padStart(4, '0') }]),
);

export const FAULTS: fc.Arbitrary<Fault[]> = fc.array(fc.record({ at: fc.nat(), change: CHANGE }), {
  minLength: 1,
  maxLength: 4,
});

/** Returns elements with faults, in items of sequences, too. */
export function withFaults(elements: Element[], faults: readonly Fault[]): Element[] {
  return faults.reduce((found, fault) => changed(found, fault), elements);
}

function countOf(elements: readonly Element[]): number {
  return elements.reduce((sum, { value }) => sum + 1 + (Buffer.isBuffer(value) ? 0 : countOf(value.flat())), 0);
}

function changed(elements: Element[], { at, change }: Fault): Element[] {
  const count = countOf(elements);
  let left = count === 0 ? -1 : at % count;
  const visit = (one: Element): Element[] => {
    left -= 1;
    if (left === -1) return change(one);
    return Buffer.isBuffer(one.value) ? [one] : [{ ...one, value: one.value.map((item) => item.flatMap(visit)) }];
  };
  return elements.flatMap(visit);
}

/** Changes of single bytes, and where the file ends. */
export interface Damage {
  bytes: { at: number; to: number }[];
  cut: number | undefined;
}

export const DAMAGE: fc.Arbitrary<Damage> = fc.record({
  bytes: fc.array(fc.record({ at: fc.nat(), to: fc.oneof(fc.constantFrom(0, 1, 127, 128, 254, 255), fc.nat(255)) }), {
    maxLength: 6,
  }),
  cut: fc.option(fc.nat(), { nil: undefined, freq: 4 }),
});

export function damaged(whole: Uint8Array, { bytes, cut }: Damage): Uint8Array<ArrayBuffer> {
  const found = Uint8Array.from(cut === undefined ? whole : whole.subarray(0, cut % (whole.length + 1)));
  for (const { at, to } of bytes) if (found.length > 0) found[at % found.length] = to;
  return found;
}
