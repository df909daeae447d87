import { h } from './dom';

/** One line that screen readers speak politely: what the lab is doing. Set only when that changes, never per step. */
export class StatusLine {
  readonly element = h('p', { class: 'status', role: 'status', 'aria-live': 'polite' });

  say(text: string): void {
    if (this.element.textContent !== text) this.element.textContent = text;
  }
}

/** What went wrong, in plain words, over the view. The result that was there stays visible under it. */
export class ErrorBanner {
  readonly element: HTMLElement;
  readonly #title = h('strong');
  readonly #message = h('span', { 'data-error': '' });

  constructor(onDismiss: () => void) {
    const close = h('button', { type: 'button', class: 'quiet', onclick: onDismiss }, 'Dismiss');
    this.element = h(
      'div',
      { class: 'banner', role: 'alert', hidden: true },
      h('p', {}, this.#title, ' ', this.#message),
      close,
    );
  }

  get shown(): boolean {
    return !this.element.hidden;
  }

  show(title: string, message: string): void {
    this.#title.textContent = title;
    this.#message.textContent = message;
    this.element.hidden = false;
  }

  hide(): void {
    this.element.hidden = true;
    this.#message.textContent = '';
  }
}
