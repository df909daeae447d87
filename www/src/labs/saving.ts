import type { MeshFormat } from '../protocol';
import { download } from '../ui/files';
import type { History } from '../ui/history';
import { toCsv } from './csv';

/** Saves what the lab has, under the name of what is open; `say` hears what was saved. */
export class Saving {
  readonly #fetch: (format: MeshFormat) => Promise<Uint8Array>;
  readonly #say: (text: string) => void;
  /** Of the volume or file that is open. */
  name = 'surface';

  /** `fetch` gives the surface in a format. */
  constructor(fetch: (format: MeshFormat) => Promise<Uint8Array>, say: (text: string) => void) {
    this.#fetch = fetch;
    this.#say = say;
  }

  /** The surface as it is now. */
  async mesh(format: MeshFormat, type: string, suffix = ''): Promise<void> {
    this.bytes(format, await this.#fetch(format), type, suffix);
  }

  /** What the plots show. */
  plots(history: History, residual?: string): void {
    this.bytes('csv', new TextEncoder().encode(toCsv(history, residual)), 'text/csv');
  }

  /** `suffix` tells files of the same kind apart. */
  bytes(extension: string, bytes: Uint8Array, type: string, suffix = ''): void {
    const stem = this.name
      .replace(/\.(nii|nrrd|nhdr|mha|mhd|gz|ply|obj|xyz|pts|csv|txt)\b.*$/i, '')
      .replaceAll(' ', '-');
    download(`${stem}${suffix}.${extension}`, bytes, type);
    this.#say(`Saved ${stem}${suffix}.${extension}.`);
  }
}
