import { h } from '../../../kit/dom';
import { count } from '../../../kit/format';
import { type Change, type History, totals } from '../../../kit/history';
import { plural, text } from '../../../texts';

/** Largest number of entries of the event log; the totals above the list count all topology changes. */
const MOST_ENTRIES = 300;

/** Log of the events of a run, newest first: level changes, joins, cuts, components that vanished or were seeded. */
export class EventLog {
  readonly element: HTMLElement;
  readonly #summary = h('p', { class: 'help' });
  readonly #list = h('ol', { class: 'log', tabindex: 0, 'aria-label': text('measures.eventsList') });
  #phases = 0;
  #changes = 0;

  constructor() {
    this.element = h('div', {}, this.#summary, this.#list);
    this.clear();
  }

  clear(): void {
    this.#phases = 0;
    this.#changes = 0;
    this.#list.replaceChildren();
    this.#summary.textContent = text('measures.noEvents');
  }

  /** Adds entries for the events that the history has gained since the last call, at the top. */
  update(history: History): void {
    const fresh = [
      ...history.phases
        .slice(this.#phases)
        .map(({ iteration, phase }) => entry(iteration, 'level', text('measures.phaseBegins', { phase }))),
      ...history.changes
        .slice(this.#changes)
        .map((change) => entry(change.iteration, kindOf(change), describe(change))),
    ];
    if (fresh.length === 0) return;
    this.#phases = history.phases.length;
    this.#changes = history.changes.length;
    fresh.sort((a, b) => b.iteration - a.iteration);
    this.#list.prepend(...fresh.slice(0, MOST_ENTRIES).map(({ element }) => element));
    while (this.#list.children.length > MOST_ENTRIES) this.#list.lastElementChild?.remove();
    this.#summary.textContent = totals(history.changes);
  }
}

function entry(iteration: number, kind: string, text: string): { iteration: number; element: HTMLElement } {
  const mark = h('span', { class: `mark ${kind}`, 'aria-hidden': 'true' });
  return { iteration, element: h('li', {}, h('span', { class: 'when' }, count(iteration)), mark, text) };
}

function kindOf(change: Change): string {
  return (['axial', 'annular', 'seeds', 'vanished'] as const).find((kind) => change[kind] > 0) ?? 'vanished';
}

export function describe({ axial, annular, vanished, seeds }: Change): string {
  const parts: string[] = [];
  if (axial > 0) parts.push(plural('measures.joins', axial));
  if (annular > 0) parts.push(plural('measures.cuts', annular));
  if (vanished > 0) parts.push(plural('measures.vanished', vanished));
  if (seeds > 0) parts.push(plural('measures.seeded', seeds));
  return parts.join(', ');
}
