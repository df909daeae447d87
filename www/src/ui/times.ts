import { h } from './dom';
import type { History } from './history';

/** Rows of the paper's tables 1 and 2: the paper's letter, the name here, and the parts of a step that are summed. */
export const TIME_ROWS = [
  { letter: 'T', name: 'topology', parts: ['topology', 'embedding'] },
  { letter: 'N', name: 'normals', parts: ['normals'] },
  { letter: 'F', name: 'dynamics', parts: ['forces', 'motion'] },
] as const;
const DETAILS = ['topology', 'embedding', 'forces', 'motion'];
export const TIME_NOTE =
  'Seconds. T: finding and resolving topology, and looking for triangles that would cross (embedding); N: normals; F: dynamics, that is forces and motion.';

/** Milliseconds by part of a step. */
export type PartTimes = ReadonlyMap<string, number>;

/** Returns the sum of some parts, or of all, in milliseconds. */
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

/** Table of the time spent by part and level, in the layout of the paper's tables 1 and 2. */
export class TimeTable {
  readonly element: HTMLElement;
  readonly #table = h('table', { class: 'times' });

  constructor() {
    const label = 'Time per part and level';
    this.element = h(
      'div',
      {},
      h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, this.#table),
      h('p', { class: 'help' }, TIME_NOTE),
    );
  }

  update({ times }: History): void {
    const columns = [...times, ['total', addTimes([...times.values()])] as const];
    const row = (head: (Node | string)[], value: (parts: PartTimes) => number, className?: string) => {
      const cells = columns.map(([, parts]) => h('td', {}, seconds(value(parts))));
      return h('tr', { class: className }, h('th', { scope: 'row' }, ...head), ...cells);
    };
    const titles = columns.map(([title]) => h('th', { scope: 'col' }, title));
    this.#table.replaceChildren(
      h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, 'Part'), ...titles)),
      h(
        'tbody',
        {},
        ...TIME_ROWS.map(({ letter, name, parts }) =>
          row([h('i', {}, letter), ` ${name}`], (all) => timeOf(all, parts)),
        ),
        ...DETAILS.map((part) => row([part], (all) => timeOf(all, [part]), 'detail')),
      ),
      h(
        'tfoot',
        {},
        row(['together'], (all) => timeOf(all)),
      ),
    );
  }
}
