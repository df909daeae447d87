import type { StartShape } from '../protocol';
import { h, uniqueId } from './dom';

type Kind = StartShape['kind'];

const SHAPES: { kind: Kind; label: string; help: string }[] = [
  {
    kind: 'enclosing',
    label: 'Enclosing surface',
    help: 'One surface around the whole volume, shrinking onto the object.',
  },
  { kind: 'bubbles', label: 'Grid of bubbles', help: 'Many small spheres that grow, meet and join.' },
  { kind: 'sphere', label: 'Sphere at the crosshair', help: 'One sphere where the three slices meet.' },
  {
    kind: 'isosurface',
    label: 'Iso-surface',
    help: 'Marching cubes at the iso value, then smoothed and cleaned by the model.',
  },
];
const DEFAULT_LEVELS = 1;
const MOST_LEVELS = 6;
const DEFAULT_BUBBLES = 5;

type Ids = [string, string, string, string];

export interface StartChoice {
  kind: Kind;
  bubbles: number;
  levels: number;
  /** Mean edge in world units; chosen by the model where undefined. */
  edge: number | undefined;
}

/** What the model starts from. A change starts it over. */
export class StartControls {
  readonly element: HTMLElement;
  readonly #shape: HTMLSelectElement;
  readonly #bubbles: HTMLInputElement;
  readonly #levels: HTMLInputElement;
  readonly #edge: HTMLInputElement;
  readonly #bubbleRow: HTMLElement;
  readonly #help: HTMLElement;

  constructor(onChange: () => void) {
    const [shapeId, bubblesId, levelsId, edgeId] = ['shape', 'bubbles', 'levels', 'edge'].map(uniqueId) as Ids;
    const options = SHAPES.map(({ kind, label }) => h('option', { value: kind }, label));
    const changed = () => this.#changed(onChange);
    this.#help = h('p', { class: 'help', id: `${shapeId}-help` });
    this.#shape = h('select', { id: shapeId, 'aria-describedby': `${shapeId}-help`, onchange: changed }, ...options);
    this.#bubbles = integer(bubblesId, 2, 32, DEFAULT_BUBBLES, changed);
    this.#levels = integer(levelsId, 0, MOST_LEVELS, DEFAULT_LEVELS, changed);
    this.#edge = h('input', {
      type: 'number',
      id: edgeId,
      min: 0,
      step: 'any',
      placeholder: 'auto',
      onchange: changed,
    });
    this.#bubbleRow = row(bubblesId, 'Bubbles along each side', this.#bubbles);
    const levelHelp = h(
      'p',
      { class: 'help' },
      'Coarser copies of the volume to pass through first; 0 works on the volume itself at once.',
    );
    this.element = h(
      'div',
      { class: 'start' },
      row(shapeId, 'Shape', this.#shape),
      this.#help,
      this.#bubbleRow,
      row(levelsId, 'Pyramid levels', this.#levels),
      levelHelp,
      row(edgeId, 'Mean edge', this.#edge),
      h(
        'p',
        { class: 'help' },
        'Of the triangles at the end, in the units of the volume; left empty, it follows the voxels.',
      ),
    );
    this.#explain();
  }

  get value(): StartChoice {
    return {
      kind: this.#shape.value as Kind,
      bubbles: this.#bubbles.valueAsNumber,
      levels: this.#levels.valueAsNumber,
      edge: this.#edge.value === '' ? undefined : this.#edge.valueAsNumber,
    };
  }

  /** Sets what suits an example; no change is reported. */
  show({ kind, levels, edge }: Omit<StartChoice, 'bubbles'>): void {
    this.#shape.value = kind;
    this.#levels.valueAsNumber = levels;
    this.#edge.value = edge === undefined ? '' : String(edge);
    this.#explain();
  }

  #changed(onChange: () => void): void {
    this.#explain();
    if ([this.#bubbles, this.#levels, this.#edge].every((input) => input.checkValidity())) onChange();
    else this.element.querySelector<HTMLInputElement>('input:invalid')?.reportValidity();
  }

  #explain(): void {
    const kind = this.#shape.value;
    this.#bubbleRow.hidden = kind !== 'bubbles';
    this.#help.textContent = SHAPES.find((shape) => shape.kind === kind)?.help ?? '';
  }
}

function integer(id: string, min: number, max: number, value: number, onchange: () => void): HTMLInputElement {
  return h('input', { type: 'number', id, min, max, step: 1, value, required: true, onchange });
}

function row(id: string, label: string, control: HTMLElement): HTMLElement {
  return h('div', { class: 'row' }, h('label', { for: id }, label), h('span', { class: 'value' }, control));
}
