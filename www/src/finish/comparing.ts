import { signal } from '@preact/signals';
import type { Unit } from '../engine/protocol';
import { cellOf, type Warning } from '../engine/warnings';
import { nameOf, readFiles } from '../importers/files';
import { csvOf } from '../kit/csv';
import { text } from '../texts';
import { type Finishing, isCancelled } from './finishing';
import type { Comparison, Distances } from './protocol';

export const MEASURES = [
  ['mean', text('finish.mean')],
  ['rms', text('finish.rms')],
  ['p95', text('finish.p95')],
  ['max', text('finish.hausdorff')],
] as const satisfies [keyof Distances, string][];
export const DIRECTIONS = [
  ['toReference', text('finish.toReference')],
  ['fromReference', text('finish.fromReference')],
  ['both', text('finish.both')],
] as const satisfies [keyof Comparison, string][];

export interface ComparingEvents {
  /** Called with the distance of each vertex from the reference, to be shown as colours; undefined for none. */
  onValues: (values: Float32Array | undefined) => void;
  onSave: (extension: string, bytes: Uint8Array, type: string, suffix: string) => void;
  /** Returns the warnings that concern the surface. */
  warnings: () => readonly Warning[];
}

/** The comparison of the surface with a reference, a mesh or a label map, from files. */
export class Comparing {
  readonly unit = signal<Unit>('');
  readonly status = signal('');
  readonly error = signal('');
  readonly found = signal<Comparison | undefined>(undefined);
  /** The label of the reference that is compared with; undefined for all. */
  readonly label = signal<number | undefined>(undefined);
  /** Whether distances are shown as colours. */
  readonly isColored = signal(true);
  /** Whether the lab has a surface that does not change by itself. */
  readonly isEnabled = signal(false);
  readonly #finishing: Finishing;
  readonly #events: ComparingEvents;
  /** Name of the reference; undefined if there is none. */
  #name: string | undefined;
  /** Files of the reference. */
  #files: File[] = [];
  /** Files of a reference that is being read. */
  #reading: File[] | undefined;
  /** Counts comparisons, so that only the newest is shown. */
  #asked = 0;

  constructor(finishing: Finishing, events: ComparingEvents) {
    this.#finishing = finishing;
    this.#events = events;
    this.isColored.subscribe(() => this.#color());
  }

  /** Forgets the reference, which the worker has lost. */
  forget(): void {
    this.#name = undefined;
    this.status.value = '';
    this.clear();
  }

  /** Reads the reference again, and one that was being read, for a worker that has lost them. */
  reopen(): void {
    const lost = this.#name === undefined ? [] : [this.#files];
    if (this.#reading) lost.push(this.#reading);
    if (lost.length === 0) return;
    this.forget();
    for (const files of lost) void this.open(files);
  }

  /** Compares the present surface with the reference, if there is one. */
  async compare(): Promise<void> {
    if (this.#name === undefined) return;
    const asked = ++this.#asked;
    const label = this.label.peek();
    await this.#attempt(async () => {
      const found = await this.#finishing.request('compare', label === undefined ? {} : { label });
      if (asked !== this.#asked) return;
      this.found.value = found;
      this.#color();
    });
  }

  /** Removes the results, as the surface has changed; the reference stays. */
  clear(): void {
    this.#asked += 1;
    this.found.value = undefined;
    this.#color();
  }

  async open(files: File[]): Promise<void> {
    await this.#attempt(async () => {
      this.#reading = files;
      await this.#finishing.request('reference', await readFiles(files));
      if (this.#reading === files) this.#reading = undefined;
      this.#name = nameOf(files);
      this.#files = files;
      this.label.value = undefined;
      await this.compare();
    });
  }

  async #attempt(work: () => Promise<void>): Promise<void> {
    this.error.value = '';
    this.status.value = text('controls.comparing');
    try {
      await work();
    } catch (error) {
      // It is made again then.
      if (isCancelled(error)) return;
      this.#reading = undefined;
      const reason = error instanceof Error ? error.message : String(error);
      this.error.value = text('finish.referenceFailed', { reason });
    } finally {
      this.status.value = this.#name ?? '';
    }
  }

  #color(): void {
    this.#events.onValues(this.isColored.peek() ? this.found.peek()?.values : undefined);
  }

  save = (): void => {
    const found = this.found.peek();
    if (!found) return;
    const unit = this.unit.peek() && ` (${this.unit.peek()})`;
    const head = ['direction', ...MEASURES.map(([name]) => (name === 'max' ? 'hausdorff' : name) + unit)];
    const lines = DIRECTIONS.map(([name]) => [name, ...MEASURES.map(([measure]) => found[name][measure])]);
    const warnings = cellOf(this.#events.warnings());
    const rest = [['dice', found.dice ?? ''], ...(warnings ? [['warnings', warnings]] : [])];
    const table = csvOf([head, ...lines, ...rest]);
    this.#events.onSave('csv', new TextEncoder().encode(table), 'text/csv', '-comparison');
  };
}
