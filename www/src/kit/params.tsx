import { signal, useSignal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import type { ParamSpec, ParamValues } from '../engine/protocol';
import { text } from '../texts';
import { figure } from './format';
import { sliderFor } from './slider';
import { Field, NumberInput } from './ui/field';
import { Select } from './ui/parts';

/** Value of the extra option in the list of a parameter that accepts a number as well as its named choices. */
const NUMBER = 'number';
/** Significant digits of a chosen value: more would not fit into its field. */
const CHOSEN_DIGITS = 3;
/** Value of a numeric parameter that the method chooses. */
const AUTO = 'auto';

/** The parameters of a method, as their controls show them. */
export class Params {
  /** Empty until they are known. */
  readonly specs = signal<readonly ParamSpec[]>([]);
  readonly values = signal<ParamValues>({});
  /** The values that the method chose for automatic parameters; those that are missing are not known yet. */
  readonly chosen = signal<Record<string, number>>({});
  /** Parameters that have no effect at present, whose controls are hidden. */
  readonly hidden = signal<Record<string, boolean>>({});
  /** Why a value was rejected. */
  readonly refusal = signal<{ name: string; message: string } | undefined>(undefined);

  /** Shows the values in force, and that none was rejected. */
  show(values: ParamValues): void {
    this.refusal.value = undefined;
    this.values.value = { ...this.values.peek(), ...values };
  }

  hide(names: Record<string, boolean>): void {
    this.hidden.value = { ...this.hidden.peek(), ...names };
  }

  /** Shows, beside the control of the parameter `name`, why its value was rejected. */
  refuse(name: string, message: string): void {
    this.refusal.value = { name, message };
  }

  /** Returns a parameter's label on the page, in lower case, for use in messages; its name if it is unknown. */
  labelOf(name: string): string {
    return (
      this.specs
        .peek()
        .find((spec) => spec.name === name)
        ?.label.toLowerCase() ?? name
    );
  }
}

interface ControlsProps {
  params: Params;
  /** Names of parameters that have controls elsewhere on the page. */
  skip: readonly string[];
  onChange: (name: string, value: unknown) => void;
}

/** Controls for a method's parameters, generated from their specifications. */
export function ParamControls({ params, skip, onChange }: ControlsProps) {
  const [values, chosen, hidden, refusal] = [
    params.values.value,
    params.chosen.value,
    params.hidden.value,
    params.refusal.value,
  ];
  const shown = params.specs.value.filter(({ name }) => !skip.includes(name));
  return (
    <div class="params">
      {shown.map((spec) => (
        <ParamControl
          key={spec.name}
          {...{ spec, value: values[spec.name], chosen: chosen[spec.name], isHidden: hidden[spec.name] === true }}
          refusal={refusal?.name === spec.name ? refusal : undefined}
          onChange={(value) => onChange(spec.name, value)}
        />
      ))}
    </div>
  );
}

interface ControlProps {
  spec: ParamSpec;
  value: unknown;
  /** The value that the method chose. */
  chosen: number | undefined;
  isHidden: boolean;
  refusal: { message: string } | undefined;
  onChange: (value: unknown) => void;
}

function ParamControl(props: ControlProps) {
  if (props.spec.type === 'boolean') return <SwitchParam {...props} />;
  return props.spec.type === 'choice' ? <ChoiceParam {...props} /> : <NumberParam {...props} />;
}

/** What all fields of parameters have. */
const fieldOf = ({ spec: { label, symbol, help, name }, isHidden, refusal }: ControlProps) => ({
  ...{ label, symbol, help, hidden: isHidden, 'data-param': name, error: refusal?.message },
});

function SwitchParam(props: ControlProps) {
  const { value, onChange } = props;
  return (
    <Field {...fieldOf(props)} unit={props.spec.unit}>
      {(tied) => (
        <input
          {...tied}
          type="checkbox"
          checked={value === true}
          onChange={({ currentTarget }) => onChange(currentTarget.checked)}
        />
      )}
    </Field>
  );
}

/** A list of choices; with a numeric option for a parameter that accepts a number, too, whose field is shown while it is selected. */
function ChoiceParam(props: ControlProps) {
  const { spec, value, onChange } = props;
  const { label, choices = [], min, max, unit } = spec;
  const takesNumber = min !== undefined;
  const isWanted = useSignal(false);
  const isNumber = typeof value === 'number' || isWanted.value;
  const own = useRef<HTMLSpanElement>(null);
  useLayoutEffect(() => {
    if (isWanted.value) own.current?.querySelector('input')?.focus();
  }, [isWanted.value]);
  const choose = (chosen: string) => {
    isWanted.value = chosen === NUMBER;
    if (chosen !== NUMBER) onChange(chosen);
  };
  const named = Object.fromEntries(choices.map((name) => [name, name]));
  const row = takesNumber && (
    <span class="value own" hidden={!isNumber} ref={own}>
      <NumberInput
        {...{ min, max, 'aria-label': [label, unit].filter(Boolean).join(', ') }}
        shown={typeof value === 'number' ? typed(value) : ''}
        onEnter={onChange}
      />
      {unit && <span class="unit">{unit}</span>}
    </span>
  );
  return (
    <Field {...fieldOf(props)} below={row}>
      {(tied) => (
        <Select
          {...tied}
          choices={takesNumber ? { ...named, [NUMBER]: text('controls.customValue') } : named}
          value={isNumber ? NUMBER : String(value ?? '')}
          onChoose={choose}
        />
      )}
    </Field>
  );
}

/**
 * A number field with a slider, if the range of the parameter is bounded. For a parameter that may be automatic, with a
 * checkbox: checked, the field shows the value that the method chose, and a number that is entered replaces it.
 */
function NumberParam(props: ControlProps) {
  const { spec, value, chosen, onChange } = props;
  const isAuto = value === AUTO;
  const shown = isAuto ? chosen && Number(chosen.toPrecision(CHOSEN_DIGITS)) : value;
  const below = (
    <>
      {spec.choices?.includes(AUTO) && (
        <label class="check automatic">
          <input
            type="checkbox"
            aria-label={text('controls.automaticOf', { label: spec.label })}
            checked={isAuto}
            // Before there is a value to start from, there is none to switch to.
            disabled={isAuto && chosen === undefined}
            onChange={({ currentTarget }) => onChange(currentTarget.checked ? AUTO : chosen)}
          />
          {text('controls.automatic')}
        </label>
      )}
      <Slider spec={spec} value={shown} onChange={onChange} />
    </>
  );
  // Empty or invalid input is passed on as NaN, so that the library itself reports what is accepted.
  return (
    <Field {...fieldOf(props)} unit={spec.unit} below={below}>
      {(tied) => (
        <NumberInput
          {...{ ...tied, min: spec.min, max: spec.max, onEnter: onChange }}
          shown={typeof shown === 'number' ? typed(shown) : String(shown ?? '')}
        />
      )}
    </Field>
  );
}

/** The slider of a parameter with a bounded range. The number field beside it carries the label, and follows it at once. */
function Slider({ spec, value, onChange }: Pick<ControlProps, 'spec' | 'value' | 'onChange'>) {
  const slider = sliderFor(spec);
  if (!slider) return null;
  const number = typeof value === 'number' ? value : undefined;
  return (
    <input
      type="range"
      aria-label={text('controls.sliderOf', { label: spec.label })}
      {...slider.range}
      {...(number !== undefined && { value: slider.position(number) })}
      // The position is not the value on a nonlinear scale, so the value is announced instead.
      aria-valuetext={number === undefined ? undefined : figure(number)}
      onInput={({ currentTarget }) => {
        const chosen = slider.value(currentTarget.valueAsNumber);
        const field = currentTarget.closest('.param')?.querySelector<HTMLInputElement>('input[type=number]');
        if (field) field.value = typed(chosen);
        onChange(chosen);
      }}
    />
  );
}

/** Formats a number the way it is usually typed: 1e-6 rather than 0.000001. */
function typed(value: number): string {
  const short = Number(value.toPrecision(6));
  return short !== 0 && Math.abs(short) < 1e-4 ? short.toExponential() : String(short);
}
