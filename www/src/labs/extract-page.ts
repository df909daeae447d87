import type { Example } from '../examples';
import type { VolumeView } from '../protocol';
import { text } from '../texts';
import { h, section, uniqueId } from '../ui/dom';
import { figure } from '../ui/format';

/** Elements of the Extract lab that {@link layOut} arranges on its page. */
export interface Parts {
  data: HTMLElement;
  figure: HTMLElement;
  histogram: HTMLElement;
  start: HTMLElement;
  params: HTMLElement;
  pyramid: HTMLElement;
  attractors: HTMLElement;
  transport: HTMLElement;
  cancel: HTMLElement;
  options: HTMLElement;
  legend: HTMLElement;
  banner: HTMLElement;
  status: HTMLElement;
  canvas: HTMLElement;
  slices: HTMLElement;
  drop: HTMLElement;
  measures: HTMLElement;
  coverage: HTMLElement;
  exports: HTMLElement;
  sculpt: HTMLElement;
  link: HTMLElement;
  plots: HTMLElement;
  csv: HTMLElement;
  times: HTMLElement;
  log: HTMLElement;
  compare: HTMLDetailsElement;
  exercises: HTMLElement;
}

/**
 * Arranges the elements of the Extract lab in `root`: setup on one side, the view in the middle, results on the other
 * side.
 */
export function layOut(root: HTMLElement, parts: Parts): void {
  root.className = 'lab';
  const view = h('div', { class: 'view' }, parts.canvas, parts.options, parts.legend, parts.banner, parts.drop);
  const params = folded(text('labs.parameters'), parts.params);
  params.open = matchMedia('(min-width: 700px)').matches;
  root.replaceChildren(
    h(
      'div',
      { class: 'stage' },
      view,
      parts.transport,
      h('div', { class: 'saying' }, parts.status, parts.cancel),
      parts.slices,
    ),
    h(
      'div',
      { class: 'column setup' },
      section(text('extract.sectionData'), parts.data, parts.figure),
      section(text('extract.sectionIntensities'), parts.histogram),
      section(text('extract.sectionStart'), parts.start),
      section(text('extract.sectionPyramid'), parts.pyramid),
      section(text('extract.sectionAttractors'), parts.attractors),
      params,
    ),
    h(
      'div',
      { class: 'column results' },
      section(text('labs.sectionSurface'), parts.measures),
      section(text('extract.sectionCoverage'), parts.coverage),
      section(text('labs.sectionSave'), parts.exports, parts.sculpt, parts.link),
      section(text('labs.sectionProgress'), parts.plots, parts.csv),
      section(text('extract.sectionEvents'), parts.log),
      section(text('extract.sectionTimes'), parts.times),
      parts.compare,
      folded(text('extract.sectionExercises'), parts.exercises),
    ),
  );
}

/** Returns a titled section of a lab's page that is collapsed until the user opens it. */
export function folded(title: string, ...children: Node[]): HTMLDetailsElement {
  return h('details', { class: 'panel' }, h('summary', {}, h('h2', {}, title)), ...children);
}

/** Labels of the facts about the open volume; shown before a volume is open, too, so that the layout does not shift. */
const FACTS = [
  text('labs.factFile'),
  text('extract.factVoxels'),
  text('labs.factVoxelSize'),
  text('extract.sectionIntensities'),
];

/** Panel of the Extract lab with the facts about the open volume, and controls to open examples and files. */
export class DataPanel {
  readonly element: HTMLElement;
  readonly #examples: HTMLSelectElement;
  readonly #own = h('option', { value: '', hidden: true }, text('labs.yourFile'));
  readonly #facts = h('dl', { class: 'facts' });
  readonly #credit = h('p', { class: 'help credit' });

  /**
   * `figures`, the examples from the paper, are listed apart from the other examples; `chooser` is the control that
   * opens files, `large` those of volumes larger than memory.
   */
  constructor(
    examples: Example[],
    figures: Example[],
    chooser: HTMLElement,
    large: HTMLElement,
    onExample: (example: Example) => void,
  ) {
    const id = uniqueId('example');
    const group = (label: string, list: Example[]) =>
      h('optgroup', { label }, ...list.map((example) => h('option', { value: example.id }, example.name)));
    const groups = [group(text('extract.groupVolumes'), examples), group(text('labs.groupFigures'), figures)];
    this.#examples = h('select', { id }, this.#own, ...groups);
    this.#examples.addEventListener('change', () => {
      const example = [...examples, ...figures].find((one) => one.id === this.#examples.value);
      if (example) onExample(example);
    });
    this.#showFacts(FACTS.map((name) => [name, '–']));
    this.#credit.textContent = examples[0]?.credit ?? '';
    this.element = h(
      'div',
      { class: 'data' },
      h(
        'div',
        { class: 'row' },
        h('label', { for: id }, text('labs.example')),
        h('span', { class: 'value' }, this.#examples),
      ),
      h('div', { class: 'row' }, chooser),
      h('p', { class: 'help' }, text('extract.dropHelp')),
      large,
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list of examples, or “Your file” if the open volume is no example. */
  choose(example: Example | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  /**
   * Shows the facts about the open volume and the credits of its example, and selects the example in the list;
   * `example` is undefined for the user's file.
   */
  show(volume: VolumeView, example: Example | undefined): void {
    this.choose(example);
    const spacing = volume.spacing.map(figure).join(' × ');
    const facts: [string, string][] = [
      [text('labs.factFile'), volume.name],
      [text('extract.factVoxels'), volume.dims.join(' × ')],
      [text('labs.factVoxelSize'), `${spacing} ${example?.unit ?? 'mm'}`.trim()],
      [
        text('extract.sectionIntensities'),
        text('extract.range', { low: figure(volume.range[0]), high: figure(volume.range[1]) }),
      ],
    ];
    if (volume.large)
      facts.push([text('extract.factLevels'), volume.large.levels.map((dims) => dims.join(' × ')).join(', ')]);
    if (volume.frames > 1)
      facts.push([text('labs.frames'), text('extract.framesFirstShown', { count: volume.frames })]);
    this.#showFacts(facts);
    this.#credit.textContent = example?.credit ?? '';
  }

  #showFacts(facts: [string, string][]): void {
    this.#facts.replaceChildren(...facts.map(([name, value]) => h('div', {}, h('dt', {}, name), h('dd', {}, value))));
  }
}
