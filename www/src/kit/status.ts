import { text } from '../texts';
import { h } from './dom';

/**
 * Least milliseconds between the last message of the status line and a progress report: rarely enough for screen
 * readers, and for the rest of the page.
 */
const REPORT_EVERY = 10_000;

/**
 * Status line of a lab, announced politely by screen readers. Its text is set when the state of the lab changes, and
 * occasionally during a run.
 */
export class StatusLine {
  readonly element = h('p', { class: 'status', role: 'status', 'aria-live': 'polite' });
  #saidAt = 0;

  say(text: string): void {
    this.#saidAt = performance.now();
    if (this.element.textContent !== text) this.element.textContent = text;
  }

  /** Reports the progress of a run. May be called at any rate; `text` is evaluated only when a report is due. */
  report(text: () => string): void {
    if (performance.now() - this.#saidAt >= REPORT_EVERY) this.say(text());
  }
}

/** Banner over the view with an error message in plain words. The previous result stays visible below it. */
export class ErrorBanner {
  readonly element: HTMLElement;
  readonly #title = h('strong');
  readonly #message = h('span', { 'data-error': '' });

  constructor(onDismiss: () => void) {
    const close = h('button', { type: 'button', class: 'quiet', onclick: onDismiss }, text('controls.dismiss'));
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
    this.#title.textContent = '';
    this.#message.textContent = '';
  }
}
