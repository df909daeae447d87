import type { Shade } from '../protocol';
import { h, uniqueId } from './dom';

/** Placement of the slices in the 3D view: on the walls behind the surface, in place, or hidden. */
export type SlicePlacement = 'walls' | 'in place' | 'hidden';

/** Colouring of the surface in the Extract lab. */
export type ColorMode = 'plain' | 'component' | Shade;

export interface ViewOptions {
  surface: boolean;
  edges: boolean;
  color: ColorMode;
  slices: SlicePlacement;
}

const SWITCHES = [
  { name: 'surface', label: 'Surface' },
  { name: 'edges', label: 'Wireframe' },
] as const;
export const PLACEMENTS: { value: SlicePlacement; label: string }[] = [
  { value: 'walls', label: 'on the walls' },
  { value: 'in place', label: 'in place' },
  { value: 'hidden', label: 'hidden' },
];

export const COLOR_MODES: { value: ColorMode; label: string }[] = [
  { value: 'plain', label: 'plain' },
  { value: 'component', label: 'component' },
  { value: 'speed', label: 'speed' },
  { value: 'mean curvature', label: 'mean curvature' },
  { value: 'gaussian curvature', label: 'Gaussian curvature' },
];

/** View options of the Extract lab. */
export class ViewOptionControls {
  readonly element: HTMLElement;
  readonly #color: HTMLSelectElement;
  readonly #value: ViewOptions;
  readonly #onChange: (options: ViewOptions) => void;

  constructor(initial: ViewOptions, onChange: (options: ViewOptions) => void) {
    this.#value = { ...initial };
    this.#onChange = onChange;
    const switches = SWITCHES.map(({ name, label }) => {
      const box = h('input', { type: 'checkbox', checked: initial[name], 'data-view': name });
      box.addEventListener('change', () => this.#change({ [name]: box.checked }));
      return h('label', {}, box, label);
    });
    const color = choice('Colour', 'color', COLOR_MODES, initial.color, (color) => this.#change({ color }));
    const slices = choice('Slices', 'slices', PLACEMENTS, initial.slices, (slices) => this.#change({ slices }));
    this.#color = color.select;
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': 'What the view shows' },
      ...switches,
      color.element,
      slices.element,
    );
  }

  get value(): ViewOptions {
    return this.#value;
  }

  /** Sets the colouring; an unknown name counts as plain. */
  set color(color: ColorMode) {
    const known = COLOR_MODES.some(({ value }) => value === color) ? color : 'plain';
    this.#color.value = known;
    this.#change({ color: known });
  }

  #change(changed: Partial<ViewOptions>): void {
    this.#onChange({ ...Object.assign(this.#value, changed) });
  }
}

/** Creates a labelled selection list. */
export function choice<Value extends string>(
  label: string,
  name: string,
  choices: { value: Value; label: string }[],
  initial: Value,
  onChange: (value: Value) => void,
): { element: HTMLElement; select: HTMLSelectElement } {
  const id = uniqueId(name);
  const options = choices.map(({ value, label }) => h('option', { value, selected: value === initial }, label));
  const select = h('select', { id, 'data-view': name }, ...options);
  select.addEventListener('change', () => onChange(select.value as Value));
  return { element: h('span', { class: 'placement' }, h('label', { for: id }, label), select), select };
}
