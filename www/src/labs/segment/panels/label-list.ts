import type { Label } from '../../../engine/labels';
import { h, icon, uniqueId } from '../../../kit/dom';
import { text } from '../../../texts';
import { KeptRows } from './kept-rows';

const EYE = 'M12 5C6 5 2.5 12 2.5 12S6 19 12 19s9.5-7 9.5-7S18 5 12 5zm0 11a4 4 0 1 1 0-8 4 4 0 0 1 0 8z';
const CROSS = 'M6.4 5 12 10.6 17.6 5 19 6.4 13.4 12l5.6 5.6-1.4 1.4-5.6-5.6L6.4 19 5 17.6 10.6 12 5 6.4z';

export interface LabelListEvents {
  /** Called when the label that the tools paint is chosen. */
  onActive: (value: number) => void;
  onRename: (value: number, name: string) => void;
  onColor: (value: number, color: string) => void;
  onVisible: (value: number, visible: boolean) => void;
  onAdd: () => void;
  /** Called when a label is to be removed, with its voxels. */
  onRemove: (value: number) => void;
}

/** List of the labels: which one the tools paint, and the colour, name and visibility of each. */
export class LabelList {
  readonly element: HTMLElement;
  readonly #events: LabelListEvents;
  readonly #list = h('ul', { class: 'labels' });
  readonly #rows = new KeptRows(this.#list, (label: Label, isActive: boolean, visible: boolean) =>
    this.#item(label, isActive, visible),
  );
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #group = uniqueId('label');

  constructor(events: LabelListEvents) {
    this.#events = events;
    const add = h(
      'button',
      { type: 'button', class: 'wide', 'data-label': 'add', onclick: events.onAdd },
      text('segment.addLabel'),
    );
    this.element = h('div', {}, this.#list, add, this.#error, h('p', { class: 'help' }, text('segment.labelsHelp')));
  }

  /** Shows all labels; `active` is the one that the tools paint, and the surfaces of `hidden` are not drawn. */
  show(labels: readonly Label[], active: number, hidden: ReadonlySet<number>): void {
    this.#error.textContent = '';
    const focused = this.#focused();
    const shown = (label: Label): [Label, boolean, boolean] => [
      label,
      label.value === active,
      !hidden.has(label.value),
    ];
    this.#rows.show(labels.map((label) => ({ key: label.value, shown: shown(label) })));
    if (focused) this.#list.querySelector<HTMLElement>(focused)?.focus();
  }

  showError(message: string): void {
    this.#error.textContent = message;
  }

  /** Returns a selector of the control of the list that has the focus, to restore it; undefined if none has. */
  #focused(): string | undefined {
    const { activeElement } = document;
    if (!(activeElement instanceof HTMLElement) || !this.#list.contains(activeElement)) return undefined;
    const { control, value } = activeElement.dataset;
    return `[data-control="${control}"][data-value="${value}"]`;
  }

  #item({ value, name, color }: Label, isActive: boolean, visible: boolean): HTMLElement {
    const { onActive, onRename, onColor, onVisible, onRemove } = this.#events;
    const named = (control: string) => ({ 'data-control': control, 'data-value': value });
    const radio = h('input', {
      type: 'radio',
      name: this.#group,
      checked: isActive,
      'aria-label': text('segment.paintLabel', { name }),
      title: text('segment.paintLabel', { name }),
      ...named('active'),
    });
    radio.addEventListener('change', () => onActive(value));
    const swatch = h('input', {
      type: 'color',
      value: color,
      'aria-label': text('segment.colorOf', { name }),
      title: text('segment.colorOf', { name }),
      ...named('color'),
    });
    swatch.addEventListener('change', () => onColor(value, swatch.value));
    const field = h('input', {
      type: 'text',
      value: name,
      maxlength: 60,
      'aria-label': text('segment.nameOf', { value }),
      ...named('name'),
    });
    field.addEventListener('change', () => {
      const given = field.value.trim();
      if (given) onRename(value, given);
      else field.value = name;
    });
    return h(
      'li',
      { 'data-current': isActive },
      radio,
      swatch,
      field,
      iconButton(EYE, text('segment.visibleOf', { name }), named('visible'), () => onVisible(value, !visible), visible),
      iconButton(CROSS, text('segment.removeLabel', { name }), named('remove'), () => onRemove(value)),
    );
  }
}

/** Creates a button with an icon, for which `label` says what it does; with `pressed`, one that is switched on or off. */
function iconButton(
  path: string,
  label: string,
  data: Record<string, unknown>,
  onclick: () => void,
  pressed?: boolean,
): HTMLButtonElement {
  const state = pressed === undefined ? {} : { 'aria-pressed': String(pressed) };
  return h(
    'button',
    { type: 'button', class: 'icon-only', title: label, 'aria-label': label, onclick, ...state, ...data },
    icon(path),
  );
}
