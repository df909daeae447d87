import type { ParamSpec } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { Field, showIn } from '../../../kit/field';
import { figure } from '../../../kit/format';
import { text } from '../../../texts';

/**
 * Multiple of the noise's standard deviation; a warning is shown for an edge threshold τ below it, at which noise alone
 * is detected as boundary.
 */
const NOISE_FACTOR = 2.5;

/**
 * Control of the Track lab for the edge threshold τ, with the estimated noise level, a suggested value, and a warning
 * if the threshold is below {@link NOISE_FACTOR} times the noise.
 */
export class EdgeThreshold {
  readonly element: HTMLElement;
  readonly #field: Field;
  readonly #number = h('input', { type: 'number', step: 'any', min: 0, inputmode: 'decimal' });
  readonly #slider: HTMLInputElement;
  readonly #suggest: HTMLButtonElement;
  readonly #noise = h('p', { class: 'help' });
  readonly #warning = h('p', { class: 'warning', role: 'status' });
  #suggested = 0;

  /**
   * `onTry` is called with the threshold while the slider is dragged, and with undefined when it is released;
   * `onChange` with each threshold that is to take effect: released, entered or suggested.
   */
  constructor(
    { label, symbol, help }: ParamSpec,
    onChange: (threshold: number) => void,
    onTry: (threshold: number | undefined) => void,
  ) {
    this.#slider = h('input', {
      type: 'range',
      min: 0,
      max: 1,
      step: 'any',
      'aria-label': text('controls.sliderOf', { label }),
    });
    this.#number.addEventListener('change', () => onChange(this.#number.valueAsNumber));
    // A change restarts the tracker, so it is applied only when the slider is released.
    this.#slider.addEventListener('input', () => {
      this.#number.value = String(rounded(this.#slider.valueAsNumber));
      onTry(rounded(this.#slider.valueAsNumber));
    });
    this.#slider.addEventListener('change', () => {
      onTry(undefined);
      onChange(rounded(this.#slider.valueAsNumber));
    });
    this.#suggest = h('button', {
      type: 'button',
      'data-threshold': 'suggest',
      onclick: () => onChange(this.#suggested),
    });
    const parts = { label, symbol, help, extra: [this.#slider], attributes: { 'data-param': 'threshold' } };
    this.#field = new Field(this.#number, parts);
    this.element = this.#field.element;
    this.element.append(this.#noise, h('div', { class: 'buttons' }, this.#suggest), this.#warning);
  }

  /**
   * Shows the threshold, the noise's standard deviation and the suggested threshold, all in intensity units. `largest`:
   * the largest possible difference of intensities, in the same units; the slider ends at half of it, or at the
   * threshold if that is larger.
   */
  show(threshold: number, noise: number, suggested: number, largest: number): void {
    this.#suggested = suggested;
    const top = rounded(Math.max(largest / 2, threshold));
    Object.assign(this.#slider, { max: String(top), step: String(top / 500) });
    this.#slider.valueAsNumber = threshold;
    this.#slider.setAttribute('aria-valuetext', figure(threshold));
    showIn(this.#number, String(Number(threshold.toPrecision(6))));
    this.#noise.textContent = text('trackPanels.noiseEstimate', {
      noise: figure(rounded(noise)),
      suggested: figure(rounded(suggested)),
    });
    this.#suggest.textContent = text('trackPanels.useSuggested', { suggested: figure(rounded(suggested)) });
    this.#suggest.disabled = Object.is(threshold, suggested);
    const low = threshold < NOISE_FACTOR * noise;
    const warning = low ? text('trackPanels.noiseWarning', { limit: figure(rounded(NOISE_FACTOR * noise)) }) : '';
    if (this.#warning.textContent !== warning) this.#warning.textContent = warning;
    this.#field.showError(undefined);
  }

  showError(message: string): void {
    this.#field.showError(message);
  }
}

const rounded = (value: number) => Number(value.toPrecision(3));
