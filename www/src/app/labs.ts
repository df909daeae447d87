import { preloadWorker } from '../engine/channel';
import { h } from '../kit/dom';
import { mayLose } from '../kit/question';
import { labOf } from '../lab/address';
import type { Captured, Handoff, Lab, LabKind } from '../lab/lab';
import { text } from '../texts';
import type { Keeping } from './keeping';
import type { Kept } from './kept-store';
import { LABS, labCalled } from './list';

const sessionWorker = (name: string) =>
  new Worker(new URL('./session/worker.ts', import.meta.url), { type: 'module', name });

/**
 * Opens and closes the labs on the page: one is open at a time. The address of a closed lab, which contains its
 * settings, is kept in its link in the navigation.
 */
export class Labs {
  readonly #root: HTMLElement;
  readonly #help: HTMLElement;
  readonly #keeping: Keeping;
  readonly #links = new Map<string, HTMLAnchorElement>();
  #kind: LabKind | undefined;
  #lab: Lab | undefined;
  /**
   * Number of times a lab was opened. If it has increased by the time a lab's code is loaded, another lab was opened
   * meanwhile, and that code is not used.
   */
  #turn = 0;
  /** Opens something else, once the open lab is kept. */
  #next: (() => void) | undefined;

  constructor(root: HTMLElement, help: HTMLElement, nav: HTMLElement, keeping: Keeping) {
    this.#root = root;
    this.#help = help;
    this.#keeping = keeping;
    for (const { id, name } of LABS) {
      const link = h('a', { href: `#${id}`, 'data-lab': id }, name);
      this.#links.set(id, link);
      nav.append(link);
    }
    nav.addEventListener('click', (event) => this.#onLink(event));
    // In the capture phase, before the listeners of the open lab.
    window.addEventListener('hashchange', (event) => this.#follow(event), true);
    this.#follow();
  }

  /** Brings a lab back as it was kept, in place of the open one. */
  bringBack(kept: Kept): void {
    const kind = labCalled(kept.lab);
    this.#leave(() => {
      history.pushState(null, '', kept.hash);
      void this.#open(kind, asHandoff(kind, kept), kept);
    });
  }

  /** Opens `next` once the open lab is kept, or the user agrees to lose its work. The newest call wins. */
  #leave(next: () => void): void {
    const isLeaving = this.#next !== undefined;
    this.#next = next;
    if (!isLeaving) void this.#left().then((isLeft) => this.#goOn(isLeft));
  }

  async #left(): Promise<boolean> {
    if (await this.#keeping.leave()) return true;
    const losses = this.#lab?.work.unsaved ?? [];
    if (!(await mayLose(text('work.leave'), losses, text('work.leaveGo')))) return false;
    await this.#keeping.giveUp();
    return true;
  }

  #goOn(isLeft: boolean): void {
    const next = this.#next;
    this.#next = undefined;
    if (isLeft) next?.();
  }

  /** Follows a link to another lab, after the open one is kept. */
  #onLink(event: MouseEvent): void {
    // Before the address changes, so that the link leads back to the lab as it was.
    this.#remember();
    const link = [...this.#links.values()].find((one) => one === event.target);
    const isElsewhere = event.ctrlKey || event.metaKey || event.shiftKey;
    if (!link || isElsewhere || link.hasAttribute('aria-current') || (this.#lab?.isPlain ?? true)) return;
    event.preventDefault();
    this.#leave(() => {
      // pushState fires no hashchange.
      history.pushState(null, '', link.hash);
      void this.#open(labCalled(link.dataset.lab));
    });
  }

  /** Opens the lab of the address, unless it is open. */
  #follow(event?: HashChangeEvent): void {
    const kind = LABS.find(({ id }) => id === labOf(location.hash));
    if (kind ? kind === this.#kind : this.#kind) return;
    if (!event?.oldURL || !this.#lab) return void this.#open(kind ?? labCalled(undefined));
    if (this.#lab.isPlain && !this.#next) {
      void this.#keeping.leave();
      return void this.#open(kind ?? labCalled(undefined));
    }
    event.stopImmediatePropagation();
    // The address is that of the open lab as long as it is.
    history.replaceState(null, '', event.oldURL);
    this.#leave(() => {
      history.replaceState(null, '', event.newURL);
      void this.#open(kind ?? labCalled(undefined));
    });
  }

  /** Opens a lab: with what another passes on, or as it was kept, or as its address says. */
  async #open(kind: LabKind, passedOn?: Handoff, from = this.#keeping.leftAt(kind.id, location.hash)): Promise<void> {
    const kept = passedOn?.captured || !passedOn ? from : undefined;
    this.#lab?.close();
    this.#lab = undefined;
    this.#kind = kind;
    const turn = ++this.#turn;
    this.#present(kind);
    this.#root.dataset.state = 'loading';
    // The lab lists its shortcuts; a press before would be lost.
    this.#help.toggleAttribute('disabled', true);
    try {
      // The engine loads in parallel with the lab's own code.
      preloadWorker(kind.spawn);
      const make = await kind.load();
      if (turn !== this.#turn) return;
      this.#lab = make({
        ...{ root: this.#root, help: this.#help, guide: kind.guide, sessionWorker },
        passOn: (passedOn) => this.#passOn(passedOn),
      });
      this.#keeping.follow(kind.id, this.#lab, kept?.id);
      this.#help.toggleAttribute('disabled', false);
      void this.#lab.start(passedOn ?? (kept && asHandoff(kind, kept)));
    } catch (error) {
      this.#root.dataset.state = 'error';
      this.#root.textContent = text('shell.unsupported', {
        message: error instanceof Error ? error.message : String(error),
      });
    }
  }

  #passOn(passedOn: Handoff): void {
    this.#leave(() => {
      this.#remember();
      const kind = labCalled(passedOn.lab);
      history.pushState(null, '', `#${kind.id}`);
      void this.#open(kind, passedOn);
    });
  }

  #remember(): void {
    const link = this.#kind && this.#links.get(this.#kind.id);
    if (link && location.hash.startsWith(`#${this.#kind?.id}`)) link.setAttribute('href', location.hash);
  }

  #present({ id, name, tagline, guide }: LabKind): void {
    document.title = text('shell.title', { lab: name });
    for (const [one, link] of this.#links) {
      if (one === id) {
        link.setAttribute('aria-current', 'page');
        centreInBar(link);
      } else link.removeAttribute('aria-current');
    }
    const title = document.getElementById('lab-name');
    if (title) title.textContent = name;
    const summary = document.getElementById('tagline');
    if (summary) summary.textContent = tagline;
    document.getElementById('guide')?.setAttribute('href', guide);
  }
}

/**
 * Scrolls the bar of the labs, which is narrow on phones, to the middle of a link. After `scrollIntoView`, Tab would begin
 * behind the link.
 */
function centreInBar(link: HTMLElement): void {
  const bar = link.closest('.labs');
  if (!bar) return;
  const [whole, part] = [bar.getBoundingClientRect(), link.getBoundingClientRect()];
  bar.scrollLeft += (part.left + part.right - whole.left - whole.right) / 2;
}

/** Returns what brings a lab back as it was. */
const asHandoff = ({ id: lab }: LabKind, captured: Captured): Handoff => ({
  ...{ lab, captured, name: '', bytes: new Uint8Array(), params: {} },
});
