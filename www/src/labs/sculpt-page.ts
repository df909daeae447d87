import type { SculptExample } from '../sculpt/examples';
import { h, section, uniqueId } from '../ui/dom';
import { count, milliseconds } from '../ui/format';
import { folded } from './extract-page';

/** Elements that the lab's page is laid out from. */
export interface Parts {
  data: HTMLElement;
  figure: HTMLElement;
  ellipsoids: HTMLElement;
  film: HTMLElement;
  params: HTMLElement;
  transport: HTMLElement;
  cancel: HTMLElement;
  options: HTMLElement;
  legend: HTMLElement;
  coarse: HTMLElement;
  captions: HTMLElement;
  banner: HTMLElement;
  status: HTMLElement;
  canvas: HTMLElement;
  drop: HTMLElement;
  measures: HTMLElement;
  exports: HTMLElement;
  link: HTMLElement;
  plots: HTMLElement;
  csv: HTMLElement;
  exercises: HTMLElement;
}

/** Lays the lab out: setup on one side, the view in the middle, results on the other side. */
export function layOut(root: HTMLElement, parts: Parts): void {
  root.className = 'lab sculpt';
  const scene = h('div', { class: 'scene' }, parts.canvas, parts.legend, parts.coarse, parts.captions);
  const view = h(
    'div',
    { class: 'view beside' },
    parts.options,
    h('div', { class: 'pictures' }, scene),
    parts.banner,
    parts.drop,
  );
  root.replaceChildren(
    h('div', { class: 'stage' }, view, parts.transport, h('div', { class: 'saying' }, parts.status, parts.cancel)),
    h(
      'div',
      { class: 'column setup' },
      section('Scene', parts.data, parts.figure),
      section('Ellipsoids', parts.ellipsoids),
      section('Film', parts.film),
      folded('Parameters', parts.params),
    ),
    h(
      'div',
      { class: 'column results' },
      section('Surface', parts.measures),
      section('Save', parts.exports, parts.link),
      section('Plots', parts.plots, parts.csv),
      folded('Exercise', parts.exercises),
    ),
  );
}

/** Names of the facts about a scene; they are shown before one is open, so that the layout does not shift. */
const FACTS = ['File', 'Detail', 'Bands', 'Made in'];

/** Panel that shows the open scene and opens others. */
export class ScenePanel {
  readonly element: HTMLElement;
  readonly #examples: HTMLSelectElement;
  readonly #own = h('option', { value: '', hidden: true }, 'Your file');
  readonly #facts = h('dl', { class: 'facts' });
  readonly #credit = h('p', { class: 'help credit' });

  /** `figures` are listed apart from the other examples. */
  constructor(
    examples: SculptExample[],
    figures: SculptExample[],
    chooser: HTMLElement,
    onExample: (example: SculptExample) => void,
  ) {
    const id = uniqueId('example');
    const group = (label: string, list: SculptExample[]) =>
      h('optgroup', { label }, ...list.map((example) => h('option', { value: example.id }, example.name)));
    const groups = [group('Scenes', examples), ...(figures.length > 0 ? [group('Figures of the paper', figures)] : [])];
    this.#examples = h('select', { id }, this.#own, ...groups);
    this.#examples.addEventListener('change', () => {
      const example = [...examples, ...figures].find((one) => one.id === this.#examples.value);
      if (example) onExample(example);
    });
    this.show(undefined, undefined);
    this.element = h(
      'div',
      { class: 'data' },
      h('div', { class: 'row stacked' }, h('label', { for: id }, 'Example'), this.#examples),
      h('div', { class: 'row' }, chooser),
      h(
        'p',
        { class: 'help' },
        'Or drop a closed mesh anywhere on the page: GLB, OBJ, PLY or STL; two at once are a detailed one and its base. It stays on this machine.',
      ),
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list, or “Your file” if it is none. */
  choose(example: SculptExample | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  show(
    facts: { name: string; detail: number | undefined; bands: number; made: number } | undefined,
    example: SculptExample | undefined,
  ): void {
    this.choose(example);
    const detail = facts?.detail === undefined ? 'none' : `${count(facts.detail)} triangles`;
    const known = facts && [facts.name, detail, count(facts.bands), milliseconds(facts.made)];
    const rows = FACTS.map((name, i) => h('div', {}, h('dt', {}, name), h('dd', {}, known?.[i] ?? '–')));
    this.#facts.replaceChildren(...rows);
    this.#credit.textContent = example?.credit ?? '';
  }
}
