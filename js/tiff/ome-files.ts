// The files of an OME data set.
import type { OpenFile } from './layout.js';
import type { Ome, TiffData } from './ome.js';

/** A file of a data set, with its own description. */
export interface OmeFile extends OpenFile {
  ome: Ome | undefined;
}

/** Returns the files that a description names, among those that were opened. */
export function namedFiles(main: OmeFile, ome: Ome, files: OmeFile[]): Set<OmeFile> {
  const finder = new Finder(main, ome, files);
  const found = ome.images.flatMap(({ tiffData }) => tiffData.map(({ file }) => finder.find(file)));
  return new Set(found.filter((file) => file !== undefined));
}

const baseName = (name: string) => name.slice(Math.max(name.lastIndexOf('/'), name.lastIndexOf('\\')) + 1);

/** Finds the files that a description names. */
export class Finder {
  readonly #byId = new Map<string, OmeFile>();
  readonly #byName = new Map<string, OmeFile>();
  readonly #unnamed: OmeFile | undefined;
  readonly #only: OmeFile | undefined;

  constructor(main: OmeFile, ome: Ome, files: OmeFile[]) {
    const images = files.filter(({ pages }) => pages.length > 0);
    for (const file of images) {
      if (file.ome?.uuid) this.#byId.set(file.ome.uuid, file);
      this.#byName.set(baseName(file.source.name), file);
    }
    const only = images.length === 1 ? images[0] : undefined;
    this.#unnamed = main.pages.length > 0 ? main : only;
    // One file whose description names one file is that, whatever its name is now.
    const named = ome.images.flatMap(({ tiffData }) => tiffData.map(({ file }) => file?.uuid || file?.name || ''));
    this.#only = new Set(named).size === 1 ? only : undefined;
  }

  /** Returns a file by its identifier, its name, or as the only one; undefined if it was not opened. */
  find(file: TiffData['file']): OmeFile | undefined {
    if (!file) return this.#unnamed;
    return this.#byId.get(file.uuid) ?? this.#byName.get(baseName(file.name)) ?? this.#only;
  }
}
