/**
 * Measures the latency of moving an ellipsoid: until the displayed surface is carried along, and until the model's
 * frame follows.
 */
export class Answers {
  /** Poses sent that no frame of the model has followed yet: their number, the time, and the frames drawn by then. */
  #waiting: { turn: number; at: number; drawn: number }[] = [];
  #drawn = 0;
  #alongMs: number | undefined;
  /** Latency of the model for the last pose it followed: milliseconds, and frames drawn. */
  #last: { milliseconds: number; frames: number } | undefined;

  /** Display latency: milliseconds from the last move to the displayed surface that was carried along. */
  get alongMs(): number | undefined {
    return this.#alongMs;
  }

  /** Latency of the model for the last pose it followed: milliseconds, and frames drawn. */
  get last(): { milliseconds: number; frames: number } | undefined {
    return this.#last;
  }

  /** Records that a pose was sent. */
  sent(turn: number, at: number): void {
    this.#waiting.push({ turn, at, drawn: this.#drawn });
  }

  /** Records that the surface drawn follows a move `milliseconds` ago. */
  along(milliseconds: number): void {
    this.#alongMs = milliseconds;
  }

  /**
   * Records that a frame following all poses up to `turn` was drawn; returns whether any pose was pending until then.
   */
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
