/**
 * Converts plain data with typed arrays to JSON and parts, which are the bytes of the arrays by name, and back. Numbers
 * that JSON does not have are kept, too.
 */

export type Parts = Record<string, Uint8Array>;

const ARRAYS = {
  ...{ Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array },
  ...{ Float32Array, Float64Array },
};

/** Value in JSON that stands for a typed array, whose bytes are a part. */
interface ArrayStand {
  $part: string;
  type: keyof typeof ARRAYS;
}

/**
 * Returns a value as plain JSON, without properties that are undefined; adds the bytes of its typed arrays to `parts`,
 * each named after its path in the value.
 */
export function encode(value: unknown, parts: Parts, path = ''): unknown {
  if (typeof value === 'number' && (!Number.isFinite(value) || Object.is(value, -0)))
    return { $number: Object.is(value, -0) ? '-0' : String(value) };
  if (ArrayBuffer.isView(value)) {
    const $part = `${path}.bin`;
    parts[$part] = new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
    return { $part, type: value.constructor.name };
  }
  if (typeof value !== 'object' || value === null) return value;
  const below = (name: string | number) => (path === '' ? String(name) : `${path}/${name}`);
  if (Array.isArray(value)) return value.map((one, index) => encode(one, parts, below(index)));
  const entries = Object.entries(value).filter(([, one]) => one !== undefined);
  return Object.fromEntries(entries.map(([name, one]) => [name, encode(one, parts, below(name))]));
}

/** Most levels of objects and lists within each other; the deepest of a session, its poses in a log, have 14. */
const DEEPEST = 32;
const NUMBERS = ['NaN', 'Infinity', '-Infinity', '-0'];
/** Names that an object has by itself: values under these could reach the prototypes of objects. */
const RESERVED = ['__proto__', 'constructor', 'prototype'];

/**
 * Returns the value that {@link encode} was given; `find` returns a part, or throws if there is none of that name. Throws a
 * TypeError or a RangeError for what `encode` does not return: an array of unknown type or length, another number, a
 * reserved name, or too many levels.
 */
export function decode(value: unknown, find: (part: string) => Uint8Array, level = 0): unknown {
  if (typeof value !== 'object' || value === null) return value;
  if (level > DEEPEST) throw new RangeError('too many levels');
  const below = (one: unknown) => decode(one, find, level + 1);
  if (Array.isArray(value)) return value.map(below);
  if ('$number' in value) return numberOf(value.$number);
  if ('$part' in value) return arrayOf(value as Partial<ArrayStand>, find);
  return Object.fromEntries(
    Object.entries(value).map(([name, one]) => {
      if (RESERVED.includes(name)) throw new TypeError('reserved name');
      return [name, below(one)];
    }),
  );
}

function numberOf(name: unknown): number {
  if (typeof name !== 'string' || !NUMBERS.includes(name)) throw new TypeError('unknown number');
  return Number(name);
}

function arrayOf({ $part, type = 'Uint8Array' }: Partial<ArrayStand>, find: (part: string) => Uint8Array): unknown {
  if (typeof $part !== 'string' || !Object.hasOwn(ARRAYS, type)) throw new TypeError('unknown array');
  // A copy of its own, since the part need not begin at a multiple of the size of its numbers.
  return new ARRAYS[type](find($part).slice().buffer);
}
