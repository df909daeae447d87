import type { CloudExample } from '../reconstruct/examples';
import { text } from '../texts';
import { h, section, uniqueId } from '../ui/dom';
import { count } from '../ui/format';
import { folded } from './extract-page';

/** Elements of the Reconstruct lab that {@link layOut} arranges on its page. */
export interface Parts {
  data: HTMLElement;
  figure: HTMLElement;
  setup: HTMLElement;
  params: HTMLElement;
  tools: HTMLElement;
  transport: HTMLElement;
  options: HTMLElement;
  legend: HTMLElement;
  banner: HTMLElement;
  status: HTMLElement;
  canvas: HTMLElement;
  photograph: HTMLElement;
  photos: HTMLElement;
  drop: HTMLElement;
  phases: HTMLElement;
  measures: HTMLElement;
  warning: HTMLElement;
  exports: HTMLElement;
  volume: HTMLElement;
  extract: HTMLElement;
  sculpt: HTMLElement;
  link: HTMLElement;
  plots: HTMLElement;
  kernel: HTMLElement;
  csv: HTMLElement;
  timing: HTMLElement;
  exercises: HTMLElement;
}

/**
 * Arranges the elements of the Reconstruct lab in `root`: setup on one side, the view in the middle, results on the
 * other side.
 */
export function layOut(root: HTMLElement, parts: Parts): void {
  root.className = 'lab reconstruct';
  const view = h(
    'div',
    { class: 'view beside' },
    parts.options,
    h('div', { class: 'pictures' }, h('div', { class: 'scene' }, parts.canvas, parts.legend), parts.photograph),
    parts.banner,
    parts.drop,
  );
  const params = folded(text('labs.parameters'), parts.params);
  params.open = matchMedia('(min-width: 700px)').matches;
  root.replaceChildren(
    h('div', { class: 'stage' }, view, parts.transport, parts.status, parts.warning, parts.photos),
    h(
      'div',
      { class: 'column setup' },
      section(text('reconstruct.points'), parts.data, parts.figure, parts.setup),
      params,
      section(text('reconstruct.sectionEdits'), parts.tools),
    ),
    h(
      'div',
      { class: 'column results' },
      section(text('labs.sectionProgress'), parts.phases),
      section(text('labs.sectionSurface'), parts.measures),
      section(text('labs.sectionSave'), parts.exports, parts.volume, parts.extract, parts.sculpt, parts.link),
      section(text('labs.sectionPlots'), parts.plots, parts.kernel, parts.csv),
      folded(text('reconstruct.sectionTiming'), parts.timing),
      folded(text('labs.sectionExercise'), parts.exercises),
    ),
  );
}

/** Labels of the facts about the open points; shown before any are open, too, so that the layout does not shift. */
const FACTS = [
  text('labs.factFile'),
  text('reconstruct.points'),
  text('reconstruct.factColours'),
  text('reconstruct.factCameras'),
];

/** Panel of the Reconstruct lab with the facts about the open points, and controls to open examples and files. */
export class CloudPanel {
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
    examples: CloudExample[],
    figures: CloudExample[],
    chooser: HTMLElement,
    onExample: (example: CloudExample) => void,
  ) {
    const id = uniqueId('example');
    const group = (label: string, list: CloudExample[]) =>
      h('optgroup', { label }, ...list.map((example) => h('option', { value: example.id }, example.name)));
    const groups = [group(text('reconstruct.points'), examples), group(text('labs.groupFigures'), figures)];
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
      h('p', { class: 'help' }, text('reconstruct.dropHelp')),
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list of examples, or “Your file” if the open points are no example. */
  choose(example: CloudExample | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  show(
    facts: { name: string; points: number; colors: boolean; normals: boolean; cameras: number } | undefined,
    example: CloudExample | undefined,
  ): void {
    this.choose(example);
    const known = facts && [
      facts.name,
      count(facts.points),
      facts.colors ? text('labs.yes') : text('labs.no'),
      facts.cameras > 0 ? count(facts.cameras) : text('labs.none'),
    ];
    const rows = FACTS.map((name, i) => h('div', {}, h('dt', {}, name), h('dd', {}, known?.[i] ?? '–')));
    if (facts?.normals)
      rows.push(h('div', {}, h('dt', {}, text('reconstruct.factNormals')), h('dd', {}, text('labs.yes'))));
    this.#facts.replaceChildren(...rows);
    this.#credit.textContent = example?.credit ?? '';
  }
}
