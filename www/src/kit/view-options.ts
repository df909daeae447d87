import { text } from '../texts';
import { h } from './dom';
import { type FormControl, placed, selectFrom } from './field';
import { initialOptions, type OptionsOf, type ViewDeclaration, type ViewOption } from './view';

/** Controls over a 3D view for its options: a switch, a selection list or a slider each. */
export class OptionControls<Declared extends ViewDeclaration> {
  readonly element: HTMLElement;
  readonly #declared: Declared;
  readonly #controls = new Map<keyof Declared, FormControl>();
  readonly #value: OptionsOf<Declared>;
  readonly #onChange: (options: OptionsOf<Declared>) => void;

  constructor(declared: Declared, onChange: (options: OptionsOf<Declared>) => void) {
    this.#declared = declared;
    this.#value = initialOptions(declared);
    this.#onChange = onChange;
    const attributes = { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') };
    const controls = Object.entries(declared).map(([name, option]) => this.#build(name, option));
    this.element = h('div', attributes, ...controls);
    this.#show();
  }

  get value(): OptionsOf<Declared> {
    return this.#value;
  }

  /** Changes options and reports all of them to the lab; an unknown value is replaced by the initial one. */
  set(changed: Partial<OptionsOf<Declared>>): void {
    Object.assign(this.#value, changed);
    const initial = initialOptions(this.#declared);
    for (const name of Object.keys(this.#declared) as (keyof Declared & string)[]) {
      const option = this.#declared[name];
      if (option && !isPossible(option, this.#value[name])) this.#value[name] = initial[name];
    }
    this.#show();
    this.#onChange({ ...this.#value });
  }

  /** Places an element before the control of an option. */
  place(element: HTMLElement, before: keyof Declared): void {
    this.#controls.get(before)?.parentElement?.before(element);
  }

  /** Hides the control of an option, or shows it. */
  hide(name: keyof Declared, isHidden: boolean): void {
    const element = this.#controls.get(name)?.parentElement;
    if (element) element.hidden = isHidden;
  }

  /** Hides an entry of an option's selection list, or shows it. */
  hideEntry(name: keyof Declared, value: string, isHidden: boolean): void {
    const entry = this.#entry(name, value);
    if (entry) entry.hidden = isHidden;
  }

  /** Disables an entry of an option's selection list, or enables it. */
  disableEntry(name: keyof Declared, value: string, isDisabled: boolean): void {
    const entry = this.#entry(name, value);
    if (entry) entry.disabled = isDisabled;
  }

  #entry(name: keyof Declared, value: string): HTMLOptionElement | null | undefined {
    return this.#controls.get(name)?.querySelector<HTMLOptionElement>(`[value="${value}"]`);
  }

  #build(name: string, option: ViewOption): HTMLElement {
    const control = controlOf(option);
    control.dataset.view = name;
    this.#controls.set(name, control);
    const change = () => this.set({ [name]: read(control) } as Partial<OptionsOf<Declared>>);
    control.addEventListener('step' in option ? 'input' : 'change', change);
    const label = text(option.label);
    return control.type === 'checkbox' ? h('label', {}, control, label) : placed(label, control);
  }

  #show(): void {
    for (const [name, control] of this.#controls) {
      const value: unknown = this.#value[name];
      if (typeof value === 'boolean') (control as HTMLInputElement).checked = value;
      else control.value = String(value);
    }
  }
}

function controlOf(option: ViewOption): FormControl {
  if ('entries' in option)
    return selectFrom(Object.entries(option.entries).map(([value, label]) => ({ value, label: text(label) })));
  return h('input', 'step' in option ? { type: 'range', min: 0, max: 1, step: option.step } : { type: 'checkbox' });
}

function read(control: FormControl): unknown {
  if (control.type === 'checkbox') return (control as HTMLInputElement).checked;
  return control.type === 'range' ? Number(control.value) : control.value;
}

function isPossible(option: ViewOption, value: unknown): boolean {
  if ('entries' in option) return typeof value === 'string' && Object.hasOwn(option.entries, value);
  if ('step' in option) return typeof value === 'number' && value >= 0 && value <= 1;
  return typeof value === 'boolean';
}
