import { h } from '../../../kit/dom';
import { count, figure } from '../../../kit/format';
import { plural, text } from '../../../texts';
import { warningsOf } from '../curve';
import type { FrameStatistics, SurfaceError } from '../protocol';

interface Column {
  head: string;
  help: string;
  text: (facts: FrameStatistics) => string;
}

const COLUMNS: Column[] = [
  {
    head: text('trackPanels.columnVolume'),
    help: text('trackPanels.columnVolumeHelp'),
    text: ({ volume }) => figure(volume),
  },
  { head: text('trackPanels.columnArea'), help: text('trackPanels.columnAreaHelp'), text: ({ area }) => figure(area) },
  {
    head: text('trackPanels.columnFolded'),
    help: text('trackPanels.columnFoldedHelp'),
    text: ({ folded }) => count(folded),
  },
  {
    head: text('trackPanels.columnCorrection'),
    help: text('trackPanels.columnCorrectionHelp'),
    text: ({ meanFinalCorrection }) => figure(round(meanFinalCorrection)),
  },
  {
    head: text('trackPanels.columnSteps'),
    help: text('trackPanels.columnStepsHelp'),
    text: ({ steps }) => figure(round(steps)),
  },
  {
    head: text('trackPanels.columnHeld'),
    help: text('trackPanels.columnHeldHelp'),
    text: ({ heldMoves }) => count(heldMoves),
  },
  {
    head: text('trackPanels.columnRejected'),
    help: text('trackPanels.columnRejectedHelp'),
    text: ({ rejected }) => count(rejected),
  },
  {
    head: text('trackPanels.columnRetracted'),
    help: text('trackPanels.columnRetractedHelp'),
    text: ({ withoutBoundary }) => count(withoutBoundary),
  },
];

const round = (value: number) => Number(value.toPrecision(3));

/**
 * Table of the Track lab with the statistics of each frame, and warnings about folded triangles and jumps of the area.
 */
export class FrameTable {
  readonly warnings = h('p', { class: 'warning', role: 'status', 'data-warnings': '0' });
  readonly element: HTMLElement;
  readonly #table = h('table', { class: 'times' });
  #facts: readonly FrameStatistics[] = [];
  #rows: HTMLElement[] = [];

  constructor() {
    const label = text('trackPanels.framesTable');
    this.element = h(
      'div',
      {},
      h('div', { class: 'scroll tall', tabindex: 0, role: 'region', 'aria-label': label }, this.#table),
      h('p', { class: 'help' }, text('trackPanels.framesTableHelp')),
    );
  }

  /** Shows the statistics and errors of frames, and marks the current `frame`. */
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
    const heads = [
      text('trackPanels.columnFrame'),
      ...COLUMNS.map(({ head }) => head),
      ...(known ? [text('trackPanels.columnError')] : []),
    ];
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
    const percent = (shares: number[]) =>
      text('controls.percent', { value: (100 * Math.max(...shares.map(Math.abs))).toFixed(1) });
    const texts = [
      ...(folded.length > 0
        ? [plural('trackPanels.foldedWarning', folded.length, { most: percent(folded.map(({ share }) => share)) })]
        : []),
      ...(jumped.length > 0
        ? [plural('trackPanels.areaWarning', jumped.length, { most: percent(jumped.map(({ share }) => share)) })]
        : []),
    ];
    this.warnings.dataset.warnings = String(found.length);
    const warnings = texts.join(' ');
    if (this.warnings.textContent !== warnings) this.warnings.textContent = warnings;
  }
}
