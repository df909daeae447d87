/** Asks whether the browser may keep unsaved work, offers what it has kept, and lets the user forget it. */
import { h, uniqueId } from '../kit/dom';
import { LANGUAGE, text } from '../texts';
import type { Keeping } from './keeping';
import { type Kept, MOST, TooLargeToKeep } from './kept-store';
import type { Labs } from './labs';
import { labCalled } from './list';

const TIME = new Intl.DateTimeFormat(LANGUAGE, { dateStyle: 'medium', timeStyle: 'short' });

/** Where unsaved work is shown: a notice on the page, and a dialog. */
export class KeptWork {
  readonly #keeping: Keeping;
  readonly #labs: Labs;
  readonly #notice: HTMLElement;
  /** Whether the question was asked on this page. */
  #isAsked = false;

  constructor(keeping: Keeping, labs: Labs, notice: HTMLElement) {
    this.#keeping = keeping;
    this.#labs = labs;
    this.#notice = notice;
    notice.setAttribute('aria-label', text('kept.title'));
    keeping.onShowKept = () => void this.#showDialog();
    keeping.onChange = () => this.#ask();
    keeping.onFailure = (error) => this.#say(text('kept.failed', { message: reasonOf(error) }));
    if (keeping.choice) void this.#offer();
  }

  /** Offers on the page what is kept of pages that were closed. */
  async #offer(): Promise<void> {
    const kept = await this.#keeping.leftBehind();
    if (kept.length === 0) return;
    const list = this.#list(kept, () => this.#hide());
    this.#show(
      h('p', {}, text('kept.left')),
      this.#button(text('kept.later'), () => this.#hide()),
      list,
    );
  }

  /** Asks once, after the first work by hand, if the user was never asked. */
  #ask(): void {
    const keeping = this.#keeping;
    if (this.#isAsked || keeping.choice !== undefined || !keeping.hasWorkByHand) return;
    this.#isAsked = true;
    const answer = (isAgreed: boolean) => () => {
      this.#hide();
      void keeping.choose(isAgreed);
    };
    const yes = this.#button(text('kept.yes'), answer(true));
    this.#show(h('p', {}, text('kept.ask', { days: MOST.days })), yes, this.#button(text('kept.no'), answer(false)));
  }

  #say(message: string): void {
    this.#show(
      h('p', {}, message),
      this.#button(text('controls.close'), () => this.#hide()),
    );
  }

  async #showDialog(): Promise<void> {
    const kept = await this.#keeping.leftBehind();
    const [title, help] = [uniqueId('kept'), uniqueId('kept')];
    const close = () => dialog.close();
    const choice = h('input', { type: 'checkbox', 'aria-describedby': help, checked: this.#keeping.choice === true });
    choice.addEventListener('change', () => {
      void this.#keeping.choose(choice.checked);
      if (!choice.checked) list.remove();
    });
    const none = h('p', { class: 'help' }, text('kept.none'));
    const list = kept.length > 0 ? this.#list(kept, close) : none;
    const dialog = h(
      'dialog',
      { class: 'kept', 'aria-labelledby': title },
      h('h2', { id: title }, text('kept.title')),
      h('label', { class: 'check' }, choice, text('kept.keep')),
      h('p', { class: 'help', id: help }, text('kept.help', { days: MOST.days })),
      list,
      h('form', { method: 'dialog' }, h('button', { class: 'primary' }, text('controls.close'))),
    );
    dialog.addEventListener('close', () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  }

  /** Lists kept labs, each with what brings it back and what discards it; `onEnd` is called once none is left or one is back. */
  #list(kept: readonly Kept[], onEnd: () => void): HTMLElement {
    const list = h('ul', { class: 'kept-list' });
    for (const one of kept) {
      const name = nameOf(one);
      const entry = h('li', {}, h('span', {}, name));
      const remove = () => {
        entry.remove();
        if (list.childElementCount === 0) onEnd();
      };
      const back = () => {
        onEnd();
        this.#labs.bringBack(one);
      };
      const discard = () => void this.#keeping.discard(one).then(remove);
      const discarding = this.#button(text('kept.discard'), discard, name);
      entry.append(h('div', {}, this.#button(text('kept.back'), back, name), discarding));
      list.append(entry);
    }
    return list;
  }

  #button(label: string, onclick: () => void, of?: string): HTMLButtonElement {
    return h('button', { type: 'button', 'aria-label': of && `${label}: ${of}`, onclick }, label);
  }

  #show(...content: HTMLElement[]): void {
    this.#notice.replaceChildren(...content);
    this.#notice.hidden = false;
  }

  #hide(): void {
    this.#notice.hidden = true;
    this.#notice.replaceChildren();
  }
}

/** Returns what was kept, in a line: lab, data and time. */
function nameOf({ lab, name, time }: Kept): string {
  return text('kept.entry', { lab: labCalled(lab).name, name, time: TIME.format(time) });
}

/** Returns why the browser does not keep something. */
function reasonOf(error: unknown): string {
  if (error instanceof TooLargeToKeep) return text('kept.tooLarge', { gigabytes: MOST.bytes / 2 ** 30 });
  if (error instanceof DOMException && error.name === 'QuotaExceededError') return text('kept.noRoom');
  return error instanceof Error ? error.message : String(error);
}
