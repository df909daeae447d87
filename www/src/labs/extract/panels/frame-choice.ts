import { h, uniqueId } from '../../../kit/dom';
import { labelFor } from '../../../kit/field';
import { count } from '../../../kit/format';
import { text } from '../../../texts';

/** Slider of the Extract lab that chooses the frame of a 4D volume to which the surface is fitted; hidden for others. */
export class FrameChoice {
  readonly element: HTMLElement;
  readonly #slider: HTMLInputElement;
  readonly #output = h('output', { 'aria-live': 'off' });
  #frames = 1;

  /** `onFrame` is called with the index of the frame that the user chooses. */
  constructor(onFrame: (frame: number) => void) {
    const id = uniqueId('frame');
    this.#slider = h('input', { type: 'range', id, min: 0, step: 1, 'aria-describedby': `${id}-help` });
    this.#slider.addEventListener('input', () => this.#showNumber());
    // Each choice opens the frame, so it is applied only when the slider is released.
    this.#slider.addEventListener('change', () => onFrame(this.#slider.valueAsNumber));
    this.element = h(
      'div',
      { class: 'param', 'data-param': 'frame', hidden: true },
      labelFor(this.#slider, text('controls.frame')),
      this.#output,
      this.#slider,
      h('p', { class: 'help', id: `${id}-help` }, text('slices.frameHelp')),
    );
  }

  /** Shows the open frame of a volume of `frames` frames. */
  show(frame: number, frames: number): void {
    this.#frames = frames;
    this.element.hidden = frames < 2;
    this.#slider.max = String(frames - 1);
    this.#slider.valueAsNumber = frame;
    this.#showNumber();
  }

  #showNumber(): void {
    const shown = text('controls.frameOf', {
      frame: count(this.#slider.valueAsNumber + 1),
      last: count(this.#frames),
    });
    this.#output.value = shown;
    this.#slider.setAttribute('aria-valuetext', shown);
  }
}
