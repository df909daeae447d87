/**
 * Converts plain data with typed arrays to JSON and parts, which are the bytes of the arrays by name, and back. Numbers
 * that JSON does not have are kept, too.
 */

export type Parts = Record<string, Uint8Array>;

const ARRAYS = {
  ...{ Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array },
  ...{ Float32Array, Float64Array },
};

/** Value in JSON that stands for a typed array, whose bytes are a part, or for a number that JSON does not have. */
type Stand = { $part: string; type: keyof typeof ARRAYS } | { $number: string };

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

/**
 * Returns the value that {@link encode} was given; `find` returns a part, or throws if there is none of that name. Throws a
 * TypeError or a RangeError for an array of unknown type or length.
 */
export function decode(value: unknown, find: (part: string) => Uint8Array): unknown {
  if (typeof value !== 'object' || value === null) return value;
  if (Array.isArray(value)) return value.map((one) => decode(one, find));
  const stand = value as Partial<Stand>;
  if ('$number' in stand) return Number(stand.$number);
  // A copy of its own, since the part need not begin at a multiple of the size of its numbers.
  if ('$part' in stand) return new ARRAYS[stand.type ?? 'Uint8Array'](find(String(stand.$part)).slice().buffer);
  return Object.fromEntries(Object.entries(value).map(([name, one]) => [name, decode(one, find)]));
}
