/** How soon a hand is answered: by the surface that goes along at once, and by the model's own frame. */
export class Answers {
  /** Poses that no frame of the model has followed yet. */
  #waiting: { turn: number; at: number; drawn: number }[] = [];
  #drawn = 0;
  #alongMs: number | undefined;
  /** Of the last pose that the model answered: milliseconds, and frames of the model. */
  #last: { milliseconds: number; frames: number } | undefined;

  /** Milliseconds from the last move to the surface on the screen that goes along. */
  get alongMs(): number | undefined {
    return this.#alongMs;
  }

  get last(): { milliseconds: number; frames: number } | undefined {
    return this.#last;
  }

  sent(turn: number, at: number): void {
    this.#waiting.push({ turn, at, drawn: this.#drawn });
  }

  /** The surface on the screen goes along with a move that was `milliseconds` ago. */
  along(milliseconds: number): void {
    this.#alongMs = milliseconds;
  }

  /** A frame that follows all poses up to `turn` is on the screen; true where that answers one. */
  drawn(turn: number, at: number): boolean {
    this.#drawn += 1;
    const oldest = this.#waiting.find((one) => one.turn <= turn);
    if (!oldest) return false;
    this.#waiting = this.#waiting.filter((one) => one.turn > turn);
    this.#last = { milliseconds: at - oldest.at, frames: this.#drawn - oldest.drawn };
    return true;
  }

  clear(): void {
    this.#waiting = [];
    this.#alongMs = undefined;
    this.#last = undefined;
  }
}
