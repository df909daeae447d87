import { cellOf, type Warning } from '../engine/warnings';
import { fileChooser, VOLUME_FILES } from '../importers/chooser';
import { acceptDropsOn, nameOf, readFiles } from '../importers/files';
import { csvOf } from '../kit/csv';
import { h, uniqueId } from '../kit/dom';
import { figure } from '../kit/format';
import { text } from '../texts';
import { type Finishing, isCancelled } from './finishing';
import type { Comparison, Distances } from './protocol';

const MEASURES = [
  ['mean', text('finish.mean')],
  ['rms', text('finish.rms')],
  ['p95', text('finish.p95')],
  ['max', text('finish.hausdorff')],
] as const satisfies [keyof Distances, string][];
const DIRECTIONS = [
  ['toReference', text('finish.toReference')],
  ['fromReference', text('finish.fromReference')],
  ['both', text('finish.both')],
] as const satisfies [keyof Comparison, string][];

export interface ComparePanelEvents {
  /** Called with the distance of each vertex from the reference, to be shown as colours; undefined for none. */
  onValues: (values: Float32Array | undefined) => void;
  onSave: (extension: string, bytes: Uint8Array, type: string, suffix: string) => void;
  /** Returns the warnings that concern the surface. */
  warnings: () => readonly Warning[];
}

/** Panel that compares the surface with a reference, a mesh or a label map, from files. */
export class ReferencePanel {
  readonly element: HTMLElement;
  /** Unit of length, or empty. */
  unit = '';
  readonly #finishing: Finishing;
  readonly #events: ComparePanelEvents;
  readonly #status = h('p', { class: 'help', role: 'status', 'data-reference': 'status' });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #result = h('div', { 'data-reference': 'result' });
  readonly #label = h('select', { id: uniqueId('label') });
  readonly #labelRow: HTMLElement;
  readonly #colors = h('input', { type: 'checkbox', checked: true });
  readonly #more: HTMLElement;
  /** Name of the reference; undefined if there is none. */
  #name: string | undefined;
  /** Files of the reference. */
  #files: File[] = [];
  /** Files of a reference that is being read. */
  #reading: File[] | undefined;
  #comparison: Comparison | undefined;
  #enabled = false;
  /** Counts comparisons, so that only the newest is shown. */
  #asked = 0;

  constructor(finishing: Finishing, events: ComparePanelEvents) {
    this.#finishing = finishing;
    this.#events = events;
    const chooser = fileChooser(
      (files) => void this.#open(files),
      `.ply,.stl,.obj,.glb,${VOLUME_FILES}`,
      text('finish.openReference'),
    );
    this.#label.addEventListener('change', () => void this.compare());
    this.#labelRow = h('div', { class: 'row' }, h('label', { for: this.#label.id }, text('finish.label')), this.#label);
    this.#colors.addEventListener('change', () => this.#color());
    this.#more = h(
      'div',
      { hidden: true },
      this.#labelRow,
      this.#result,
      h('label', {}, this.#colors, ' ', text('finish.colors')),
      h('button', { type: 'button', 'data-reference': 'csv', onclick: () => this.#save() }, text('finish.csv')),
    );
    this.element = h(
      'div',
      { class: 'reference' },
      h('p', { class: 'help' }, text('finish.referenceHelp')),
      h('div', { class: 'row' }, chooser),
      this.#status,
      this.#error,
      this.#more,
    );
    acceptDropsOn(this.element, (data) => {
      const files = [...(data?.files ?? [])];
      if (files.length > 0 && this.#enabled) void this.#open(files);
    });
  }

  /** Whether the lab has a surface that does not change by itself. */
  set enabled(enabled: boolean) {
    this.#enabled = enabled;
    for (const input of this.element.querySelectorAll('input')) input.disabled = !enabled;
  }

  /** Forgets the reference, which the worker has lost. */
  forget(): void {
    this.#name = undefined;
    this.#status.textContent = '';
    this.clear();
  }

  /** Reads the reference again, and one that was being read, for a worker that has lost them. */
  reopen(): void {
    const lost = this.#name === undefined ? [] : [this.#files];
    if (this.#reading) lost.push(this.#reading);
    if (lost.length === 0) return;
    this.forget();
    for (const files of lost) void this.#open(files);
  }

  /** Compares the present surface with the reference, if there is one. */
  async compare(): Promise<void> {
    if (this.#name === undefined) return;
    const asked = ++this.#asked;
    const label = this.#label.value === '' ? {} : { label: Number(this.#label.value) };
    await this.#attempt(async () => {
      const found = await this.#finishing.request('compare', label);
      if (asked === this.#asked) this.#show(found);
    });
  }

  /** Removes the results, as the surface has changed; the reference stays. */
  clear(): void {
    this.#asked += 1;
    this.#comparison = undefined;
    this.#more.hidden = true;
    this.#color();
  }

  async #open(files: File[]): Promise<void> {
    await this.#attempt(async () => {
      this.#reading = files;
      await this.#finishing.request('reference', await readFiles(files));
      if (this.#reading === files) this.#reading = undefined;
      this.#name = nameOf(files);
      this.#files = files;
      this.#label.replaceChildren();
      await this.compare();
    });
  }

  async #attempt(work: () => Promise<void>): Promise<void> {
    this.#error.textContent = '';
    this.#status.textContent = text('controls.comparing');
    try {
      await work();
      this.#status.textContent = this.#name ?? '';
    } catch (error) {
      this.#status.textContent = this.#name ?? '';
      // It is made again then.
      if (isCancelled(error)) return;
      this.#reading = undefined;
      const reason = error instanceof Error ? error.message : String(error);
      this.#error.textContent = text('finish.referenceFailed', { reason });
    }
  }

  #show(found: Comparison): void {
    this.#comparison = found;
    this.#more.hidden = false;
    this.#labelRow.hidden = found.labels.length < 2;
    if (this.#label.options.length === 0) {
      const option = (value: string, name: string) => h('option', { value }, name);
      this.#label.append(option('', text('finish.allLabels')), ...found.labels.map((n) => option(`${n}`, `${n}`)));
    }
    const heads = [this.unit, ...DIRECTIONS.map(([, label]) => label)].map((label) => h('th', { scope: 'col' }, label));
    const rows = MEASURES.map(([measure, label]) => {
      const cells = DIRECTIONS.map(([name]) => h('td', {}, figure(found[name][measure])));
      return h('tr', {}, h('th', { scope: 'row' }, label), ...cells);
    });
    const table = h(
      'table',
      { class: 'times distances' },
      h('thead', {}, h('tr', {}, ...heads)),
      h('tbody', {}, ...rows),
    );
    const { dice } = found;
    const overlap = dice === undefined ? text('finish.noDice') : text('finish.dice', { value: dice.toFixed(4) });
    this.#result.dataset.values = JSON.stringify({ ...found, values: undefined });
    this.#result.replaceChildren(h('div', { class: 'scroll' }, table), h('p', { class: 'help' }, overlap));
    this.#color();
  }

  #color(): void {
    this.#events.onValues(this.#colors.checked ? this.#comparison?.values : undefined);
  }

  #save(): void {
    const found = this.#comparison;
    if (!found) return;
    const unit = this.unit && ` (${this.unit})`;
    const head = ['direction', ...MEASURES.map(([name]) => (name === 'max' ? 'hausdorff' : name) + unit)];
    const lines = DIRECTIONS.map(([name]) => [name, ...MEASURES.map(([measure]) => found[name][measure])]);
    const warnings = cellOf(this.#events.warnings());
    const rest = [['dice', found.dice ?? ''], ...(warnings ? [['warnings', warnings]] : [])];
    const table = csvOf([head, ...lines, ...rest]);
    this.#events.onSave('csv', new TextEncoder().encode(table), 'text/csv', '-comparison');
  }
}
