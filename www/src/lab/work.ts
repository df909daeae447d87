/** Work of a user in a lab that is not saved, and is lost when the lab or the page is left. */
import { text } from '../texts';

/** Kinds of work: labels that were painted, edits of a surface, shapes that were deformed, and runs that were started. */
export type WorkKind = 'painted' | 'edited' | 'shaped' | 'run';

const SENTENCES = {
  painted: 'work.painted',
  edited: 'work.edited',
  shaped: 'work.shaped',
  run: 'work.run',
} as const satisfies Record<WorkKind, string>;

/** The unsaved work in a lab since its data were opened. */
export class Work {
  readonly #unsaved = new Set<WorkKind>();

  did(kind: WorkKind): void {
    this.#unsaved.add(kind);
  }

  /** Tells that work of these kinds is saved or undone; without kinds, all. */
  settled(...kinds: WorkKind[]): void {
    if (kinds.length === 0) this.#unsaved.clear();
    for (const kind of kinds) this.#unsaved.delete(kind);
  }

  /** Sentences that say what is not saved. */
  get unsaved(): string[] {
    return [...this.#unsaved].map((kind) => text(SENTENCES[kind]));
  }

  /** The same for what nobody could have the app do again: a run can be started again. */
  get unsavedByHand(): string[] {
    return [...this.#unsaved].filter((kind) => kind !== 'run').map((kind) => text(SENTENCES[kind]));
  }
}
