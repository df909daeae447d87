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
const DEFAULT_LEVELS = 3;
const MOST_LEVELS = 6;
const DEFAULT_BUBBLES = 6;

export interface StartChoice {
  kind: Kind;
  bubbles: number;
  levels: number;
}

/** What the model starts from. A change starts it over. */
export class StartControls {
  readonly element: HTMLElement;
  readonly #shape: HTMLSelectElement;
  readonly #bubbles: HTMLInputElement;
  readonly #levels: HTMLInputElement;
  readonly #bubbleRow: HTMLElement;
  readonly #help: HTMLElement;

  constructor(onChange: () => void) {
    const [shapeId, bubblesId, levelsId] = [uniqueId('shape'), uniqueId('bubbles'), uniqueId('levels')];
    const options = SHAPES.map(({ kind, label }) => h('option', { value: kind }, label));
    const changed = () => this.#changed(onChange);
    this.#help = h('p', { class: 'help', id: `${shapeId}-help` });
    this.#shape = h('select', { id: shapeId, 'aria-describedby': `${shapeId}-help`, onchange: changed }, ...options);
    this.#bubbles = integer(bubblesId, 2, 32, DEFAULT_BUBBLES, changed);
    this.#levels = integer(levelsId, 0, MOST_LEVELS, DEFAULT_LEVELS, changed);
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
    );
    this.#explain();
  }

  get value(): StartChoice {
    return {
      kind: this.#shape.value as Kind,
      bubbles: this.#bubbles.valueAsNumber,
      levels: this.#levels.valueAsNumber,
    };
  }

  /** Sets what suits an example; no change is reported. */
  show({ kind, levels }: Pick<StartChoice, 'kind' | 'levels'>): void {
    this.#shape.value = kind;
    this.#levels.valueAsNumber = levels;
    this.#explain();
  }

  #changed(onChange: () => void): void {
    this.#explain();
    if (this.#bubbles.checkValidity() && this.#levels.checkValidity()) onChange();
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
