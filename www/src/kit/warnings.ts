import { keyOf, merged, type Place, placeText, type Warning } from '../engine/warnings';
import { legible, plural, text } from '../texts';
import { h, icon } from './dom';

/** A triangle with an exclamation mark. */
const TRIANGLE = 'M12 2 1 21h22L12 2Zm-1 7h2v6h-2V9Zm0 8h2v2h-2v-2Z';
/** Number of warnings from which on the list may scroll, and can be reached by the keyboard to do so. */
const LONG = 4;
/** Most warnings that are listed; the number of the others is stated. */
const MOST_LISTED = 200;

/** Kinds that are about a result, and not about data. */
const OF_RESULTS: readonly string[] = [
  'begins-in-frame',
  'ends-in-frame',
  'handle-stopped',
  'handles',
  'inward-normals',
  'no-boundary',
  'self-intersecting',
  'outliers',
  'parts',
  'small-object',
  'thin-label',
  'thin-parts',
  'touches-box',
  'uneven-brightness',
  'volume-jump',
];

/** A report of a run, of which only the warnings matter. */
type Report = { warnings?: readonly Warning[] };

/** Actions of a click on the place of a warning, by the kind of place; others are shown as text. */
export interface PlaceActions {
  frame?: (frame: number) => void;
  label?: (label: number) => void;
  point?: (point: [number, number, number]) => void;
}

/**
 * Warnings about the data and the result: a list beside the measures of every lab, hidden
 * while it is empty. A warning is announced to screen readers once, when it appears.
 */
export class WarningList {
  readonly element: HTMLElement;
  readonly #box: HTMLElement;
  readonly #title = h('h3');
  readonly #list = h('ul');
  readonly #news = h('p', { class: 'visually-hidden', role: 'status' });
  #actions: PlaceActions = {};
  #data: readonly Warning[] = [];
  #report: Report | undefined;
  #restored: readonly Warning[] = [];
  #shown: readonly Warning[] = [];

  constructor() {
    this.#box = h('div', { class: 'warnings', hidden: true }, this.#title, this.#list);
    this.element = h('div', { 'data-warning-list': '[]' }, this.#box, this.#news);
  }

  /** All warnings, each once. */
  get all(): readonly Warning[] {
    return this.#shown;
  }

  set actions(actions: PlaceActions) {
    this.#actions = actions;
    this.#fill();
  }

  /** Shows the warnings of the data that are open. */
  showData(...lists: (readonly Warning[] | undefined)[]): void {
    this.#data = lists.flatMap((list) => list ?? []);
    this.#restored = [];
    this.#update();
  }

  /** Shows the warnings of the last report of a run; without one, none. May be called at every step, or more often. */
  showReport(report: Report | undefined): void {
    if (report === this.#report) return;
    this.#report = report;
    this.#restored = this.#restored.filter(({ code }) => !OF_RESULTS.includes(code));
    this.#update();
  }

  /** Shows the warnings of a session: those of results until there is another report, all until other data are open. */
  restore(warnings: readonly Warning[]): void {
    this.#restored = warnings;
    this.#update();
  }

  #update(): void {
    // Reports of older sessions have none.
    const warnings = merged(this.#data, this.#report?.warnings ?? [], this.#restored);
    if (warnings.length + this.#shown.length === 0 || JSON.stringify(warnings) === JSON.stringify(this.#shown)) return;
    const known = new Set(this.#shown.map(keyOf));
    const found = warnings.filter((warning) => !known.has(keyOf(warning)));
    this.#shown = warnings;
    this.#fill();
    this.element.dataset.warningList = JSON.stringify(warnings.map(wordsOf));
    // Only what is new: all of it at every change would be too much to listen to.
    const words = found.map(wordsOf).join(' ');
    this.#news.textContent = found.length > 0 ? plural('warnings.news', found.length, { words }) : '';
  }

  #fill(): void {
    const { length } = this.#shown;
    this.#box.hidden = length === 0;
    this.#title.replaceChildren(icon(TRIANGLE), plural('warnings.title', length));
    const items = this.#shown.slice(0, MOST_LISTED).map((warning) => this.#item(warning));
    const others = length - items.length;
    this.#list.replaceChildren(...items, ...(others > 0 ? [h('li', {}, plural('warnings.more', others))] : []));
    const scrolls = length > LONG ? { tabindex: '0', role: 'region', 'aria-label': text('warnings.list') } : {};
    for (const name of ['tabindex', 'role', 'aria-label']) this.#box.removeAttribute(name);
    for (const [name, value] of Object.entries(scrolls)) this.#box.setAttribute(name, value);
  }

  #item({ code, text: words, where }: Warning): HTMLElement {
    const place = where ? [this.#place(where), ' '] : [];
    return h('li', { 'data-code': code }, ...place, legible(words));
  }

  /** Returns the place in words, as a button if there is a way to go there. */
  #place(where: Place): HTMLElement {
    const words = placeText(where);
    const go = this.#goTo(where);
    if (!go) return h('b', {}, words);
    return h('button', { type: 'button', class: 'place', title: text('warnings.goTo'), onclick: go }, words);
  }

  #goTo(where: Place): (() => void) | undefined {
    const { frame, label, point } = this.#actions;
    if ('frame' in where) return frame && (() => frame(where.frame));
    if ('label' in where) return label && (() => label(where.label));
    return point && (() => point(where.point));
  }
}

function wordsOf({ text: words, where }: Warning): string {
  return where ? `${placeText(where)}: ${words}` : words;
}
