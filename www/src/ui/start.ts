import type { StartShape } from '../protocol';
import { text } from '../texts';
import { h, symbol, uniqueId } from './dom';

type Kind = StartShape['kind'];

export function isStartKind(text: string | undefined): text is Kind {
  return SHAPES.some(({ kind }) => kind === text);
}

const SHAPES: { kind: Kind; label: string; help: string }[] = [
  {
    kind: 'contour',
    label: text('extractPanels.startContour'),
    help: text('extractPanels.startContourHelp'),
  },
  {
    kind: 'enclosing',
    label: text('extractPanels.startEnclosing'),
    help: text('extractPanels.startEnclosingHelp'),
  },
  { kind: 'bubbles', label: text('extractPanels.startBubbles'), help: text('extractPanels.startBubblesHelp') },
  { kind: 'sphere', label: text('extractPanels.startSphere'), help: text('extractPanels.startSphereHelp') },
  {
    kind: 'isosurface',
    label: text('extractPanels.startIsosurface'),
    help: text('extractPanels.startIsosurfaceHelp'),
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
  /** Mean edge length of the surface in world units; undefined lets the model choose. */
  edge: number | undefined;
}

/**
 * Controls of the Extract lab for the initial surface. A change restarts the model; if it is rejected, the previous
 * values are restored.
 */
export class StartControls {
  readonly element: HTMLElement;
  readonly #shape = new Field(text('extractPanels.startShape'), h('select', {}, ...SHAPES.map(optionFor)), '', '');
  readonly #bubbles = new Field(
    text('extractPanels.bubblesPerAxis'),
    integer(2, MOST_BUBBLES, DEFAULT_BUBBLES),
    text('extractPanels.bubblesPerAxisHelp'),
    text('extractPanels.bubblesPerAxisError', { most: MOST_BUBBLES }),
  );
  readonly #levels = new Field(
    [text('extractPanels.pyramidLevelCount'), symbol('m')],
    integer(0, MOST_LEVELS, DEFAULT_LEVELS),
    text('extractPanels.pyramidLevelCountHelp'),
    text('extractPanels.pyramidLevelCountError', { most: MOST_LEVELS }),
  );
  readonly #edge = new Field(
    text('extractPanels.meanEdgeLength'),
    h('input', { type: 'number', min: 0, step: 'any', inputmode: 'decimal', placeholder: text('controls.auto') }),
    text('extractPanels.meanEdgeLengthHelp'),
    text('extractPanels.meanEdgeLengthError'),
  );
  readonly #fields = [this.#shape, this.#bubbles, this.#levels, this.#edge];
  /** The field that was changed last, which shows the error if no model can be created. */
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

  /**
   * Choice of the initial surface with which the current model was created. During the attempt to create a model with a
   * new choice, {@link value} is the new one already.
   */
  get inForce(): StartChoice {
    return this.#inForce;
  }

  /**
   * Shows the choice with which the current model was created and clears error messages, without reporting a change.
   */
  show(choice: StartChoice): void {
    this.#inForce = choice;
    this.#shape.control.value = choice.kind;
    this.#bubbles.control.valueAsNumber = choice.bubbles;
    this.#levels.control.valueAsNumber = choice.levels;
    this.#edge.control.value = choice.edge === undefined ? '' : String(choice.edge);
    for (const field of this.#fields) field.showError(undefined);
    this.#explain();
  }

  /**
   * Shows why a change was rejected beside the field changed last, and restores the values of the current model in all
   * fields.
   */
  reject(message: string): void {
    this.show(this.#inForce);
    this.#changed.showError(message);
  }

  #onChange(field: Field, onChange: () => void): void {
    this.#changed = field;
    for (const each of this.#fields) each.showError(undefined);
    this.#explain();
    if (field.control.checkValidity()) onChange();
    else this.reject(field.need);
  }

  #explain(): void {
    const kind = this.#shape.control.value;
    this.#bubbles.element.hidden = kind !== 'bubbles';
    this.#shape.help = SHAPES.find((shape) => shape.kind === kind)?.help ?? '';
  }
}

/** A form control with its label, help text and error message. */
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

  showError(message: string | undefined): void {
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
