import type { Layout } from '../sculpt/protocol';
import type { SculptViewOptions } from '../view/sculpture';
import type { SurfaceColor } from '../view/surface';
import { h } from './dom';
import { choice } from './view-options';

const SWITCHES = [
  { name: 'edges', label: 'Wireframe' },
  { name: 'ellipsoids', label: 'Ellipsoids' },
] as const;

export const LAYOUTS: { value: Layout; label: string }[] = [
  { value: 'result', label: 'result' },
  { value: 'base', label: 'deformed base' },
  { value: 'pair', label: 'base and result' },
  { value: 'row', label: 'all five, as in figure 1' },
  { value: 'levels', label: 'levels of the solver' },
  { value: 'stages', label: 'stages of restructuring' },
];

export const SCULPT_COLORS: { value: SurfaceColor; label: string }[] = [
  { value: 'plain', label: 'plain' },
  { value: 'texture', label: 'texture' },
  { value: 'component', label: 'component' },
  { value: 'area distortion', label: 'distortion of area' },
  { value: 'angle distortion', label: 'distortion of angles' },
  { value: 'mean curvature', label: 'mean curvature' },
];

/** View options of the Sculpt lab. */
export class SculptOptionControls {
  readonly element: HTMLElement;
  readonly #boxes = new Map<string, HTMLInputElement>();
  readonly #layout: HTMLSelectElement;
  readonly #color: HTMLSelectElement;
  readonly #value: SculptViewOptions;
  readonly #onChange: (options: SculptViewOptions) => void;

  constructor(initial: SculptViewOptions, onChange: (options: SculptViewOptions) => void) {
    this.#value = { ...initial };
    this.#onChange = onChange;
    const switches = SWITCHES.map(({ name, label }) => {
      const box = h('input', { type: 'checkbox', checked: initial[name], 'data-view': name });
      box.addEventListener('change', () => this.set({ [name]: box.checked }));
      this.#boxes.set(name, box);
      return h('label', {}, box, label);
    });
    const layout = choice('Show', 'layout', LAYOUTS, initial.layout, (layout) => this.set({ layout }));
    const color = choice('Colour', 'color', SCULPT_COLORS, initial.color, (color) => this.set({ color }));
    this.#layout = layout.select;
    this.#color = color.select;
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': 'What the view shows' },
      ...switches,
      layout.element,
      color.element,
    );
  }

  get value(): SculptViewOptions {
    return this.#value;
  }

  /** Whether there are stages of restructuring to show. */
  set staged(staged: boolean) {
    const option = [...this.#layout.options].find(({ value }) => value === 'stages');
    if (option) option.hidden = !staged;
  }

  /** Whether there is a texture to show. */
  set textured(textured: boolean) {
    const option = [...this.#color.options].find(({ value }) => value === 'texture');
    if (option) option.disabled = !textured;
    if (!textured && this.#value.color === 'texture') this.set({ color: 'plain' });
  }

  /** Changes options and reports them; an unknown colouring or layout is replaced by the first. */
  set(changed: Partial<SculptViewOptions>): void {
    Object.assign(this.#value, changed);
    if (!SCULPT_COLORS.some(({ value }) => value === this.#value.color)) this.#value.color = 'plain';
    if (!LAYOUTS.some(({ value }) => value === this.#value.layout)) this.#value.layout = 'result';
    for (const { name } of SWITCHES) {
      const box = this.#boxes.get(name);
      if (box) box.checked = this.#value[name];
    }
    this.#layout.value = this.#value.layout;
    this.#color.value = this.#value.color;
    this.#onChange({ ...this.#value });
  }
}
