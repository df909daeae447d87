import type { ComponentChildren, InputHTMLAttributes, JSX } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { useId } from './id';
import { showIn } from './typing';

/**
 * A symbol of a formula; a Latin letter after a Greek one is its subscript, and so is the part after an underscore.
 */
export function FormulaSymbol({ children }: { children: string }) {
  const [, base = children, index] = /^([α-ω])([A-Za-z])$/.exec(children) ?? /^(\w)_(\w+)$/.exec(children) ?? [];
  return (
    <span class="symbol">
      {base}
      {index && <sub>{index}</sub>}
    </span>
  );
}

/** Attributes that tie a control to its label, its help and its error message. */
export interface Tied {
  id: string;
  'aria-describedby': string;
  'aria-invalid': 'true' | undefined;
}

interface FieldProps {
  label: string;
  /** The paper's symbol of the quantity. */
  symbol?: string | undefined;
  unit?: string | undefined;
  /** A sentence below the control. */
  help?: string | undefined;
  /** Why a value was rejected; empty if none was. */
  error?: string | undefined;
  /** Whether label and control are a row of options, and not a parameter, separated from others by lines. */
  isRow?: boolean;
  hidden?: boolean;
  title?: string;
  class?: string;
  /** Elements below the control, such as a slider. */
  below?: ComponentChildren;
  /** Elements below the help and the error message. */
  after?: ComponentChildren;
  children: (tied: Tied) => JSX.Element;
  [data: `data-${string}`]: string | undefined;
}

/** A form control with its label, symbol, unit, help and error message. */
export function Field({
  label,
  symbol,
  unit,
  help,
  error = '',
  isRow = false,
  below,
  after,
  children,
  ...rest
}: FieldProps) {
  const id = useId();
  const described = [help !== undefined && `${id}-help`, `${id}-error`].filter(Boolean).join(' ');
  const labelled = (
    <label for={id}>
      {label}
      {symbol && ' '}
      {symbol && <FormulaSymbol>{symbol}</FormulaSymbol>}
    </label>
  );
  const control = (
    <span class="value">
      {children({ id, 'aria-describedby': described, 'aria-invalid': error ? 'true' : undefined })}
      {unit && <span class="unit">{unit}</span>}
    </span>
  );
  return (
    <div class={isRow ? undefined : 'param'} {...rest}>
      {isRow ? (
        <div class="row">
          {labelled}
          {control}
        </div>
      ) : (
        [labelled, control]
      )}
      {below}
      {help !== undefined && (
        <p class="help" id={`${id}-help`}>
          {help}
        </p>
      )}
      <p class="field-error" id={`${id}-error`} role="alert">
        {error}
      </p>
      {after}
    </div>
  );
}

type NumberProps = Omit<InputHTMLAttributes<HTMLInputElement>, 'type' | 'value' | 'onChange' | 'role'> & {
  /** What is shown, unless the user is typing. */
  shown: string;
  /** Called with what was entered; NaN if it is no number. */
  onEnter: (value: number, input: HTMLInputElement) => void;
};

/** A field for a number, which shows its value again when it is left without a change. */
export function NumberInput({ shown, onEnter, ...props }: NumberProps) {
  const input = useRef<HTMLInputElement>(null);
  // Also after a render with the same value: what was entered may have been refused.
  useLayoutEffect(() => {
    if (input.current) showIn(input.current, shown);
  });
  return (
    <input
      step="any"
      inputMode="decimal"
      {...props}
      type="number"
      ref={input}
      onChange={({ currentTarget }) => onEnter(currentTarget.valueAsNumber, currentTarget)}
    />
  );
}

interface CheckProps {
  label: string;
  on: boolean;
  set: (on: boolean) => void;
  disabled?: boolean;
  title?: string;
  [data: `data-${string}`]: string | undefined;
}

/** A checkbox with its label behind it. */
export function Check({ label, on, set, title, ...props }: CheckProps) {
  return (
    <label class="check" title={title}>
      <input {...props} type="checkbox" checked={on} onChange={({ currentTarget }) => set(currentTarget.checked)} />
      {label}
    </label>
  );
}
