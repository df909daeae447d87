import type { Warning } from '../engine/warnings';
import { download } from '../kit/download';
import type { History } from '../kit/history';
import { text } from '../texts';
import { toCsv } from './run-table';

/** Saves a lab's results as files named after the open volume or mesh; `say` shows the name of each saved file. */
export class Saving {
  readonly #say: (text: string) => void;
  #name = 'surface';

  constructor(say: (text: string) => void) {
    this.#say = say;
  }

  /** Name of the open volume or file, without its folder, from which the names of saved files are derived. */
  get name(): string {
    return this.#name;
  }

  set name(name: string) {
    this.#name = name.replace(/^.*\//, '');
  }

  /** The name without the ending of its format, as part of the names of saved files. */
  get stem(): string {
    return this.name.replace(/\.(nii|nrrd|nhdr|mha|mhd|gz|ply|obj|xyz|pts|csv|txt)\b.*$/i, '').replaceAll(' ', '-');
  }

  /** Saves the data of the plots as CSV, with warnings; `residual` is the heading of the residual's column. */
  plots(history: History, warnings: readonly Warning[], residual?: string): void {
    this.bytes('csv', new TextEncoder().encode(toCsv(history, warnings, residual)), 'text/csv');
  }

  /**
   * Saves bytes as a file of the media type `type`; `suffix` is added to the file's name, to distinguish files of the
   * same type.
   */
  bytes(extension: string, bytes: Uint8Array, type: string, suffix = ''): void {
    const { stem } = this;
    download(`${stem}${suffix}.${extension}`, bytes, type);
    this.#say(text('labs.saved', { stem, suffix, extension }));
  }
}
