import './style.css';
import { ExtractLab } from './labs/extract';
import type { Lab, LabKind, PassedOn } from './labs/labs';
import { ReconstructLab } from './labs/reconstruct';
import { h } from './ui/dom';

/** The first is what an empty or unknown address opens. */
const LABS: [LabKind, ...LabKind[]] = [
  {
    id: 'extract',
    name: 'Extract',
    tagline: 'A closed surface that splits and merges as it grows onto your data. Nothing leaves this machine.',
    open: (root, help) => new ExtractLab(root, help),
  },
  {
    id: 'reconstruct',
    name: 'Reconstruct',
    tagline: 'A smooth closed surface through sparse and noisy points. Nothing leaves this machine.',
    open: (root, help, passOn) => new ReconstructLab(root, help, passOn),
  },
];

/** The labs on the one page: one is open at a time, the others keep nothing but their address. */
class Labs {
  readonly #root: HTMLElement;
  readonly #help: HTMLElement;
  readonly #links = new Map<string, HTMLAnchorElement>();
  #kind: LabKind | undefined;
  #lab: Lab | undefined;

  constructor(root: HTMLElement, help: HTMLElement, nav: HTMLElement) {
    this.#root = root;
    this.#help = help;
    for (const { id, name } of LABS) {
      const link = h('a', { href: `#${id}`, 'data-lab': id }, name);
      this.#links.set(id, link);
      nav.append(link);
    }
    // Before the address changes, so that the way back leads to where one was.
    nav.addEventListener('click', () => this.#remember());
    // In the capture phase of the window, ahead of what an open lab listens to.
    window.addEventListener('hashchange', () => this.#follow(), true);
    this.#follow();
  }

  #follow(): void {
    const kind = LABS.find(({ id }) => location.hash === `#${id}` || location.hash.startsWith(`#${id}?`));
    if (kind ? kind !== this.#kind : !this.#kind) this.#open(kind ?? LABS[0]);
  }

  #open(kind: LabKind, passedOn?: PassedOn): void {
    this.#lab?.close();
    this.#lab = undefined;
    this.#kind = kind;
    this.#present(kind);
    this.#root.dataset.state = 'loading';
    try {
      this.#lab = kind.open(this.#root, this.#help, (volume) => this.#passOn(volume));
      void this.#lab.start(passedOn);
    } catch (error) {
      this.#root.dataset.state = 'error';
      this.#root.textContent = `This page needs WebGL 2 and Web Workers, and could not use them here: ${error instanceof Error ? error.message : error}`;
    }
  }

  #passOn(volume: PassedOn): void {
    this.#remember();
    // Without a hashchange: the lab is opened here, on the volume.
    history.pushState(null, '', `#${LABS[0].id}`);
    this.#open(LABS[0], volume);
  }

  #remember(): void {
    const link = this.#kind && this.#links.get(this.#kind.id);
    if (link && location.hash.startsWith(`#${this.#kind?.id}`)) link.setAttribute('href', location.hash);
  }

  #present({ id, name, tagline }: LabKind): void {
    document.title = `Vesicle: ${name}`;
    for (const [one, link] of this.#links) {
      if (one === id) link.setAttribute('aria-current', 'page');
      else link.removeAttribute('aria-current');
    }
    const title = document.getElementById('lab-name');
    if (title) title.textContent = name;
    const text = document.querySelector('.tagline');
    if (text) text.textContent = tagline;
  }
}

const lab = document.getElementById('lab');
const help = document.getElementById('help');
const nav = document.getElementById('labs');
if (lab && help && nav) new Labs(lab, help, nav);
