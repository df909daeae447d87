import { h } from './dom';

/** Milliseconds between two reports of something that goes on: they can be listened to, and leave time for the rest of the page. */
const REPORT_EVERY = 10_000;

/** One line that screen readers speak politely: what the lab is doing. Set when that changes, and now and then while it goes on. */
export class StatusLine {
  readonly element = h('p', { class: 'status', role: 'status', 'aria-live': 'polite' });
  #saidAt = 0;

  say(text: string): void {
    this.#saidAt = performance.now();
    if (this.element.textContent !== text) this.element.textContent = text;
  }

  /** How far something is that goes on, called as often as it likes; `text` only when it is time for it. */
  report(text: () => string): void {
    if (performance.now() - this.#saidAt >= REPORT_EVERY) this.say(text());
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
