import type { UncoveredRegion, Vec3 } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { count, lengths, place } from '../../../kit/format';
import { TaskControls } from '../../../kit/task';
import { plural, text } from '../../../texts';
import type { CoverageProgressEvent, MeasuredCoverage } from '../protocol';

/**
 * Largest number of uncovered regions listed in the panel and marked in the views; the sentence above the list counts
 * all.
 */
const MOST_PARTS = 20;

const KINDS: Record<UncoveredRegion['kind'], string> = {
  matter: text('extractPanels.missingObject'),
  cavity: text('extractPanels.missingCavity'),
};

export interface CoverageEvents {
  onStart: () => void;
  onCancel: () => void;
  onSeed: () => void;
  /** Called to show a position, in world coordinates, in the slices and to centre the 3D view on it. */
  onGoTo: (point: Vec3) => void;
  /** Called with the uncovered regions to mark in the views. */
  onMark: (parts: readonly UncoveredRegion[]) => void;
}

/**
 * Panel that shows which share of the volume's iso-surface the extracted surface covers, and lists the regions it does
 * not cover.
 */
export class CoveragePanel {
  readonly element: HTMLElement;
  /** Unit of length in the volume's world space, for areas; empty if unknown. */
  unit = '';
  /** Size of the volume, to which positions are rounded. */
  size = 0;
  readonly #events: CoverageEvents;
  readonly #task: TaskControls;
  readonly #figures = h('dl', { class: 'facts', 'data-coverage': '{}' });
  readonly #list = h('ol', { class: 'uncovered', 'aria-label': text('extractPanels.uncoveredList') });

  /** `guide` is the address of the documentation that explains coverage. */
  constructor(guide: string, events: CoverageEvents) {
    this.#events = events;
    const seed = h(
      'button',
      { type: 'button', onclick: events.onSeed, 'data-coverage-action': 'seed' },
      text('extractPanels.seedMissing'),
    );
    this.#task = new TaskControls({
      ...{ name: 'coverage-action', start: text('extractPanels.measureCoverage'), others: [seed] },
      progress: text('controls.measurementProgress'),
      onStart: events.onStart,
      onCancel: events.onCancel,
    });
    const why = h('a', { href: guide, target: '_blank', rel: 'noopener' }, text('extractPanels.coverageGuide'));
    this.element = h(
      'div',
      { class: 'coverage' },
      h('p', { class: 'help' }, text('extractPanels.coverageHelp'), why),
      ...this.#task.elements,
      this.#figures,
      this.#list,
    );
  }

  /** Whether there is a surface whose coverage can be measured. */
  set enabled(enabled: boolean) {
    this.#task.enabled = enabled;
  }

  /** Removes the results of the last coverage measurement. */
  clear(): void {
    this.#show(undefined);
    this.#task.end('');
  }

  begin(): void {
    this.clear();
    this.#task.begin(text('controls.measuring'));
  }

  showProgress({ share }: CoverageProgressEvent): void {
    this.#task.showProgress(share);
  }

  /** Shows a message beside the buttons and ends a measurement; results shown before are kept. */
  say(message: string): void {
    this.#task.end(message);
  }

  finish(coverage: MeasuredCoverage | undefined): void {
    if (!coverage) {
      this.#task.end(text('controls.cancelled'));
      return;
    }
    this.#show(coverage);
    const { iteration, uncovered } = coverage;
    const values = { iteration: count(iteration), listed: MOST_PARTS };
    if (uncovered.length === 0) this.#task.end(text('extractPanels.uncoveredNone', values));
    else if (uncovered.length <= MOST_PARTS)
      this.#task.end(plural('extractPanels.uncoveredAll', uncovered.length, values));
    else this.#task.end(plural('extractPanels.uncoveredMost', uncovered.length, values));
  }

  #show(coverage: MeasuredCoverage | undefined): void {
    this.#figures.dataset.coverage = JSON.stringify(coverage ?? {});
    const rows: [string, string, string][] = coverage
      ? [
          [text('extractPanels.recall'), percent(coverage.recall), text('extractPanels.recallHelp')],
          [text('extractPanels.precision'), percent(coverage.precision), text('extractPanels.precisionHelp')],
        ]
      : [];
    this.#figures.replaceChildren(
      ...rows.map(([name, value, meaning]) => h('div', { title: meaning }, h('dt', {}, name), h('dd', {}, value))),
    );
    const parts = coverage?.uncovered.slice(0, MOST_PARTS) ?? [];
    this.#list.replaceChildren(...parts.map((part) => this.#item(part)));
    this.#list.hidden = parts.length === 0;
    this.#events.onMark(parts);
  }

  #item({ kind, area, position }: UncoveredRegion): HTMLElement {
    const where = place(position, this.size);
    const size = lengths([Number(area.toPrecision(3))], this.unit, 2);
    const label = text('extractPanels.uncoveredShow', { kind: KINDS[kind], size, where });
    const goTo = h(
      'button',
      { type: 'button', class: 'quiet', 'aria-label': label, onclick: () => this.#events.onGoTo(position) },
      h('span', { class: `kind ${kind}`, 'aria-hidden': 'true' }),
      h('span', {}, KINDS[kind]),
      h('span', { class: 'area' }, size),
      h('span', { class: 'where' }, where),
    );
    return h('li', {}, goTo);
  }
}

/** Formats a coverage, 0 to 1, in percent, rounded down to a tenth, so that 100 % means complete coverage. */
function percent(share: number): string {
  return text('controls.percent', { value: (Math.floor(share * 1000) / 10).toFixed(1) });
}
