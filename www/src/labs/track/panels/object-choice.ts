import { h } from '../../../kit/dom';
import { text } from '../../../texts';

export interface ObjectEvents {
  /** Called when the object at the crosshair is to be found. */
  onHere: () => void;
  /** Called when what moves most is to be found: in the box that was drawn, or in the whole image. */
  onMoving: (where: 'box' | 'image') => void;
  /** Called when the whole image is to be tracked as it is. */
  onWhole: () => void;
  /** Called when the object that was tracked is to stay. */
  onKeep: () => void;
}

/** Asks for the object to track, in words, with buttons that are alternatives to a click in a slice. */
export class ObjectChoice {
  readonly element: HTMLElement;
  readonly #here: HTMLButtonElement;
  readonly #box: HTMLButtonElement;
  readonly #moving: HTMLButtonElement;
  readonly #whole: HTMLButtonElement;
  readonly #keep: HTMLButtonElement;
  readonly #refusal = h('p', { class: 'field-error', role: 'alert', 'data-refusal': '' });
  #hasBox = false;
  #enabled = true;

  constructor({ onHere, onMoving, onWhole, onKeep }: ObjectEvents) {
    this.#here = button('here', text('trackPanels.objectHere'), onHere);
    this.#box = button('box', text('trackPanels.objectInBox'), () => onMoving('box'));
    this.#moving = button('moving', text('trackPanels.objectMoving'), () => onMoving('image'));
    this.#whole = button('whole', text('trackPanels.trackWhole'), onWhole);
    this.#keep = h(
      'button',
      { type: 'button', class: 'quiet', 'data-object': 'keep', onclick: onKeep },
      text('controls.dismiss'),
    );
    this.element = h(
      'div',
      { class: 'object-choice', role: 'group', 'aria-label': text('trackPanels.objectGroup'), hidden: true },
      h('p', {}, h('strong', {}, text('trackPanels.objectClick'))),
      h('p', { class: 'help' }, text('trackPanels.objectHelp')),
      this.#refusal,
      h('div', { class: 'buttons' }, this.#here, this.#box, this.#moving, this.#whole, this.#keep),
    );
  }

  /** Whether the choice is shown. */
  set open(open: boolean) {
    this.element.hidden = !open;
    if (!open) this.showRefusal('');
  }

  get open(): boolean {
    return !this.element.hidden;
  }

  /** Whether a box was drawn, in which an object can be found. */
  set hasBox(hasBox: boolean) {
    this.#hasBox = hasBox;
    this.#update();
  }

  /** Whether an object is tracked already, which can stay. */
  set hasOther(hasOther: boolean) {
    this.#keep.hidden = !hasOther;
  }

  set enabled(enabled: boolean) {
    this.#enabled = enabled;
    this.#update();
  }

  /** Shows why there is no proposal, and what to do; an empty text shows nothing. */
  showRefusal(message: string): void {
    this.#refusal.textContent = message;
  }

  #update(): void {
    for (const one of [this.#here, this.#moving, this.#whole]) one.disabled = !this.#enabled;
    this.#box.disabled = !this.#enabled || !this.#hasBox;
  }
}

function button(name: string, label: string, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', 'data-object': name, onclick }, label);
}
