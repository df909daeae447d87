/**
 * Reads the settings in links, which may come from anywhere: all lists and texts in them are bounded, so that none keeps
 * the page busy.
 */
import type { ParamValues } from '../engine/protocol';
import { count, text } from '../texts';

/** Most characters of a link's settings. Browsers and other programs cut off longer addresses. */
const MOST_CHARACTERS = 30_000;
/** Most characters of a name. */
export const MOST_NAME = 200;
/** Most parameters. */
const MOST_PARAMS = 200;

/** A link with more than any that the app makes; the message says what. */
export class LinkError extends Error {}

/** Returns what `read` returns, or the {@link LinkError} that it throws. */
export function readLink<Linked>(read: () => Linked): Linked | LinkError {
  try {
    return read();
  } catch (error) {
    if (error instanceof LinkError) return error;
    throw error;
  }
}

function tooMany(name: string, most: number, found: number): LinkError {
  return new LinkError(text('labs.linkTooMuch', { name, most, found }));
}

const tooLong = (found: number) =>
  new LinkError(text('labs.linkTooLong', { most: count(MOST_CHARACTERS), found: count(found) }));

/**
 * Returns the settings of a lab in the hash of an address; undefined if it is for another lab or contains no settings.
 * Throws a {@link LinkError} if they are too long.
 */
export function queryOf(hash: string, lab: string): URLSearchParams | undefined {
  const [address, settings] = hash.split(/\?(.*)/s, 2);
  if (address !== lab || !settings) return undefined;
  if (settings.length > MOST_CHARACTERS) throw tooLong(settings.length);
  return new URLSearchParams(settings);
}

/** Returns the parameters in a link, whose names begin with `p.`; whether they are known is not checked here. */
export function paramsIn(query: URLSearchParams, read = readValue): ParamValues {
  const entries = [...query].filter(([name]) => name.startsWith('p.'));
  if (entries.length > MOST_PARAMS) throw tooMany('p.…', MOST_PARAMS, entries.length);
  return Object.fromEntries(
    entries.map(([name, value]) => [name.slice(2, MOST_NAME), read(value.slice(0, MOST_NAME))]),
  );
}

/** Parses the value of a parameter in a link: a number if possible, else the text. */
export function readValue(text: string): unknown {
  const value = Number(text);
  return text !== '' && Number.isFinite(value) ? value : text;
}

/** Returns all texts of a name, of which there are at most `most`. */
export function allIn(query: URLSearchParams, name: string, most: number): string[] {
  const found = query.getAll(name);
  if (found.length > most) throw tooMany(name, most, found.length);
  return found;
}

/** Returns the numbers in a text with commas; undefined if they are not `length` finite ones. */
export function listOf(text: string, length: number): number[] | undefined {
  const list = text.split(',', length + 1).map(Number);
  return text && list.length === length && list.every(Number.isFinite) ? list : undefined;
}

/** Returns the entries of `values` that differ from those in `usual`, for a link that omits the others. */
export function differing(values: ParamValues, usual: ParamValues): ParamValues {
  return Object.fromEntries(Object.entries(values).filter(([name, value]) => !Object.is(usual[name], value)));
}
