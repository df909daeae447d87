import type { Layout } from '../sculpt/protocol';
import { text } from '../texts';
import type { SculptViewOptions } from '../view/sculpture';
import type { SurfaceColor } from '../view/surface';
import { h } from './dom';
import { choice } from './view-options';

const SWITCHES = [
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'ellipsoids', label: text('sculptPanels.ellipsoids') },
] as const;

export const LAYOUTS: { value: Layout; label: string }[] = [
  { value: 'result', label: text('sculptPanels.layoutResult') },
  { value: 'base', label: text('sculptPanels.layoutBase') },
  { value: 'pair', label: text('sculptPanels.layoutPair') },
  { value: 'row', label: text('sculptPanels.layoutRow') },
  { value: 'levels', label: text('sculptPanels.layoutLevels') },
  { value: 'stages', label: text('sculptPanels.layoutStages') },
];

export const SCULPT_COLORS: { value: SurfaceColor; label: string }[] = [
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'texture', label: text('sculptPanels.colorTexture') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'area distortion', label: text('sculptPanels.colorAreaDistortion') },
  { value: 'angle distortion', label: text('sculptPanels.colorAngleDistortion') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
];

/**
 * Controls for the view options of the Sculpt lab: which meshes and ellipsoids are shown, and the surfaces' colouring.
 */
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
    const layout = choice(text('sculptPanels.show'), 'layout', LAYOUTS, initial.layout, (layout) =>
      this.set({ layout }),
    );
    const color = choice(text('controls.color'), 'color', SCULPT_COLORS, initial.color, (color) => this.set({ color }));
    this.#layout = layout.select;
    this.#color = color.select;
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') },
      ...switches,
      layout.element,
      color.element,
    );
  }

  get value(): SculptViewOptions {
    return this.#value;
  }

  /** Whether there are stages of restructuring to show; if not, that layout is not offered. */
  set staged(staged: boolean) {
    const option = [...this.#layout.options].find(({ value }) => value === 'stages');
    if (option) option.hidden = !staged;
  }

  /** Whether the surface has a texture to show; if not, it is not offered, and a textured surface becomes plain. */
  set textured(textured: boolean) {
    const option = [...this.#color.options].find(({ value }) => value === 'texture');
    if (option) option.disabled = !textured;
    if (!textured && this.#value.color === 'texture') this.set({ color: 'plain' });
  }

  /**
   * Changes view options and reports all of them to the lab; an unknown colouring or layout is replaced by the first
   * choice.
   */
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
