import type { StepReport } from '../engine/protocol';
import { text } from '../texts';
import { h } from './dom';
import { count, figure } from './format';
import type { Curve } from './plots';

/** Largest number of iterations listed in the table: few enough to be read, or listened to. */
const ROWS = 12;

/**
 * The curves of several plots as a table, at a few iterations from the first to the last; the accessible form of the
 * plots.
 */
export class PlotTable {
  readonly element: HTMLDetailsElement;
  readonly #curves: Curve[];
  readonly #cells: HTMLElement[][];
  #reports: readonly StepReport[] = [];

  constructor(curves: Curve[]) {
    this.#curves = curves;
    const row = () => [h('th', { scope: 'row' }), ...curves.map(() => h('td'))];
    this.#cells = Array.from({ length: ROWS }, row);
    const heads = [text('measures.columnIteration'), ...curves.map(({ label }) => label)].map((text) =>
      h('th', { scope: 'col' }, text),
    );
    const body = h('tbody', {}, ...this.#cells.map((cells) => h('tr', {}, ...cells)));
    const table = h('table', { class: 'times', 'data-plot-table': '' }, h('thead', {}, h('tr', {}, ...heads)), body);
    const holder = h(
      'div',
      { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': text('measures.plotTable') },
      table,
    );
    this.element = h('details', {}, h('summary', {}, text('measures.plotTableSummary')), holder);
    this.element.addEventListener('toggle', () => this.#fill());
  }

  update(reports: readonly StepReport[]): void {
    this.#reports = reports;
    if (this.element.open) this.#fill();
  }

  /** Fills the table again with its existing cells, so that screen readers keep their position. */
  #fill(): void {
    const chosen = spread(this.#reports);
    for (const [i, cells] of this.#cells.entries()) {
      const report = chosen[i];
      const texts = report ? [count(report.iteration), ...this.#curves.map(({ of }) => figure(of(report)))] : [];
      for (const [k, cell] of cells.entries()) cell.textContent = texts[k] ?? '';
      cells[0]?.parentElement?.toggleAttribute('hidden', !report);
    }
  }
}

/** Returns at most `ROWS` reports, evenly spaced, including the first and the last. */
function spread(reports: readonly StepReport[]): StepReport[] {
  const { length } = reports;
  if (length <= ROWS) return [...reports];
  return Array.from({ length: ROWS }, (_, i) => reports[Math.round((i * (length - 1)) / (ROWS - 1))]).filter(
    (report) => report !== undefined,
  );
}
