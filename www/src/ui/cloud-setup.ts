import { LANGUAGE, text } from '../texts';
import { h, uniqueId } from './dom';

const DEFAULT_MAX_POINTS = 20_000;

/**
 * Settings of the Reconstruct lab's model besides its parameters: the largest number of points used, and the number of
 * clusters of points kept; undefined stands for the default number of points, and for all clusters.
 */
export interface CloudChoice {
  maxPoints: number | undefined;
  keepComponents: number | undefined;
}

interface Field {
  element: HTMLElement;
  input: HTMLInputElement;
  error: HTMLElement;
}

/** Fields of the Reconstruct lab for the largest number of points used and the number of clusters of points kept. */
export class CloudSetup {
  readonly element: HTMLElement;
  readonly #maxPoints: Field;
  readonly #keep: Field;
  #inForce: CloudChoice = { maxPoints: undefined, keepComponents: undefined };

  constructor(onChange: (choice: CloudChoice, what: string) => void) {
    this.#maxPoints = numberField(
      text('pointPanels.maxPoints'),
      'maxPoints',
      { min: 4, max: 100_000, placeholder: String(DEFAULT_MAX_POINTS) },
      [text('pointPanels.maxPointsHelp')],
    );
    this.#keep = numberField(
      text('pointPanels.clustersToKeep'),
      'keepComponents',
      { min: 1, max: 10_000, placeholder: text('pointPanels.all') },
      [text('pointPanels.clustersToKeepHelp')],
    );
    const fields: [Field, string][] = [
      [this.#maxPoints, text('pointPanels.maxPointsChange')],
      [this.#keep, text('pointPanels.clustersToKeepChange')],
    ];
    for (const [field, what] of fields)
      field.input.addEventListener('change', () => this.#changed(field, what, onChange));
    this.element = h('div', { class: 'params' }, this.#maxPoints.element, this.#keep.element);
  }

  get value(): CloudChoice {
    return this.#inForce;
  }

  show({ maxPoints, keepComponents }: CloudChoice): void {
    this.#inForce = { maxPoints, keepComponents };
    this.#maxPoints.input.value = maxPoints === undefined ? '' : String(maxPoints);
    this.#keep.input.value = keepComponents === undefined ? '' : String(keepComponents);
    for (const { error } of [this.#maxPoints, this.#keep]) error.textContent = '';
  }

  #changed({ input, error }: Field, what: string, onChange: (choice: CloudChoice, what: string) => void): void {
    error.textContent = '';
    if (!input.checkValidity()) {
      this.show(this.#inForce);
      error.textContent = text('controls.integerOrEmptyError', {
        min: input.min,
        max: Number(input.max).toLocaleString(LANGUAGE),
      });
      return;
    }
    const number = (one: HTMLInputElement) => (one.value === '' ? undefined : one.valueAsNumber);
    onChange({ maxPoints: number(this.#maxPoints.input), keepComponents: number(this.#keep.input) }, what);
  }
}

function numberField(label: string, name: string, range: Record<string, unknown>, [help = '']: string[]): Field {
  const id = uniqueId(name);
  const input = h('input', { type: 'number', id, step: 1, 'aria-describedby': `${id}-help ${id}-error`, ...range });
  const error = h('p', { class: 'field-error', id: `${id}-error`, role: 'alert' });
  const element = h(
    'div',
    { class: 'param', 'data-param': name },
    h('label', { for: id }, label),
    h('span', { class: 'value' }, input),
    h('p', { class: 'help', id: `${id}-help` }, help),
    error,
  );
  return { element, input, error };
}
