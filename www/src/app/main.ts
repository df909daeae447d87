import { LANGUAGE, text } from '../texts';
import '../kit/style.css';
import { preloadWorker } from '../engine/channel';
import { h } from '../kit/dom';
import { GUIDES } from '../kit/guides';
import { mayLose } from '../kit/question';
import { labOf } from '../lab/address';
import type { Handoff, Lab, LabKind } from '../lab/lab';
import { spawnExtract } from '../labs/extract/client';
import { spawnReconstruct } from '../labs/reconstruct/client';
import { spawnSculpt } from '../labs/sculpt/client';
import { spawnSegment } from '../labs/segment/client';
import { spawnTrack } from '../labs/track/client';
import { chooseLanguage, LANGUAGES } from '../texts/language';
import { workOffline } from './offline';

/**
 * The labs (the app's five pages), in the order of the navigation. If none is open yet, an empty or unknown address
 * opens the first one.
 */
const LABS: [LabKind, ...LabKind[]] = [
  {
    id: 'extract',
    name: text('shell.extract'),
    tagline: text('shell.extractTagline'),
    guide: GUIDES.extract,
    spawn: spawnExtract,
    load: async () => (await import('../labs/extract')).ExtractLab,
  },
  {
    id: 'reconstruct',
    name: text('shell.reconstruct'),
    tagline: text('shell.reconstructTagline'),
    guide: GUIDES.reconstruct,
    spawn: spawnReconstruct,
    load: async () => (await import('../labs/reconstruct')).ReconstructLab,
  },
  {
    id: 'track',
    name: text('shell.track'),
    tagline: text('shell.trackTagline'),
    guide: GUIDES.track,
    spawn: spawnTrack,
    load: async () => (await import('../labs/track')).TrackLab,
  },
  {
    id: 'sculpt',
    name: text('shell.sculpt'),
    tagline: text('shell.sculptTagline'),
    guide: GUIDES.sculpt,
    spawn: spawnSculpt,
    load: async () => (await import('../labs/sculpt')).SculptLab,
  },
  {
    id: 'segment',
    name: text('shell.segment'),
    tagline: text('shell.segmentTagline'),
    guide: GUIDES.segment,
    spawn: spawnSegment,
    load: async () => (await import('../labs/segment')).SegmentLab,
  },
];

/**
 * Opens and closes the labs on the page: one is open at a time. The address of a closed lab, which contains its
 * settings, is kept in its link in the navigation.
 */
class Labs {
  readonly #root: HTMLElement;
  readonly #help: HTMLElement;
  readonly #links = new Map<string, HTMLAnchorElement>();
  #kind: LabKind | undefined;
  #lab: Lab | undefined;
  /**
   * Number of times a lab was opened. If it has increased by the time a lab's code is loaded, another lab was opened
   * meanwhile, and that code is not used.
   */
  #turn = 0;

  constructor(root: HTMLElement, help: HTMLElement, nav: HTMLElement) {
    this.#root = root;
    this.#help = help;
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

  /** Sentences that say what is lost when the open lab is left. */
  get unsaved(): string[] {
    return this.#lab?.work.unsaved ?? [];
  }

  /** Whether the open lab may be left; asks if something is lost. */
  async mayLeave(losses = this.unsaved): Promise<boolean> {
    return losses.length === 0 || mayLose(text('work.leave'), losses, text('work.leaveGo'));
  }

  /** Forgets that something is not saved, since the user has agreed to lose it. */
  giveUp(): void {
    this.#lab?.work.settled();
  }

  #onLink(event: MouseEvent): void {
    // Before the address changes, so that the link leads back to the lab as it was.
    this.#remember();
    const link = [...this.#links.values()].find((one) => one === event.target);
    const isElsewhere = event.ctrlKey || event.metaKey || event.shiftKey;
    if (!link || isElsewhere || link.hasAttribute('aria-current') || this.unsaved.length === 0) return;
    event.preventDefault();
    void this.mayLeave().then((may) => {
      if (!may) return;
      this.giveUp();
      location.hash = link.hash;
    });
  }

  /** Opens the lab of the address, unless it is open. */
  #follow(event?: HashChangeEvent): void {
    const kind = LABS.find(({ id }) => id === labOf(location.hash));
    if (kind ? kind === this.#kind : this.#kind) return;
    if (event?.oldURL && this.unsaved.length > 0) void this.#leave(kind ?? LABS[0], event);
    else void this.#open(kind ?? LABS[0]);
  }

  /** Opens another lab after a change of the address, if the user agrees to lose what is not saved. */
  async #leave(kind: LabKind, event: HashChangeEvent): Promise<void> {
    event.stopImmediatePropagation();
    // The address is that of the open lab as long as it is.
    history.replaceState(null, '', event.oldURL);
    if (!(await this.mayLeave())) return;
    history.replaceState(null, '', event.newURL);
    await this.#open(kind);
  }

  async #open(kind: LabKind, passedOn?: Handoff): Promise<void> {
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
      const Kind = await kind.load();
      if (turn !== this.#turn) return;
      this.#lab = new Kind(this.#root, this.#help, (passedOn) => void this.#passOn(passedOn));
      this.#help.toggleAttribute('disabled', false);
      void this.#lab.start(passedOn);
    } catch (error) {
      this.#root.dataset.state = 'error';
      this.#root.textContent = text('shell.unsupported', {
        message: error instanceof Error ? error.message : String(error),
      });
    }
  }

  async #passOn(passedOn: Handoff): Promise<void> {
    // The surface of a run goes with it.
    if (!(await this.mayLeave(this.#lab?.work.unsavedByHand))) return;
    this.#remember();
    const kind = LABS.find(({ id }) => id === passedOn.lab) ?? LABS[0];
    // pushState fires no hashchange: the lab is opened here, with the data passed on.
    history.pushState(null, '', `#${kind.id}`);
    await this.#open(kind, passedOn);
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

/** Offers the lessons: a button shows and hides their panel, whose code is fetched when it is first needed. */
function offerLessons(lab: HTMLElement, opener: HTMLElement, panel: HTMLElement): void {
  const address = new URL(location.href).searchParams.get('lesson');
  const show = (shown: boolean) => {
    panel.hidden = !shown;
    opener.setAttribute('aria-expanded', String(shown));
    if (!shown) opener.focus();
  };
  let begun = false;
  const open = async () => {
    show(true);
    if (begun) return;
    begun = true;
    const { LessonPanel } = await import('../lessons/panel');
    const lessons = new LessonPanel(panel, lab, () => show(false));
    await (address ? lessons.open(address) : lessons.showList());
  };
  opener.textContent = text('shell.lessons');
  opener.addEventListener('click', () => (panel.hidden ? void open() : show(false)));
  if (address) void open();
}

function offerLanguages(select: HTMLElement, labs: Labs): void {
  const options = Object.entries(LANGUAGES).map(([id, name]) =>
    h('option', { value: id, lang: id, selected: id === LANGUAGE }, name),
  );
  select.replaceChildren(...options);
  select.setAttribute('aria-label', text('shell.language'));
  select.title = text('shell.languageHelp');
  select.addEventListener('change', () => {
    const list = select as HTMLSelectElement;
    const chosen = list.value;
    list.value = LANGUAGE;
    void labs.mayLeave([text('shell.languageConfirm'), ...labs.unsaved]).then((may) => {
      if (!may) return;
      labs.giveUp();
      chooseLanguage(chosen);
    });
  });
}

function openLabs(): void {
  const element = (id: string) => document.getElementById(id) ?? document.body;
  const [lab, help, nav] = [element('lab'), element('help'), element('labs')];
  nav.setAttribute('aria-label', text('shell.labs'));
  help.textContent = text('shell.shortcuts');
  help.setAttribute('aria-label', text('shell.shortcutsLabel'));
  const newTab = h('span', { class: 'visually-hidden' }, text('shell.newTab'));
  element('guide').replaceChildren(text('shell.guide'), newTab);
  offerLessons(lab, element('lessons'), element('lesson'));
  const labs = new Labs(lab, help, nav);
  offerLanguages(element('language'), labs);
  window.addEventListener('beforeunload', (event) => {
    if (labs.unsaved.length > 0) event.preventDefault();
  });
}

document.documentElement.lang = LANGUAGE;
const { searchParams } = new URL(location.href);
const view = searchParams.get('view');
if (view)
  void import('../lessons/sheet').then(({ showSheet }) =>
    showSheet(searchParams.get('lesson') ?? '', view === 'teacher'),
  );
else openLabs();
workOffline();
