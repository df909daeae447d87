import type { Vec3 } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { Field, showIn } from '../../../kit/field';
import { SLICE_NAMES, type SliceOrientation } from '../../../scene/anatomy';
import { text } from '../../../texts';
import type { VoxelBox } from '../box';
import type { Cavity } from '../protocol';

export interface RegionEvents {
  onRegion: (region: VoxelBox | undefined) => void;
  /** Called when the component to track is chosen: the one nearest to the crosshair, or the largest. */
  onComponent: (which: 'here' | 'largest') => void;
  /** Called when the lab is to ask for the object to track, or no longer. */
  onAsk: () => void;
  onCavity: (cavity: Cavity) => void;
}

/** Values that the controls of the region show. */
export interface ShownRegion {
  region: VoxelBox;
  /** Whether the region is the whole image. */
  whole: boolean;
  dims: Vec3;
  /** Names of the slices across each voxel axis. */
  names: SliceOrientation['name'][];
  /** Point in world coordinates to which the tracked component is the nearest; the largest if undefined. */
  nearest: Vec3 | undefined;
  cavity: Cavity | undefined;
}

/**
 * Controls of the Track lab for the region of interest, by its first and last slice along each axis, for the component to
 * track, and for what counts as inside it.
 */
export class RegionControls {
  readonly element: HTMLElement;
  readonly #inputs: HTMLInputElement[] = [];
  readonly #names: HTMLElement[] = [];
  readonly #whole: HTMLButtonElement;
  readonly #largest: HTMLButtonElement;
  readonly #here: HTMLButtonElement;
  readonly #ask: HTMLButtonElement;
  readonly #cavity = new Field(h('input', { type: 'checkbox', role: 'switch', 'data-cavity': 'closed' }), {
    label: text('trackPanels.cavity'),
    help: text('trackPanels.cavityHelp'),
  });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #followed = h('p', { class: 'help', 'data-component': '' });
  #dims: Vec3 = [1, 1, 1];
  #region: VoxelBox = { low: [0, 0, 0], high: [0, 0, 0] };
  readonly #onRegion: RegionEvents['onRegion'];

  constructor({ onRegion, onComponent, onAsk, onCavity }: RegionEvents) {
    this.#onRegion = onRegion;
    const rows = [0, 1, 2].map((axis) => this.#row(axis));
    this.#whole = button('box', 'whole', text('trackPanels.wholeImage'), () => onRegion(undefined));
    this.#largest = button('component', 'largest', text('trackPanels.largestComponent'), () => onComponent('largest'));
    this.#here = button('component', 'here', text('trackPanels.nearestComponent'), () => onComponent('here'));
    this.#ask = h(
      'button',
      { type: 'button', class: 'wide', 'data-action': 'ask', onclick: onAsk },
      text('trackPanels.ask'),
    );
    const { control } = this.#cavity;
    control.addEventListener('change', () => onCavity(control.checked ? 'closed' : 'open'));
    this.element = h(
      'div',
      { class: 'region' },
      this.#ask,
      h('p', { class: 'help' }, text('trackPanels.regionHelp')),
      ...rows,
      this.#error,
      h('div', { class: 'buttons' }, this.#whole),
      h('p', {}, text('trackPanels.trackedSurface')),
      h('div', { class: 'buttons' }, this.#largest, this.#here),
      this.#followed,
      this.#cavity.element,
    );
  }

  /** Whether the lab asks for the object to track. */
  set asks(asks: boolean) {
    this.#ask.setAttribute('aria-pressed', String(asks));
  }

  set enabled(enabled: boolean) {
    this.#ask.disabled = !enabled;
  }

  show({ region, whole, dims, names, nearest, cavity }: ShownRegion): void {
    this.#cavity.control.checked = cavity === 'closed';
    this.#dims = dims;
    this.#region = region;
    for (const axis of [0, 1, 2]) {
      const orientation = names[axis];
      const name = orientation ? SLICE_NAMES[orientation] : '';
      this.#names[axis]?.replaceChildren(name);
      for (const [side, input] of this.#inputs.slice(2 * axis, 2 * axis + 2).entries()) {
        input.max = String((dims[axis] ?? 1) - 1);
        showIn(input, String((side === 0 ? region.low : region.high)[axis] ?? 0));
        input.setAttribute(
          'aria-label',
          text(side === 0 ? 'trackPanels.firstSlice' : 'trackPanels.lastSlice', { name }),
        );
      }
    }
    this.#whole.disabled = whole;
    this.#largest.setAttribute('aria-pressed', String(nearest === undefined));
    this.#here.setAttribute('aria-pressed', String(nearest !== undefined));
    this.#followed.textContent = nearest
      ? text('trackPanels.trackedNearest', { point: nearest.map((x) => x.toFixed(1)).join(', ') })
      : text('trackPanels.trackedLargest');
    this.#error.textContent = '';
  }

  showError(message: string): void {
    this.#error.textContent = message;
  }

  #row(axis: number): HTMLElement {
    const inputs = ['first', 'last'].map((side) => {
      const input = h('input', {
        type: 'number',
        min: 0,
        step: 1,
        inputmode: 'numeric',
        'data-box': `${axis}-${side}`,
      });
      input.addEventListener('change', () => this.#onInput());
      this.#inputs.push(input);
      return input;
    });
    const name = h('span');
    this.#names.push(name);
    const swatch = h('span', { class: `swatch axis-${axis}`, 'aria-hidden': 'true' });
    return h(
      'div',
      { class: 'row' },
      h('span', { class: 'value' }, swatch, name),
      h('span', { class: 'value' }, ...inputs),
    );
  }

  #onInput(): void {
    const values = this.#inputs.map((input) => input.valueAsNumber);
    const ends = (side: number) => [0, 1, 2].map((axis) => values[2 * axis + side] ?? Number.NaN) as Vec3;
    const [low, high] = [ends(0), ends(1)];
    const wrong = [0, 1, 2].some((axis) => {
      const [from = Number.NaN, to = Number.NaN] = [low[axis], high[axis]];
      return (
        !Number.isInteger(from) || !Number.isInteger(to) || from < 0 || to >= (this.#dims[axis] ?? 1) || from >= to
      );
    });
    if (wrong) this.#error.textContent = text('trackPanels.regionError');
    else if (low.some((x, k) => x !== this.#region.low[k]) || high.some((x, k) => x !== this.#region.high[k]))
      this.#onRegion({ low, high });
  }
}

function button(group: string, name: string, text: string, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', [`data-${group}`]: name, onclick }, text);
}
