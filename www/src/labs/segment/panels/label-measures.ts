import type { Label } from '../../../engine/labels';
import type { Unit } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { count, figure } from '../../../kit/format';
import { sized } from '../../../kit/measures';
import { text } from '../../../texts';
import { KeptRows } from './kept-rows';

/** Measures of a label and its surface; lengths are in world units. */
export interface LabelMeasures {
  value: number;
  voxels: number;
  volume: number;
  area: number;
  vertices: number;
  triangles: number;
  /** Number of surfaces of this label that have been shown so far. */
  version: number;
}

/** Table of the measures of all labels, also available to other programs as JSON in `data-measures`. */
export class LabelMeasureTable {
  readonly element: HTMLElement;
  readonly #body = h('tbody');
  readonly #rows = new KeptRows(this.#body, row);

  constructor() {
    const heads = [
      text('segment.labelHead'),
      text('segment.voxels'),
      text('measures.volume'),
      text('measures.area'),
    ].map((name) => h('th', { scope: 'col' }, name));
    const table = h('table', { class: 'times label-measures' }, h('thead', {}, h('tr', {}, ...heads)), this.#body);
    this.element = h(
      'div',
      { 'data-measures': '{}' },
      h('div', { class: 'scroll tall' }, table),
      h('p', { class: 'help' }, text('segment.measuresHelp')),
    );
  }

  /**
   * `more` is only for other programs: milliseconds from the end of the last stroke until its surfaces were drawn, and
   * how often surfaces were shown.
   */
  show(
    labels: readonly Label[],
    measures: ReadonlyMap<number, LabelMeasures>,
    unit: Unit,
    more: { latency: { first?: number; smooth?: number }; updates: number },
  ): void {
    const shown = (label: Label): [Label, LabelMeasures | undefined, Unit] => [label, measures.get(label.value), unit];
    this.#rows.show(labels.map((label) => ({ key: label.value, shown: shown(label) })));
    const all = labels.map(({ value, name }) => ({ name, ...(measures.get(value) ?? { value, voxels: 0 }) }));
    this.element.dataset.measures = JSON.stringify({ labels: all, ...more });
  }
}

function row({ name, color }: Label, measures: LabelMeasures | undefined, unit: Unit): HTMLElement {
  const dot = h('span', { class: 'dot', 'aria-hidden': 'true' });
  dot.style.background = color;
  const { voxels = 0, volume = 0, area = 0 } = measures ?? {};
  const cells = [count(voxels), volumeText(volume, unit), sized(area, 2, unit)].map((value) => h('td', {}, value));
  return h('tr', {}, h('th', { scope: 'row' }, dot, name), ...cells);
}

/** Formats a volume; from 1 ml on, cubic millimetres are converted to millilitres. */
function volumeText(volume: number, unit: Unit): string {
  return unit === 'mm' && volume >= 1000
    ? text('segment.millilitres', { value: figure(volume / 1000) })
    : sized(volume, 3, unit);
}
