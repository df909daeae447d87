import { h } from './dom';
import { figure } from './format';

const STEPS = 64;

/** What a shade's colours mean, over the view. */
export interface LegendText {
  title: string;
  below: string;
  above: string;
}

/** A bar of the colours in use with the numbers at its ends and middle. */
export class Legend {
  readonly #bar = h('canvas', { width: STEPS, height: 1, 'aria-hidden': 'true' });
  readonly #title = h('span', { class: 'title' });
  readonly #ends = [h('span'), h('span'), h('span')] as const;
  readonly #words = [h('span'), h('span')] as const;
  readonly element = h(
    'div',
    { class: 'color-legend', role: 'group', 'aria-label': 'Meaning of the colours', hidden: true },
    this.#title,
    this.#bar,
    h('span', { class: 'ends' }, ...this.#ends),
    h('span', { class: 'ends' }, ...this.#words),
  );

  /** `color` gives sRGB for −1 to 1. */
  constructor(color: (t: number) => [number, number, number]) {
    const context = this.#bar.getContext('2d');
    for (let i = 0; i < STEPS; i++) {
      if (!context) break;
      context.fillStyle = `rgb(${color((2 * i) / (STEPS - 1) - 1).join(' ')})`;
      context.fillRect(i, 0, 1, 1);
    }
  }

  show({ title, below, above }: LegendText, range: number): void {
    this.element.hidden = false;
    this.#title.textContent = title;
    this.#words[0].textContent = below;
    this.#words[1].textContent = above;
    const texts = [`−${figure(range)}`, '0', figure(range)];
    for (const [i, end] of this.#ends.entries()) if (end.textContent !== texts[i]) end.textContent = texts[i] ?? '';
  }

  hide(): void {
    this.element.hidden = true;
  }
}
