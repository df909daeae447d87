import { signal } from '@preact/signals';
import { Field, NumberInput } from '../../../kit/ui/field';
import { Select } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import { SHAPES, type StartChoice, USUAL_START } from '../start';

type Name = keyof StartChoice;

const MOST_LEVELS = 6;
const MOST_BUBBLES = 32;
const LABELS = Object.fromEntries(SHAPES.map(({ value, label }) => [value, label])) as Record<
  StartChoice['kind'],
  string
>;

/** A field for a number of the choice. */
interface NumberField {
  name: Exclude<Name, 'kind'>;
  label: string;
  symbol?: string;
  help: string;
  /** Message for a value that is no such number. */
  error: string;
  /** Range and kind of the number. */
  range: { min: number; max?: number; step?: number; required?: boolean; placeholder?: string };
}

const FIELDS: NumberField[] = [
  {
    name: 'bubbles',
    label: text('extractPanels.bubblesPerAxis'),
    help: text('extractPanels.bubblesPerAxisHelp'),
    error: text('extractPanels.bubblesPerAxisError', { most: MOST_BUBBLES }),
    range: { min: 2, max: MOST_BUBBLES, step: 1, required: true },
  },
  {
    name: 'levels',
    label: text('extractPanels.pyramidLevelCount'),
    symbol: 'm',
    help: text('extractPanels.pyramidLevelCountHelp'),
    error: text('extractPanels.pyramidLevelCountError', { most: MOST_LEVELS }),
    range: { min: 0, max: MOST_LEVELS, step: 1, required: true },
  },
  {
    name: 'edge',
    label: text('extractPanels.meanEdgeLength'),
    help: text('extractPanels.meanEdgeLengthHelp'),
    error: text('extractPanels.meanEdgeLengthError'),
    range: { min: 0, placeholder: text('controls.auto') },
  },
  {
    name: 'box',
    label: text('extractPanels.boxSide'),
    help: text('extractPanels.boxSideHelp'),
    error: text('extractPanels.boxSideError'),
    range: { min: 0, placeholder: text('extractPanels.boxWhole') },
  },
];

/** The choice of the initial surface. A change restarts the model; if it is rejected, the previous one is restored. */
export class StartState {
  /** The choice shown: during the attempt to create a model with a new choice, this is the new one already. */
  readonly shown = signal<StartChoice>(USUAL_START);
  /** The field that shows why a change was rejected. */
  readonly rejected = signal<{ name: Name; message: string } | undefined>(undefined);
  /** Whether the open volume is larger than memory. */
  readonly isLarge = signal(false);
  /** The field that was changed last, which shows the error if no model can be created. */
  #changed: Name = 'kind';
  #inForce: StartChoice = USUAL_START;
  readonly #onChange: () => void;

  constructor(onChange: () => void) {
    this.#onChange = onChange;
  }

  /** The choice with which the current model was created. */
  get inForce(): StartChoice {
    return this.#inForce;
  }

  /**
   * Shows the choice with which the current model was created and clears error messages, without reporting a change.
   */
  show(choice: StartChoice): void {
    this.#inForce = choice;
    this.shown.value = { ...choice };
    this.rejected.value = undefined;
  }

  /**
   * Shows why a change was rejected beside the field changed last, and restores the values of the current model in all
   * fields.
   */
  reject(message: string): void {
    this.show(this.#inForce);
    this.rejected.value = { name: this.#changed, message };
  }

  change(name: Name, changed: Partial<StartChoice>): void {
    this.#changed = name;
    this.shown.value = { ...this.shown.peek(), ...changed };
    this.rejected.value = undefined;
    this.#onChange();
  }

  /** Takes over what was entered in a field for a number, or says why not. */
  enter({ name, error }: NumberField, input: HTMLInputElement): void {
    this.#changed = name;
    const value = input.value === '' ? undefined : input.valueAsNumber;
    if (input.checkValidity()) this.change(name, { [name]: value });
    else this.reject(error);
  }
}

/** Controls of the Extract lab for the initial surface. */
export function StartControls({ state }: { state: StartState }) {
  const { kind } = state.shown.value;
  const isHidden = { bubbles: kind !== 'bubbles', levels: false, edge: false, box: !state.isLarge.value };
  return (
    <div class="start">
      <Field
        isRow
        label={text('extractPanels.startShape')}
        help={SHAPES.find(({ value }) => value === kind)?.help ?? ''}
        error={errorOf(state, 'kind')}
      >
        {(tied) => (
          <Select
            {...{ ...tied, choices: LABELS, value: kind }}
            onChoose={(chosen) => state.change('kind', { kind: chosen })}
          />
        )}
      </Field>
      {FIELDS.map((field) => (
        <StartNumber key={field.name} {...{ state, field, hidden: isHidden[field.name] }} />
      ))}
    </div>
  );
}

function StartNumber({ state, field, hidden }: { state: StartState; field: NumberField; hidden: boolean }) {
  const { name, range, error: _, ...told } = field;
  return (
    <Field isRow {...{ ...told, hidden, error: errorOf(state, name) }}>
      {(tied) => (
        <NumberInput
          {...{ ...tied, ...range, shown: String(state.shown.value[name] ?? '') }}
          onEnter={(_, input) => state.enter(field, input)}
        />
      )}
    </Field>
  );
}

function errorOf({ rejected }: StartState, name: Name): string {
  return rejected.value?.name === name ? rejected.value.message : '';
}
