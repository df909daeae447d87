import type { StartShape } from '../protocol';
import { h, symbol, uniqueId } from './dom';

type Kind = StartShape['kind'];

export function isStartKind(text: string | undefined): text is Kind {
  return SHAPES.some(({ kind }) => kind === text);
}

const SHAPES: { kind: Kind; label: string; help: string }[] = [
  {
    kind: 'contour',
    label: 'Contour',
    help: 'The iso-surface of the coarsest level with its hollows: for real data.',
  },
  {
    kind: 'enclosing',
    label: 'Enclosing surface',
    help: 'One surface around all that is brighter than the iso value, shrinking onto it.',
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
const MOST_BUBBLES = 32;

export interface StartChoice {
  kind: Kind;
  bubbles: number;
  levels: number;
  /** Mean edge length in world units; undefined lets the model choose. */
  edge: number | undefined;
}

/**
 * Controls for the initial surface. A change restarts the model; if it is rejected, the previous values are restored.
 */
export class StartControls {
  readonly element: HTMLElement;
  readonly #shape = new Field('Shape', h('select', {}, ...SHAPES.map(optionFor)), '', '');
  readonly #bubbles = new Field(
    'Bubbles along each side',
    integer(2, MOST_BUBBLES, DEFAULT_BUBBLES),
    'More of them find smaller parts.',
    `A whole number from 2 to ${MOST_BUBBLES} is needed.`,
  );
  readonly #levels = new Field(
    ['Pyramid levels ', symbol('m')],
    integer(0, MOST_LEVELS, DEFAULT_LEVELS),
    'Coarser copies of the volume to pass through first; 0 works on the volume itself at once.',
    `A whole number from 0 to ${MOST_LEVELS} is needed.`,
  );
  readonly #edge = new Field(
    'Mean edge',
    h('input', { type: 'number', min: 0, step: 'any', inputmode: 'decimal', placeholder: 'auto' }),
    'Of the triangles at the end, in the units of the volume; left empty, it follows the voxels.',
    'A number above 0 is needed, or nothing.',
  );
  readonly #fields = [this.#shape, this.#bubbles, this.#levels, this.#edge];
  /** The field changed last, which shows the error if the model cannot be created. */
  #changed: Field = this.#shape;
  #inForce: StartChoice;

  constructor(onChange: () => void) {
    for (const field of this.#fields) field.control.addEventListener('change', () => this.#onChange(field, onChange));
    this.element = h('div', { class: 'start' }, ...this.#fields.map((field) => field.element));
    this.#explain();
    this.#inForce = this.value;
  }

  get value(): StartChoice {
    const edge = this.#edge.control;
    return {
      kind: this.#shape.control.value as Kind,
      bubbles: this.#bubbles.control.valueAsNumber,
      levels: this.#levels.control.valueAsNumber,
      edge: edge.value === '' ? undefined : edge.valueAsNumber,
    };
  }

  /** The initial surface of the current model; while another one is being tried, {@link value} is ahead of it. */
  get inForce(): StartChoice {
    return this.#inForce;
  }

  /** Shows the current values and clears error messages, without reporting a change. */
  show(choice: StartChoice): void {
    this.#inForce = choice;
    this.#shape.control.value = choice.kind;
    this.#bubbles.control.valueAsNumber = choice.bubbles;
    this.#levels.control.valueAsNumber = choice.levels;
    this.#edge.control.value = choice.edge === undefined ? '' : String(choice.edge);
    for (const field of this.#fields) field.complain(undefined);
    this.#explain();
  }

  /** Shows an error beside the field changed last, and restores the current values. */
  refuse(message: string): void {
    this.show(this.#inForce);
    this.#changed.complain(message);
  }

  #onChange(field: Field, onChange: () => void): void {
    this.#changed = field;
    for (const each of this.#fields) each.complain(undefined);
    this.#explain();
    if (field.control.checkValidity()) onChange();
    else this.refuse(field.need);
  }

  #explain(): void {
    const kind = this.#shape.control.value;
    this.#bubbles.element.hidden = kind !== 'bubbles';
    this.#shape.help = SHAPES.find((shape) => shape.kind === kind)?.help ?? '';
  }
}

/** A control with its label, help text and error message. */
class Field<Control extends HTMLInputElement | HTMLSelectElement = HTMLInputElement | HTMLSelectElement> {
  readonly element: HTMLElement;
  readonly control: Control;
  /** Error message for an invalid value. */
  readonly need: string;
  readonly #help: HTMLElement;
  readonly #error: HTMLElement;

  constructor(label: string | (string | Node)[], control: Control, help: string, need: string) {
    const id = uniqueId('start');
    this.control = control;
    this.need = need;
    this.#help = h('p', { class: 'help', id: `${id}-help` }, help);
    this.#error = h('p', { class: 'field-error', id: `${id}-error`, role: 'alert' });
    control.id = id;
    control.setAttribute('aria-describedby', `${id}-help ${id}-error`);
    const row = h(
      'div',
      { class: 'row' },
      h('label', { for: id }, ...[label].flat()),
      h('span', { class: 'value' }, control),
    );
    this.element = h('div', {}, row, this.#help, this.#error);
  }

  set help(text: string) {
    this.#help.textContent = text;
  }

  complain(message: string | undefined): void {
    this.#error.textContent = message ?? '';
    this.control.toggleAttribute('aria-invalid', message !== undefined);
  }
}

function optionFor({ kind, label }: (typeof SHAPES)[number]): HTMLOptionElement {
  return h('option', { value: kind }, label);
}

function integer(min: number, max: number, value: number): HTMLInputElement {
  return h('input', { type: 'number', min, max, step: 1, value, required: true });
}
