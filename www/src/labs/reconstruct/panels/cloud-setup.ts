import { h } from '../../../kit/dom';
import { Field } from '../../../kit/field';
import { LANGUAGE, text } from '../../../texts';

const DEFAULT_MAX_POINTS = 20_000;

/**
 * Settings of the Reconstruct lab's model besides its parameters: the largest number of points used, and the number of
 * clusters of points kept; undefined stands for the default number of points, and for all clusters.
 */
export interface CloudChoice {
  maxPoints: number | undefined;
  keepComponents: number | undefined;
}

/** Fields of the Reconstruct lab for the largest number of points used and the number of clusters of points kept. */
export class CloudSetup {
  readonly element: HTMLElement;
  readonly #maxPoints = new Field(integer({ min: 4, max: 100_000, placeholder: String(DEFAULT_MAX_POINTS) }), {
    label: text('pointPanels.maxPoints'),
    help: text('pointPanels.maxPointsHelp'),
    attributes: { 'data-param': 'maxPoints' },
  });
  readonly #keep = new Field(integer({ min: 1, max: 10_000, placeholder: text('pointPanels.all') }), {
    label: text('pointPanels.clustersToKeep'),
    help: text('pointPanels.clustersToKeepHelp'),
    attributes: { 'data-param': 'keepComponents' },
  });
  #inForce: CloudChoice = { maxPoints: undefined, keepComponents: undefined };

  constructor(onChange: (choice: CloudChoice, what: string) => void) {
    const fields: [Field, string][] = [
      [this.#maxPoints, text('pointPanels.maxPointsChange')],
      [this.#keep, text('pointPanels.clustersToKeepChange')],
    ];
    for (const [field, what] of fields)
      field.control.addEventListener('change', () => this.#changed(field, what, onChange));
    this.element = h('div', { class: 'params' }, this.#maxPoints.element, this.#keep.element);
  }

  get value(): CloudChoice {
    return this.#inForce;
  }

  show({ maxPoints, keepComponents }: CloudChoice): void {
    this.#inForce = { maxPoints, keepComponents };
    this.#maxPoints.control.value = maxPoints === undefined ? '' : String(maxPoints);
    this.#keep.control.value = keepComponents === undefined ? '' : String(keepComponents);
    for (const field of [this.#maxPoints, this.#keep]) field.showError(undefined);
  }

  #changed(field: Field, what: string, onChange: (choice: CloudChoice, what: string) => void): void {
    field.showError(undefined);
    const { control } = field;
    if (!control.checkValidity()) {
      this.show(this.#inForce);
      const max = Number(control.max).toLocaleString(LANGUAGE);
      field.showError(text('controls.integerOrEmptyError', { min: control.min, max }));
      return;
    }
    const number = (one: HTMLInputElement) => (one.value === '' ? undefined : one.valueAsNumber);
    onChange({ maxPoints: number(this.#maxPoints.control), keepComponents: number(this.#keep.control) }, what);
  }
}

function integer(range: Record<string, unknown>): HTMLInputElement {
  return h('input', { type: 'number', step: 1, ...range });
}
