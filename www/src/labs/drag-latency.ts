/**
 * Measures the latency of moving an ellipsoid: until the displayed surface is carried along, and until the model's
 * frame follows.
 */
export class DragLatency {
  /** Poses sent that no frame of the model has followed yet: their number, the time, and the frames drawn by then. */
  #pending: { poseId: number; at: number; drawn: number }[] = [];
  #drawn = 0;
  #displayMs: number | undefined;
  /** Latency of the model for the last pose it followed: milliseconds, and frames drawn. */
  #last: { milliseconds: number; frames: number } | undefined;

  /** Display latency: milliseconds from the last move to the displayed surface that was carried along. */
  get displayMs(): number | undefined {
    return this.#displayMs;
  }

  /** Latency of the model for the last pose it followed: milliseconds, and frames drawn. */
  get last(): { milliseconds: number; frames: number } | undefined {
    return this.#last;
  }

  /** Records that a pose was sent. */
  poseSent(poseId: number, at: number): void {
    this.#pending.push({ poseId, at, drawn: this.#drawn });
  }

  /** Records that the surface drawn follows a move `milliseconds` ago. */
  carried(milliseconds: number): void {
    this.#displayMs = milliseconds;
  }

  /**
   * Records that a frame following all poses up to `poseId` was drawn; returns whether any pose was pending until then.
   */
  frameDrawn(poseId: number, at: number): boolean {
    this.#drawn += 1;
    const oldest = this.#pending.find((one) => one.poseId <= poseId);
    if (!oldest) return false;
    this.#pending = this.#pending.filter((one) => one.poseId > poseId);
    this.#last = { milliseconds: at - oldest.at, frames: this.#drawn - oldest.drawn };
    return true;
  }

  clear(): void {
    this.#pending = [];
    this.#displayMs = undefined;
    this.#last = undefined;
  }
}
