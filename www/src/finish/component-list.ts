import type { Unit } from '../engine/protocol';
import { h } from '../kit/dom';
import { sized } from '../kit/measures';
import { componentRoots } from '../scene/components';
import { plural, text } from '../texts';
import type { Component, Edited } from './protocol';

/** Largest number of components listed; the smaller ones can still be chosen by click. */
const MOST = 100;

/** List of a surface's connected components, from the largest volume on, of which some are chosen. */
export class ComponentList {
  readonly element = h('ul', { class: 'components', 'aria-label': text('finish.components') });
  readonly #boxes = new Map<number, HTMLInputElement>();
  readonly #chosen = new Set<number>();
  #edited: Edited | undefined;

  /** Indices of the components that are chosen, and those of all others. */
  get chosen(): { chosen: number[]; others: number[] } {
    const all = [...(this.#edited?.components.keys() ?? [])];
    return {
      chosen: all.filter((index) => this.#chosen.has(index)),
      others: all.filter((index) => !this.#chosen.has(index)),
    };
  }

  /** Index of the component of the largest volume. */
  get largest(): number {
    return this.#ranked()[0] ?? 0;
  }

  show(edited: Edited | undefined, unit: Unit): void {
    this.#edited = edited;
    this.#chosen.clear();
    this.#boxes.clear();
    const all = edited?.components ?? [];
    const items = this.#ranked().slice(0, MOST);
    this.element.replaceChildren(...items.map((index, rank) => this.#item(index, rank, all[index], unit)));
  }

  /** Chooses the component of a triangle, or no longer chooses it. */
  toggle(triangle: number): void {
    const index = this.#componentOf(triangle);
    this.#choose(index, !this.#chosen.has(index));
    const box = this.#boxes.get(index);
    if (box) box.checked = this.#chosen.has(index);
    box?.scrollIntoView({ block: 'nearest' });
  }

  #choose(index: number, on: boolean): void {
    if (on) this.#chosen.add(index);
    else this.#chosen.delete(index);
  }

  #ranked(): number[] {
    const parts = this.#edited?.components ?? [];
    const size = (index: number) => Math.abs(parts[index]?.volume ?? 0);
    return [...parts.keys()].sort((i, j) => size(j) - size(i) || i - j);
  }

  #item(index: number, rank: number, part: Component | undefined, unit: Unit): HTMLElement {
    const { vertices = 0, volume = 0, area = 0 } = part ?? {};
    const box = h('input', { type: 'checkbox', 'data-component': index });
    box.addEventListener('change', () => this.#choose(index, box.checked));
    this.#boxes.set(index, box);
    const sizes = { rank: rank + 1, volume: sized(volume, 3, unit), area: sized(area, 2, unit) };
    const size = text('finish.component', { ...sizes, vertices: plural('counts.vertex', vertices) });
    return h('li', {}, h('label', {}, box, ' ', size));
  }

  /** Returns the index of a triangle's component; components are numbered by their first triangles. */
  #componentOf(triangle: number): number {
    const { indices, triangles, vertices } = this.#edited?.surface ?? {};
    if (!indices || !triangles || !vertices) return 0;
    const roots = componentRoots(indices, 3 * triangles, vertices);
    const rootOf = (index: number) => roots[indices[3 * index] ?? 0] ?? 0;
    const order = new Set(Array.from({ length: triangles }, (_, index) => rootOf(index)));
    return [...order].indexOf(rootOf(triangle));
  }
}
