import { warningsOf } from '../track/curve';
import type { FrameStatistics, SurfaceError } from '../track/protocol';
import { h } from './dom';
import { count, figure, plural } from './format';

/** A column of the table of frames. */
interface Column {
  head: string;
  help: string;
  text: (facts: FrameStatistics) => string;
}

const COLUMNS: Column[] = [
  { head: 'volume', help: 'Enclosed', text: ({ volume }) => figure(volume) },
  { head: 'area', help: 'Of the surface', text: ({ area }) => figure(area) },
  { head: 'folded', help: 'Triangles that face away from their three neighbours', text: ({ folded }) => count(folded) },
  {
    head: 'rest',
    help: 'How far the last projection still moved the vertices, in the mean',
    text: ({ meanFinalCorrection }) => figure(round(meanFinalCorrection)),
  },
  { head: 'steps', help: 'Of the projections, in the mean', text: ({ steps }) => figure(round(steps)) },
  { head: 'held', help: 'Moves held back, so that nothing crosses', text: ({ heldMoves }) => count(heldMoves) },
  { head: 'rejected', help: 'Projections that led nowhere or too far', text: ({ rejected }) => count(rejected) },
  {
    head: 'retracted',
    help: 'Vertices without a boundary: drawn together where a crevice closed, grown where one opened',
    text: ({ withoutBoundary }) => count(withoutBoundary),
  },
];

const round = (value: number) => Number(value.toPrecision(3));

/**
 * Table of the Track lab with the statistics of each frame, and warnings about folded triangles and jumps of the area.
 */
export class BeatTable {
  readonly warnings = h('p', { class: 'warning', role: 'status', 'data-warnings': '0' });
  readonly element: HTMLElement;
  readonly #table = h('table', { class: 'times' });
  #facts: readonly FrameStatistics[] = [];
  #rows: HTMLElement[] = [];

  constructor() {
    const label = 'What happened in each frame';
    this.element = h(
      'div',
      {},
      h('div', { class: 'scroll tall', tabindex: 0, role: 'region', 'aria-label': label }, this.#table),
      h(
        'p',
        { class: 'help' },
        'Volume and area in world units. Steps: of the projections. Rest: how far the last of them still moved the vertices. Held, rejected and retracted: moves that were not made, and why.',
      ),
    );
  }

  show(facts: readonly FrameStatistics[], errors: readonly (SurfaceError | undefined)[], frame: number): void {
    const isNew = facts.length !== this.#facts.length || facts.some((one, i) => one !== this.#facts[i]);
    this.#facts = facts;
    if (isNew) this.#fill(facts, errors);
    for (const [i, row] of this.#rows.entries()) {
      if (i === frame) row.setAttribute('aria-current', 'true');
      else row.removeAttribute('aria-current');
    }
  }

  #fill(facts: readonly FrameStatistics[], errors: readonly (SurfaceError | undefined)[]): void {
    this.#warn(facts);
    const known = errors.some((error) => error);
    const heads = ['frame', ...COLUMNS.map(({ head }) => head), ...(known ? ['error'] : [])];
    const head = heads.map((title, i) => h('th', { scope: 'col', title: COLUMNS[i - 1]?.help }, title));
    this.#rows = facts.map((one, i) => {
      const cells = COLUMNS.map(({ text }) => h('td', {}, text(one)));
      const error = errors[i];
      if (known) cells.push(h('td', {}, error ? figure(round(error.mean)) : ''));
      return h('tr', {}, h('th', { scope: 'row' }, String(i + 1)), ...cells);
    });
    this.#table.replaceChildren(h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...this.#rows));
  }

  #warn(facts: readonly FrameStatistics[]): void {
    const found = warningsOf(facts);
    const frames = (kind: 'folded' | 'area') => found.filter((one) => one.kind === kind);
    const [folded, jumped] = [frames('folded'), frames('area')];
    const percent = (shares: number[]) => `${(100 * Math.max(...shares.map(Math.abs))).toFixed(1)} %`;
    const texts = [
      ...(folded.length > 0
        ? [
            `In ${plural(folded.length, 'frame')} more than 1 % of the triangles are folded over, at most ${percent(folded.map(({ share }) => share))}: there the surface is crumpled, however well its volume looks.`,
          ]
        : []),
      ...(jumped.length > 0
        ? [
            `In ${plural(jumped.length, 'frame')} the area is more than 15 % off what it was before and the change of volume explains, at most ${percent(jumped.map(({ share }) => share))}: parts may have been lost or joined.`,
          ]
        : []),
    ];
    this.warnings.dataset.warnings = String(found.length);
    const text = texts.join(' ');
    if (this.warnings.textContent !== text) this.warnings.textContent = text;
  }
}
