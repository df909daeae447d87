// Makes TIFF files whose tags a test decides.

/** Tags by their number: text, fractions, or integers. */
export type Tags = Record<number, string | number | number[] | { fraction: [number, number] }>;

/** One page: its data, which become its only strip unless the tags have strips, and its tags. */
export interface PageSpec {
  data?: Uint8Array;
  tags?: Tags;
}

/** Form of a file. */
export interface Form {
  isBig?: boolean;
  isLittle?: boolean;
  /** Index of the page that follows the last one; default none. */
  next?: number;
  /** Bytes that are at the end. */
  after?: Uint8Array;
}

/** A file for `openTiff`. */
export type Made = { name: string; bytes: Uint8Array<ArrayBuffer> };

/** Writes numbers in the order of a file. */
class Writer {
  readonly #bytes: number[] = [];
  readonly #form: Form;

  constructor(form: Form) {
    this.#form = form;
  }

  get length(): number {
    return this.#bytes.length;
  }

  number(value: number, size: number): void {
    const digits = Array.from({ length: size }, (_, k) => Math.floor(value / 256 ** k) % 256);
    this.#bytes.push(...(this.#form.isLittle === false ? digits.reverse() : digits));
  }

  offset(value: number): void {
    this.number(value, this.#form.isBig ? 8 : 4);
  }

  put(bytes: Iterable<number>): number {
    const at = this.#bytes.length;
    for (const byte of bytes) this.#bytes.push(byte);
    return at;
  }

  setOffset(at: number, value: number): void {
    const end = this.#bytes.length;
    this.offset(value);
    this.#bytes.splice(at, this.#bytes.length - end, ...this.#bytes.splice(end));
  }

  done(): Uint8Array<ArrayBuffer> {
    return Uint8Array.from(this.#bytes);
  }
}

const SIZES = { 2: 1, 4: 4, 5: 8 } as const;

/** Returns the type of a value, the number of its parts, and its bytes. */
function encoded(value: Tags[number], form: Form): { type: keyof typeof SIZES; count: number; bytes: Uint8Array } {
  const writer = new Writer(form);
  if (typeof value === 'string') {
    writer.put(new TextEncoder().encode(`${value}\0`));
    return { type: 2, count: writer.length, bytes: writer.done() };
  }
  if (typeof value === 'object' && 'fraction' in value) {
    for (const part of value.fraction) writer.number(part, 4);
    return { type: 5, count: 1, bytes: writer.done() };
  }
  const list = [value].flat();
  for (const part of list) writer.number(part, 4);
  return { type: 4, count: list.length, bytes: writer.done() };
}

/** Returns a file with pages, their directories after the data of all. */
export function tiff(pages: PageSpec[], form: Form = {}): Uint8Array<ArrayBuffer> {
  const writer = new Writer(form);
  writer.put(form.isLittle === false ? [0x4d, 0x4d] : [0x49, 0x49]);
  writer.number(form.isBig ? 43 : 42, 2);
  if (form.isBig) for (const part of [8, 0]) writer.number(part, 2);
  let link = writer.length;
  writer.offset(0);
  const strips = pages.map(({ data = new Uint8Array() }) => [writer.put(data), data.length]);
  const starts: number[] = [];
  for (const [k, { tags = {} }] of pages.entries()) {
    const [at = 0, bytes = 0] = strips[k] ?? [];
    const all: Tags = { 256: 1, 257: 1, 258: 8, 259: 1, 262: 1, 273: at, 279: bytes, ...tags };
    const entries = Object.entries(all).map(([tag, value]) => ({ tag: Number(tag), ...encoded(value, form) }));
    const width = form.isBig ? 8 : 4;
    const values = entries.map(({ bytes }) => (bytes.length > width ? writer.put(bytes) : -1));
    starts.push(writer.length);
    writer.setOffset(link, writer.length);
    writer.number(entries.length, form.isBig ? 8 : 2);
    for (const [index, { tag, type, count, bytes }] of entries.entries()) {
      writer.number(tag, 2);
      writer.number(type, 2);
      writer.offset(count);
      const value = values[index] ?? -1;
      if (value >= 0) writer.offset(value);
      else writer.put([...bytes, ...new Uint8Array(width - bytes.length)]);
    }
    link = writer.length;
    writer.offset(0);
  }
  if (form.next !== undefined) writer.setOffset(link, starts[form.next] ?? 0);
  writer.put(form.after ?? []);
  return writer.done();
}

/** Size of the images of `stack`, and number of their pixels. */
export const [WIDE, HIGH, EACH] = [5, 3, 15];

/** Returns the value of pixel `i` of page `k` of `stack`. */
export const valueAt = (k: number, i: number) => 1000 * k + 7 * i;

/** Returns the values of pages of `stack`, one after the other. */
export const valuesOf = (...pages: number[]): number[] =>
  pages.flatMap((k) => Array.from({ length: EACH }, (_, i) => valueAt(k, i)));

/** Returns pages of 5 × 3 pixels of 16 bits, the first with a description. */
export function pagesOf(count: number, description = '', tags: Tags = {}, form: Form = {}): PageSpec[] {
  return Array.from({ length: count }, (_, k) => {
    const writer = new Writer(form);
    for (const value of valuesOf(k)) writer.number(value, 2);
    const own: Tags = { 256: WIDE, 257: HIGH, 258: 16, ...tags };
    if (k === 0 && description) own[270] = description;
    return { data: writer.done(), tags: own };
  });
}

/** Returns a file with pages of 5 × 3 pixels of 16 bits, the first with a description. */
export function stack(count: number, description = '', name = 'stack.tif', tags: Tags = {}, form: Form = {}): Made {
  return { name, bytes: tiff(pagesOf(count, description, tags, form), form) };
}

/** Returns OME's XML with one image. */
export function ome(pixels: string, content = '', root = ''): string {
  const size = `SizeX="${WIDE}" SizeY="${HIGH}"`;
  const image = `<Image ID="Image:0"><Pixels Type="uint16" ${size} ${pixels}>${content}</Pixels></Image>`;
  return `<?xml version="1.0"?><!-- <Image> --><OME ${root}>${image}</OME>`;
}
