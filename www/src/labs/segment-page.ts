import type { SegmentExample } from '../segment/examples';
import type { OpenedImage } from '../segment/protocol';
import { text } from '../texts';
import { h, section, uniqueId } from '../ui/dom';
import { figure, milliseconds } from '../ui/format';
import { folded } from './extract-page';

/** Elements of the Segment lab that {@link layOut} arranges on its page. */
export interface Parts {
  data: HTMLElement;
  labels: HTMLElement;
  toolBar: HTMLElement;
  toolSettings: HTMLElement;
  params: HTMLElement;
  cancel: HTMLElement;
  options: HTMLElement;
  banner: HTMLElement;
  status: HTMLElement;
  canvas: HTMLElement;
  slices: HTMLElement;
  drop: HTMLElement;
  measures: HTMLElement;
  maps: HTMLElement;
  exports: HTMLElement;
  link: HTMLElement;
  reset: HTMLElement;
}

/**
 * Arranges the elements of the Segment lab in `root`: labels and tools on one side, the slices and the 3D view in the
 * middle, results on the other side.
 */
export function layOut(root: HTMLElement, parts: Parts): void {
  root.className = 'lab segment';
  const scene = h('div', { class: 'scene' }, parts.canvas);
  const view = h(
    'div',
    { class: 'view beside' },
    parts.options,
    h('div', { class: 'pictures' }, scene),
    parts.banner,
    parts.drop,
  );
  root.replaceChildren(
    h(
      'div',
      { class: 'stage' },
      parts.toolBar,
      h('div', { class: 'four' }, view, parts.slices),
      h('div', { class: 'saying' }, parts.status, parts.cancel),
    ),
    h(
      'div',
      { class: 'column setup' },
      section(text('segment.sectionLabels'), parts.labels),
      section(text('segment.sectionTool'), parts.toolSettings),
      section(text('segment.sectionVolume'), parts.data, parts.reset),
      folded(text('labs.parameters'), parts.params),
    ),
    h(
      'div',
      { class: 'column results' },
      section(text('segment.sectionMeasures'), parts.measures),
      section(text('segment.sectionMap'), parts.maps),
      section(text('segment.sectionSurfaces'), parts.exports, parts.link),
    ),
  );
}

/** Labels of the facts about the open volume; shown before a volume is open, too, so that the layout does not shift. */
const FACTS = [
  text('labs.factFile'),
  text('segment.factMap'),
  text('extract.factVoxels'),
  text('labs.factVoxelSize'),
  text('segment.factSurfaces'),
];

/** Panel of the Segment lab with the facts about the open volume, and controls to open examples and files. */
export class SegmentDataPanel {
  readonly element: HTMLElement;
  readonly #examples: HTMLSelectElement;
  readonly #own = h('option', { value: '', hidden: true }, text('labs.yourFile'));
  readonly #facts = h('dl', { class: 'facts' });
  readonly #credit = h('p', { class: 'help credit' });

  /** `chooser` opens a volume, or a volume and its label map; `mapChooser` a label map of the open volume. */
  constructor(
    examples: readonly SegmentExample[],
    chooser: HTMLElement,
    mapChooser: HTMLElement,
    onExample: (example: SegmentExample) => void,
  ) {
    const id = uniqueId('example');
    const options = examples.map((example) => h('option', { value: example.id }, example.name));
    this.#examples = h('select', { id }, this.#own, ...options);
    this.#examples.addEventListener('change', () => {
      const example = examples.find((one) => one.id === this.#examples.value);
      if (example) onExample(example);
    });
    this.show(undefined, undefined);
    this.element = h(
      'div',
      { class: 'data' },
      h('div', { class: 'row stacked' }, h('label', { for: id }, text('labs.example')), this.#examples),
      h('div', { class: 'row choosers' }, chooser, mapChooser),
      h('p', { class: 'help' }, text('segment.dropHelp')),
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list of examples, or “Your file” if the open volume is no example. */
  choose(example: SegmentExample | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  show(opened: OpenedImage | undefined, example: SegmentExample | undefined): void {
    this.choose(example);
    const unit = example?.unit ?? 'mm';
    const known = opened && [
      opened.volume.name,
      opened.labelFile ?? (example?.labelling ? text('segment.computedMap') : text('segment.emptyMap')),
      opened.volume.dims.join(' × '),
      `${opened.volume.spacing.map((x) => figure(Number(x.toPrecision(3)))).join(' × ')} ${unit}`.trim(),
      milliseconds(opened.milliseconds),
    ];
    const rows = FACTS.map((fact, i) => h('div', {}, h('dt', {}, fact), h('dd', {}, known?.[i] ?? '–')));
    this.#facts.replaceChildren(...rows);
    this.#credit.textContent = example?.credit ?? '';
  }

  /** Shows the name of the file of a label map that was opened later. */
  showMap(name: string): void {
    const cell = this.#facts.querySelectorAll('dd')[1];
    if (cell) cell.textContent = name;
  }
}
