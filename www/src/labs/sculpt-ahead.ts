import { carried } from '../sculpt/carry';
import { samePose } from '../sculpt/ellipsoids';
import type { FrameEvent, Pose, Surface } from '../sculpt/protocol';
import type { SculptureView } from '../view/sculpture';

/**
 * Carries the displayed surface along with the ellipsoids at once during a drag, between two frames of the model; each
 * frame of the model replaces it.
 */
export class Ahead {
  readonly #view: SculptureView;
  /** The last frame of the model. */
  #frame: FrameEvent | undefined;
  /** Pose under the pointer, until the model has reached it. */
  #hand: { pose: Pose; turn: number } | undefined;

  constructor(view: SculptureView) {
    this.#view = view;
  }

  /** Carries the surface to a dragged pose; returns whether that was possible. */
  follow(pose: Pose, turn: number): boolean {
    this.#hand = { pose, turn };
    return this.#carry();
  }

  /** Takes a frame of the model, and carries it on if the pointer is still ahead. */
  shown(frame: FrameEvent): void {
    this.#frame = frame;
    const hand = this.#hand;
    if (!hand) return;
    // The model still approaches the dragged pose if it has not received the newest, or has not been sent elsewhere
    // since.
    const onItsWay = frame.turn < hand.turn || samePose(frame.pose, hand.pose);
    if (!onItsWay || samePose(frame.ellipsoids, hand.pose)) this.#hand = undefined;
    else this.#carry();
  }

  /** Displays the surface of the model itself, once nothing moves. */
  rest(): void {
    if (!this.#hand) return;
    this.#hand = undefined;
    this.#place((surface) => surface.positions);
  }

  /** Forgets the frame and the pose, for another scene. */
  clear(): void {
    this.#frame = undefined;
    this.#hand = undefined;
  }

  #carry(): boolean {
    const [before, after] = [this.#frame?.ellipsoids, this.#hand?.pose];
    // While ellipsoids vanish, the poses do not correspond.
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
