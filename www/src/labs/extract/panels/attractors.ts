import { shortenedPoint } from '../../../engine/placing';
import type { Attractor, Vec3 } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { labelFor } from '../../../kit/field';
import { place } from '../../../kit/format';
import { MOST_ATTRACTORS } from '../../../lab/attractors';
import { text } from '../../../texts';

const STRENGTH = 0.1;
const PLACE = text('extractPanels.attractorPlace');
const STRONGEST = 1000;

/**
 * Keys, in the catalogue of texts, for the fields of an attractor: visible label, label for screen readers, and name of
 * a change for undo.
 */
const FIELDS = {
  strength: {
    shown: 'extractPanels.attractorStrength',
    label: 'extractPanels.attractorStrengthOf',
    change: 'extractPanels.attractorStrengthChange',
  },
  radius: {
    shown: 'extractPanels.attractorRadius',
    label: 'extractPanels.attractorRadiusOf',
    change: 'extractPanels.attractorRadiusChange',
  },
} as const;

export interface AttractorEvents {
  /**
   * Called with all attractors after a change; `what` names the change, for undo. With `tuning`, repeated changes in
   * quick succession are merged into one undo step.
   */
  onChange: (attractors: Attractor[], what: string, tuning: boolean) => void;
  /** Called when placing attractors by clicks in the views is switched on or off. */
  onPlacing: (placing: boolean) => void;
  /** Called to move the slices to a position in world coordinates. */
  onGoTo: (point: Vec3) => void;
  /** Returns the point in world coordinates where the slices intersect, at which a new attractor may be placed. */
  crosshair: () => Vec3;
}

/**
 * Controls for attractors, points that pull the surface: placed by clicking or at the crosshair, each with strength and
 * radius.
 */
export class AttractorControls {
  readonly element: HTMLElement;
  readonly #events: AttractorEvents;
  readonly #place: HTMLButtonElement;
  readonly #list = h('ol', { class: 'attractors' });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  #attractors: Attractor[] = [];
  #radius = 10;
  #placing = false;

  constructor(events: AttractorEvents) {
    this.#events = events;
    const add = () => this.add(events.crosshair());
    const label = text('extractPanels.attractorAtCrosshairLabel');
    const button = h(
      'button',
      { type: 'button', onclick: add, 'data-attractor': 'add', title: label, 'aria-label': label },
      text('extractPanels.attractorAtCrosshair'),
    );
    this.#place = h(
      'button',
      { type: 'button', 'aria-pressed': 'false', 'data-attractor': 'place', onclick: () => this.place(!this.#placing) },
      PLACE,
    );
    const help = text('extractPanels.attractorsHelp');
    this.element = h(
      'div',
      {},
      h('div', { class: 'buttons' }, this.#place, button),
      h('p', { class: 'help' }, help),
      this.#list,
      this.#error,
    );
  }

  /** Radius of the next attractor that is added, world units. */
  set radius(radius: number) {
    this.#radius = Number(radius.toPrecision(2));
  }

  /** Size of what attractors are placed in, about ten times the radius of one. */
  get #size(): number {
    return 10 * this.#radius;
  }

  show(attractors: Attractor[]): void {
    this.#attractors = attractors;
    this.#error.textContent = '';
    this.#list.replaceChildren(...attractors.map((attractor, index) => this.#item(attractor, index)));
  }

  showError(message: string): void {
    this.#error.textContent = message;
  }

  add(point: Vec3): void {
    if (this.#attractors.length >= MOST_ATTRACTORS) {
      this.showError(text('extractPanels.attractorsFull', { most: MOST_ATTRACTORS }));
      return;
    }
    const rounded = shortenedPoint(point, 6, this.#size);
    this.#change(
      [...this.#attractors, { point: rounded, strength: STRENGTH, radius: this.#radius }],
      text('extractPanels.newAttractor'),
    );
  }

  place(placing: boolean): void {
    this.#placing = placing;
    this.#place.setAttribute('aria-pressed', String(placing));
    this.#place.textContent = placing ? text('extractPanels.attractorStopPlacing') : PLACE;
    this.#events.onPlacing(placing);
  }

  #change(attractors: Attractor[], what: string): void {
    this.show(attractors);
    this.#events.onChange(attractors, what, false);
  }

  #item(attractor: Attractor, index: number): HTMLElement {
    const name = text('extractPanels.attractorName', { number: index + 1 });
    const where = place(attractor.point, this.#size);
    const goTo = h(
      'button',
      {
        type: 'button',
        class: 'quiet place',
        title: text('extractPanels.showInSlices'),
        'aria-label': text('extractPanels.attractorShow', { name, where }),
        onclick: () => this.#events.onGoTo(attractor.point),
      },
      `${index + 1}: ${where}`,
    );
    const remove = h(
      'button',
      {
        type: 'button',
        class: 'quiet',
        'aria-label': text('extractPanels.attractorRemove', { number: index + 1 }),
        onclick: () => this.#remove(index),
      },
      text('controls.remove'),
    );
    const field = (key: 'strength' | 'radius', range: Record<string, number>) => {
      const [label, shown] = [text(FIELDS[key].label, { number: index + 1 }), text(FIELDS[key].shown)];
      return this.#field({ attractor, index, key, label, shown, range });
    };
    return h(
      'li',
      {},
      h('div', { class: 'row' }, goTo, remove),
      h('div', { class: 'row' }, field('strength', { min: -STRONGEST, max: STRONGEST }), field('radius', { min: 0 })),
    );
  }

  #remove(index: number): void {
    this.#change(
      this.#attractors.filter((_, i) => i !== index),
      text('extractPanels.attractorRemoval', { number: index + 1 }),
    );
    // The focused button was removed.
    this.#place.focus();
  }

  #field(given: {
    attractor: Attractor;
    index: number;
    key: 'strength' | 'radius';
    label: string;
    shown: string;
    range: Record<string, number>;
  }): HTMLElement {
    const { attractor, index, key, label, shown, range } = given;
    const value = attractor[key];
    const input = h('input', { type: 'number', step: 'any', value, ...range, 'aria-label': label });
    input.addEventListener('change', () => {
      const number = input.valueAsNumber;
      if (!Number.isFinite(number) || (key === 'radius' && number <= 0)) {
        input.valueAsNumber = value;
        return this.showError(
          key === 'radius' ? text('extractPanels.attractorRadiusError') : text('controls.numberError'),
        );
      }
      const next = this.#attractors.map((one, i) => (i === index ? { ...one, [key]: number } : one));
      this.#attractors = next;
      this.#error.textContent = '';
      this.#events.onChange(next, text(FIELDS[key].change, { number: index + 1 }), true);
    });
    return h('span', { class: 'value' }, labelFor(input, shown), input);
  }
}
