import { text } from '../texts';
import type { CloudViewOptions } from '../view/reconstruction';
import type { SurfaceColor } from '../view/surface';
import { h } from './dom';
import { choice } from './view-options';

type Switch = 'surface' | 'edges' | 'points' | 'constraints' | 'cameras';

const SWITCHES: { name: Switch; label: string }[] = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'points', label: text('pointPanels.viewPoints') },
  { name: 'constraints', label: text('pointPanels.viewConstraints') },
  { name: 'cameras', label: text('pointPanels.viewCameras') },
];

export const CLOUD_COLORS: { value: SurfaceColor; label: string }[] = [
  { value: 'own', label: text('pointPanels.colorOwn') },
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
  { value: 'distance', label: text('pointPanels.colorDistance') },
];

/** Controls for the view options of the Reconstruct lab: which objects are shown, and the surface's colouring. */
export class CloudOptionControls {
  readonly element: HTMLElement;
  readonly #boxes = new Map<Switch, HTMLInputElement>();
  readonly #color: HTMLSelectElement;
  readonly #key = h(
    'p',
    { class: 'legend' },
    h('span', {}, h('span', { class: 'dot point', 'aria-hidden': 'true' }), text('pointPanels.legendSurface')),
    h('span', {}, h('span', { class: 'dot exterior', 'aria-hidden': 'true' }), text('pointPanels.legendExterior')),
  );
  readonly #value: CloudViewOptions;
  readonly #onChange: (options: CloudViewOptions) => void;

  constructor(initial: CloudViewOptions, onChange: (options: CloudViewOptions) => void) {
    this.#value = { ...initial };
    this.#onChange = onChange;
    const switches = SWITCHES.map(({ name, label }) => {
      const box = h('input', { type: 'checkbox', checked: initial[name], 'data-view': name });
      box.addEventListener('change', () => this.set({ [name]: box.checked }));
      this.#boxes.set(name, box);
      return h('label', {}, box, label);
    });
    const color = choice(text('controls.color'), 'color', CLOUD_COLORS, initial.color, (color) => this.set({ color }));
    this.#color = color.select;
    this.#key.hidden = !initial.constraints;
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') },
      ...switches,
      this.#key,
      color.element,
    );
  }

  get value(): CloudViewOptions {
    return this.#value;
  }

  /** Changes view options and reports all of them to the lab; an unknown colouring counts as plain. */
  set(changed: Partial<CloudViewOptions>): void {
    Object.assign(this.#value, changed);
    if (!CLOUD_COLORS.some(({ value }) => value === this.#value.color)) this.#value.color = 'plain';
    for (const [name, box] of this.#boxes) box.checked = this.#value[name];
    this.#color.value = this.#value.color;
    this.#key.hidden = !this.#value.constraints;
    this.#onChange({ ...this.#value });
  }

  /** Whether there are cameras to show; if not, the checkbox that shows them is hidden and cleared. */
  set hasCameras(has: boolean) {
    const box = this.#boxes.get('cameras');
    const label = box?.closest('label');
    if (label) label.hidden = !has;
    if (!has && this.#value.cameras) this.set({ cameras: false });
  }
}
