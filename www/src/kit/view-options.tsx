import { signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { text } from '../texts';
import { useId } from './ui/id';
import { Select } from './ui/parts';
import { initialOptions, type OptionsOf, type ViewDeclaration, type ViewOption } from './view';

/** What is not offered at present. */
interface Withheld {
  /** Names of options whose controls are hidden. */
  hidden: readonly string[];
  /** Entries of selection lists that are hidden, as `name=value`. */
  hiddenEntries: readonly string[];
  /** Entries of selection lists that are disabled. */
  disabledEntries: readonly string[];
}

/** The options of a view in force, which a lab declares. */
export class ViewOptions<Declared extends ViewDeclaration> {
  readonly declared: Declared;
  readonly options;
  readonly withheld = signal<Withheld>({ hidden: [], hiddenEntries: [], disabledEntries: [] });
  readonly #onChange: (options: OptionsOf<Declared>) => void;

  constructor(declared: Declared, onChange: (options: OptionsOf<Declared>) => void) {
    this.declared = declared;
    this.options = signal(initialOptions(declared));
    this.#onChange = onChange;
  }

  get value(): OptionsOf<Declared> {
    return this.options.peek();
  }

  /** Changes options and reports all of them to the lab; an unknown value is replaced by the initial one. */
  set(changed: Partial<OptionsOf<Declared>>): void {
    const [initial, options] = [initialOptions(this.declared), { ...this.value, ...changed }];
    for (const name of Object.keys(this.declared) as (keyof Declared & string)[]) {
      const option = this.declared[name];
      if (option && !isPossible(option, options[name])) options[name] = initial[name];
    }
    this.options.value = options;
    this.#onChange(options);
  }

  /** Withholds what is given. */
  withhold(withheld: Partial<Withheld>): void {
    this.withheld.value = { ...this.withheld.peek(), ...withheld };
  }
}

interface ControlsProps<Declared extends ViewDeclaration> {
  of: ViewOptions<Declared>;
  /** Elements before the control of an option, by its name. */
  before?: Partial<Record<keyof Declared, ComponentChildren>>;
}

/** Controls over a 3D view for its options: a switch, a selection list or a slider each. */
export function OptionControls<Declared extends ViewDeclaration>({ of, before = {} }: ControlsProps<Declared>) {
  const { hidden } = of.withheld.value;
  const values: Record<string, unknown> = of.options.value;
  const preceding: Record<string, ComponentChildren> = before;
  return (
    <fieldset class="view-options" aria-label={text('controls.viewOptions')}>
      {Object.entries(of.declared).map(([name, option]) => [
        preceding[name],
        <OptionControl
          key={name}
          {...{ name, option, value: values[name], isHidden: hidden.includes(name), withheld: of.withheld.value }}
          set={(value) => of.set({ [name]: value } as Partial<OptionsOf<Declared>>)}
        />,
      ])}
    </fieldset>
  );
}

interface ControlProps {
  name: string;
  option: ViewOption;
  value: unknown;
  isHidden: boolean;
  withheld: Withheld;
  set: (value: unknown) => void;
}

function OptionControl({ name, option, value, isHidden, withheld, set }: ControlProps) {
  const id = useId();
  const label = text(option.label);
  if (!('entries' in option) && !('step' in option))
    return (
      <label hidden={isHidden}>
        <input
          type="checkbox"
          data-view={name}
          checked={value === true}
          onChange={({ currentTarget }) => set(currentTarget.checked)}
        />
        {label}
      </label>
    );
  return (
    <span class="placement" hidden={isHidden}>
      <label for={id}>{label}</label>
      {'entries' in option ? (
        <Select
          {...{ id, 'data-view': name, value: String(value), onChoose: set }}
          choices={Object.fromEntries(Object.entries(option.entries).map(([one, key]) => [one, text(key)]))}
          hidden={namesOf(name, withheld.hiddenEntries)}
          disabledChoices={namesOf(name, withheld.disabledEntries)}
        />
      ) : (
        <input
          {...{ type: 'range', id, min: 0, max: 1, step: option.step, value: Number(value), 'data-view': name }}
          onInput={({ currentTarget }) => set(Number(currentTarget.value))}
        />
      )}
    </span>
  );
}

/** Returns the values of the entries of an option, given as `name=value`. */
const namesOf = (name: string, entries: readonly string[]): string[] =>
  entries.filter((entry) => entry.startsWith(`${name}=`)).map((entry) => entry.slice(name.length + 1));

function isPossible(option: ViewOption, value: unknown): boolean {
  if ('entries' in option) return typeof value === 'string' && Object.hasOwn(option.entries, value);
  if ('step' in option) return typeof value === 'number' && value >= 0 && value <= 1;
  return typeof value === 'boolean';
}
