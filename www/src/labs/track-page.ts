import { text } from '../texts';
import type { TrackExample } from '../track/examples';
import type { OpenedImage } from '../track/protocol';
import { h, section, uniqueId } from '../ui/dom';
import { figure, milliseconds } from '../ui/format';
import { folded } from './extract-page';

/** Elements of the Track lab that {@link layOut} arranges on its page. */
export interface Parts {
  data: HTMLElement;
  figure: HTMLElement;
  preparation: HTMLElement;
  region: HTMLElement;
  threshold: HTMLElement;
  params: HTMLElement;
  transport: HTMLElement;
  frames: HTMLElement;
  cancel: HTMLElement;
  options: HTMLElement;
  banner: HTMLElement;
  status: HTMLElement;
  canvas: HTMLElement;
  slices: HTMLElement;
  stills: HTMLElement;
  drop: HTMLElement;
  measures: HTMLElement;
  warnings: HTMLElement;
  curve: HTMLElement;
  table: HTMLElement;
  compare: HTMLElement;
  exports: HTMLElement;
  saves: HTMLElement;
  link: HTMLElement;
  exercises: HTMLElement;
}

/**
 * Arranges the elements of the Track lab in `root`: setup on one side, view and slices in the middle, results on the
 * other side.
 */
export function layOut(root: HTMLElement, parts: Parts): void {
  root.className = 'lab track';
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
      view,
      parts.frames,
      parts.transport,
      h('div', { class: 'saying' }, parts.status, parts.cancel),
      parts.slices,
      parts.stills,
    ),
    h(
      'div',
      { class: 'column setup' },
      section(text('track.sectionImage'), parts.data, parts.figure),
      section(text('track.sectionBoundary'), parts.threshold),
      section(text('track.sectionRegion'), parts.region),
      folded(text('track.sectionPreparation'), parts.preparation),
      folded(text('labs.parameters'), parts.params),
    ),
    h(
      'div',
      { class: 'column results' },
      section(text('track.sectionCurve'), parts.curve, parts.warnings),
      section(text('track.sectionSurface'), parts.measures),
      section(text('labs.sectionSave'), parts.exports, parts.saves, parts.link),
      folded(text('labs.frames'), parts.table),
      folded(text('track.sectionCompare'), parts.compare),
      folded(text('labs.sectionExercise'), parts.exercises),
    ),
  );
}

/** Labels of the facts about the open image; shown before an image is open, too, so that the layout does not shift. */
const FACTS = [
  text('labs.factFile'),
  text('labs.frames'),
  text('extract.factVoxels'),
  text('labs.factVoxelSize'),
  text('track.factPrepared'),
  text('track.factOpening'),
];

/** Panel of the Track lab with the facts about the open image, and controls to open examples and files. */
export class ImagePanel {
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
    examples: TrackExample[],
    figures: TrackExample[],
    chooser: HTMLElement,
    onExample: (example: TrackExample) => void,
  ) {
    const id = uniqueId('example');
    const group = (label: string, list: TrackExample[]) =>
      h('optgroup', { label }, ...list.map((example) => h('option', { value: example.id }, example.name)));
    this.#examples = h(
      'select',
      { id },
      this.#own,
      group(text('track.groupImages'), examples),
      ...(figures.length > 0 ? [group(text('labs.groupFigures'), figures)] : []),
    );
    this.#examples.addEventListener('change', () => {
      const example = [...examples, ...figures].find((one) => one.id === this.#examples.value);
      if (example) onExample(example);
    });
    this.show(undefined, undefined, '');
    this.element = h(
      'div',
      { class: 'data' },
      h('div', { class: 'row stacked' }, h('label', { for: id }, text('labs.example')), this.#examples),
      h('div', { class: 'row' }, chooser),
      h('p', { class: 'help' }, text('track.dropHelp')),
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list of examples, or “Your file” if the open image is no example. */
  choose(example: TrackExample | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  show(
    opened: Pick<OpenedImage, 'dims' | 'spacing' | 'volume' | 'openingMs'> | undefined,
    example: TrackExample | undefined,
    name: string,
  ): void {
    this.choose(example);
    const sizes = (values: readonly number[]) => values.map((x) => figure(Number(x.toPrecision(3)))).join(' × ');
    const unit = example?.unit ?? 'mm';
    const known = opened && [
      name,
      String(opened.volume.frames),
      sizes(opened.dims),
      `${sizes(opened.spacing)} ${unit}`.trim(),
      `${sizes(opened.volume.dims)}`,
      milliseconds(opened.openingMs),
    ];
    const rows = FACTS.map((fact, i) => h('div', {}, h('dt', {}, fact), h('dd', {}, known?.[i] ?? '–')));
    this.#facts.replaceChildren(...rows);
    this.#credit.textContent = example?.credit ?? '';
  }
}
