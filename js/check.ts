// Validation of arguments. Each function returns the value, or throws `invalid-argument` naming the parameter and what
// is accepted.
import type { PointArray } from './data.js';
import { VesicleError } from './error.js';

/** Returns the `invalid-argument` error whose message names the parameter and its problem; the caller throws it. */
export function invalid(parameter: string, problem: string): VesicleError {
  return new VesicleError('invalid-argument', `${parameter}: ${problem}`);
}

/** Formats a value for an error message. */
function format(value: unknown): string {
  if (typeof value === 'string') return `'${value}'`;
  if (value !== null && typeof value === 'object') return `${value.constructor?.name ?? 'object'}`;
  return String(value);
}

/** Inclusive bounds of a numeric argument; a missing bound does not limit it. */
interface Bounds {
  min?: number;
  max?: number;
}

/** Returns `value` if it is a finite number within the bounds, else throws `invalid-argument`. */
export function number(parameter: string, value: unknown, { min = -Infinity, max = Infinity }: Bounds = {}): number {
  if (typeof value === 'number' && Number.isFinite(value) && value >= min && value <= max) return value;
  throw invalid(parameter, `must be ${describeBounds('a finite number', min, max)}, got ${format(value)}`);
}

/** Returns `value` if it is a finite number above 0, else throws `invalid-argument`. */
export function positive(parameter: string, value: unknown): number {
  if (number(parameter, value) > 0) return value as number;
  throw invalid(parameter, `must be > 0, got ${format(value)}`);
}

/** Returns `value` if it is a number, which may be infinite but not NaN, else throws `invalid-argument`. */
export function ordered(parameter: string, value: unknown): number {
  if (typeof value === 'number' && !Number.isNaN(value)) return value;
  throw invalid(parameter, `must be a number, which may be infinite, got ${format(value)}`);
}

/** Returns `value` if it is true or false, else throws `invalid-argument`. */
export function boolean(parameter: string, value: unknown): boolean {
  if (typeof value === 'boolean') return value;
  throw invalid(parameter, `must be true or false, got ${format(value)}`);
}

/** Returns `value` if it is an integer within the bounds (default 0 to 2^32 - 1), else throws `invalid-argument`. */
export function integer(parameter: string, value: unknown, { min = 0, max = 0xffffffff }: Bounds = {}): number {
  if (Number.isInteger(value) && (value as number) >= min && (value as number) <= max) return value as number;
  throw invalid(parameter, `must be ${describeBounds('an integer', min, max)}, got ${format(value)}`);
}

function describeBounds(kind: string, min: number, max: number): string {
  if (min > -Infinity && max < Infinity) return `${kind} from ${min} to ${max}`;
  if (min > -Infinity) return `${kind} of at least ${min}`;
  return max < Infinity ? `${kind} of at most ${max}` : kind;
}

/** Returns `value` if it is one of `choices`, else throws `invalid-argument`. */
export function choice<T extends string>(parameter: string, value: unknown, choices: readonly T[]): T {
  if (choices.includes(value as T)) return value as T;
  throw invalid(parameter, `must be one of ${choices.map(format).join(', ')}, got ${format(value)}`);
}

/**
 * Copies an array of any kind into a `Float64Array`; throws `invalid-argument` unless all entries are finite numbers
 * and the length is one of `lengths`.
 */
export function numbers(parameter: string, value: unknown, ...lengths: number[]): Float64Array<ArrayBuffer> {
  const list = value as ArrayLike<number>;
  if (value === null || typeof value !== 'object' || !lengths.includes(list.length)) {
    throw invalid(parameter, `must be ${lengths.join(' or ')} numbers, got ${format(value)}${lengthOf(value)}`);
  }
  return Float64Array.from(list, (entry) => number(parameter, entry));
}

/** Copies three finite numbers into a `Float64Array`; throws `invalid-argument` for anything else. */
export const vec3 = (parameter: string, value: unknown): Float64Array<ArrayBuffer> => numbers(parameter, value, 3);

function lengthOf(value: unknown): string {
  const length = (value as { length?: unknown } | null | undefined)?.length;
  return typeof length === 'number' && typeof value === 'object' ? ` of length ${length}` : '';
}

/**
 * Returns `value` if it is a readable typed array of class `kind` with a length that is a multiple of `stride`, else
 * throws `invalid-argument`.
 */
export function typedArray<T extends { readonly length: number }>(
  parameter: string,
  value: unknown,
  kind: new (length: number) => T,
  stride = 1,
): T {
  if (!(value instanceof kind)) throw invalid(parameter, `must be a ${kind.name}, got ${format(value)}`);
  if (isDetached(value)) throw invalid(parameter, 'the array is detached or out of bounds; pass a readable array');
  if (value.length % stride === 0) return value;
  throw invalid(parameter, `the length must be a multiple of ${stride}, got ${value.length}`);
}

/** Returns whether a typed array is detached or out of bounds; its length is then 0, like that of an empty array. */
function isDetached(array: { readonly length: number }): boolean {
  try {
    if (array.length === 0 && ArrayBuffer.isView(array)) (array as unknown as Uint8Array).at(0);
    return false;
  } catch {
    return true;
  }
}

/**
 * Returns `value` if it is a `Float32Array` of finite numbers with a length that is a multiple of `stride`, else throws
 * `invalid-argument`.
 */
export function finite(parameter: string, value: unknown, stride: number): Float32Array {
  const array = typedArray(parameter, value, Float32Array, stride);
  const wrong = array.findIndex((entry) => !Number.isFinite(entry));
  if (wrong < 0) return array;
  throw invalid(parameter, `all numbers must be finite, got ${array[wrong]} at index ${wrong}`);
}

/**
 * Returns `value` if it is a `Float32Array` or `Float64Array` of finite points, packed xyz, within the range of single
 * precision, else throws `invalid-argument`.
 */
export function pointArray(parameter: string, value: unknown): PointArray {
  if (!(value instanceof Float64Array)) return finite(parameter, value, 3);
  const array = typedArray(parameter, value, Float64Array, 3);
  const wrong = array.findIndex((entry) => !Number.isFinite(Math.fround(entry)));
  if (wrong < 0) return array;
  throw invalid(parameter, `all numbers must be finite and within ±3.4e38, got ${array[wrong]} at index ${wrong}`);
}

/**
 * Returns `value` if it is an object without properties other than `names`, and `{}` if it is undefined; else throws
 * `invalid-argument`, so that misspelled options are found.
 */
export function checkProperties<T extends object>(
  parameter: string,
  value: T | undefined,
  names: readonly string[],
): Partial<T> {
  if (value === undefined) return {};
  if (value === null || typeof value !== 'object') throw invalid(parameter, `must be an object, got ${format(value)}`);
  for (const name of Object.keys(value)) {
    if (!names.includes(name)) throw invalid(name, `unknown property of ${parameter}; known: ${names.join(', ')}`);
  }
  return value;
}

/**
 * Copies an array, or throws `invalid-argument` if it is none; holes become `undefined`, so that `map` visits them,
 * too.
 */
export function denseCopy<T>(parameter: string, value: readonly T[]): readonly T[] {
  if (Array.isArray(value)) return Array.from(value);
  throw invalid(parameter, `must be an array, got ${format(value)}`);
}

/**
 * Returns a shallow copy of an options object, so that getters and proxies run their code here and not during a call
 * into the WebAssembly module; throws `invalid-argument` for anything else.
 */
export function shallowCopy<T extends object>(parameter: string, value: T): T {
  if (value === null || typeof value !== 'object' || Array.isArray(value))
    throw invalid(parameter, 'must be an object');
  return { ...value };
}
