import { h } from '../../../kit/dom';
import { count, figure, levelSymbol } from '../../../kit/format';
import { TaskControls } from '../../../kit/task';
import { text } from '../../../texts';
import type { ComparisonProgressEvent, ExtractionRun, Requests } from '../protocol';
import { addTimes, seconds, TIME_NOTE, TIME_ROWS, timeOf } from './times';

type Result = NonNullable<Requests['compare']['reply']>;

const NAMES = { direct: text('extractPanels.direct'), coarseToFine: text('extractPanels.coarseToFine') } as const;

export interface CompareEvents {
  onStart: () => void;
  onCancel: () => void;
}

/**
 * Panel that has the same extraction run twice, directly on the volume and coarse to fine, and compares the two runs,
 * as in tables 1 and 2 of Lachaud and Montanvert.
 */
export class ComparePanel {
  readonly element: HTMLElement;
  readonly #task: TaskControls;
  readonly #tables = h('div', { 'data-comparison': '{}' });

  constructor({ onStart, onCancel }: CompareEvents) {
    this.#task = new TaskControls({
      name: 'compare',
      start: text('controls.compare'),
      progress: text('controls.comparisonProgress'),
      max: 2,
      onStart,
      onCancel,
    });
    const help = h('p', { class: 'help' }, text('extractPanels.compareHelp'));
    this.element = h('div', { class: 'compare' }, help, ...this.#task.elements, this.#tables);
  }

  /** Whether there is a volume, so that a comparison can be started. */
  set enabled(enabled: boolean) {
    this.#task.enabled = enabled;
  }

  /** Removes the results of the last comparison. */
  clear(): void {
    this.#tables.replaceChildren();
    this.#tables.dataset.comparison = '{}';
    this.#task.end('');
  }

  begin(): void {
    this.clear();
    this.#task.begin(text('controls.comparing'));
  }

  /** Shows the progress of a comparison, without announcing it to screen readers. */
  showProgress({ run, report }: ComparisonProgressEvent): void {
    const value = (run === 'direct' ? 0 : 1) + (Number.isFinite(report.progress) ? report.progress : 0);
    const iteration = count(report.iteration);
    this.#task.showProgress(value, text('extractPanels.compareCancel', { run: NAMES[run], iteration }));
  }

  reject(message: string): void {
    this.#task.end(message);
  }

  finish(result: Result | undefined): void {
    if (result) this.#show(result);
    else this.#task.end(text('controls.cancelled'));
  }

  #show(result: Result): void {
    const { direct, coarseToFine } = result;
    const factor = total(direct) / total(coarseToFine);
    const [key, times] =
      factor >= 1
        ? (['extractPanels.compareFaster', factor] as const)
        : (['extractPanels.compareSlower', 1 / factor] as const);
    this.#task.end(text(key, { factor: figure(round(times)), difference: difference(result) }));
    this.#tables.dataset.comparison = JSON.stringify({ direct: summary(direct), coarseToFine: summary(coarseToFine) });
    this.#tables.replaceChildren(
      scrolling(text('extractPanels.compareTimes'), timeTable(coarseToFine, direct)),
      h('p', { class: 'help' }, TIME_NOTE),
      scrolling(text('controls.compareResults'), outcomeTable(coarseToFine, direct)),
    );
  }
}

const round = (value: number) => Number(value.toPrecision(2));

function total(run: ExtractionRun): number {
  return timeOf(addTimes(run.byLevel.map(({ times }) => new Map(Object.entries(times)))));
}

function summary(run: ExtractionRun) {
  const { vertices, components, genus, area, volume } = run.info;
  const { iteration: iterations, done } = run.report;
  return { levels: run.levels, iterations, done, milliseconds: total(run), vertices, components, genus, area, volume };
}

function difference({ direct, coarseToFine }: Result): string {
  if (direct.info.vertices === 0 || coarseToFine.info.vertices === 0) return text('extractPanels.compareVanished');
  const part = (key: 'area' | 'volume') => {
    const off = Math.abs(coarseToFine.info[key] / direct.info[key] - 1);
    return text('controls.percent', { value: (100 * off).toFixed(off < 0.1 ? 2 : 0) });
  };
  return text('extractPanels.compareDifference', { area: part('area'), volume: part('volume') });
}

function scrolling(label: string, table: HTMLTableElement): HTMLElement {
  return h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, table);
}

/**
 * Creates the table of durations in seconds, for both runs of a comparison: rows T (topology), N (normals) and F
 * (forces and motion) as in the paper, the sum of all parts, and the number of iterations; a column per pyramid level
 * and one for the whole run.
 */
function timeTable(coarseToFine: ExtractionRun, direct: ExtractionRun): HTMLTableElement {
  const levels = coarseToFine.byLevel.map(({ level }) => level);
  const head = [
    text('extractPanels.timePart'),
    ...levels.map((level) => levelSymbol(level)),
    text('extractPanels.timeTotal'),
  ].map((title) => h('th', { scope: 'col' }, title));
  const body = [
    ...rowsOf(text('extractPanels.coarseToFine'), coarseToFine, levels),
    ...rowsOf(text('extractPanels.direct'), direct, levels),
  ];
  return h('table', { class: 'times' }, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...body));
}

function rowsOf(name: string, run: ExtractionRun, levels: number[]): HTMLElement[] {
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
    h('th', { scope: 'row' }, text('extractPanels.timeSteps')),
    ...steps.map((value) => h('td', {}, value === undefined ? '' : count(value))),
  );
  return [title, ...TIME_ROWS.map(({ letter, parts }) => row(letter, parts)), sum, stepRow];
}

function outcomeTable(coarseToFine: ExtractionRun, direct: ExtractionRun): HTMLTableElement {
  const runs = [coarseToFine, direct];
  const row = (name: string, value: (run: ExtractionRun) => string) =>
    h('tr', {}, h('th', { scope: 'row' }, name), ...runs.map((run) => h('td', {}, value(run))));
  const head = [text('controls.measure'), text('extractPanels.coarseToFine'), text('extractPanels.direct')].map(
    (title) => h('th', { scope: 'col' }, title),
  );
  return h(
    'table',
    { class: 'times' },
    h('thead', {}, h('tr', {}, ...head)),
    h(
      'tbody',
      {},
      row(text('extractPanels.outcomeIterations'), ({ report }) => count(report.iteration)),
      row(text('extractPanels.outcomeConverged'), ({ report }) =>
        report.done ? text('controls.yes') : text('controls.no'),
      ),
      row(text('controls.time'), (run) => text('controls.seconds', { value: seconds(total(run)) })),
      row(text('measures.vertices'), ({ info }) => count(info.vertices)),
      row(text('measures.components'), ({ info }) => count(info.components)),
      row(text('measures.genus'), ({ info }) => count(info.genus)),
      row(text('measures.area'), ({ info }) => figure(info.area)),
      row(text('measures.volume'), ({ info }) => figure(info.volume)),
    ),
  );
}
