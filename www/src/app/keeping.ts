/**
 * Keeps labs: in the page when they are left, so that they come back as they were, and, if the user agrees, in the browser's
 * storage a moment after each change, so that they come back after a crash.
 */
import type { Lab } from '../lab/lab';
import type { WorkKind } from '../lab/work';
import { type Kept, KeptStore } from './kept-store';
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
  /** Id of what it is brought back from, which is kept until the lab itself is. */
  from: string | undefined;
  /** Whether it was brought back. */
  isBack: boolean;
  /** Whether there was work in it, since it was opened or before. */
  hadWork: boolean;
  /** Whether another lab is about to take its place. */
  isLeft: boolean;
  /** Number of changes, and of those that the page and the browser keep. */
  changes: number;
  kept: number;
  stored: number;
  timer: number;
}

export class Keeping {
  /** The browser's storage, if the user agrees. */
  #store: KeptStore | undefined;
  /** Labs of this page that are kept, by their ids in addresses. */
  readonly #kept = new Map<string, { kept: Kept; isStored: boolean }>();
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
    if (this.choice) this.#store = new KeptStore();
  }

  /** Whether the user agrees that the browser keeps labs; undefined if they were not asked. */
  get choice(): boolean | undefined {
    const stored = storedChoice();
    return stored === null ? undefined : stored === 'yes';
  }

  /** Takes the user's answer. Without their agreement, what the browser has kept is deleted, but for that of other open pages. */
  async choose(isAgreed: boolean): Promise<void> {
    storeChoice(isAgreed);
    if (isAgreed === (this.#store !== undefined)) return;
    if (this.#store) await this.#deleteAll(this.#store);
    this.#store = isAgreed ? new KeptStore() : undefined;
    for (const one of this.#kept.values()) one.isStored = one.kept.kinds.length > 0 && (await this.#put(one.kept));
    if (this.#open) this.#open.stored = -1;
    this.#schedule();
  }

  async #deleteAll(store: KeptStore): Promise<void> {
    const open = await openPages();
    const all = (await this.#attempt(() => store.all())) ?? [];
    for (const { id, page } of all) if (page === PAGE || !open.has(page)) await this.#attempt(() => store.delete(id));
  }

  /** Follows a lab that was opened; `from` is the id of what it was brought back from. */
  follow(kind: string, lab: Lab, from?: string): void {
    const open: Open = {
      ...{ lab, kind, id: newName(), from, isBack: false, hadWork: false, isLeft: false },
      ...{ changes: 0, kept: -1, stored: -1, timer: 0 },
    };
    this.#open = open;
    lab.onShowKept = () => this.onShowKept();
    lab.onChange = () => {
      if (this.#open !== open) return;
      open.changes += 1;
      open.isBack ||= lab.work.isResumed;
      open.hadWork ||= lab.work.isAny;
      this.onChange();
      this.#schedule();
    };
  }

  /** Returns the lab that this page has left, if its address is still the one it had, or none in particular. */
  leftAt(kind: string, hash: string): Kept | undefined {
    const { kept } = this.#kept.get(kind) ?? {};
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
    const own = open && open.stored !== open.changes ? open.lab.work.kinds : [];
    const isOpen = (kind: string) => kind === open?.kind && open.hadWork;
    const left = [...this.#kept].filter(([kind, { isStored }]) => !isOpen(kind) && !isStored);
    return [...new Set([...own, ...left.flatMap(([, { kept }]) => kept.kinds)])];
  }

  /** Has the browser keep the open lab at once, if it has changed. */
  async now(): Promise<void> {
    const open = this.#open;
    if (open && this.#store && open.stored !== open.changes && open.lab.work.kinds.length > 0) await this.#keep(open);
  }

  /** Keeps the open lab, since it is left; returns whether none of its work is lost. */
  async leave(): Promise<boolean> {
    const open = this.#open;
    if (!open) return true;
    clearTimeout(open.timer);
    // A lab that is not back yet stays kept.
    if (open.from && !open.hadWork) return true;
    if (open.lab.isPlain) await this.giveUp();
    else await this.#keep(open).catch(() => undefined);
    open.isLeft = open.kept === open.changes || open.lab.work.kinds.length === 0;
    return open.isLeft;
  }

  /** Forgets the open lab, since nothing in it is to be kept. */
  async giveUp(): Promise<void> {
    if (!this.#open) return;
    this.#open.isLeft = true;
    this.#kept.delete(this.#open.kind);
    await this.#forget(this.#open);
  }

  /** Returns the labs with unsaved work that pages have left behind, which are closed. */
  async leftBehind(): Promise<Kept[]> {
    const open = await openPages();
    const all = (await this.#attempt(async () => this.#store?.all())) ?? [];
    return all.filter(({ id, page }) => id !== this.#open?.from && !open.has(page));
  }

  /** Deletes what the browser has kept of another page. */
  async discard({ id }: Kept): Promise<void> {
    await this.#attempt(async () => this.#store?.delete(id));
  }

  /** Has the browser keep the open lab a moment later. */
  #schedule(delay = REST.milliseconds): void {
    const open = this.#open;
    if (!open || !this.#store) return;
    clearTimeout(open.timer);
    open.timer = window.setTimeout(() => void this.#keepInTime(open), open.lab.isRunning ? RUNNING_REST : delay);
  }

  async #keepInTime(open: Open): Promise<void> {
    if (open.isLeft) return;
    const start = performance.now();
    const hasWork = () => open.lab.work.kinds.length > 0;
    if (hasWork()) await this.#keep(open).catch((error) => this.onFailure(error));
    else await this.#forget(open);
    const isDone = open.stored === open.changes && !open.lab.isRunning;
    if (open !== this.#open || isDone || !hasWork()) return;
    this.#schedule(Math.max(REST.milliseconds, REST.times * (performance.now() - start)));
  }

  /** Has the browser forget an open lab, and what it was brought back from. */
  async #forget(open: Open): Promise<void> {
    if (!open.hadWork) return;
    open.stored = -1;
    await this.#attempt(async () => this.#store?.delete(open.id));
    await this.#forgetOrigin(open);
  }

  /** Keeps a lab as it is, after what is being kept, unless it cannot be saved now. Throws if it cannot be saved at all. */
  #keep(open: Open): Promise<void> {
    const keeping = this.#turn.then(() => this.#keepNow(open));
    this.#turn = keeping.catch(() => undefined);
    return keeping;
  }

  async #keepNow(open: Open): Promise<void> {
    const { lab, id, kind } = open;
    const [before, wasRunning] = [open.changes, lab.isRunning];
    const captured = await lab.capture();
    if (!captured) return;
    // A run that is paused for it has changed twice.
    const changes = wasRunning ? open.changes : before;
    const kept = { ...captured, id, lab: kind, page: PAGE, time: Date.now() };
    open.kept = changes;
    const one = { kept, isStored: false };
    this.#kept.set(kind, one);
    one.isStored = kept.kinds.length > 0 && (await this.#put(kept));
    if (!one.isStored) return;
    open.stored = changes;
    await this.#forgetOrigin(open);
  }

  /** Has the browser forget what a lab was brought back from. */
  async #forgetOrigin(open: Open): Promise<void> {
    const { from } = open;
    if (!from || !open.isBack) return;
    open.from = undefined;
    await this.#attempt(async () => this.#store?.delete(from));
  }

  /** Returns whether the browser keeps a lab now. */
  async #put(kept: Kept): Promise<boolean> {
    const store = this.#store;
    return (store && (await this.#attempt(() => store.put(kept).then(() => true)))) ?? false;
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
