// Arrays with spare capacity: those of a growing mesh fit for a while, and so do buffers of the GPU that are as long.

/** Ratio of consecutive capacities. A smaller one needs new arrays more often, a larger one leaves more memory unused. */
const RATIO = 1.25;

/** Rounds a number of vertices or triangles up to the next capacity, of a geometric sequence. */
export function capacityFor(count: number): number {
  return Math.ceil(RATIO ** Math.ceil(Math.log(Math.max(1, count)) / Math.log(RATIO)));
}

/** Least share of an array that is used: shorter ones are not replaced at each change around a capacity. */
const LEAST_USED = 0.25;

type Kind<T> = new (length: number) => T;

/** Returns an array for `count` items of `size` numbers: `array` if it is long enough and mostly used, else a new one. */
export function roomFor<T extends Float32Array | Uint32Array>(
  array: T | undefined,
  count: number,
  size: number,
  kind: Kind<T>,
): T {
  const [needed, length] = [size * count, size * capacityFor(count)];
  const fits = array instanceof kind && array.length >= needed && LEAST_USED * array.length <= length;
  return fits ? array : new kind(length);
}

/** Copies the values of items of `size` numbers into such an array. */
export function copyWithRoom<T extends Float32Array | Uint32Array>(
  array: T | undefined,
  values: T,
  size: number,
  kind: Kind<T>,
): T {
  const room = roomFor(array, values.length / size, size, kind);
  room.set(values);
  return room;
}
