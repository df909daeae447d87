import type { ComparedRun, ComparingEvent, Requests } from '../protocol';
import { h } from './dom';
import { count, figure, levelSymbol } from './format';
import { addTimes, seconds, TIME_NOTE, TIME_ROWS, timeOf } from './times';

type Result = NonNullable<Requests['compare']['reply']>;

const NAMES = { direct: 'direct', coarseToFine: 'coarse to fine' } as const;

export interface CompareEvents {
  onStart: () => void;
  onCancel: () => void;
}

/** Compares the same extraction on the volume itself and coarse to fine, as in the paper's tables 1 and 2. */
export class ComparePanel {
  readonly element: HTMLElement;
  readonly #start: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #progress = h('progress', { max: 2, value: 0, 'aria-label': 'Progress of the comparison', hidden: true });
  readonly #status = h('p', { class: 'help', role: 'status' });
  readonly #tables = h('div', { 'data-comparison': '{}' });

  constructor({ onStart, onCancel }: CompareEvents) {
    this.#start = h('button', { type: 'button', onclick: onStart, 'data-compare': 'start' }, 'Compare');
    this.#cancel = h('button', { type: 'button', onclick: onCancel, 'data-compare': 'cancel', hidden: true }, 'Cancel');
    const help =
      'Runs twice with the volume, start and parameters as they are now: on the volume itself, and through the pyramid; attractors take no part. The surface shown stays.';
    this.element = h(
      'div',
      { class: 'compare' },
      h('p', { class: 'help' }, help),
      h('div', { class: 'buttons' }, this.#start, this.#cancel),
      this.#progress,
      this.#status,
      this.#tables,
    );
  }

  /** Whether there is a volume to compare on. */
  set enabled(enabled: boolean) {
    this.#start.disabled = !enabled;
  }

  /** Removes the results of the last comparison. */
  clear(): void {
    this.#tables.replaceChildren();
    this.#tables.dataset.comparison = '{}';
    this.#end('');
  }

  begin(): void {
    this.clear();
    this.#start.hidden = true;
    this.#cancel.hidden = false;
    this.#cancel.focus();
    this.#progress.hidden = false;
    this.#progress.value = 0;
    this.#status.textContent = 'Comparing.';
  }

  /** Shows the progress, without announcing it to screen readers. */
  tell({ run, report }: ComparingEvent): void {
    this.#progress.value = (run === 'direct' ? 0 : 1) + (Number.isFinite(report.progress) ? report.progress : 0);
    this.#cancel.textContent = `Cancel (${NAMES[run]}, iteration ${count(report.iteration)})`;
  }

  refuse(message: string): void {
    this.#end(message);
  }

  finish(result: Result | undefined): void {
    if (result) this.#show(result);
    else this.#end('Cancelled.');
  }

  #show(result: Result): void {
    const { direct, coarseToFine } = result;
    const factor = total(direct) / total(coarseToFine);
    this.#end(
      `Coarse to fine took ${factor >= 1 ? `${figure(round(factor))} times less` : `${figure(round(1 / factor))} times more`} time than direct. ${difference(result)}`,
    );
    this.#tables.dataset.comparison = JSON.stringify({ direct: summary(direct), coarseToFine: summary(coarseToFine) });
    this.#tables.replaceChildren(
      scrolling('Time of both ways, as in the paper’s table 1', timeTable(coarseToFine, direct)),
      h('p', { class: 'help' }, TIME_NOTE),
      scrolling('What came of both ways', outcomeTable(coarseToFine, direct)),
    );
  }

  #end(text: string): void {
    const hadFocus = document.activeElement === this.#cancel;
    this.#start.hidden = false;
    this.#cancel.hidden = true;
    this.#cancel.textContent = 'Cancel';
    this.#progress.hidden = true;
    this.#status.textContent = text;
    if (hadFocus) this.#start.focus();
  }
}

const round = (value: number) => Number(value.toPrecision(2));

function total(run: ComparedRun): number {
  return timeOf(addTimes(run.byLevel.map(({ times }) => new Map(Object.entries(times)))));
}

function summary(run: ComparedRun) {
  const { vertices, components, genus, area, volume } = run.info;
  const { iteration: iterations, done } = run.report;
  return { levels: run.levels, iterations, done, milliseconds: total(run), vertices, components, genus, area, volume };
}

function difference({ direct, coarseToFine }: Result): string {
  if (direct.info.vertices === 0 || coarseToFine.info.vertices === 0) return 'One of the two surfaces has vanished.';
  const part = (key: 'area' | 'volume') => {
    const off = Math.abs(coarseToFine.info[key] / direct.info[key] - 1);
    return `${(100 * off).toFixed(off < 0.1 ? 2 : 0)} %`;
  };
  return `Area differs by ${part('area')}, volume by ${part('volume')}.`;
}

function scrolling(label: string, table: HTMLTableElement): HTMLElement {
  return h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, table);
}

/** Creates the table of times: rows T, N, F and their sum, a column per level, for both runs. */
function timeTable(coarseToFine: ComparedRun, direct: ComparedRun): HTMLTableElement {
  const levels = coarseToFine.byLevel.map(({ level }) => level);
  const head = ['Part', ...levels.map((level) => levelSymbol(level)), 'total'].map((title) =>
    h('th', { scope: 'col' }, title),
  );
  const body = [...rowsOf('coarse to fine', coarseToFine, levels), ...rowsOf('direct', direct, levels)];
  return h('table', { class: 'times' }, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...body));
}

function rowsOf(name: string, run: ComparedRun, levels: number[]): HTMLElement[] {
  const byLevel = new Map(run.byLevel.map(({ level, times }) => [level, new Map(Object.entries(times))]));
  const all = addTimes([...byLevel.values()]);
  const row = (head: string, parts?: readonly string[]) => {
    const cells = levels.map((level) => {
      const times = byLevel.get(level);
      return h('td', {}, times ? seconds(timeOf(times, parts)) : '');
    });
    return h('tr', {}, h('th', { scope: 'row' }, head), ...cells, h('td', {}, seconds(timeOf(all, parts))));
  };
  const title = h('tr', { class: 'group' }, h('th', { scope: 'rowgroup', colspan: levels.length + 2 }, name));
  const sum = row('=');
  sum.classList.add('sum');
  const iterations = new Map(run.byLevel.map((level) => [level.level, level.iterations]));
  const steps = [...levels.map((level) => iterations.get(level)), run.report.iteration];
  const stepRow = h(
    'tr',
    { class: 'detail' },
    h('th', { scope: 'row' }, 'steps'),
    ...steps.map((value) => h('td', {}, value === undefined ? '' : count(value))),
  );
  return [title, ...TIME_ROWS.map(({ letter, parts }) => row(letter, parts)), sum, stepRow];
}

function outcomeTable(coarseToFine: ComparedRun, direct: ComparedRun): HTMLTableElement {
  const runs = [coarseToFine, direct];
  const row = (name: string, value: (run: ComparedRun) => string) =>
    h('tr', {}, h('th', { scope: 'row' }, name), ...runs.map((run) => h('td', {}, value(run))));
  const head = ['Measure', 'coarse to fine', 'direct'].map((title) => h('th', { scope: 'col' }, title));
  return h(
    'table',
    { class: 'times' },
    h('thead', {}, h('tr', {}, ...head)),
    h(
      'tbody',
      {},
      row('Iterations', ({ report }) => count(report.iteration)),
      row('Came to rest', ({ report }) => (report.done ? 'yes' : 'no')),
      row('Time', (run) => `${seconds(total(run))} s`),
      row('Vertices', ({ info }) => count(info.vertices)),
      row('Components', ({ info }) => count(info.components)),
      row('Genus', ({ info }) => count(info.genus)),
      row('Area', ({ info }) => figure(info.area)),
      row('Volume', ({ info }) => figure(info.volume)),
    ),
  );
}
