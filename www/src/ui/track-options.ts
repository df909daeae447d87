import { text } from '../texts';
import type { ContentBelow, TrackViewOptions, VisibleVotes } from '../view/track';
import { h } from './dom';
import { choice, PLACEMENTS } from './view-options';

const SWITCHES = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'region', label: text('trackPanels.viewBox') },
] as const;

const VOTES: { value: VisibleVotes; label: string }[] = [
  { value: 'none', label: text('trackPanels.votesHidden') },
  { value: 'near', label: text('trackPanels.votesNear') },
  { value: 'all', label: text('trackPanels.votesAll') },
];

const BELOW: { value: ContentBelow; label: string }[] = [
  { value: 'slices', label: text('trackPanels.belowSlices') },
  { value: 'boundary', label: text('trackPanels.belowBoundary') },
  { value: 'time', label: text('trackPanels.belowTime') },
  { value: 'between', label: text('trackPanels.belowBetween') },
];

/** Controls for the view options of the Track lab, including what is shown below the 3D view. */
export class TrackOptionControls {
  readonly element: HTMLElement;
  readonly #boxes = new Map<string, HTMLInputElement>();
  readonly #votes: HTMLSelectElement;
  readonly #slices: HTMLSelectElement;
  readonly #below: HTMLSelectElement;
  readonly #value: TrackViewOptions;
  readonly #onChange: (options: TrackViewOptions) => void;

  constructor(initial: TrackViewOptions, onChange: (options: TrackViewOptions) => void) {
    this.#value = { ...initial };
    this.#onChange = onChange;
    const switches = SWITCHES.map(({ name, label }) => {
      const box = h('input', { type: 'checkbox', checked: initial[name], 'data-view': name });
      box.addEventListener('change', () => this.set({ [name]: box.checked }));
      this.#boxes.set(name, box);
      return h('label', {}, box, label);
    });
    const votes = choice(text('trackPanels.boundary'), 'votes', VOTES, initial.votes, (value) =>
      this.set({ votes: value }),
    );
    const slices = choice(text('controls.slices'), 'slices', PLACEMENTS, initial.slices, (value) =>
      this.set({ slices: value }),
    );
    const below = choice(text('trackPanels.below'), 'below', BELOW, initial.below, (value) =>
      this.set({ below: value }),
    );
    this.#votes = votes.select;
    this.#slices = slices.select;
    this.#below = below.select;
    this.element = h(
      'div',
      { class: 'view-options', role: 'group', 'aria-label': text('controls.viewOptions') },
      ...switches,
      votes.element,
      slices.element,
      below.element,
    );
  }

  get value(): TrackViewOptions {
    return this.#value;
  }

  /** Changes view options and reports all of them to the lab; an unknown value is replaced by the first choice. */
  set(changed: Partial<TrackViewOptions>): void {
    Object.assign(this.#value, changed);
    if (!BELOW.some(({ value }) => value === this.#value.below)) this.#value.below = 'slices';
    if (!PLACEMENTS.some(({ value }) => value === this.#value.slices)) this.#value.slices = 'walls';
    if (!VOTES.some(({ value }) => value === this.#value.votes)) this.#value.votes = 'none';
    for (const { name } of SWITCHES) {
      const box = this.#boxes.get(name);
      if (box) box.checked = this.#value[name];
    }
    this.#votes.value = this.#value.votes;
    this.#slices.value = this.#value.slices;
    this.#below.value = this.#value.below;
    this.#onChange({ ...this.#value });
  }
}
