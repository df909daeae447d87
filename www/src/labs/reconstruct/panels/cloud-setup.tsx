import { signal } from '@preact/signals';
import { Field, NumberInput } from '../../../kit/ui/field';
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

interface CloudField {
  name: keyof CloudChoice;
  label: string;
  help: string;
  /** Name of a change, for undo. */
  change: string;
  min: number;
  max: number;
  placeholder: string;
}

const FIELDS: CloudField[] = [
  {
    ...{ name: 'maxPoints', min: 4, max: 100_000, placeholder: String(DEFAULT_MAX_POINTS) },
    label: text('pointPanels.maxPoints'),
    help: text('pointPanels.maxPointsHelp'),
    change: text('pointPanels.maxPointsChange'),
  },
  {
    ...{ name: 'keepComponents', min: 1, max: 10_000, placeholder: text('pointPanels.all') },
    label: text('pointPanels.clustersToKeep'),
    help: text('pointPanels.clustersToKeepHelp'),
    change: text('pointPanels.clustersToKeepChange'),
  },
];

/** The choice in force, as its fields show it. */
export class CloudSetup {
  readonly choice = signal<CloudChoice>({ maxPoints: undefined, keepComponents: undefined });
  /** Name of the field whose entry was refused. */
  readonly refused = signal<keyof CloudChoice | undefined>(undefined);

  show({ maxPoints, keepComponents }: CloudChoice): void {
    this.choice.value = { maxPoints, keepComponents };
    this.refused.value = undefined;
  }
}

interface SetupProps {
  state: CloudSetup;
  onChange: (choice: CloudChoice, what: string) => void;
}

/** Fields of the Reconstruct lab for the largest number of points used and the number of clusters of points kept. */
export function CloudSetupFields({ state, onChange }: SetupProps) {
  const choice = state.choice.value;
  const enter = ({ name, change }: CloudField, entered: HTMLInputElement) => {
    state.refused.value = entered.checkValidity() ? undefined : name;
    const value = entered.value === '' ? undefined : entered.valueAsNumber;
    if (entered.checkValidity()) onChange({ ...choice, [name]: value }, change);
  };
  return (
    <div class="params">
      {FIELDS.map((field) => {
        const { name, label, help, min, max, placeholder } = field;
        const refusal = text('controls.integerOrEmptyError', { min, max: max.toLocaleString(LANGUAGE) });
        return (
          <Field
            key={name}
            {...{ label, help, 'data-param': name }}
            error={state.refused.value === name ? refusal : ''}
          >
            {(tied) => (
              <NumberInput
                {...{ ...tied, min, max, placeholder, step: 1, inputMode: 'numeric' }}
                shown={String(choice[name] ?? '')}
                onEnter={(_, input) => enter(field, input)}
              />
            )}
          </Field>
        );
      })}
    </div>
  );
}
