/** Rows of a list or a table, of which only those are made again that show something new. */
export class KeptRows<Shown extends readonly unknown[]> {
  readonly #parent: HTMLElement;
  readonly #make: (...shown: Shown) => HTMLElement;
  #rows = new Map<number, { shown: Shown; element: HTMLElement }>();

  /** `make` makes a row in `parent` that shows some values. */
  constructor(parent: HTMLElement, make: (...shown: Shown) => HTMLElement) {
    this.#parent = parent;
    this.#make = make;
  }

  /** Shows rows in the order of `all`, which has their keys and what they show. */
  show(all: readonly { key: number; shown: Shown }[]): void {
    const before = [...this.#rows];
    const rows = all.map(({ key, shown }) => [key, this.#row(key, shown)] as const);
    this.#rows = new Map(rows);
    if (rows.length !== before.length || rows.some(([key], i) => key !== before[i]?.[0])) {
      this.#parent.replaceChildren(...rows.map(([, { element }]) => element));
      return;
    }
    for (const [i, [, { element }]] of rows.entries()) {
      const previous = before[i]?.[1].element;
      if (previous !== element) previous?.replaceWith(element);
    }
  }

  #row(key: number, shown: Shown): { shown: Shown; element: HTMLElement } {
    const before = this.#rows.get(key);
    const isKept = before?.shown.every((value, i) => Object.is(value, shown[i]));
    return before && isKept ? before : { shown, element: this.#make(...shown) };
  }
}
