/** Work of a user in a lab that is not saved, and is lost with the lab or the page unless it is kept. */
import { text } from '../texts';

/** Kinds of work: labels that were painted, edits of a surface, shapes that were deformed, and runs that were started. */
export type WorkKind = 'painted' | 'edited' | 'shaped' | 'run';

const SENTENCES = {
  painted: 'work.painted',
  edited: 'work.edited',
  shaped: 'work.shaped',
  run: 'work.run',
} as const satisfies Record<WorkKind, string>;

/** Returns sentences that say that work of these kinds is not saved. */
export const sentencesOf = (kinds: readonly WorkKind[]): string[] => kinds.map((kind) => text(SENTENCES[kind]));

/** The unsaved work in a lab since its data were opened. */
export class Work {
  readonly #unsaved = new Set<WorkKind>();
  #isAny = false;
  #isResumed = false;
  /** Called after each change of the work. */
  onChange: () => void = () => undefined;

  did(kind: WorkKind): void {
    this.#unsaved.add(kind);
    this.#isAny = true;
    this.onChange();
  }

  /** Tells that work of these kinds is saved or undone; without kinds, all. */
  settled(...kinds: WorkKind[]): void {
    if (kinds.length === 0) this.#unsaved.clear();
    for (const kind of kinds) this.#unsaved.delete(kind);
    this.onChange();
  }

  /** Continues work that was brought back, of which these kinds are not saved. */
  resume(kinds: readonly WorkKind[]): void {
    for (const kind of kinds) this.#unsaved.add(kind);
    this.#isAny = true;
    this.#isResumed = true;
    this.onChange();
  }

  /** Tells that other data have taken the place of those that the work was on. */
  end(): void {
    this.#isAny = false;
    this.#isResumed = false;
    this.settled();
  }

  /** Whether anything was done since the data were opened, saved or not. */
  get isAny(): boolean {
    return this.#isAny;
  }

  /** Whether it was brought back. */
  get isResumed(): boolean {
    return this.#isResumed;
  }

  /** Kinds of work that is not saved. */
  get kinds(): WorkKind[] {
    return [...this.#unsaved];
  }

  /** Sentences that say what is not saved. */
  get unsaved(): string[] {
    return sentencesOf(this.kinds);
  }

  /** The same for what nobody could have the app do again: a run can be started again. */
  get unsavedByHand(): string[] {
    return sentencesOf(this.kinds.filter((kind) => kind !== 'run'));
  }
}
