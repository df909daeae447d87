import { shortenedPoint } from '../../../engine/placing';
import { h, uniqueId } from '../../../kit/dom';
import { showIn } from '../../../kit/field';
import { text } from '../../../texts';
import { boxOf, lengthsOf, turned, withLengths } from '../ellipsoids';
import type { HandleMode } from '../handles';
import type { ControlEllipsoid, Vec3 } from '../protocol';

const MODES: { mode: HandleMode; label: string; key: string; help: string }[] = [
  {
    mode: 'move',
    label: text('sculptPanels.modeMove'),
    key: 'm',
    help: text('sculptPanels.modeMoveHelp'),
  },
  {
    mode: 'turn',
    label: text('sculptPanels.modeRotate'),
    key: 't',
    help: text('sculptPanels.modeRotateHelp'),
  },
  {
    mode: 'size',
    label: text('sculptPanels.modeScale'),
    key: 'e',
    help: text('sculptPanels.modeScaleHelp'),
  },
];
/** Significant digits of coordinates and lengths; dragging is no more precise. */
const DIGITS = 4;
/** Number of characters for which there is room in each of three fields side by side. */
const WIDTH = 8;
const AXES = ['x', 'y', 'z'] as const;
const DIRECTIONS: Vec3[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

export interface EllipsoidEvents {
  onChoose: (index: number | undefined) => void;
  onMode: (mode: HandleMode) => void;
  /** Called with the selected ellipsoid after a change; `what` names the change, for undo. */
  onChange: (ellipsoid: ControlEllipsoid, what: string) => void;
  onAdd: () => void;
  onRemove: () => void;
}

/** Controls of the Sculpt lab: a list of the control ellipsoids, and fields for the selected one. */
export class EllipsoidControls {
  readonly element: HTMLElement;
  readonly #events: EllipsoidEvents;
  readonly #list = h('div', { class: 'buttons chips', role: 'group', 'aria-label': text('sculptPanels.ellipsoids') });
  readonly #modes = new Map<HandleMode, HTMLButtonElement>();
  readonly #help = h('p', { class: 'help' });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #center: HTMLInputElement[];
  readonly #lengths: HTMLInputElement[];
  readonly #degrees: HTMLInputElement;
  readonly #numbers: HTMLElement;
  readonly #remove: HTMLButtonElement;
  readonly #add: HTMLButtonElement;
  #pose: ControlEllipsoid[] = [];
  #names: string[] = [];
  #chosen: number | undefined;

  constructor(events: EllipsoidEvents) {
    this.#events = events;
    this.#center = AXES.map((axis, k) =>
      this.#field(text('sculptPanels.centreAxis', { axis }), (value) => this.#setCenter(k, value)),
    );
    this.#lengths = AXES.map((_, k) =>
      this.#field(text('sculptPanels.semiAxis', { number: k + 1 }), (value) => this.#setLength(k, value)),
    );
    this.#degrees = h('input', {
      type: 'number',
      value: 15,
      min: -180,
      max: 180,
      step: 'any',
      'aria-label': text('sculptPanels.rotationAngle'),
    });
    this.#add = h(
      'button',
      { type: 'button', 'data-ellipsoid': 'add', onclick: events.onAdd },
      text('sculptPanels.add'),
    );
    this.#remove = h(
      'button',
      { type: 'button', 'data-ellipsoid': 'remove', onclick: events.onRemove },
      text('controls.remove'),
    );
    this.#numbers = this.#layOutNumbers();
    const modes = h('div', { class: 'buttons', role: 'group', 'aria-label': text('sculptPanels.handleMode') });
    modes.append(...MODES.map(({ mode, label, key }) => this.#modeButton(mode, label, key)));
    this.element = h(
      'div',
      { class: 'ellipsoids' },
      h('p', { class: 'help' }, text('sculptPanels.ellipsoidsHelp')),
      this.#list,
      h('div', { class: 'buttons' }, this.#add, this.#remove),
      modes,
      this.#help,
      this.#numbers,
      this.#error,
    );
    this.mode = 'move';
    this.show([], [], undefined);
  }

  set mode(mode: HandleMode) {
    for (const [one, button] of this.#modes) button.setAttribute('aria-pressed', String(one === mode));
    this.#help.textContent = text('sculptPanels.modeHelp', {
      help: MODES.find((one) => one.mode === mode)?.help ?? '',
    });
  }

  show(pose: ControlEllipsoid[], names: string[], chosen: number | undefined): void {
    this.#pose = pose;
    this.#chosen = chosen;
    this.#showNames(names);
    for (const [index, button] of [...this.#list.children].entries())
      button.setAttribute('aria-pressed', String(index === chosen));
    const ellipsoid = chosen === undefined ? undefined : pose[chosen];
    this.#numbers.hidden = ellipsoid === undefined;
    this.#remove.disabled = ellipsoid === undefined || pose.length < 2;
    this.#error.textContent = '';
    if (ellipsoid) this.#showNumbers(ellipsoid);
  }

  showError(message: string): void {
    this.#error.textContent = message;
  }

  /**
   * Focuses the button of the selected ellipsoid, or of the first if none is selected; called when the focused button
   * may have been removed.
   */
  focus(): void {
    const button = this.#list.children[this.#chosen ?? 0];
    if (button instanceof HTMLElement) button.focus();
  }

  /**
   * Shows a button for each ellipsoid; while the names are unchanged, the existing buttons stay, and so does the focus.
   */
  #showNames(names: string[]): void {
    if (names.length === this.#names.length && names.every((name, k) => name === this.#names[k])) return;
    this.#names = names;
    const button = (name: string, index: number) =>
      h(
        'button',
        { type: 'button', 'data-ellipsoid': index + 1, onclick: () => this.#choose(index) },
        `${index + 1} ${name}`.trim(),
      );
    this.#list.replaceChildren(...names.map(button));
  }

  #choose(index: number): void {
    this.#events.onChoose(index === this.#chosen ? undefined : index);
  }

  #showNumbers(ellipsoid: ControlEllipsoid): void {
    const lengths = lengthsOf(ellipsoid);
    const place = this.#place(ellipsoid);
    const isLong = place.some((text) => text.length > WIDTH);
    this.#center[0]?.parentElement?.classList.toggle('long', isLong);
    for (let k = 0; k < 3; k++) {
      const [center, length] = [this.#center[k], this.#lengths[k]];
      if (center) showIn(center, place[k] ?? '');
      if (length) showIn(length, short(lengths[k] ?? 0));
    }
  }

  #layOutNumbers(): HTMLElement {
    const row = (label: string, fields: HTMLElement[]) =>
      h('div', { class: 'triple' }, h('span', {}, label), ...fields);
    const turns = AXES.map((axis, k) =>
      h(
        'button',
        {
          type: 'button',
          'aria-label': text('sculptPanels.rotateAbout', { axis }),
          'data-turn': axis,
          onclick: () => this.#turn(k),
        },
        axis,
      ),
    );
    return h(
      'div',
      { class: 'numbers' },
      row(text('sculptPanels.centre'), this.#center),
      row(text('sculptPanels.semiAxes'), this.#lengths),
      h(
        'div',
        { class: 'triple' },
        h('span', {}, text('sculptPanels.rotateBy'), this.#degrees, text('sculptPanels.degreesAbout')),
        ...turns,
      ),
    );
  }

  #modeButton(mode: HandleMode, label: string, key: string): HTMLButtonElement {
    const button = h(
      'button',
      {
        type: 'button',
        'data-mode': mode,
        title: text('sculptPanels.modeKey', { key }),
        onclick: () => this.#events.onMode(mode),
      },
      label,
    );
    this.#modes.set(mode, button);
    return button;
  }

  #field(label: string, onValue: (value: number) => void): HTMLInputElement {
    const input = h('input', { type: 'number', id: uniqueId('ellipsoid'), step: 'any', 'aria-label': label });
    input.addEventListener('change', () => onValue(input.valueAsNumber));
    return input;
  }

  /** Returns the centre of an ellipsoid as texts, to four digits of the box around all ellipsoids. */
  #place({ center }: ControlEllipsoid): string[] {
    const { min, max } = boxOf(this.#pose);
    const size = Math.max(...max.map((high, k) => high - (min[k] ?? 0)));
    return shortenedPoint(center, DIGITS, size).map(String);
  }

  get #ellipsoid(): ControlEllipsoid | undefined {
    return this.#chosen === undefined ? undefined : this.#pose[this.#chosen];
  }

  #setCenter(k: number, value: number): void {
    const ellipsoid = this.#ellipsoid;
    if (!ellipsoid) return;
    if (!Number.isFinite(value)) {
      this.#reject(text('controls.numberError'));
      return;
    }
    const center: Vec3 = [...ellipsoid.center];
    center[k] = value;
    this.#events.onChange({ ...ellipsoid, center }, text('sculpt.moved'));
  }

  #setLength(k: number, value: number): void {
    const ellipsoid = this.#ellipsoid;
    if (!ellipsoid) return;
    if (!(value > 0)) {
      this.#reject(text('sculptPanels.lengthError'));
      return;
    }
    const lengths = lengthsOf(ellipsoid);
    lengths[k] = value;
    this.#events.onChange(withLengths(ellipsoid, lengths), text('sculpt.scaled'));
  }

  #turn(k: number): void {
    const [ellipsoid, about, degrees] = [this.#ellipsoid, DIRECTIONS[k], this.#degrees.valueAsNumber];
    if (!ellipsoid || !about) return;
    if (!Number.isFinite(degrees)) {
      this.#reject(text('sculptPanels.angleError'));
      return;
    }
    this.#events.onChange(turned(ellipsoid, about, (degrees * Math.PI) / 180), text('sculpt.rotated'));
  }

  #reject(message: string): void {
    const ellipsoid = this.#ellipsoid;
    if (ellipsoid) this.#showNumbers(ellipsoid);
    this.showError(message);
  }
}

/** Formats a length with as many digits as it is worth. */
function short(value: number): string {
  return String(Number(value.toPrecision(DIGITS)));
}
