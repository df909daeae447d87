import { h, symbol, uniqueId } from './dom';

export type FormControl = HTMLInputElement | HTMLSelectElement;

/** An entry of a selection list. */
export interface Choice<Value extends string = string> {
  value: Value;
  label: string;
}

interface FieldParts {
  label: string;
  /** The paper's symbol of the quantity. */
  symbol?: string | undefined;
  unit?: string | undefined;
  /** A sentence below the control; an empty one may be set later. */
  help?: string;
  /** Elements below the control, such as a slider. */
  extra?: Node[];
  /** Class of the row with label and control; by default the field is a parameter, separated from others by lines. */
  row?: string;
  /** Attributes of the field's element. */
  attributes?: Record<string, unknown>;
}

/** A form control with its label, symbol, unit, help and error message. */
export class Field<Control extends FormControl = HTMLInputElement> {
  readonly element: HTMLElement;
  readonly control: Control;
  readonly #help: HTMLElement;
  readonly #error: HTMLElement;

  constructor(control: Control, { label, symbol: letter, unit, help, extra = [], row, attributes = {} }: FieldParts) {
    this.control = control;
    const labelled = labelFor(control, label, ...(letter ? [' ', symbol(letter)] : []));
    const value = h('span', { class: 'value' }, control, ...(unit ? [h('span', { class: 'unit' }, unit)] : []));
    this.#help = h('p', { class: 'help', id: `${control.id}-help` }, help ?? '');
    this.#error = h('p', { class: 'field-error', id: `${control.id}-error`, role: 'alert' });
    const described = help === undefined ? [this.#error] : [this.#help, this.#error];
    const below = [...extra, ...described];
    control.setAttribute('aria-describedby', described.map(({ id }) => id).join(' '));
    this.element =
      row === undefined
        ? h('div', { class: 'param', ...attributes }, labelled, value, ...below)
        : h('div', attributes, h('div', { class: row }, labelled, value), ...below);
  }

  set help(text: string) {
    this.#help.textContent = text;
  }

  /** Shows why a value was rejected; undefined removes the message. */
  showError(message: string | undefined): void {
    this.#error.textContent = message ?? '';
    if (message === undefined) this.control.removeAttribute('aria-invalid');
    else this.control.setAttribute('aria-invalid', 'true');
  }
}

/** The value that a field is to show, and that which was last put there. */
interface Shown {
  value: string;
  there: string;
}

const shown = new WeakMap<HTMLInputElement, Shown>();

/**
 * Shows a value in a field of the page, unless the user is typing there, for instance while an earlier change takes effect:
 * then it is shown when the field is left without a change.
 */
export function showIn(field: HTMLInputElement, value: string): void {
  const before = shown.get(field) ?? watched(field);
  before.value = value;
  const isTyping = field === document.activeElement && field.value !== before.there;
  if (!isTyping) field.value = before.there = value;
}

function watched(field: HTMLInputElement): Shown {
  const one = { value: field.value, there: field.value };
  shown.set(field, one);
  // A value that has been entered is no longer being typed.
  const entered = () => {
    one.there = field.value;
  };
  field.addEventListener('change', entered, { capture: true });
  field.addEventListener('blur', () => {
    if (field.value !== one.there) field.value = one.there = one.value;
  });
  return one;
}

/** Creates the label of a control, which is given an id if it has none. */
export function labelFor(control: HTMLElement, ...content: (Node | string)[]): HTMLLabelElement {
  control.id ||= uniqueId('control');
  return h('label', { for: control.id }, ...content);
}

/** Creates a control with its label before it, for a row of options. */
export function placed(label: string, control: HTMLElement): HTMLElement {
  return h('span', { class: 'placement' }, labelFor(control, label), control);
}

/** Creates a selection list. */
export function selectFrom(choices: readonly Choice[], attributes: Record<string, unknown> = {}): HTMLSelectElement {
  return h('select', attributes, ...choices.map(({ value, label }) => h('option', { value }, label)));
}
