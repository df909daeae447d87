import { h } from '../../../kit/dom';
import { count, text } from '../../../texts';

/** Message that a volume looks like a label map, with a button that opens it where each label gets a surface. */
export class LabelsOffer {
  readonly element: HTMLElement;
  readonly #message = h('p', { class: 'help' });

  constructor(onSegment: () => void) {
    const open = h(
      'button',
      { type: 'button', 'data-action': 'segment', onclick: onSegment },
      text('extract.openInSegment'),
    );
    this.element = h('div', { role: 'status', hidden: true }, this.#message, open);
  }

  /** Shows the message for a number of labels; hides it if that is 0. */
  show(labels: number): void {
    this.element.hidden = labels === 0;
    this.#message.textContent = labels === 0 ? '' : text('extract.looksLikeLabels', { labels: count(labels) });
  }
}
