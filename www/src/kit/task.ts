import { text } from '../texts';
import { h } from './dom';

interface TaskParts {
  /** Name of the attribute `data-…` of the buttons, whose values are `start` and `cancel`. */
  name: string;
  /** Text of the button that starts the task. */
  start: string;
  /** Name of the progress bar for screen readers. */
  progress: string;
  /** Value of the progress bar at the end of the task. */
  max?: number;
  onStart: () => void;
  onCancel: () => void;
  /** Further buttons, which are hidden during the task. */
  others?: HTMLButtonElement[];
  /** Further buttons, which are shown only during the task. */
  during?: HTMLButtonElement[];
}

/** Controls of a task that takes a while: buttons to start and cancel it, its progress, and a message. */
export class TaskControls {
  /** The buttons, the progress bar and the message, in this order. */
  readonly elements: HTMLElement[];
  readonly #idle: HTMLButtonElement[];
  readonly #cancel: HTMLButtonElement;
  readonly #during: HTMLButtonElement[];
  readonly #progress: HTMLProgressElement;
  readonly #status = h('p', { class: 'help', role: 'status' });

  constructor({ name, start, progress, max = 1, onStart, onCancel, others = [], during = [] }: TaskParts) {
    const button = (value: string, label: string, onclick: () => void) =>
      h('button', { type: 'button', [`data-${name}`]: value, onclick }, label);
    this.#idle = [button('start', start, onStart), ...others];
    this.#cancel = button('cancel', text('controls.cancel'), onCancel);
    this.#during = [this.#cancel, ...during];
    for (const one of this.#during) one.hidden = true;
    this.#progress = h('progress', { max, value: 0, hidden: true, 'aria-label': progress });
    const [first = '', ...rest] = this.#idle;
    this.elements = [h('div', { class: 'buttons' }, first, ...this.#during, ...rest), this.#progress, this.#status];
  }

  /** Whether the task can be started. */
  set enabled(enabled: boolean) {
    for (const button of this.#idle) button.disabled = !enabled;
  }

  begin(message: string): void {
    this.#show(true, message);
    this.#progress.value = 0;
    this.#cancel.focus();
  }

  /** Shows the progress, and what cancelling would stop; neither is announced to screen readers. */
  showProgress(value: number, cancel = text('controls.cancel')): void {
    this.#progress.value = Number.isFinite(value) ? value : 0;
    this.#cancel.textContent = cancel;
  }

  /** Ends the task, if it is running, and shows a message. */
  end(message: string): void {
    const hadFocus = document.activeElement === this.#cancel;
    this.#show(false, message);
    this.#cancel.textContent = text('controls.cancel');
    if (hadFocus) this.#idle[0]?.focus();
  }

  /** Shows a message beside the buttons. */
  say(message: string): void {
    this.#status.textContent = message;
  }

  #show(isRunning: boolean, message: string): void {
    for (const button of this.#idle) button.hidden = isRunning;
    for (const button of this.#during) button.hidden = !isRunning;
    this.#progress.hidden = !isRunning;
    this.say(message);
  }
}
