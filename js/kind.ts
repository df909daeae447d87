import { invalid } from './check.js';
import type { VesicleError } from './error.js';

/** The property of the library's objects that tells what they are, to other entry points and copies of the package, too. */
const KIND = Symbol.for('vesicle kind');

/** The class of an object, and whether it is a proxy of one in a worker. */
type Kind = { name: string; isRemote: boolean };

/** Marks the objects of a class. */
export function mark(prototype: object, name: string, isRemote = false): void {
  const value: Kind = { name, isRemote };
  Object.defineProperty(prototype, KIND, { value });
}

/** Returns whether a value is a proxy of an object in a worker. */
export const isProxy = (value: unknown): boolean =>
  (value as { [KIND]?: Kind } | null | undefined)?.[KIND]?.isRemote === true;

/** Returns the error of a parameter that must be an object of a class, which says what it is instead, as far as it is known. */
export function notA(name: 'Volume' | 'Mesh', parameter: string, value: unknown, orElse = ''): VesicleError {
  const kind = (value as { [KIND]?: Kind } | null | undefined)?.[KIND];
  if (kind?.name !== name) return invalid(parameter, `must be a ${name}${orElse}`);
  const arrays = name === 'Volume' ? 'its voxels (new Volume)' : 'its arrays (Mesh.fromArrays)';
  if (kind.isRemote)
    return invalid(
      parameter,
      `is a ${name} in a worker; use it with the classes of vesicle/worker, or pass on ${arrays}`,
    );
  return invalid(parameter, `is a ${name} of another entry point, or copy, of the package; pass on ${arrays}`);
}
