import { beatOf } from '../track/curve';
import type { ComparedTrack, FrameStatistics, Preparation, SurfaceError } from '../track/protocol';
import { h, uniqueId } from './dom';
import { count, figure, milliseconds } from './format';

/** The alternative with which the current run is compared. */
export type Other = 'prediction' | 'none' | 'linear' | 'flow';

const OTHERS: { value: Other; label: string }[] = [
  { value: 'prediction', label: 'prediction' },
  { value: 'none', label: 'no in-between slices' },
  { value: 'linear', label: 'in-between slices, linear' },
  { value: 'flow', label: 'in-between slices by flow' },
];

/** One of the two runs of a comparison. */
export interface ComparedRun {
  name: string;
  facts: readonly FrameStatistics[];
  closing: number | undefined;
  error: SurfaceError | undefined;
  /** Duration in milliseconds, if known. */
  took: number | undefined;
}

export interface TrackCompareEvents {
  onStart: (other: Other) => void;
  onCancel: () => void;
}

/** Tracks the same image again with one alternative setting, and compares the volume curves and measures. */
export class TrackComparePanel {
  readonly element: HTMLElement;
  readonly #select: HTMLSelectElement;
  readonly #start: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #progress = h('progress', { max: 1, value: 0, 'aria-label': 'Progress of the comparison', hidden: true });
  readonly #status = h('p', { class: 'help', role: 'status' });
  readonly #table = h('div', { 'data-comparison': '{}' });

  constructor({ onStart, onCancel }: TrackCompareEvents) {
    const id = uniqueId('compare');
    this.#select = h(
      'select',
      { id, 'data-compare': 'with' },
      ...OTHERS.map(({ value, label }) => h('option', { value }, label)),
    );
    this.#start = h(
      'button',
      { type: 'button', disabled: true, 'data-compare': 'start', onclick: () => onStart(this.#select.value as Other) },
      'Compare',
    );
    this.#cancel = h('button', { type: 'button', onclick: onCancel, 'data-compare': 'cancel', hidden: true }, 'Cancel');
    this.element = h(
      'div',
      { class: 'compare' },
      h('p', { class: 'help' }, 'Tracks all frames once more with the other choice. The surfaces shown stay.'),
      h('div', { class: 'row stacked' }, h('label', { for: id }, 'With and without'), this.#select),
      h('div', { class: 'buttons' }, this.#start, this.#cancel),
      this.#progress,
      this.#status,
      this.#table,
    );
  }

  /** Whether the current run is finished, so that it can be compared. */
  set enabled(enabled: boolean) {
    this.#start.disabled = !enabled;
  }

  /** Updates the alternatives; the current setting is not offered. */
  show(prediction: boolean, { enrichment }: Preparation): void {
    for (const option of this.#select.options) {
      if (option.value === 'prediction') option.textContent = prediction ? 'without prediction' : 'with prediction';
      else option.disabled = option.value === enrichment;
    }
    if (this.#select.selectedOptions[0]?.disabled) this.#select.value = 'prediction';
  }

  clear(): void {
    this.#table.replaceChildren();
    this.#table.dataset.comparison = '{}';
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
  tell(part: number, phase: string): void {
    this.#progress.value = Number.isFinite(part) ? part : 0;
    this.#cancel.textContent = `Cancel (${phase})`;
  }

  refuse(message: string): void {
    this.#end(message);
  }

  finish(runs: [ComparedRun, ComparedRun]): void {
    this.#end(said(runs));
    this.#table.dataset.comparison = JSON.stringify(runs.map(summary));
    this.#table.replaceChildren(tableOf(runs));
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

/** Returns the figures of the table, also for other programs. */
function summary({ name, facts, closing, error, took }: ComparedRun) {
  const mean = (of: (one: FrameStatistics) => number) =>
    facts.reduce((sum, one) => sum + of(one), 0) / (facts.length || 1);
  const later = facts.slice(1);
  const rest = later.reduce((sum, { meanFinalCorrection }) => sum + meanFinalCorrection, 0) / (later.length || 1);
  const steps = later.reduce((sum, one) => sum + one.steps, 0) / (later.length || 1);
  const beat = beatOf(facts.map(({ volume }) => volume));
  return {
    name,
    ejection: beat?.ejection,
    diastole: beat?.largest,
    systole: beat?.smallest,
    rest,
    steps,
    folded: mean(({ folded, triangles }) => folded / (triangles || 1)),
    area: mean(({ area }) => area),
    closing,
    error: error?.mean,
    most: error?.most,
    took,
  };
}

export type Summary = ReturnType<typeof summary>;

function said(runs: [ComparedRun, ComparedRun]): string {
  const [here, there] = runs.map(summary) as [Summary, Summary];
  const percent = (share: number | undefined) => (share === undefined ? '–' : `${(100 * share).toFixed(1)} %`);
  return `Ejection fraction ${percent(here.ejection)} ${here.name}, ${percent(there.ejection)} ${there.name}; projections took ${figure(round(here.steps))} and ${figure(round(there.steps))} steps in the mean.`;
}

const round = (value: number) => Number(value.toPrecision(3));

function tableOf(runs: [ComparedRun, ComparedRun]): HTMLElement {
  const both = runs.map(summary);
  const size = (value: number | undefined) => (value === undefined ? '–' : figure(round(value)));
  const row = (label: string, text: (one: Summary) => string) =>
    h('tr', {}, h('th', { scope: 'row' }, label), ...both.map((one) => h('td', {}, text(one))));
  const rows = [
    row('Largest volume', ({ diastole }) => size(diastole)),
    row('Smallest volume', ({ systole }) => size(systole)),
    row('Ejection fraction', ({ ejection }) => (ejection === undefined ? '–' : `${(100 * ejection).toFixed(1)} %`)),
    row('Steps of projections', ({ steps }) => size(steps)),
    row('Rest of the last', ({ rest }) => size(rest)),
    row('Folded', ({ folded }) => `${(100 * folded).toFixed(2)} %`),
    row('Area', ({ area }) => size(area)),
    ...(both.some(({ closing }) => closing !== undefined)
      ? [row('Closes within', ({ closing }) => size(closing))]
      : []),
    ...(both.some(({ error }) => error !== undefined)
      ? [row('Error, mean', ({ error }) => size(error)), row('Error, 95 %', ({ most }) => size(most))]
      : []),
    row('Time', ({ took }) => (took === undefined ? '–' : milliseconds(took))),
  ];
  const head = ['Measure', ...runs.map(({ name }) => name)].map((title) => h('th', { scope: 'col' }, title));
  const table = h('table', { class: 'times' }, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows));
  const label = `What came of both ways, ${count(runs[0].facts.length)} frames`;
  return h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, table);
}

/** Converts a tracked run to an entry of a comparison. */
export function comparedRun(name: string, { facts, closing, error, took }: ComparedTrack): ComparedRun {
  return { name, facts, closing, error, took };
}
