import type { ParamSpec, ParamValues } from '../engine/protocol';
import { text } from '../texts';
import { h } from './dom';
import { Field, type FormControl, selectFrom, showIn } from './field';
import { figure } from './format';

/**
 * Number of steps of a slider with a nonlinear scale, or with a linear one for a real number whose specification gives
 * no step.
 */
const LOG_STEPS = 200;
/** Upper bound of a parameter's range from which it counts as unbounded, so that there is no slider. */
const ENDLESS = 1e9;
/**
 * Fraction of a range's upper bound: if a real parameter's range begins at 0 and its default is below this fraction,
 * the slider is scaled by a power law with the exponent {@link SMALL_POWER}, so that most of it is for small values.
 */
const SMALL_SHARE = 0.01;
/** Exponent of the power law that scales the slider of a parameter whose usual values are small. */
const SMALL_POWER = 4;
/** Value of the extra option in the list of a parameter that accepts a number as well as its named choices. */
const NUMBER = 'number';

/** Significant digits of a chosen value: more would not fit into its field. */
const CHOSEN_DIGITS = 3;
/** Value of a numeric parameter that the method chooses. */
const AUTO = 'auto';

interface Control {
  field: Field<FormControl>;
  show(value: unknown): void;
  /** Shows the value that the method chose, while the parameter is automatic. */
  showChosen?: ((value: number | undefined) => void) | undefined;
}

/** Controls for a method's parameters, generated from their specifications. */
export class ParamControls {
  readonly element: HTMLElement;
  readonly #controls = new Map<string, Control>();
  readonly #specs: ParamSpec[];

  /** `skip` are the names of parameters that have controls elsewhere on the page. */
  constructor(specs: ParamSpec[], skip: string[], onChange: (name: string, value: unknown) => void) {
    this.#specs = specs;
    for (const spec of specs) {
      if (!skip.includes(spec.name))
        this.#controls.set(
          spec.name,
          controlFor(spec, (value) => onChange(spec.name, value)),
        );
    }
    this.element = h('div', { class: 'params' }, ...[...this.#controls.values()].map(({ field }) => field.element));
  }

  /**
   * Returns a parameter's label on the page, in lower case, for use in messages; undefined for an unknown parameter.
   */
  labelOf(name: string): string | undefined {
    return this.#specs.find((spec) => spec.name === name)?.label.toLowerCase();
  }

  /** Shows the current values of the parameters and clears error messages. */
  show(values: ParamValues): void {
    for (const [name, control] of this.#controls) {
      if (name in values) control.show(values[name]);
      control.field.showError(undefined);
    }
  }

  /** Shows the values that the method chose for automatic parameters; those that are missing are not known yet. */
  showChosen(values: Record<string, number>): void {
    for (const [name, control] of this.#controls) control.showChosen?.(values[name]);
  }

  /** Hides or shows controls by parameter name; used to hide parameters that currently have no effect. */
  hide(names: Record<string, boolean>): void {
    for (const [name, hidden] of Object.entries(names)) {
      const control = this.#controls.get(name);
      if (control) control.field.element.hidden = hidden;
    }
  }

  /** Shows, beside the control of the parameter `name`, why its value was rejected. */
  showError(name: string, message: string): void {
    this.#controls.get(name)?.field.showError(message);
  }
}

function controlFor(spec: ParamSpec, onChange: (value: unknown) => void): Control {
  const { main, extra, show, showChosen } = inputFor(spec, onChange);
  const { label, symbol, help, name } = spec;
  const unit = spec.type === 'choice' ? undefined : spec.unit;
  return {
    field: new Field(main, { label, symbol, help, unit, extra, attributes: { 'data-param': name } }),
    show,
    showChosen,
  };
}

interface Input {
  main: FormControl;
  extra: HTMLElement[];
  show(value: unknown): void;
  showChosen?: ((value: number | undefined) => void) | undefined;
}

function inputFor(spec: ParamSpec, onChange: (value: unknown) => void): Input {
  switch (spec.type) {
    case 'boolean':
      return checkbox(onChange);
    case 'choice':
      return choice(spec, onChange);
    default:
      return spec.choices?.includes(AUTO) ? automatic(spec, onChange) : numberInput(spec, onChange);
  }
}

function checkbox(onChange: (value: unknown) => void): Input {
  const main = h('input', { type: 'checkbox' });
  main.addEventListener('change', () => onChange(main.checked));
  const show = (value: unknown) => {
    main.checked = value === true;
  };
  return { main, extra: [], show };
}

function choice(spec: ParamSpec, onChange: (value: unknown) => void): Input {
  const main = selectFrom((spec.choices ?? []).map((name) => ({ value: name, label: name })));
  main.addEventListener('change', () => {
    if (main.value !== NUMBER) onChange(main.value);
  });
  const show = (value: unknown) => {
    main.value = String(value);
  };
  return spec.min === undefined ? { main, extra: [], show } : withNumber({ main, extra: [], show }, spec, onChange);
}

/**
 * Adds a numeric option to a list of choices, for a parameter that accepts a number, too, with a number field that is
 * shown while this option is selected.
 */
function withNumber({ main, show }: Input, spec: ParamSpec, onChange: (value: unknown) => void): Input {
  const { label, min, max, unit } = spec;
  const name = [label, unit].filter(Boolean).join(', ');
  const field = h('input', { type: 'number', min, max, step: 'any', inputmode: 'decimal', 'aria-label': name });
  const row = h(
    'span',
    { class: 'value own', hidden: true },
    field,
    ...(unit ? [h('span', { class: 'unit' }, unit)] : []),
  );
  main.append(h('option', { value: NUMBER }, text('controls.customValue')));
  main.addEventListener('change', () => {
    row.hidden = main.value !== NUMBER;
    if (!row.hidden) field.focus();
  });
  field.addEventListener('change', () => onChange(field.valueAsNumber));
  const showEither = (value: unknown) => {
    const given = typeof value === 'number';
    show(given ? NUMBER : value);
    row.hidden = !given;
    showIn(field, given ? typed(value) : '');
  };
  return { main, extra: [row], show: showEither };
}

/**
 * Creates a number field for a parameter that may be automatic, with a checkbox: checked, the field shows the value that the
 * method chose, and a number that is entered replaces it.
 */
function automatic(spec: ParamSpec, onChange: (value: unknown) => void): Input {
  const { main, extra, show } = numberInput(spec, onChange);
  const tick = h('input', { type: 'checkbox', 'aria-label': text('controls.automaticOf', { label: spec.label }) });
  let chosen: number | undefined;
  const update = (isAuto: boolean) => {
    tick.checked = isAuto;
    // Before there is a value to start from, there is none to switch to.
    tick.disabled = isAuto && chosen === undefined;
    if (isAuto) show(chosen === undefined ? '' : Number(chosen.toPrecision(CHOSEN_DIGITS)));
  };
  tick.addEventListener('change', () => onChange(tick.checked ? AUTO : chosen));
  const row = h('label', { class: 'check automatic' }, tick, text('controls.automatic'));
  return {
    main,
    extra: [row, ...extra],
    show: (value) => {
      if (value !== AUTO) show(value);
      update(value === AUTO);
    },
    showChosen: (value) => {
      chosen = value;
      update(tick.checked);
    },
  };
}

/** Creates a number field for a parameter, with a slider beside it if the parameter's range is bounded. */
function numberInput(spec: ParamSpec, onChange: (value: unknown) => void): Input {
  const { min, max } = spec;
  const main = h('input', { type: 'number', min, max, step: 'any', inputmode: 'decimal' });
  const slider = min !== undefined && max !== undefined && max < ENDLESS ? new Slider(spec, min, max) : undefined;
  const show = (value: unknown) => {
    showIn(main, typeof value === 'number' ? typed(value) : String(value));
    if (typeof value === 'number') slider?.show(value);
  };
  // Empty or invalid input is passed on as NaN, so that the library itself reports what is accepted.
  main.addEventListener('change', () => onChange(main.valueAsNumber));
  slider?.element.addEventListener('input', () => {
    main.value = typed(slider.value);
    onChange(slider.value);
  });
  return { main, extra: slider ? [slider.element] : [], show };
}

/** Formats a number the way it is usually typed: 1e-6 rather than 0.000001. */
function typed(value: number): string {
  const short = Number(value.toPrecision(6));
  return short !== 0 && Math.abs(short) < 1e-4 ? short.toExponential() : String(short);
}

/**
 * A parameter's slider with a linear or logarithmic scale, or one that favours small values. The number field beside it
 * carries the label.
 */
class Slider {
  readonly element: HTMLInputElement;
  readonly #scale: 'linear' | 'log' | 'small';
  readonly #min: number;
  readonly #max: number;

  constructor(spec: ParamSpec, min: number, max: number) {
    this.#scale = scaleOf(spec, min, max);
    this.#min = min;
    this.#max = max;
    const step = spec.step ?? (spec.type === 'integer' ? 1 : (max - min) / LOG_STEPS);
    const range = this.#scale === 'linear' ? { min, max, step } : { min: 0, max: LOG_STEPS, step: 1 };
    this.element = h('input', {
      type: 'range',
      'aria-label': text('controls.sliderOf', { label: spec.label }),
      ...range,
    });
  }

  get value(): number {
    const position = this.element.valueAsNumber;
    const part = position / LOG_STEPS;
    if (this.#scale === 'linear') return rounded(position);
    if (this.#scale === 'small') return rounded(this.#max * part ** SMALL_POWER);
    return rounded(this.#min * (this.#max / this.#min) ** part);
  }

  show(value: number): void {
    this.element.value = String(this.#position(value));
    // The position is not the value on a nonlinear scale, so the value is announced instead.
    this.element.setAttribute('aria-valuetext', figure(value));
  }

  #position(value: number): number {
    if (this.#scale === 'linear') return value;
    if (this.#scale === 'small') return LOG_STEPS * Math.max(0, value / this.#max) ** (1 / SMALL_POWER);
    return (LOG_STEPS * Math.log(value / this.#min)) / Math.log(this.#max / this.#min);
  }
}

const rounded = (value: number) => Number(value.toPrecision(4));

function scaleOf(spec: ParamSpec, min: number, max: number): 'linear' | 'log' | 'small' {
  if (spec.scale === 'log' && min > 0) return 'log';
  const { default: usual } = spec;
  const isSmall = typeof usual === 'number' ? usual > 0 && usual < SMALL_SHARE * max : usual === AUTO;
  const small = min === 0 && isSmall;
  return small && spec.type === 'number' ? 'small' : 'linear';
}
