import { h } from '../../../kit/dom';
import { type Choice, Field, selectFrom } from '../../../kit/field';
import { text } from '../../../texts';
import type { Enrichment, Preparation } from '../protocol';

const BINNINGS: Choice[] = [
  { value: '1', label: '×1' },
  { value: '2', label: '×2' },
];
const KINDS: Choice<Enrichment>[] = [
  { value: 'none', label: text('trackPanels.enrichNone') },
  { value: 'linear', label: text('trackPanels.enrichLinear') },
  { value: 'flow', label: text('trackPanels.enrichFlow') },
];
/** Largest factor, supported by the library, by which in-between slices may divide the distance between slices. */
const MAX_FACTOR = 16;

/** Controls of the Track lab for the preprocessing of the image before tracking: binning and in-between slices. */
export class PreparationControls {
  readonly element: HTMLElement;
  readonly #binning = new Field(selectFrom(BINNINGS, { 'data-prepare': 'binning' }), {
    label: text('trackPanels.binning'),
    help: text('trackPanels.binningHelp'),
  });
  readonly #kind = new Field(selectFrom(KINDS, { 'data-prepare': 'enrichment' }), {
    label: text('trackPanels.inBetweenSlices'),
    help: text('trackPanels.inBetweenSlicesHelp'),
  });
  readonly #factor = new Field(
    h('input', {
      ...{ type: 'number', min: 0, max: MAX_FACTOR, step: 1, inputmode: 'numeric', 'data-prepare': 'factor' },
      placeholder: text('controls.auto'),
    }),
    { label: text('trackPanels.inBetweenFactor'), help: text('trackPanels.inBetweenFactorHelp') },
  );
  #value: Preparation = { binning: 1, enrichment: 'none', factor: 0 };

  constructor(onChange: (preparation: Preparation, what: string) => void) {
    const [binning, kind, factor] = [this.#binning.control, this.#kind.control, this.#factor.control];
    binning.addEventListener('change', () =>
      onChange({ ...this.#value, binning: binning.value === '2' ? 2 : 1 }, text('trackPanels.binningChange')),
    );
    kind.addEventListener('change', () =>
      onChange({ ...this.#value, enrichment: kind.value as Enrichment }, text('trackPanels.inBetweenSlicesChange')),
    );
    factor.addEventListener('change', () => {
      const valid = factor.checkValidity();
      this.#factor.showError(valid ? undefined : text('trackPanels.inBetweenFactorError', { most: MAX_FACTOR }));
      const given = factor.value === '' ? 0 : factor.valueAsNumber;
      if (valid) onChange({ ...this.#value, factor: given }, text('trackPanels.inBetweenFactorChange'));
    });
    this.element = h(
      'div',
      { class: 'preparation' },
      ...[this.#binning, this.#kind, this.#factor].map((field) => field.element),
    );
  }

  show(preparation: Preparation): void {
    this.#value = preparation;
    this.#binning.control.value = String(preparation.binning);
    this.#kind.control.value = preparation.enrichment;
    this.#factor.control.value = preparation.factor > 0 ? String(preparation.factor) : '';
    this.#factor.control.disabled = preparation.enrichment === 'none';
    this.#factor.showError(undefined);
  }
}
