import { text } from '../texts';
import type { SegmentViewOptions } from '../view/segmentation';
import { h, uniqueId } from './dom';
import { choice, PLACEMENTS } from './view-options';

/** Controls for the view options of the Segment lab. */
export class SegmentOptionControls {
  readonly element: HTMLElement;
  readonly #edges = h('input', { type: 'checkbox', 'data-view': 'edges' });
  readonly #outlines = h('input', { type: 'checkbox', 'data-view': 'outlines' });
  readonly #slices: HTMLSelectElement;
  readonly #opacity: HTMLInputElement;
  readonly #value: SegmentViewOptions;
  readonly #onChange: (options: SegmentViewOptions) => void;

  constructor(initial: SegmentViewOptions, onChange: (options: SegmentViewOptions) => void) {
    this.#value = { ...initial };
    this.#onChange = onChange;
    this.#edges.addEventListener('change', () => this.set({ edges: this.#edges.checked }));
    this.#outlines.addEventListener('change', () => this.set({ outlines: this.#outlines.checked }));
    const slices = choice(text('controls.slices'), 'slices', PLACEMENTS, initial.slices, (value) =>
      this.set({ slices: value }),
    );
    this.#slices = slices.select;
    const id = uniqueId('opacity');
    this.#opacity = h('input', { type: 'range', id, min: 0, max: 1, step: 0.05, 'data-view': 'opacity' });
    this.#opacity.addEventListener('input', () => this.set({ opacity: this.#opacity.valueAsNumber }));
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') },
      h('label', {}, this.#edges, text('controls.viewWireframe')),
      h('label', {}, this.#outlines, text('segment.outlines')),
      slices.element,
      h('span', { class: 'placement' }, h('label', { for: id }, text('segment.opacity')), this.#opacity),
    );
    this.#show();
  }

  get value(): SegmentViewOptions {
    return this.#value;
  }

  /** Changes view options and reports all of them to the lab; unknown values are replaced by usual ones. */
  set(changed: Partial<SegmentViewOptions>): void {
    Object.assign(this.#value, changed);
    if (!PLACEMENTS.some(({ value }) => value === this.#value.slices)) this.#value.slices = 'walls';
    if (!(this.#value.opacity >= 0 && this.#value.opacity <= 1)) this.#value.opacity = 0.5;
    this.#show();
    this.#onChange({ ...this.#value });
  }

  #show(): void {
    this.#edges.checked = this.#value.edges;
    this.#outlines.checked = this.#value.outlines;
    this.#slices.value = this.#value.slices;
    this.#opacity.valueAsNumber = this.#value.opacity;
  }
}
