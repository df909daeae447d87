import { text } from '../texts';
import type { Enrichment, Preparation } from '../track/protocol';
import { h, uniqueId } from './dom';

const KINDS: { value: Enrichment; label: string }[] = [
  { value: 'none', label: text('trackPanels.enrichNone') },
  { value: 'linear', label: text('trackPanels.enrichLinear') },
  { value: 'flow', label: text('trackPanels.enrichFlow') },
];
/** Largest factor, supported by the library, by which in-between slices may divide the distance between slices. */
const MAX_FACTOR = 16;

/** Controls of the Track lab for the preprocessing of the image before tracking: binning and in-between slices. */
export class PreparationControls {
  readonly element: HTMLElement;
  readonly #binning: HTMLSelectElement;
  readonly #kind: HTMLSelectElement;
  readonly #factor: HTMLInputElement;
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  #value: Preparation = { binning: 1, enrichment: 'none', factor: 0 };

  constructor(onChange: (preparation: Preparation, what: string) => void) {
    const [binning, kind, factor] = ['binning', 'enrichment', 'factor'].map(uniqueId) as [string, string, string];
    this.#binning = h(
      'select',
      { id: binning, 'data-prepare': 'binning' },
      h('option', { value: '1' }, '×1'),
      h('option', { value: '2' }, '×2'),
    );
    this.#binning.addEventListener('change', () =>
      onChange({ ...this.#value, binning: this.#binning.value === '2' ? 2 : 1 }, text('trackPanels.binningChange')),
    );
    const options = KINDS.map(({ value, label }) => h('option', { value }, label));
    this.#kind = h('select', { id: kind, 'data-prepare': 'enrichment' }, ...options);
    this.#kind.addEventListener('change', () =>
      onChange(
        { ...this.#value, enrichment: this.#kind.value as Enrichment },
        text('trackPanels.inBetweenSlicesChange'),
      ),
    );
    this.#factor = h('input', {
      type: 'number',
      id: factor,
      min: 0,
      max: MAX_FACTOR,
      step: 1,
      placeholder: text('controls.auto'),
      inputmode: 'numeric',
      'data-prepare': 'factor',
    });
    this.#factor.addEventListener('change', () => {
      const given = this.#factor.value === '' && !this.#factor.validity.badInput ? 0 : this.#factor.valueAsNumber;
      const valid = Number.isInteger(given) && given >= 0 && given <= MAX_FACTOR;
      this.#error.textContent = valid ? '' : text('trackPanels.inBetweenFactorError', { most: MAX_FACTOR });
      if (valid) onChange({ ...this.#value, factor: given }, text('trackPanels.inBetweenFactorChange'));
    });
    this.element = h(
      'div',
      { class: 'preparation' },
      row(text('trackPanels.binning'), binning, this.#binning, text('trackPanels.binningHelp')),
      row(text('trackPanels.inBetweenSlices'), kind, this.#kind, text('trackPanels.inBetweenSlicesHelp')),
      row(text('trackPanels.inBetweenFactor'), factor, this.#factor, text('trackPanels.inBetweenFactorHelp')),
      this.#error,
    );
  }

  show(preparation: Preparation): void {
    this.#value = preparation;
    this.#binning.value = String(preparation.binning);
    this.#kind.value = preparation.enrichment;
    this.#factor.value = preparation.factor > 0 ? String(preparation.factor) : '';
    this.#factor.disabled = preparation.enrichment === 'none';
    this.#error.textContent = '';
  }
}

function row(label: string, id: string, control: HTMLElement, help: string): HTMLElement {
  control.setAttribute('aria-describedby', `${id}-help`);
  return h(
    'div',
    { class: 'param' },
    h('label', { for: id }, label),
    h('span', { class: 'value' }, control),
    h('p', { class: 'help', id: `${id}-help` }, help),
  );
}
