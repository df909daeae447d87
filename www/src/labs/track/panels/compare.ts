import { h } from '../../../kit/dom';
import { type Choice, labelFor, selectFrom } from '../../../kit/field';
import { count, figure, milliseconds } from '../../../kit/format';
import { TaskControls } from '../../../kit/task';
import { text } from '../../../texts';
import { beatOf } from '../curve';
import type { Alternative, ComparedTrack, FrameStatistics, Preparation, SurfaceError } from '../protocol';

const ALTERNATIVES: Choice<Alternative>[] = [
  { value: 'prediction', label: text('trackPanels.otherPrediction') },
  { value: 'none', label: text('trackPanels.otherNone') },
  { value: 'linear', label: text('trackPanels.otherLinear') },
  { value: 'flow', label: text('trackPanels.otherFlow') },
];

/** One of the two tracking runs of a comparison, in the form that the panel shows. */
export interface TrackingRun {
  name: string;
  facts: readonly FrameStatistics[];
  closing: number | undefined;
  error: SurfaceError | undefined;
  /** Duration of the run in milliseconds, if known. */
  duration: number | undefined;
}

export interface TrackCompareEvents {
  onStart: (other: Alternative) => void;
  onCancel: () => void;
}

/**
 * Panel that starts a second tracking run of the same image with one alternative setting, and compares the volume
 * curves and measures of both runs.
 */
export class TrackComparePanel {
  readonly element: HTMLElement;
  readonly #select = selectFrom(ALTERNATIVES, { 'data-compare': 'with' });
  readonly #task: TaskControls;
  readonly #table = h('div', { 'data-comparison': '{}' });

  constructor({ onStart, onCancel }: TrackCompareEvents) {
    this.#task = new TaskControls({
      name: 'compare',
      start: text('controls.compare'),
      progress: text('controls.comparisonProgress'),
      onStart: () => onStart(this.#select.value as Alternative),
      onCancel,
    });
    this.#task.enabled = false;
    this.element = h(
      'div',
      { class: 'compare' },
      h('p', { class: 'help' }, text('trackPanels.compareHelp')),
      h('div', { class: 'row stacked' }, labelFor(this.#select, text('trackPanels.changedSetting')), this.#select),
      ...this.#task.elements,
      this.#table,
    );
  }

  /** Whether the current tracking run is finished, so that it can be compared with another. */
  set enabled(enabled: boolean) {
    this.#task.enabled = enabled;
  }

  /** Updates the choice of alternative settings for the second run; the current setting is not offered. */
  show(prediction: boolean, { enrichment }: Preparation): void {
    for (const option of this.#select.options) {
      if (option.value === 'prediction')
        option.textContent = prediction ? text('trackPanels.withoutPrediction') : text('trackPanels.withPrediction');
      else option.disabled = option.value === enrichment;
    }
    if (this.#select.selectedOptions[0]?.disabled) this.#select.value = 'prediction';
  }

  clear(): void {
    this.#table.replaceChildren();
    this.#table.dataset.comparison = '{}';
    this.#task.end('');
  }

  begin(): void {
    this.clear();
    this.#task.begin(text('controls.comparing'));
  }

  /** Shows the progress of the second run, 0 to 1, and its phase, without announcing them to screen readers. */
  showProgress(part: number, phase: string): void {
    this.#task.showProgress(part, text('trackPanels.cancelPhase', { phase }));
  }

  reject(message: string): void {
    this.#task.end(message);
  }

  finish(runs: [TrackingRun, TrackingRun]): void {
    this.#task.end(describeResult(runs));
    this.#table.dataset.comparison = JSON.stringify(runs.map(summary));
    this.#table.replaceChildren(tableOf(runs));
  }
}

/**
 * Returns the numbers in a run's column of the comparison table, also published as JSON in the element's
 * `data-comparison`.
 */
function summary({ name, facts, closing, error, duration }: TrackingRun) {
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
    most: error?.p95,
    took: duration,
  };
}

export type Summary = ReturnType<typeof summary>;

function describeResult(runs: [TrackingRun, TrackingRun]): string {
  const [here, there] = runs.map(summary) as [Summary, Summary];
  const percent = (share: number | undefined) =>
    share === undefined ? '–' : text('controls.percent', { value: (100 * share).toFixed(1) });
  return text('trackPanels.compareTold', {
    first: percent(here.ejection),
    firstName: here.name,
    second: percent(there.ejection),
    secondName: there.name,
    firstSteps: figure(round(here.steps)),
    secondSteps: figure(round(there.steps)),
  });
}

const round = (value: number) => Number(value.toPrecision(3));

function tableOf(runs: [TrackingRun, TrackingRun]): HTMLElement {
  const both = runs.map(summary);
  const size = (value: number | undefined) => (value === undefined ? '–' : figure(round(value)));
  const row = (label: string, text: (one: Summary) => string) =>
    h('tr', {}, h('th', { scope: 'row' }, label), ...both.map((one) => h('td', {}, text(one))));
  const rows = [
    row(text('trackPanels.largestVolume'), ({ diastole }) => size(diastole)),
    row(text('trackPanels.smallestVolume'), ({ systole }) => size(systole)),
    row(text('trackPanels.ejectionFraction'), ({ ejection }) =>
      ejection === undefined ? '–' : text('controls.percent', { value: (100 * ejection).toFixed(1) }),
    ),
    row(text('trackPanels.meanSteps'), ({ steps }) => size(steps)),
    row(text('trackPanels.meanFinalCorrection'), ({ rest }) => size(rest)),
    row(text('trackPanels.foldedShare'), ({ folded }) =>
      text('controls.percent', { value: (100 * folded).toFixed(2) }),
    ),
    row(text('measures.area'), ({ area }) => size(area)),
    ...(both.some(({ closing }) => closing !== undefined)
      ? [row(text('trackPanels.cycleClosureError'), ({ closing }) => size(closing))]
      : []),
    ...(both.some(({ error }) => error !== undefined)
      ? [
          row(text('trackPanels.meanError'), ({ error }) => size(error)),
          row(text('trackPanels.error95'), ({ most }) => size(most)),
        ]
      : []),
    row(text('controls.time'), ({ took }) => (took === undefined ? '–' : milliseconds(took))),
  ];
  const head = [text('controls.measure'), ...runs.map(({ name }) => name)].map((title) =>
    h('th', { scope: 'col' }, title),
  );
  const table = h('table', { class: 'times' }, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows));
  const label = text('trackPanels.compareTable', { frames: count(runs[0].facts.length) });
  return h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, table);
}

/** Converts the result of the comparison's second run to the form that the panel shows, under the name `name`. */
export function comparedRun(name: string, { facts, closing, error, duration }: ComparedTrack): TrackingRun {
  return { name, facts, closing, error, duration };
}
