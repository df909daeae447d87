import { context2d, h } from '../kit/dom';
import { figure } from '../kit/format';
import { text } from '../texts';
import { type Inks, paintText } from './scale-bar';

const STEPS = 64;
/** Width of the colour bar in pictures, and its distance from their edges, in CSS pixels. */
const [BAR_WIDTH, MARGIN] = [190, 16];

/** Texts of a colour legend: title of the scale, and labels of its lower and upper end. */
export interface LegendText {
  title: string;
  below: string;
  above: string;
  /**
   * Whether the scale starts at 0, instead of being symmetric about it, and uses only the upper half of the colours.
   */
  positive?: boolean;
}

/** Legend over the 3D view: a colour bar with the values at its ends and middle. */
export class Legend {
  readonly #bar = h('canvas', { width: STEPS, height: 1, 'aria-hidden': 'true' });
  readonly #title = h('span', { class: 'title' });
  readonly #ends = [h('span'), h('span'), h('span')] as const;
  readonly #words = [h('span'), h('span')] as const;
  readonly #color: (t: number) => [number, number, number];
  readonly element = h(
    'div',
    { class: 'color-legend', role: 'group', 'aria-label': text('controls.colorScale'), hidden: true },
    this.#title,
    this.#bar,
    h('span', { class: 'ends' }, ...this.#ends),
    h('span', { class: 'ends' }, ...this.#words),
  );

  /** `color` maps a position on the symmetric scale, −1 to 1, to sRGB, 0..255. */
  constructor(color: (t: number) => [number, number, number]) {
    this.#color = color;
  }

  show({ title, below, above, positive = false }: LegendText, range: number): void {
    this.element.hidden = false;
    this.#draw(positive ? 0 : -1);
    this.#title.textContent = title;
    this.#words[0].textContent = below;
    this.#words[1].textContent = above;
    const texts = positive ? ['0', figure(range / 2), figure(range)] : [`−${figure(range)}`, '0', figure(range)];
    for (const [i, end] of this.#ends.entries()) if (end.textContent !== texts[i]) end.textContent = texts[i] ?? '';
  }

  /** Draws the colour bar from `low`, −1 or 0, to 1. */
  #draw(low: number): void {
    const context = context2d(this.#bar);
    for (let i = 0; i < STEPS; i++) {
      if (!context) break;
      context.fillStyle = `rgb(${this.#color(low + ((1 - low) * i) / (STEPS - 1)).join(' ')})`;
      context.fillRect(i, 0, 1, 1);
    }
  }

  hide(): void {
    this.element.hidden = true;
  }

  /** Draws the legend, if it is shown, over a picture that is `width` wide, in the upper right corner. */
  paint(context: CanvasRenderingContext2D, width: number, inks: Inks): void {
    if (this.element.hidden) return;
    const [left, right] = [width - BAR_WIDTH - MARGIN, width - MARGIN];
    const write = (element: HTMLElement, x: number, y: number, align: CanvasTextAlign) =>
      paintText(context, element.textContent ?? '', x, y, align, inks);
    write(this.#title, left, MARGIN + 10, 'left');
    context.drawImage(this.#bar, left, MARGIN + 18, BAR_WIDTH, 10);
    const [low, middle, high] = this.#ends;
    const [below, above] = this.#words;
    write(low, left, MARGIN + 44, 'left');
    write(middle, (left + right) / 2, MARGIN + 44, 'center');
    write(high, right, MARGIN + 44, 'right');
    write(below, left, MARGIN + 60, 'left');
    write(above, right, MARGIN + 60, 'right');
  }
}
