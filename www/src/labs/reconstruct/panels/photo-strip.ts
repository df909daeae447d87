import { context2d, h } from '../../../kit/dom';
import { text } from '../../../texts';
import type { Photograph } from '../photographs';

const THUMBNAIL = 72;

/**
 * Photographs of the Reconstruct lab as thumbnails to choose from; the selected one is shown large beside the view from
 * the same camera.
 */
export class PhotoStrip {
  readonly element = h('div', { class: 'photos', hidden: true });
  /** Element with the selected photograph, which the page places beside the 3D view. */
  readonly large: HTMLElement;
  readonly #canvas = h('canvas', { role: 'img' });
  readonly #caption = h('figcaption');
  readonly #onChoose: (index: number | undefined) => void;
  #photographs: readonly Photograph[] = [];
  #buttons: HTMLButtonElement[] = [];
  #chosen: number | undefined;

  constructor(onChoose: (index: number | undefined) => void) {
    this.#onChoose = onChoose;
    const close = h(
      'button',
      { type: 'button', class: 'quiet', onclick: () => this.choose(undefined) },
      text('pointPanels.closePhotograph'),
    );
    this.large = h('figure', { class: 'photograph', hidden: true }, this.#canvas, h('div', {}, this.#caption, close));
  }

  show(photographs: readonly Photograph[]): void {
    this.choose(undefined);
    for (const { picture } of this.#photographs)
      if (!photographs.some((one) => one.picture === picture)) picture?.close();
    this.#photographs = photographs;
    const pictured = photographs.filter(({ picture }) => picture);
    this.element.hidden = pictured.length === 0;
    this.#buttons = photographs.map((photograph, i) => this.#button(photograph, i));
    this.element.replaceChildren(
      h('p', { class: 'help' }, text('pointPanels.photographsHelp')),
      h(
        'div',
        {
          class: 'strip',
          role: 'toolbar',
          'aria-label': text('pointPanels.photographs'),
          onkeydown: (event) => this.#goAlong(event),
          onfocusin: ({ target }) => this.#makeStop(this.#buttons.indexOf(target as HTMLButtonElement)),
        },
        ...this.#buttons,
      ),
    );
    this.#makeStop(0);
  }

  get chosen(): number | undefined {
    return this.#chosen;
  }

  /**
   * Selects the photograph with the index `index`, from 0, which is then shown beside the 3D view; none if undefined.
   */
  choose(index: number | undefined): void {
    const photograph = index === undefined ? undefined : this.#photographs[index];
    const changed = index !== this.#chosen;
    this.#chosen = photograph ? index : undefined;
    for (const [i, button] of this.#buttons.entries()) button.setAttribute('aria-pressed', String(i === this.#chosen));
    this.large.hidden = !photograph?.picture;
    if (photograph?.picture) {
      draw(this.#canvas, photograph.picture, photograph.picture.width);
      this.#canvas.setAttribute(
        'aria-label',
        text('pointPanels.photographNamed', { number: (index ?? 0) + 1, name: photograph.name }),
      );
      this.#caption.textContent = text('pointPanels.photographCaption', {
        number: (index ?? 0) + 1,
        count: this.#photographs.length,
      });
    }
    if (this.#chosen !== undefined) this.#makeStop(this.#chosen);
    if (changed) this.#onChoose(this.#chosen);
  }

  /** Makes one thumbnail the strip's only tab stop; arrow keys move between thumbnails. */
  #makeStop(index: number): void {
    for (const [i, button] of this.#buttons.entries()) button.tabIndex = i === index ? 0 : -1;
  }

  #goAlong(event: KeyboardEvent): void {
    const last = this.#buttons.length - 1;
    const at = this.#buttons.indexOf(event.target as HTMLButtonElement);
    const to = { ArrowRight: Math.min(at + 1, last), ArrowLeft: Math.max(at - 1, 0), Home: 0, End: last }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    this.#buttons[to]?.focus();
  }

  #button({ name, picture }: Photograph, index: number): HTMLButtonElement {
    const canvas = h('canvas', { 'aria-hidden': 'true' });
    if (picture) draw(canvas, picture, THUMBNAIL);
    const label = text('pointPanels.photographCamera', { number: index + 1 });
    const act = () => this.choose(this.#chosen === index ? undefined : index);
    return h(
      'button',
      { type: 'button', title: name, 'aria-label': label, 'aria-pressed': 'false', 'data-photo': index, onclick: act },
      canvas,
      h('span', {}, String(index + 1)),
    );
  }
}

function draw(canvas: HTMLCanvasElement, picture: ImageBitmap, width: number): void {
  canvas.width = width;
  canvas.height = Math.round((width * picture.height) / picture.width);
  context2d(canvas)?.drawImage(picture, 0, 0, canvas.width, canvas.height);
}
