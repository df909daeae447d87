import { h } from '../../../kit/dom';
import { Field, type FormControl, selectFrom } from '../../../kit/field';
import { text } from '../../../texts';
import type { StartShape } from '../protocol';

type Kind = StartShape['kind'];

export const SHAPES: { value: Kind; label: string; help: string }[] = [
  {
    value: 'contour',
    label: text('extractPanels.startContour'),
    help: text('extractPanels.startContourHelp'),
  },
  {
    value: 'enclosing',
    label: text('extractPanels.startEnclosing'),
    help: text('extractPanels.startEnclosingHelp'),
  },
  { value: 'bubbles', label: text('extractPanels.startBubbles'), help: text('extractPanels.startBubblesHelp') },
  { value: 'sphere', label: text('extractPanels.startSphere'), help: text('extractPanels.startSphereHelp') },
  {
    value: 'isosurface',
    label: text('extractPanels.startIsosurface'),
    help: text('extractPanels.startIsosurfaceHelp'),
  },
];
const DEFAULT_LEVELS = 1;
const MOST_LEVELS = 6;
const DEFAULT_BUBBLES = 5;
const MOST_BUBBLES = 32;

export interface StartChoice {
  kind: Kind;
  bubbles: number;
  levels: number;
  /** Mean edge length of the surface in world units; undefined lets the model choose. */
  edge: number | undefined;
  /**
   * Side, in world units, of the box around the crosshair in which a volume larger than memory is followed to its finer
   * levels; undefined for the whole volume.
   */
  box?: number | undefined;
}

/** The choice for a volume for which no other was made. */
export const USUAL_START: StartChoice = {
  kind: 'contour',
  bubbles: DEFAULT_BUBBLES,
  levels: DEFAULT_LEVELS,
  edge: undefined,
};

/**
 * Controls of the Extract lab for the initial surface. A change restarts the model; if it is rejected, the previous
 * values are restored.
 */
export class StartControls {
  readonly element: HTMLElement;
  readonly #shape = new Field(selectFrom(SHAPES), { label: text('extractPanels.startShape'), help: '', row: 'row' });
  readonly #bubbles = new Field(integer(2, MOST_BUBBLES, DEFAULT_BUBBLES), {
    label: text('extractPanels.bubblesPerAxis'),
    help: text('extractPanels.bubblesPerAxisHelp'),
    row: 'row',
  });
  readonly #levels = new Field(integer(0, MOST_LEVELS, DEFAULT_LEVELS), {
    label: text('extractPanels.pyramidLevelCount'),
    symbol: 'm',
    help: text('extractPanels.pyramidLevelCountHelp'),
    row: 'row',
  });
  readonly #edge = new Field(length(text('controls.auto')), {
    label: text('extractPanels.meanEdgeLength'),
    help: text('extractPanels.meanEdgeLengthHelp'),
    row: 'row',
  });
  readonly #box = new Field(length(text('extractPanels.boxWhole')), {
    label: text('extractPanels.boxSide'),
    help: text('extractPanels.boxSideHelp'),
    row: 'row',
  });
  /** The fields, each with the error message for an invalid value. */
  readonly #needs = new Map<Field<FormControl>, string>([
    [this.#shape, ''],
    [this.#bubbles, text('extractPanels.bubblesPerAxisError', { most: MOST_BUBBLES })],
    [this.#levels, text('extractPanels.pyramidLevelCountError', { most: MOST_LEVELS })],
    [this.#edge, text('extractPanels.meanEdgeLengthError')],
    [this.#box, text('extractPanels.boxSideError')],
  ]);
  /** The field that was changed last, which shows the error if no model can be created. */
  #changed: Field<FormControl> = this.#shape;
  #inForce: StartChoice;

  constructor(onChange: () => void) {
    for (const field of this.#needs.keys())
      field.control.addEventListener('change', () => this.#onChange(field, onChange));
    this.element = h('div', { class: 'start' }, ...[...this.#needs.keys()].map((field) => field.element));
    this.isLarge = false;
    this.#explain();
    this.#inForce = this.value;
  }

  /** Whether the open volume is larger than memory. */
  set isLarge(large: boolean) {
    this.#box.element.hidden = !large;
  }

  get value(): StartChoice {
    return {
      kind: this.#shape.control.value as Kind,
      bubbles: this.#bubbles.control.valueAsNumber,
      levels: this.#levels.control.valueAsNumber,
      edge: read(this.#edge.control),
      box: read(this.#box.control),
    };
  }

  /**
   * Choice of the initial surface with which the current model was created. During the attempt to create a model with a
   * new choice, {@link value} is the new one already.
   */
  get inForce(): StartChoice {
    return this.#inForce;
  }

  /**
   * Shows the choice with which the current model was created and clears error messages, without reporting a change.
   */
  show(choice: StartChoice): void {
    this.#inForce = choice;
    this.#shape.control.value = choice.kind;
    this.#bubbles.control.valueAsNumber = choice.bubbles;
    this.#levels.control.valueAsNumber = choice.levels;
    this.#edge.control.value = String(choice.edge ?? '');
    this.#box.control.value = String(choice.box ?? '');
    for (const field of this.#needs.keys()) field.showError(undefined);
    this.#explain();
  }

  /**
   * Shows why a change was rejected beside the field changed last, and restores the values of the current model in all
   * fields.
   */
  reject(message: string): void {
    this.show(this.#inForce);
    this.#changed.showError(message);
  }

  #onChange(field: Field<FormControl>, onChange: () => void): void {
    this.#changed = field;
    for (const each of this.#needs.keys()) each.showError(undefined);
    this.#explain();
    if (field.control.checkValidity()) onChange();
    else this.reject(this.#needs.get(field) ?? '');
  }

  #explain(): void {
    const kind = this.#shape.control.value;
    this.#bubbles.element.hidden = kind !== 'bubbles';
    this.#shape.help = SHAPES.find(({ value }) => value === kind)?.help ?? '';
  }
}

/** Creates a field for a length that may be empty, which `empty` explains. */
function length(empty: string): HTMLInputElement {
  return h('input', { type: 'number', min: 0, step: 'any', inputmode: 'decimal', placeholder: empty });
}

function read({ value, valueAsNumber }: HTMLInputElement): number | undefined {
  return value === '' ? undefined : valueAsNumber;
}

function integer(min: number, max: number, value: number): HTMLInputElement {
  return h('input', { type: 'number', min, max, step: 1, value, required: true });
}
