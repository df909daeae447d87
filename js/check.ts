// Checks of arguments. Each gives the value back, or throws `invalid-argument` naming the parameter and saying
// what is accepted.
import { VesicleError } from './error.js';

/** The error for one parameter. */
export function invalid(parameter: string, problem: string): VesicleError {
  return new VesicleError('invalid-argument', `${parameter}: ${problem}`);
}

/** A value as it can be shown in a message. */
function shown(value: unknown): string {
  if (typeof value === 'string') return `'${value}'`;
  if (value !== null && typeof value === 'object') return `${value.constructor?.name ?? 'object'}`;
  return String(value);
}

/** What a number has to satisfy. */
interface Bounds {
  min?: number;
  max?: number;
}

/** A finite number between bounds. */
export function number(parameter: string, value: unknown, { min = -Infinity, max = Infinity }: Bounds = {}): number {
  if (typeof value === 'number' && Number.isFinite(value) && value >= min && value <= max) return value;
  throw invalid(parameter, `${shown(value)}; ${wanted('a finite number', min, max)} is needed`);
}

/** A finite number above 0. */
export function positive(parameter: string, value: unknown): number {
  if (number(parameter, value) > 0) return value as number;
  throw invalid(parameter, `${shown(value)}; a number above 0 is needed`);
}

/** A whole number between bounds; 0 to 2^32 - 1 where none are given. */
export function whole(parameter: string, value: unknown, { min = 0, max = 0xffffffff }: Bounds = {}): number {
  if (Number.isInteger(value) && (value as number) >= min && (value as number) <= max) return value as number;
  throw invalid(parameter, `${shown(value)}; ${wanted('a whole number', min, max)} is needed`);
}

function wanted(kind: string, min: number, max: number): string {
  if (min > -Infinity && max < Infinity) return `${kind} from ${min} to ${max}`;
  if (min > -Infinity) return `${kind} of at least ${min}`;
  return max < Infinity ? `${kind} of at most ${max}` : kind;
}

/** One of some words. */
export function choice<T extends string>(parameter: string, value: unknown, choices: readonly T[]): T {
  if (choices.includes(value as T)) return value as T;
  throw invalid(parameter, `${shown(value)}; one of ${choices.map(shown).join(', ')} is needed`);
}

/** Finite numbers, so many of them, in an array of any kind. */
export function numbers(parameter: string, value: unknown, ...lengths: number[]): Float64Array<ArrayBuffer> {
  const list = value as ArrayLike<number>;
  if (value === null || typeof value !== 'object' || !lengths.includes(list.length)) {
    throw invalid(parameter, `${lengths.join(' or ')} numbers are needed, not ${shown(value)}${lengthOf(value)}`);
  }
  return Float64Array.from(list, (entry) => number(parameter, entry));
}

/** Three finite numbers. */
export const vec3 = (parameter: string, value: unknown): Float64Array<ArrayBuffer> => numbers(parameter, value, 3);

function lengthOf(value: unknown): string {
  const length = (value as { length?: unknown } | null | undefined)?.length;
  return typeof length === 'number' && typeof value === 'object' ? ` of length ${length}` : '';
}

/** A typed array of one kind, its length a multiple of `stride`. */
export function typed<T extends { readonly length: number }>(
  parameter: string,
  value: unknown,
  kind: new (length: number) => T,
  stride = 1,
): T {
  if (!(value instanceof kind)) throw invalid(parameter, `${shown(value)}; a ${kind.name} is needed`);
  if (isGone(value))
    throw invalid(parameter, 'its memory was transferred or has shrunk; an array that can be read is needed');
  if (value.length % stride === 0) return value;
  throw invalid(parameter, `length ${value.length} is not a multiple of ${stride}`);
}

/** Whether a typed array's memory is elsewhere: its length is 0 then, like that of one that is only empty. */
function isGone(array: { readonly length: number }): boolean {
  try {
    if (array.length === 0 && ArrayBuffer.isView(array)) (array as unknown as Uint8Array).at(0);
    return false;
  } catch {
    return true;
  }
}

/** Packed numbers, all finite, their count a multiple of `stride`. */
export function finite(parameter: string, value: unknown, stride: number): Float32Array {
  const array = typed(parameter, value, Float32Array, stride);
  const wrong = array.findIndex((entry) => !Number.isFinite(entry));
  if (wrong < 0) return array;
  throw invalid(parameter, `${array[wrong]} at index ${wrong}; all numbers must be finite`);
}

/** An object that has no other properties than those named; `{}` where it is left out. */
export function knownOnly<T extends object>(
  parameter: string,
  value: T | undefined,
  names: readonly string[],
): Partial<T> {
  if (value === undefined) return {};
  if (value === null || typeof value !== 'object') throw invalid(parameter, `${shown(value)}; an object is needed`);
  for (const name of Object.keys(value)) {
    if (!names.includes(name))
      throw invalid(name, `${parameter} has no property of this name; there are ${names.join(', ')}`);
  }
  return value;
}

/** An array of things. */
export function list<T>(parameter: string, value: readonly T[]): readonly T[] {
  if (Array.isArray(value)) return value;
  throw invalid(parameter, `${shown(value)}; an array is needed`);
}

/** A copy of an object, so that getters and proxies run their own code here and not in the middle of a call into the module. */
export function plain<T extends object>(parameter: string, value: T): T {
  if (value === null || typeof value !== 'object' || Array.isArray(value))
    throw invalid(parameter, 'an object is needed');
  return { ...value };
}
