import type { VertexQuantity } from '../protocol';
import { text } from '../texts';
import { h, uniqueId } from './dom';

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

const SWITCHES = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
] as const;
export const PLACEMENTS: { value: SlicePlacement; label: string }[] = [
  { value: 'walls', label: text('controls.placementWalls') },
  { value: 'in place', label: text('controls.placementInPlace') },
  { value: 'hidden', label: text('controls.placementHidden') },
];

export const COLOR_MODES: { value: ColorMode; label: string }[] = [
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'speed', label: text('controls.colorSpeed') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
  { value: 'gaussian curvature', label: text('controls.colorGaussianCurvature') },
];

/** Controls for the view options of the Extract lab: what is shown, and the surface's colouring. */
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
    const color = choice(text('controls.color'), 'color', COLOR_MODES, initial.color, (color) =>
      this.#change({ color }),
    );
    const slices = choice(text('controls.slices'), 'slices', PLACEMENTS, initial.slices, (slices) =>
      this.#change({ slices }),
    );
    this.#color = color.select;
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') },
      ...switches,
      color.element,
      slices.element,
    );
  }

  get value(): ViewOptions {
    return this.#value;
  }

  /** Sets the colouring of the surface and reports it to the lab; an unknown name counts as plain. */
  set color(color: ColorMode) {
    const known = COLOR_MODES.some(({ value }) => value === color) ? color : 'plain';
    this.#color.value = known;
    this.#change({ color: known });
  }

  #change(changed: Partial<ViewOptions>): void {
    this.#onChange({ ...Object.assign(this.#value, changed) });
  }
}

/** Creates a labelled selection list for a view option. */
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
