import { carried } from '../sculpt/carry';
import { samePose } from '../sculpt/ellipsoids';
import type { FrameEvent, Pose, Surface } from '../sculpt/protocol';
import type { SculptureView } from '../view/sculpture';

/**
 * Keeps the surface under a hand that is ahead of the model: between two frames of the model what is drawn goes along
 * with the ellipsoids at once, and each frame of the model takes its place.
 */
export class Ahead {
  readonly #view: SculptureView;
  /** The last frame of the model. */
  #frame: FrameEvent | undefined;
  /** Where the hand is, until the model is there too. */
  #hand: { pose: Pose; turn: number } | undefined;

  constructor(view: SculptureView) {
    this.#view = view;
  }

  /** The hand has moved; true where the surface went along. */
  follow(pose: Pose, turn: number): boolean {
    this.#hand = { pose, turn };
    return this.#carry();
  }

  /** A frame of the model is shown. */
  shown(frame: FrameEvent): void {
    this.#frame = frame;
    const hand = this.#hand;
    if (!hand) return;
    // The model is on its way to the hand as long as it has not heard the newest, or nobody has sent it elsewhere.
    const onItsWay = frame.turn < hand.turn || samePose(frame.pose, hand.pose);
    if (!onItsWay || samePose(frame.ellipsoids, hand.pose)) this.#hand = undefined;
    else this.#carry();
  }

  /** Nothing moves any more: what is seen is the model. */
  rest(): void {
    if (!this.#hand) return;
    this.#hand = undefined;
    this.#place((surface) => surface.positions);
  }

  /** Another scene. */
  clear(): void {
    this.#frame = undefined;
    this.#hand = undefined;
  }

  #carry(): boolean {
    const [before, after] = [this.#frame?.ellipsoids, this.#hand?.pose];
    // While some vanish, the two are not about the same ellipsoids.
    if (!before || !after || before.length !== after.length) return false;
    this.#place(({ positions, vertices }) => carried(positions, before, after, vertices));
    return true;
  }

  #place(placesOf: (surface: Surface) => Float32Array): void {
    if (!this.#frame) return;
    const { result, base } = this.#frame;
    this.#view.move('S1dash', placesOf(result));
    if (base) this.#view.move('S0dash', placesOf(base));
  }
}
