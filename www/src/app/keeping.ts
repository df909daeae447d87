/**
 * Keeps labs: in the page when they are left, so that they come back as they were, and, if the user agrees, in the browser's
 * storage a moment after each change, so that they come back after a crash.
 */
import type { Lab } from '../lab/lab';
import type { WorkKind } from '../lab/work';
import { BrowserStore, type Kept, type KeptStore, PageStore } from './kept-store';
import { newName, openPages, PAGE } from './pages';

/** Milliseconds after a change until the lab is kept, and the least time between two times, as a multiple of what one takes. */
const REST = { milliseconds: 1000, times: 4 };
/** Milliseconds between the times that a lab is kept whose model runs: the run is paused for it. */
const RUNNING_REST = 30_000;

const CHOICE = 'vesicle.keep';

/** A lab that is open, and how it is kept. */
interface Open {
  lab: Lab;
  kind: string;
  id: string;
  /** Number of changes, and of those that are kept. */
  changes: number;
  kept: number;
  /** Whether the store has it. */
  isStored: boolean;
  timer: number;
}

export class Keeping {
  #store: KeptStore;
  /** Labs that this page has left, by their ids in addresses, and whether the store has them. */
  readonly #left = new Map<string, { kept: Kept; isStored: boolean }>();
  #open: Open | undefined;
  /** Settles when what is being kept is. */
  #turn: Promise<unknown> = Promise.resolve();
  /** Whether the user agrees to lose what is not saved. */
  mayLose = false;
  /** Called when the browser does not keep what it is to. */
  onFailure: (error: unknown) => void = () => undefined;
  /** Called when the open lab has changed. */
  onChange: () => void = () => undefined;
  /** Called when the user asks in a lab what is kept. */
  onShowKept: () => void = () => undefined;

  constructor() {
    this.#store = this.isAgreed ? new BrowserStore(openPages) : new PageStore();
  }

  /** Whether the user agrees that the browser keeps labs; undefined if they were not asked. */
  get choice(): boolean | undefined {
    const stored = storedChoice();
    return stored === null ? undefined : stored === 'yes';
  }

  get isAgreed(): boolean {
    return this.choice === true;
  }

  /** Takes the user's answer; without their agreement, what the browser has kept is deleted. */
  async choose(isAgreed: boolean): Promise<void> {
    if (isAgreed !== this.isAgreed) {
      if (!isAgreed) await this.forgetAll();
      this.#store = isAgreed ? new BrowserStore(openPages) : new PageStore();
      for (const one of this.#left.values()) one.isStored = await this.#put(one.kept);
      if (this.#open) this.#open.kept = -1;
    }
    storeChoice(isAgreed);
    this.#schedule();
  }

  /** Follows a lab that was opened; `id` is that of what was kept of it, if it is brought back. */
  follow(kind: string, lab: Lab, id: string = newName()): void {
    const open = { lab, kind, id, changes: 0, kept: 0, isStored: false, timer: 0 };
    this.#open = open;
    lab.onShowKept = () => this.onShowKept();
    lab.onChange = () => {
      if (this.#open !== open) return;
      open.changes += 1;
      this.onChange();
      this.#schedule();
    };
  }

  /** Returns the lab that this page has left, if its address is still the one it had, or none in particular. */
  leftAt(kind: string, hash: string): Kept | undefined {
    const { kept } = this.#left.get(kind) ?? {};
    return kept && (hash === kept.hash || hash === `#${kind}`) ? kept : undefined;
  }

  /** Whether the open lab has unsaved work that nobody could have the app do again. */
  get hasWorkByHand(): boolean {
    return (this.#open?.lab.work.unsavedByHand.length ?? 0) > 0;
  }

  /** Kinds of work that are lost with the page: they are not saved, and the browser does not keep them. */
  get lostWithPage(): WorkKind[] {
    const open = this.#open;
    if (this.mayLose) return [];
    const { isLasting } = this.#store;
    const isSafe = isLasting && open?.isStored && open.kept === open.changes;
    const left = [...this.#left].filter(([kind, { isStored }]) => kind !== open?.kind && !(isLasting && isStored));
    return [
      ...new Set([...(isSafe ? [] : (open?.lab.work.kinds ?? [])), ...left.flatMap(([, { kept }]) => kept.kinds)]),
    ];
  }

  /** Keeps the open lab at once, if that outlives the page and something has changed. */
  async now(): Promise<void> {
    const open = this.#open;
    if (!open || !this.#store.isLasting || open.kept === open.changes || open.lab.work.kinds.length === 0) return;
    clearTimeout(open.timer);
    await this.#keep(open);
  }

  /** Keeps the open lab, since it is left; returns whether none of its work is lost. */
  async leave(): Promise<boolean> {
    const open = this.#open;
    if (!open) return true;
    clearTimeout(open.timer);
    if (open.lab.isPlain) await this.giveUp();
    else await this.#keep(open);
    return this.#left.get(open.kind)?.kept.id === open.id || open.lab.work.kinds.length === 0;
  }

  /** Forgets the open lab, since nothing in it is to be kept. */
  async giveUp(): Promise<void> {
    const open = this.#open;
    if (!open) return;
    this.#left.delete(open.kind);
    await this.#forgetOpen(open);
  }

  /** Returns the labs with unsaved work that pages have left behind, which are closed. */
  async leftBehind(): Promise<Kept[]> {
    const open = await openPages();
    const all = await this.#attempt(() => this.#store.all());
    return (all ?? []).filter(({ id, page }) => id !== this.#open?.id && !open.has(page));
  }

  async forget(kept: Kept): Promise<void> {
    for (const [kind, left] of this.#left) if (left.kept.id === kept.id) this.#left.delete(kind);
    await this.#attempt(() => this.#store.delete(kept.id));
  }

  /** Forgets all that is kept, but for labs in other pages that are open. */
  async forgetAll(): Promise<void> {
    const open = await openPages();
    open.delete(PAGE);
    const all = (await this.#attempt(() => this.#store.all())) ?? [];
    for (const kept of all) if (!open.has(kept.page)) await this.forget(kept);
    this.#left.clear();
    if (this.#open) this.#open.isStored = false;
  }

  /** Keeps the open lab a moment later, if that outlives the page. */
  #schedule(delay = REST.milliseconds): void {
    const open = this.#open;
    if (!open || !this.#store.isLasting) return;
    clearTimeout(open.timer);
    open.timer = window.setTimeout(() => void this.#keepInTime(open), open.lab.isRunning ? RUNNING_REST : delay);
  }

  async #keepInTime(open: Open): Promise<void> {
    const start = performance.now();
    if (open.lab.work.kinds.length > 0) await this.#keep(open);
    else if (open.isStored) await this.#forgetOpen(open);
    const rest = Math.max(REST.milliseconds, REST.times * (performance.now() - start));
    if (open === this.#open && open.kept !== open.changes && open.lab.work.kinds.length > 0) this.#schedule(rest);
  }

  async #forgetOpen(open: Open): Promise<void> {
    open.isStored = false;
    await this.#attempt(() => this.#store.delete(open.id));
  }

  /** Keeps a lab as it is, after what is being kept. */
  #keep(open: Open): Promise<void> {
    const keeping = this.#turn.then(() => this.#keepNow(open));
    this.#turn = keeping;
    return keeping;
  }

  async #keepNow(open: Open): Promise<void> {
    const { changes, lab, id, kind } = open;
    const wasRunning = lab.isRunning;
    const captured = await lab.capture().catch(() => undefined);
    if (!captured) return;
    const kept = { ...captured, id, lab: kind, page: PAGE, time: Date.now() };
    open.isStored = captured.kinds.length > 0 && (await this.#put(kept));
    this.#left.set(kind, { kept, isStored: open.isStored });
    // A run that is paused for it has changed twice.
    open.kept = wasRunning ? open.changes : changes;
  }

  /** Returns whether the store has a lab now. */
  async #put(kept: Kept): Promise<boolean> {
    return (await this.#attempt(() => this.#store.put(kept).then(() => true))) ?? false;
  }

  async #attempt<Result>(work: () => Promise<Result>): Promise<Result | undefined> {
    try {
      return await work();
    } catch (error) {
      this.onFailure(error);
      return undefined;
    }
  }
}

function storedChoice(): string | null {
  try {
    return localStorage.getItem(CHOICE);
  } catch {
    return null;
  }
}

function storeChoice(isAgreed: boolean): void {
  try {
    localStorage.setItem(CHOICE, isAgreed ? 'yes' : 'no');
  } catch {
    // Without storage, the choice holds for this page.
  }
}
