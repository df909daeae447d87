// The JSON of a glTF document, of which nothing is known before it is checked.
import { badGltf } from './error.js';

export type Json = Record<string, unknown>;

/** Returns a value as an object, empty if it is none. */
export const object = (value: unknown): Json =>
  typeof value === 'object' && value !== null && !Array.isArray(value) ? (value as Json) : {};

/** Returns the objects of an array; none if it is no array. */
export const objects = (value: unknown): Json[] => (Array.isArray(value) ? value.map(object) : []);

/** Returns the array of that name, added if there is none. */
export function list(owner: Json, name: string): unknown[] {
  const known = owner[name];
  if (Array.isArray(known)) return known;
  const made: unknown[] = [];
  owner[name] = made;
  return made;
}

/** Returns an integer that is not negative, `usual` if there is none; throws `bad-file` for anything else. */
export function whole(value: unknown, field: string, usual?: number): number {
  if (value === undefined && usual !== undefined) return usual;
  if (typeof value === 'number' && Number.isSafeInteger(value) && value >= 0) return value;
  throw badGltf(field, `must be an integer ≥ 0, got ${typeof value === 'number' ? value : typeof value}`);
}

/** Returns the entry of a table; throws `bad-file` if it has none with that index. */
export function entry(root: Json, table: string, index: number): Json {
  const entries = Array.isArray(root[table]) ? (root[table] as unknown[]) : [];
  if (index < entries.length) return object(entries[index]);
  throw badGltf(table, `index ${index} is out of range; there are ${entries.length} entries`);
}
