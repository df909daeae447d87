import { text } from '../texts';
import { h, uniqueId, wideButton } from './dom';

/** The user's wishes that {@link SessionControls} reports. */
export interface SessionEvents {
  /** Saves a session; `included`: with the data that it was made from. */
  onSaveSession: (included: boolean) => void;
  /** Shows what is kept of work that is not saved. */
  onShowKept: () => void;
}

/** The wishes about code that repeats the run, in labs whose model runs. */
export interface CodeEvents {
  onCopyCode: () => void;
  /** Saves the data as a file that the code reads. */
  onSaveData: () => void;
}

/** Controls that save the session, and copy the run as code. */
export class SessionControls {
  readonly element: HTMLElement;
  readonly #buttons: HTMLButtonElement[] = [];

  /** `help` describes a session of the lab. */
  constructor({ onSaveSession, onShowKept }: SessionEvents, help: string) {
    const included = h('input', { type: 'checkbox', 'data-session': 'included' });
    this.element = h(
      'div',
      { class: 'session' },
      ...this.#action('session', text('sessions.save'), help, () => onSaveSession(included.checked)),
      h('label', { class: 'check' }, included, text('sessions.include')),
      wideButton(text('kept.open'), 'kept', onShowKept),
    );
  }

  /** Adds the controls for code. */
  addCode({ onCopyCode, onSaveData }: CodeEvents): void {
    this.element.append(
      ...this.#action('code', text('sessions.copyCode'), text('sessions.copyCodeHelp'), onCopyCode),
      ...this.#action('data', text('sessions.saveData'), text('sessions.saveDataHelp'), onSaveData),
    );
  }

  set enabled(enabled: boolean) {
    for (const button of this.#buttons) button.disabled = !enabled;
  }

  #action(name: string, label: string, help: string, onclick: () => void): HTMLElement[] {
    const id = uniqueId('session');
    const button = wideButton(label, name, onclick);
    button.setAttribute('aria-describedby', id);
    button.disabled = true;
    this.#buttons.push(button);
    return [button, h('p', { class: 'help', id }, help)];
  }
}
