// Opens the arrays of an image.
import type { Group, Location, Readable, Array as ZarrArray } from 'zarrita';
import { endingTogether } from '../abort.js';
import { invalid } from '../check.js';
import type { Warning } from '../warning.js';
import { boundDecoders } from './codecs.js';
import { badZarr, RefusedError, translated, type Zarrita } from './error.js';
import { checkPyramid, checkSeries, Level, type Selection } from './levels.js';
import { parseMultiscale } from './multiscales.js';

/** Imports zarrita; throws `invalid-argument` if it is missing or too old. */
export async function importZarrita(): Promise<Zarrita> {
  let zarrita: Zarrita;
  try {
    zarrita = await import('zarrita');
  } catch {
    throw invalid('zarrita', 'this package, 0.7 or newer, is needed to read OME-Zarr: npm install zarrita');
  }
  // New in 0.7.
  if (typeof zarrita.isZarritaError === 'function') {
    boundDecoders(zarrita);
    return zarrita;
  }
  throw invalid('zarrita', 'version 0.7 or newer is needed to read OME-Zarr');
}

/** The levels of an image, its unit of length, and warnings about assumptions. */
type Opened = { levels: Level[]; unit: 'mm' | undefined; warnings: Warning[] };

/** Opens the levels of an image in a store, finest first, and checks them. */
export async function openLevels(
  zarrita: Zarrita,
  store: Readable,
  path: string,
  selection: Selection,
  signal: AbortSignal | undefined,
): Promise<Opened> {
  return endingTogether(signal, (signal) => openArrays(zarrita, store, path, selection, signal));
}

async function openArrays(
  zarrita: Zarrita,
  store: Readable,
  path: string,
  selection: Selection,
  signal: AbortSignal,
): Promise<Opened> {
  const opener = new Opener(zarrita, signal);
  const group = await opener.group(zarrita.root(store).resolve(path.replace(/^\/+|\/+$/g, '')));
  const image = parseMultiscale(Object(group.attrs));
  const arrays = await Promise.all(
    image.levels.map(({ path }) => opener.array(group.resolve(path), `array "${path}"`)),
  );
  checkSeries(arrays, image);
  const levels = image.levels.map(
    (transform, index) => new Level(zarrita, arrays[index] as ZarrArray<'uint8'>, image, transform, selection),
  );
  checkPyramid(
    levels,
    image.levels.map((transform) => transform.path),
  );
  return { levels, unit: image.unit, warnings: image.warnings };
}

/** Opens groups on Zarr 3, or else on Zarr 2, and then arrays of the same version. */
class Opener {
  readonly #zarrita: Zarrita;
  readonly #options: { signal: AbortSignal };
  #version: 'v2' | 'v3' = 'v3';

  constructor(zarrita: Zarrita, signal: AbortSignal) {
    this.#zarrita = zarrita;
    this.#options = { signal };
  }

  async group(location: Location<Readable>): Promise<Group<Readable>> {
    const part = `group "${location.path}"`;
    const first = await this.#group(location).catch((error: unknown) => this.#missing(part, error));
    if ('kind' in first) return first;
    this.#version = 'v2';
    const second = await this.#group(location).catch((error: unknown) => this.#missing(part, error));
    if ('kind' in second) return second;
    // Stores that hide what exists refuse all keys that are missing.
    throw first.error instanceof RefusedError
      ? first.error
      : badZarr(part, 'no Zarr group is there: neither zarr.json nor .zgroup');
  }

  #group(location: Location<Readable>): Promise<Group<Readable>> {
    const options = { kind: 'group', ...this.#options } as const;
    const { v2, v3 } = this.#zarrita.open;
    return this.#version === 'v2' ? v2(location, options) : v3(location, options);
  }

  /** Returns an error that says that nothing is there, or at least nothing that may be read, and throws others. */
  #missing(part: string, error: unknown): { error: unknown } {
    this.#options.signal.throwIfAborted();
    if (error instanceof RefusedError) return { error };
    if (!this.#zarrita.isZarritaError(error, 'NotFoundError')) throw translated(this.#zarrita, part, error);
    if (error.found === undefined) return { error };
    throw badZarr(part, 'this is an array; must be the group of an image');
  }

  async array(location: Location<Readable>, part: string): Promise<ZarrArray<'uint8'>> {
    try {
      const options = { kind: 'array', ...this.#options } as const;
      const { v2, v3 } = this.#zarrita.open;
      const array = await (this.#version === 'v2' ? v2(location, options) : v3(location, options));
      // Level checks the type.
      return array as ZarrArray<'uint8'>;
    } catch (error) {
      this.#options.signal.throwIfAborted();
      throw translated(this.#zarrita, part, error);
    }
  }
}
