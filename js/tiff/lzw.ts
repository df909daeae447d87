// LZW as of TIFF 6: codes of 9 to 12 bits, the highest bit first, which grow one code early.

const [CLEAR, END] = [256, 257];
const [FIRST_BITS, MOST_BITS] = [9, 12];

/** Table of strings: each is another one and a byte. */
class Strings {
  readonly #before = new Uint16Array(1 << MOST_BITS);
  readonly #last = new Uint8Array(1 << MOST_BITS);
  readonly #length = new Uint16Array(1 << MOST_BITS);
  next = END + 1;

  constructor() {
    for (let code = 0; code < CLEAR; code++) [this.#last[code], this.#length[code]] = [code, 1];
  }

  clear(): void {
    this.next = END + 1;
  }

  add(before: number, last: number): void {
    if (this.next >= 1 << MOST_BITS) return;
    this.#before[this.next] = before;
    this.#last[this.next] = last;
    this.#length[this.next] = (this.#length[before] ?? 0) + 1;
    this.next += 1;
  }

  /** Writes a string at `at`, as far as it fits, and returns its length. */
  write(out: Uint8Array, at: number, code: number): number {
    const length = this.#length[code] ?? 0;
    let rest = code;
    for (let to = at + length - 1; to >= at; to--) {
      if (to < out.length) out[to] = this.#last[rest] ?? 0;
      rest = this.#before[rest] ?? 0;
    }
    return length;
  }

  /** Returns the first byte of a string. */
  first(code: number): number {
    let rest = code;
    while (rest > END) rest = this.#before[rest] ?? 0;
    return rest;
  }
}

/** The table of the block that is being decoded: blocks may be shorter than it. */
const strings = new Strings();

/** Decodes at most `size` bytes; fewer if the codes end before. */
export function lzw(stored: Uint8Array, size: number): Uint8Array<ArrayBuffer> {
  if (stored[0] === 0 && ((stored[1] ?? 0) & 1) === 1)
    throw new Error('codes with the lowest bit first, as of TIFF 5, are not supported');
  const out = new Uint8Array(size);
  let length = 0;
  strings.clear();
  let [bits, before] = [FIRST_BITS, -1];
  for (let at = 0; length < size && at + bits <= 8 * stored.length; ) {
    const code = codeAt(stored, at, bits);
    at += bits;
    if (code === END) break;
    if (code === CLEAR) {
      strings.clear();
      [bits, before] = [FIRST_BITS, -1];
      continue;
    }
    if (code > strings.next || (before < 0 && code > END)) throw new Error(`invalid LZW code ${code}`);
    if (before >= 0) strings.add(before, strings.first(code === strings.next ? before : code));
    length += strings.write(out, length, code);
    before = code;
    if (strings.next + 1 >= 1 << bits && bits < MOST_BITS) bits += 1;
  }
  return out.subarray(0, Math.min(length, size));
}

/** Returns the code of `bits` bits, at most 12, from bit `at` on. */
function codeAt(stored: Uint8Array, at: number, bits: number): number {
  const byte = at >> 3;
  const word = ((stored[byte] ?? 0) << 16) | ((stored[byte + 1] ?? 0) << 8) | (stored[byte + 2] ?? 0);
  return (word >> (24 - (at & 7) - bits)) & ((1 << bits) - 1);
}
