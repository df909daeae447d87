import { h } from '../../../kit/dom';
import type { History } from '../../../kit/history';
import { text } from '../../../texts';

/**
 * Rows of tables of times, as in tables 1 and 2 of Lachaud and Montanvert: their letter, the name on the page, and the
 * parts of a step that are summed.
 */
export const TIME_ROWS = [
  { letter: 'T', name: text('extractPanels.timeTopology'), parts: ['topology', 'embedding'] },
  { letter: 'N', name: text('extractPanels.timeNormals'), parts: ['normals'] },
  { letter: 'F', name: text('extractPanels.timeDynamics'), parts: ['forces', 'motion'] },
] as const;
const DETAILS = [
  { part: 'topology', name: text('extractPanels.timeTopology') },
  { part: 'embedding', name: text('extractPanels.timeEmbedding') },
  { part: 'forces', name: text('extractPanels.timeForces') },
  { part: 'motion', name: text('extractPanels.timeMotion') },
];
export const TIME_NOTE = text('extractPanels.timeNote');

/** Milliseconds by part of a step ('topology', 'forces' ...), the keys as in step reports. */
export type PartTimes = ReadonlyMap<string, number>;

/** Returns the sum of the times of some parts of a step, or of all, in milliseconds. */
export function timeOf(times: PartTimes, parts?: readonly string[]): number {
  return [...times].reduce((sum, [part, ms]) => sum + (!parts || parts.includes(part) ? ms : 0), 0);
}

export function addTimes(lists: PartTimes[]): PartTimes {
  const sum = new Map<string, number>();
  for (const list of lists) for (const [part, ms] of list) sum.set(part, (sum.get(part) ?? 0) + ms);
  return sum;
}

export function seconds(ms: number): string {
  return (ms / 1000).toFixed(ms < 9950 ? 2 : 1);
}

/**
 * Table of the time that an extraction spent by part of a step and level, in seconds, in the layout of tables 1 and 2
 * of Lachaud and Montanvert.
 */
export class TimeTable {
  readonly element: HTMLElement;
  readonly #table = h('table', { class: 'times' });

  constructor() {
    const label = text('extractPanels.timeTable');
    this.element = h(
      'div',
      {},
      h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, this.#table),
      h('p', { class: 'help' }, TIME_NOTE),
    );
  }

  update({ times }: History): void {
    const columns = [...times, [text('extractPanels.timeTotal'), addTimes([...times.values()])] as const];
    const row = (head: (Node | string)[], value: (parts: PartTimes) => number, className?: string) => {
      const cells = columns.map(([, parts]) => h('td', {}, seconds(value(parts))));
      return h('tr', { class: className }, h('th', { scope: 'row' }, ...head), ...cells);
    };
    const titles = columns.map(([title]) => h('th', { scope: 'col' }, title));
    this.#table.replaceChildren(
      h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, text('extractPanels.timePart')), ...titles)),
      h(
        'tbody',
        {},
        ...TIME_ROWS.map(({ letter, name, parts }) =>
          row([h('i', {}, letter), ` ${name}`], (all) => timeOf(all, parts)),
        ),
        ...DETAILS.map(({ part, name }) => row([name], (all) => timeOf(all, [part]), 'detail')),
      ),
      h(
        'tfoot',
        {},
        row([text('extractPanels.timeTotal')], (all) => timeOf(all)),
      ),
    );
  }
}
