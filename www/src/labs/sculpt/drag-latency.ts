/**
 * Measures the two latencies of moving an ellipsoid in the Sculpt lab: of the display, until the page itself has
 * deformed the displayed surface accordingly, and of the model, until a frame that the worker computed for the new pose
 * is drawn.
 */
export class DragLatency {
  /**
   * Poses of the ellipsoids sent to the model of which no drawn frame takes account yet: their ids, the times at which
   * they were sent, in milliseconds, and the number of frames drawn before.
   */
  #pending: { poseId: number; at: number; drawn: number }[] = [];
  #drawn = 0;
  #displayMs: number | undefined;
  #last: { milliseconds: number; frames: number } | undefined;

  /**
   * Latency of the display at the last move of an ellipsoid: milliseconds until the page itself had deformed the
   * displayed surface; undefined before the first move.
   */
  get displayMs(): number | undefined {
    return this.#displayMs;
  }

  /**
   * Latency of the model, undefined until it was measured: milliseconds, and number of frames drawn, from the sending
   * of a pose of the ellipsoids until a frame that takes account of it was drawn. Where one frame is the first to take
   * account of several poses, measured from the oldest.
   */
  get last(): { milliseconds: number; frames: number } | undefined {
    return this.#last;
  }

  /** Records that a pose of the ellipsoids was sent to the model at the time `at`, in milliseconds. */
  poseSent(poseId: number, at: number): void {
    this.#pending.push({ poseId, at, drawn: this.#drawn });
  }

  /**
   * Records that the page has deformed the displayed surface for a move of an ellipsoid that happened `milliseconds`
   * ago.
   */
  carried(milliseconds: number): void {
    this.#displayMs = milliseconds;
  }

  /**
   * Records that a frame of the model that takes account of all poses up to `poseId` was drawn at the time `at`, in
   * milliseconds; returns whether it is the first to do so for any of them.
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
