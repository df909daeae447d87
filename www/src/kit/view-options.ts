import type { VertexQuantity } from '../engine/protocol';
import { text } from '../texts';
import { h } from './dom';
import { type Choice, type FormControl, placed, selectFrom } from './field';

/**
 * Placement of the slices in the 3D view: on the walls behind the surface, at their positions in the volume, or hidden.
 */
export type SlicePlacement = 'walls' | 'in place' | 'hidden';

/** Colouring of the Extract lab's surface: plain, by connected component, or by a quantity at the vertices. */
export type ColorMode = 'plain' | 'component' | VertexQuantity;

export interface ViewOptions {
  surface: boolean;
  edges: boolean;
  color: ColorMode;
  slices: SlicePlacement;
}

export const PLACEMENTS: Choice<SlicePlacement>[] = [
  { value: 'walls', label: text('controls.placementWalls') },
  { value: 'in place', label: text('controls.placementInPlace') },
  { value: 'hidden', label: text('controls.placementHidden') },
];

export const COLOR_MODES: Choice<ColorMode>[] = [
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'speed', label: text('controls.colorSpeed') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
  { value: 'gaussian curvature', label: text('controls.colorGaussianCurvature') },
];

/** An option of a view: a switch, with `choices` a selection list, or with `step` a number from 0 to 1. */
export interface ViewOption<Options> {
  name: keyof Options & string;
  label: string;
  choices?: readonly Choice[];
  step?: number;
}

/** Controls over a 3D view for its options, one for each entry of a list. */
export class OptionControls<Options extends object> {
  readonly element: HTMLElement;
  readonly #list: readonly ViewOption<Options>[];
  readonly #controls = new Map<keyof Options, FormControl>();
  readonly #initial: Options;
  readonly #value: Options;
  readonly #onChange: (options: Options) => void;

  constructor(list: readonly ViewOption<Options>[], initial: Options, onChange: (options: Options) => void) {
    this.#list = list;
    this.#initial = initial;
    this.#value = { ...initial };
    this.#onChange = onChange;
    const attributes = { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') };
    this.element = h('div', attributes, ...list.map((option) => this.#build(option)));
    this.#show();
  }

  get value(): Options {
    return this.#value;
  }

  /** Changes options and reports all of them to the lab; an unknown value is replaced by the initial one. */
  set(changed: Partial<Options>): void {
    Object.assign(this.#value, changed);
    for (const option of this.#list)
      if (!isPossible(option, this.#value[option.name])) this.#value[option.name] = this.#initial[option.name];
    this.#show();
    this.#onChange({ ...this.#value });
  }

  /** Places an element before the control of an option. */
  place(element: HTMLElement, before: keyof Options): void {
    this.#controls.get(before)?.parentElement?.before(element);
  }

  /** Hides the control of an option, or shows it. */
  hide(name: keyof Options, isHidden: boolean): void {
    const element = this.#controls.get(name)?.parentElement;
    if (element) element.hidden = isHidden;
  }

  /** Hides an entry of an option's selection list, or shows it. */
  hideEntry(name: keyof Options, value: string, isHidden: boolean): void {
    const entry = this.#entry(name, value);
    if (entry) entry.hidden = isHidden;
  }

  /** Disables an entry of an option's selection list, or enables it. */
  disableEntry(name: keyof Options, value: string, isDisabled: boolean): void {
    const entry = this.#entry(name, value);
    if (entry) entry.disabled = isDisabled;
  }

  #entry(name: keyof Options, value: string): HTMLOptionElement | null | undefined {
    return this.#controls.get(name)?.querySelector<HTMLOptionElement>(`[value="${value}"]`);
  }

  #build({ name, label, choices, step }: ViewOption<Options>): HTMLElement {
    const range = { type: 'range', min: 0, max: 1, step };
    const control = choices ? selectFrom(choices) : h('input', step ? range : { type: 'checkbox' });
    control.dataset.view = name;
    this.#controls.set(name, control);
    control.addEventListener(step ? 'input' : 'change', () => this.set({ [name]: read(control) } as Partial<Options>));
    if (!choices && !step) return h('label', {}, control, label);
    return placed(label, control);
  }

  #show(): void {
    for (const [name, control] of this.#controls) {
      const value = this.#value[name];
      if (typeof value === 'boolean') (control as HTMLInputElement).checked = value;
      else control.value = String(value);
    }
  }
}

function read(control: FormControl): unknown {
  if (control.type === 'checkbox') return (control as HTMLInputElement).checked;
  return control.type === 'range' ? Number(control.value) : control.value;
}

function isPossible<Options>({ choices, step }: ViewOption<Options>, value: unknown): boolean {
  if (choices) return choices.some((choice) => choice.value === value);
  return step === undefined || (typeof value === 'number' && value >= 0 && value <= 1);
}

/** Options of the Extract lab's view: what is shown, and the surface's colouring. */
export const EXTRACT_OPTIONS: ViewOption<ViewOptions>[] = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'color', label: text('controls.color'), choices: COLOR_MODES },
  { name: 'slices', label: text('controls.slices'), choices: PLACEMENTS },
];
