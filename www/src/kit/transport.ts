import type { StepReport } from '../engine/protocol';
import { text } from '../texts';
import { h, icon, prefersReducedMotion } from './dom';
import { count } from './format';
import type { LabState } from './state';

const PLAY = 'M7 4.5v15l12-7.5z';
const PAUSE = 'M6 5h4.5v14H6zM13.5 5H18v14h-4.5z';
const STEP = 'M6 5v14l9-7zM16 5h2.5v14H16z';
const STEPS = 'M3 5v14l7.5-7zM10.5 5v14L18 12zM18.5 5H21v14h-2.5z';
const UNDO = 'M8 5 2.5 10 8 15v-3.5h6a3.5 3.5 0 0 1 0 7H8V21h6a6 6 0 0 0 0-12H8z';
const REDO = 'm16 5 5.5 5-5.5 5v-3.5h-6a3.5 3.5 0 0 0 0 7h6V21h-6a6 6 0 0 1 0-12h6z';
const RESET = 'M12 5V1L6 6.5 12 12V8a5 5 0 1 1-5 5H4a8 8 0 1 0 8-8z';

export interface TransportEvents {
  onToggle: () => void;
  onStep: (count: number) => void;
  onReset: () => void;
  onUndo: () => void;
  onRedo: () => void;
}

/** Buttons that control a run (play, pause, step, reset, undo, redo), and its progress. */
export class Transport {
  readonly element: HTMLElement;
  readonly #play: HTMLButtonElement;
  readonly #playIcon = h('span', { class: 'icon-holder' });
  readonly #playText = h('span');
  readonly #step: HTMLButtonElement;
  readonly #steps: HTMLButtonElement;
  readonly #reset: HTMLButtonElement;
  readonly #undo: HTMLButtonElement;
  readonly #redo: HTMLButtonElement;
  readonly #iteration = h('span', { class: 'iteration' });
  readonly #phase = h('span', { class: 'phase' });
  readonly #progress = h('progress', { max: 1, 'aria-label': text('controls.progress') });

  constructor({ onToggle, onStep, onReset, onUndo, onRedo }: TransportEvents) {
    this.#play = h(
      'button',
      { type: 'button', class: 'primary play', onclick: onToggle },
      this.#playIcon,
      this.#playText,
    );
    this.#step = labelled(STEP, text('controls.step'), () => onStep(1));
    this.#steps = labelled(STEPS, text('controls.tenSteps'), () => onStep(10));
    this.#reset = labelled(RESET, text('controls.reset'), onReset);
    this.#undo = h(
      'button',
      { type: 'button', 'data-transport': 'undo', onclick: onUndo },
      icon(UNDO),
      word(text('controls.undo')),
    );
    this.#redo = h(
      'button',
      { type: 'button', 'data-transport': 'redo', onclick: onRedo },
      icon(REDO),
      word(text('controls.redo')),
    );
    const all = [this.#play, this.#step, this.#steps, this.#reset, this.#undo, this.#redo];
    const buttons = h('div', { class: 'buttons' }, ...all);
    const where = h('div', { class: 'where' }, this.#iteration, this.#phase);
    this.element = h(
      'div',
      { class: 'transport', role: 'group', 'aria-label': text('controls.runControls') },
      buttons,
      where,
      this.#progress,
    );
    this.showReport(undefined);
    this.showState('loading', false);
    this.showUndo(undefined, undefined);
  }

  /**
   * Sets the names of the changes that undo and redo would affect, which the buttons show; undefined disables the
   * button.
   */
  showUndo(undoable: string | undefined, redoable: string | undefined): void {
    showUndoable(this.#undo, text('controls.undo'), undoable);
    showUndoable(this.#redo, text('controls.redo'), redoable);
  }

  /**
   * Shows the state of the lab: enables the buttons that apply, and labels the play button. `ready`: whether there is a
   * model to run.
   */
  showState(state: LabState, ready: boolean): void {
    const running = state === 'running';
    this.#playIcon.replaceChildren(icon(running ? PAUSE : PLAY));
    this.#playText.textContent = running ? text('controls.pause') : text('controls.play');
    const idle = ready && state !== 'loading';
    this.#play.disabled = !idle || state === 'done';
    this.#step.disabled = !idle || running || state === 'done';
    this.#steps.disabled = this.#step.disabled;
    this.#reset.disabled = !idle;
    this.#showBusy(state);
  }

  showReport(report: StepReport | undefined): void {
    this.#iteration.textContent = text('controls.iteration', { number: count(report?.iteration ?? 0) });
    this.#phase.textContent = report?.phase ?? '';
    if (report && Number.isFinite(report.progress)) this.#progress.value = report.progress;
    else this.#progress.value = 0;
  }

  #showBusy(state: LabState): void {
    // A progress bar without a value is animated: the duration is unknown.
    if (state === 'loading' && !prefersReducedMotion()) this.#progress.removeAttribute('value');
    else if (!this.#progress.hasAttribute('value')) this.#progress.value = 0;
    if (state === 'done') this.#progress.value = 1;
  }
}

/** Labels a button for undo or redo (`verb`) with the change that it affects; undefined disables the button. */
export function showUndoable(button: HTMLButtonElement, verb: string, action: string | undefined): void {
  button.disabled = action === undefined;
  button.title =
    action === undefined ? text('controls.nothingTo', { verb }) : text('controls.doAction', { verb, action });
  button.setAttribute('aria-label', button.title);
}

/** Creates the text of a button with an icon; it is hidden where space is limited. */
function word(text: string): HTMLElement {
  return h('span', { class: 'word' }, text);
}

function labelled(path: string, text: string, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', onclick }, icon(path), h('span', {}, text));
}
