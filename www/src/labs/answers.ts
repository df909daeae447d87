/** How soon the surface follows a hand: from the pose that was sent to the frame on the screen that follows it. */
export class Answers {
  /** Poses that no frame has followed yet. */
  #waiting: { turn: number; at: number; drawn: number }[] = [];
  #drawn = 0;
  /** Of the last pose that was answered: milliseconds, and frames of the model. */
  #last: { milliseconds: number; frames: number } | undefined;

  get last(): { milliseconds: number; frames: number } | undefined {
    return this.#last;
  }

  sent(turn: number, at: number): void {
    this.#waiting.push({ turn, at, drawn: this.#drawn });
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
    this.#last = undefined;
  }
}
