import type { Client } from '../client';
import type { MeshFormat } from '../protocol';
import { download } from '../ui/files';
import type { History } from '../ui/history';
import { toCsv } from './csv';

/** Saves what the lab has, under the name of what is open; `say` hears what was saved. */
export class Saving {
  readonly #client: Client;
  readonly #say: (text: string) => void;
  /** Of the volume or file that is open. */
  name = 'surface';

  constructor(client: Client, say: (text: string) => void) {
    this.#client = client;
    this.#say = say;
  }

  /** The surface as it is now. */
  async mesh(format: MeshFormat, type: string): Promise<void> {
    this.#save(format, await this.#client.request('export', { format }), type);
  }

  /** What the plots show. */
  plots(history: History): void {
    this.#save('csv', new TextEncoder().encode(toCsv(history)), 'text/csv');
  }

  #save(extension: string, bytes: Uint8Array, type: string): void {
    const stem = this.name.replace(/\.(nii|nrrd|nhdr|mha|mhd|gz)\b.*$/i, '').replaceAll(' ', '-');
    download(`${stem}.${extension}`, bytes, type);
    this.#say(`Saved ${stem}.${extension}.`);
  }
}
