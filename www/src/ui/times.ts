import { h } from './dom';
import { milliseconds } from './format';
import type { History } from './history';

/** Where the time went, part by part, as the paper's tables show it. */
export class TimeTable {
  readonly element: HTMLElement;
  readonly #body = h('tbody');
  readonly #total = h('td');
  readonly #rows = new Map<string, { time: HTMLElement; share: HTMLMeterElement }>();

  constructor() {
    const head = h(
      'tr',
      {},
      h('th', { scope: 'col' }, 'Part'),
      h('th', { scope: 'col' }, 'Time'),
      h('th', { scope: 'col' }, 'Share'),
    );
    const foot = h('tr', {}, h('th', { scope: 'row' }, 'Together'), this.#total, h('td'));
    this.element = h('table', { class: 'times' }, h('thead', {}, head), this.#body, h('tfoot', {}, foot));
  }

  update({ times }: History): void {
    const sum = [...times.values()].reduce((a, b) => a + b, 0);
    this.#total.textContent = milliseconds(sum);
    if (times.size === 0) this.#clear();
    for (const [part, time] of times) {
      const row = this.#rows.get(part) ?? this.#addRow(part);
      row.time.textContent = milliseconds(time);
      row.share.value = sum > 0 ? time / sum : 0;
      row.share.textContent = `${Math.round(100 * row.share.value)} %`;
    }
  }

  #clear(): void {
    this.#rows.clear();
    this.#body.replaceChildren();
  }

  #addRow(part: string): { time: HTMLElement; share: HTMLMeterElement } {
    const row = { time: h('td'), share: h('meter', { min: 0, max: 1, 'aria-label': `share of ${part}` }) };
    this.#rows.set(part, row);
    this.#body.append(h('tr', {}, h('th', { scope: 'row' }, part), row.time, h('td', {}, row.share)));
    return row;
  }
}
