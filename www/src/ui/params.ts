import type { ParamSpec, ParamValues } from '../protocol';
import { h, symbol, uniqueId } from './dom';
import { figure } from './format';

/** Slider positions of a parameter with a logarithmic scale. */
const LOG_STEPS = 200;
/** A range up to here or beyond is none that a slider could show. */
const ENDLESS = 1e9;
/** Where the usual value is below this share of the range, most of the slider is for small values: the power says how much. */
const SMALL_SHARE = 0.01;
const SMALL_POWER = 4;
/** What is chosen in the list of a parameter that takes a number as well as its named choices. */
const NUMBER = 'number';

interface Control {
  element: HTMLElement;
  show(value: unknown): void;
  complain(message: string | undefined): void;
}

/** Controls for all parameters, generated from their specifications. */
export class ParamControls {
  readonly element: HTMLElement;
  readonly #controls = new Map<string, Control>();
  readonly #specs: ParamSpec[];

  /** `skip` are parameters that are set elsewhere. */
  constructor(specs: ParamSpec[], skip: string[], onChange: (name: string, value: unknown) => void) {
    this.#specs = specs;
    for (const spec of specs) {
      if (!skip.includes(spec.name))
        this.#controls.set(
          spec.name,
          controlFor(spec, (value) => onChange(spec.name, value)),
        );
    }
    this.element = h('div', { class: 'params' }, ...[...this.#controls.values()].map((control) => control.element));
  }

  /** What a parameter is called on the page. */
  labelOf(name: string): string | undefined {
    return this.#specs.find((spec) => spec.name === name)?.label.toLowerCase();
  }

  /** Shows the values in force, and takes complaints back. */
  show(values: ParamValues): void {
    for (const [name, control] of this.#controls) {
      if (name in values) control.show(values[name]);
      control.complain(undefined);
    }
  }

  /** Leaves out what has no meaning now. */
  hide(names: Record<string, boolean>): void {
    for (const [name, hidden] of Object.entries(names)) {
      const control = this.#controls.get(name);
      if (control) control.element.hidden = hidden;
    }
  }

  /** Says beside a control why its value was refused. */
  complain(name: string, message: string): void {
    this.#controls.get(name)?.complain(message);
  }
}

function controlFor(spec: ParamSpec, onChange: (value: unknown) => void): Control {
  const id = uniqueId(`param-${spec.name}`);
  const input = inputFor(spec, id, onChange);
  const error = h('p', { class: 'field-error', id: `${id}-error`, role: 'alert' });
  const help = h('p', { class: 'help', id: `${id}-help` }, spec.help);
  const label = h('label', { for: id }, spec.label, ' ', ...(spec.symbol ? [symbol(spec.symbol)] : []));
  const unit = spec.type === 'choice' ? [] : unitOf(spec);
  const value = h('span', { class: 'value' }, input.main, ...unit);
  const element = h('div', { class: 'param', 'data-param': spec.name }, label, value, ...input.extra, help, error);
  const complain = (message: string | undefined) => {
    error.textContent = message ?? '';
    input.main.toggleAttribute('aria-invalid', message !== undefined);
  };
  return { element, show: input.show, complain };
}

function unitOf({ unit }: ParamSpec): HTMLElement[] {
  return unit ? [h('span', { class: 'unit' }, unit)] : [];
}

interface Input {
  main: HTMLInputElement | HTMLSelectElement;
  extra: HTMLElement[];
  show(value: unknown): void;
}

function inputFor(spec: ParamSpec, id: string, onChange: (value: unknown) => void): Input {
  switch (spec.type) {
    case 'boolean':
      return checkbox(id, onChange);
    case 'choice':
      return choice(spec, id, onChange);
    default:
      return numberInput(spec, id, onChange);
  }
}

function describedBy(id: string): Record<string, string> {
  return { id, 'aria-describedby': `${id}-help ${id}-error` };
}

function checkbox(id: string, onChange: (value: unknown) => void): Input {
  const main = h('input', { type: 'checkbox', ...describedBy(id) });
  main.addEventListener('change', () => onChange(main.checked));
  const show = (value: unknown) => {
    main.checked = value === true;
  };
  return { main, extra: [], show };
}

function choice(spec: ParamSpec, id: string, onChange: (value: unknown) => void): Input {
  const options = (spec.choices ?? []).map((name) => h('option', { value: name }, name));
  const main = h('select', describedBy(id), ...options);
  main.addEventListener('change', () => {
    if (main.value !== NUMBER) onChange(main.value);
  });
  const show = (value: unknown) => {
    main.value = String(value);
  };
  return spec.min === undefined ? { main, extra: [], show } : withNumber({ main, extra: [], show }, spec, onChange);
}

/** Adds a number to a list of choices: one more choice, and a field that is there when it is chosen. */
function withNumber({ main, show }: Input, spec: ParamSpec, onChange: (value: unknown) => void): Input {
  const { label, min, max, unit } = spec;
  const name = [label, unit].filter(Boolean).join(', ');
  const field = h('input', { type: 'number', min, max, step: 'any', inputmode: 'decimal', 'aria-label': name });
  const row = h('span', { class: 'value own', hidden: true }, field, ...unitOf(spec));
  main.append(h('option', { value: NUMBER }, 'a number'));
  main.addEventListener('change', () => {
    row.hidden = main.value !== NUMBER;
    if (!row.hidden) field.focus();
  });
  field.addEventListener('change', () => onChange(field.valueAsNumber));
  const showEither = (value: unknown) => {
    const given = typeof value === 'number';
    show(given ? NUMBER : value);
    row.hidden = !given;
    field.value = given ? typed(value) : '';
  };
  return { main, extra: [row], show: showEither };
}

/** A number to type, and a slider beside it where the range is known. */
function numberInput(spec: ParamSpec, id: string, onChange: (value: unknown) => void): Input {
  const { min, max } = spec;
  const main = h('input', { type: 'number', ...describedBy(id), min, max, step: 'any', inputmode: 'decimal' });
  const slider = min !== undefined && max !== undefined && max < ENDLESS ? new Slider(spec, min, max) : undefined;
  const show = (value: unknown) => {
    main.value = typeof value === 'number' ? typed(value) : String(value);
    if (typeof value === 'number') slider?.show(value);
  };
  // Empty or unreadable goes on as NaN, so that the library itself says what is accepted.
  main.addEventListener('change', () => onChange(main.valueAsNumber));
  slider?.element.addEventListener('input', () => {
    main.value = typed(slider.value);
    onChange(slider.value);
  });
  return { main, extra: slider ? [slider.element] : [], show };
}

/** A number as one would type it: 1e-6 rather than 0.000001. */
function typed(value: number): string {
  const short = Number(value.toPrecision(6));
  return short !== 0 && Math.abs(short) < 1e-3 ? short.toExponential() : String(short);
}

/** A range input that can be logarithmic, or favour small values. The number input beside it carries the label. */
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
    this.element = h('input', { type: 'range', 'aria-label': `${spec.label}, slider`, ...range });
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
    // Where the position is no value it says nothing.
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
  const small = min === 0 && typeof usual === 'number' && usual > 0 && usual < SMALL_SHARE * max;
  return small && spec.type === 'number' ? 'small' : 'linear';
}
