import type { SculptExample } from '../sculpt/examples';
import { plural, text } from '../texts';
import { h, section, uniqueId } from '../ui/dom';
import { count, milliseconds } from '../ui/format';
import { folded } from './extract-page';

/** Elements of the Sculpt lab that {@link layOut} arranges on its page. */
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

/**
 * Arranges the elements of the Sculpt lab in `root`: setup on one side, the view in the middle, results on the other
 * side.
 */
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
      section(text('sculpt.sectionScene'), parts.data, parts.figure),
      section(text('sculpt.sectionEllipsoids'), parts.ellipsoids),
      section(text('sculpt.sectionFilm'), parts.film),
      folded(text('labs.parameters'), parts.params),
    ),
    h(
      'div',
      { class: 'column results' },
      section(text('labs.sectionSurface'), parts.measures),
      section(text('labs.sectionSave'), parts.exports, parts.link),
      section(text('labs.sectionPlots'), parts.plots, parts.csv),
      folded(text('labs.sectionExercise'), parts.exercises),
    ),
  );
}

/** Labels of the facts about the open scene; shown before a scene is open, too, so that the layout does not shift. */
const FACTS = [text('labs.factFile'), text('sculpt.factDetail'), text('sculpt.factBands'), text('sculpt.factDuration')];

/**
 * Panel of the Sculpt lab with the facts about the open scene (meshes and ellipsoids), and controls to open examples
 * and files.
 */
export class ScenePanel {
  readonly element: HTMLElement;
  readonly #examples: HTMLSelectElement;
  readonly #own = h('option', { value: '', hidden: true }, text('labs.yourFile'));
  readonly #facts = h('dl', { class: 'facts' });
  readonly #credit = h('p', { class: 'help credit' });

  /**
   * `figures`, the examples from the paper, are listed apart from the other examples; `chooser` is the control that
   * opens files.
   */
  constructor(
    examples: SculptExample[],
    figures: SculptExample[],
    chooser: HTMLElement,
    onExample: (example: SculptExample) => void,
  ) {
    const id = uniqueId('example');
    const group = (label: string, list: SculptExample[]) =>
      h('optgroup', { label }, ...list.map((example) => h('option', { value: example.id }, example.name)));
    const groups = [
      group(text('sculpt.groupScenes'), examples),
      ...(figures.length > 0 ? [group(text('labs.groupFigures'), figures)] : []),
    ];
    this.#examples = h('select', { id }, this.#own, ...groups);
    this.#examples.addEventListener('change', () => {
      const example = [...examples, ...figures].find((one) => one.id === this.#examples.value);
      if (example) onExample(example);
    });
    this.show(undefined, undefined);
    this.element = h(
      'div',
      { class: 'data' },
      h('div', { class: 'row stacked' }, h('label', { for: id }, text('labs.example')), this.#examples),
      h('div', { class: 'row' }, chooser),
      h('p', { class: 'help' }, text('sculpt.dropHelp')),
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list of examples, or “Your file” if the open scene is no example. */
  choose(example: SculptExample | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  show(
    facts: { name: string; detail: number | undefined; bands: number; made: number } | undefined,
    example: SculptExample | undefined,
  ): void {
    this.choose(example);
    const detail = facts?.detail === undefined ? text('labs.none') : plural('counts.triangle', facts.detail);
    const known = facts && [facts.name, detail, count(facts.bands), milliseconds(facts.made)];
    const rows = FACTS.map((name, i) => h('div', {}, h('dt', {}, name), h('dd', {}, known?.[i] ?? '–')));
    this.#facts.replaceChildren(...rows);
    this.#credit.textContent = example?.credit ?? '';
  }
}
