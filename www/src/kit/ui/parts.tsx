/** Small parts that the views of all labs consist of. */
import type { ReadonlySignal } from '@preact/signals';
import type { ButtonHTMLAttributes, ComponentChildren } from 'preact';
import { text } from '../../texts';

/** An icon from an SVG path on a 24 by 24 grid; decorative only, hidden from screen readers. */
export function Icon({ path }: { path: string }) {
  return (
    <svg viewBox="0 0 24 24" class="icon" aria-hidden="true">
      <path d={path} />
    </svg>
  );
}

/** A section with a heading, for a column of a lab's page. */
export function Section({ title, children }: { title: string; children: ComponentChildren }) {
  return (
    <section class="panel">
      <h2>{title}</h2>
      {children}
    </section>
  );
}

interface FoldedProps {
  title: string;
  isOpen?: boolean | ReadonlySignal<boolean>;
  onToggle?: (isOpen: boolean) => void;
  children: ComponentChildren;
}

/** A section of a column that is collapsed until the user opens it. */
export function Folded({ title, isOpen = false, onToggle, children }: FoldedProps) {
  return (
    <details
      class="panel"
      open={typeof isOpen === 'boolean' ? isOpen : isOpen.value}
      onToggle={({ currentTarget }) => onToggle?.(currentTarget.open)}
    >
      <summary>
        <h2>{title}</h2>
      </summary>
      {children}
    </details>
  );
}

/** A sentence of help. */
export function Help({ children }: { children: ComponentChildren }) {
  return <p class="help">{children}</p>;
}

interface ScrollingProps {
  label: string;
  /** Whether it also scrolls vertically. */
  isTall?: boolean;
  children: ComponentChildren;
}

/** A part that scrolls, also by keyboard, such as a wide table. */
export function Scrolling({ label, isTall = false, children }: ScrollingProps) {
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: else it could not be scrolled by keyboard.
    <section class={isTall ? 'scroll tall' : 'scroll'} tabIndex={0} aria-label={label}>
      {children}
    </section>
  );
}

/** Why something that was entered is refused; empty if nothing is. */
export function Refusal({ children }: { children: ComponentChildren }) {
  return (
    <p class="field-error" role="alert">
      {children}
    </p>
  );
}

type ButtonProps = Omit<ButtonHTMLAttributes<HTMLButtonElement>, 'type' | 'icon'>;

export function Button(props: ButtonProps) {
  return <button type="button" {...props} />;
}

/** A button with an icon alone; `label` says what it does. */
export function IconButton({ path, label, ...props }: ButtonProps & { path: string; label: string }) {
  return (
    <Button class="icon-only" title={label} aria-label={label} {...props}>
      <Icon path={path} />
    </Button>
  );
}

const UNDO = 'M8 5 2.5 10 8 15v-3.5h6a3.5 3.5 0 0 1 0 7H8V21h6a6 6 0 0 0 0-12H8z';
const REDO = 'm16 5 5.5 5-5.5 5v-3.5h-6a3.5 3.5 0 0 0 0 7h6V21h-6a6 6 0 0 1 0-12h6z';

/** The names of the changes that undo and redo would affect; undefined if there is none. */
export interface Undoable {
  undoable?: string | undefined;
  redoable?: string | undefined;
}

interface TravelProps {
  direction: 'undo' | 'redo';
  undo: Undoable;
  /** Whether the button has a word beside its icon. */
  hasWord?: boolean;
  onClick: () => void;
}

/** The button for undo or redo, whose title names the change that it affects. */
export function Travel({ direction, undo: { undoable, redoable }, hasWord = false, onClick }: TravelProps) {
  const verb = text(direction === 'undo' ? 'controls.undo' : 'controls.redo');
  const action = direction === 'undo' ? undoable : redoable;
  const title =
    action === undefined ? text('controls.nothingTo', { verb }) : text('controls.doAction', { verb, action });
  return (
    <Button {...{ 'data-transport': direction, 'aria-label': title, title, disabled: action === undefined, onClick }}>
      <Icon path={direction === 'undo' ? UNDO : REDO} />
      {hasWord && <span class="word">{verb}</span>}
    </Button>
  );
}

interface SelectProps<Value extends string> {
  choices: Readonly<Record<Value, string>>;
  value: Value;
  onChoose: (value: Value) => void;
  /** Values whose entries are hidden. */
  hidden?: readonly string[];
  /** Values whose entries are disabled. */
  disabledChoices?: readonly string[];
  id?: string;
  disabled?: boolean;
  'aria-label'?: string;
  'aria-describedby'?: string;
  'aria-invalid'?: 'true' | undefined;
  [data: `data-${string}`]: string | undefined;
}

/** A selection list of labelled values. */
export function Select<Value extends string>(given: SelectProps<Value>) {
  const { choices, value, onChoose, hidden = [], disabledChoices = [], ...props } = given;
  const entries = Object.entries(choices) as [Value, string][];
  return (
    <select {...props} value={value} onChange={({ currentTarget }) => onChoose(currentTarget.value as Value)}>
      {entries.map(([one, label]) => (
        <option
          key={one}
          value={one}
          hidden={hidden.includes(one)}
          disabled={disabledChoices.includes(one)}
          // Else it would lack the attribute where its label is the same.
          ref={(option) => option?.setAttribute('value', one)}
        >
          {label}
        </option>
      ))}
    </select>
  );
}
