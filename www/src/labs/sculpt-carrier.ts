import { deformPoints } from '../sculpt/deform';
import { samePose } from '../sculpt/ellipsoids';
import type { FrameEvent, Pose, Surface } from '../sculpt/protocol';
import type { SculptureView } from '../view/sculpture';

/**
 * Deforms the displayed surface along with the ellipsoids at once during a drag, between two frames of the model; each
 * frame of the model replaces the result.
 */
export class SurfaceCarrier {
  readonly #view: SculptureView;
  /** The last frame of the model. */
  #frame: FrameEvent | undefined;
  /** Pose under the pointer, and its id, until the model has reached it. */
  #dragged: { pose: Pose; poseId: number } | undefined;

  constructor(view: SculptureView) {
    this.#view = view;
  }

  /**
   * Deforms the displayed surface to a dragged pose; returns false if that was not possible, because there is no frame
   * of the model yet or the number of ellipsoids has changed.
   */
  dragTo(pose: Pose, poseId: number): boolean {
    this.#dragged = { pose, poseId };
    return this.#deform();
  }

  /**
   * Takes a frame of the model that is displayed, and deforms its surface to the pointer's pose if the model has not
   * reached it.
   */
  frameShown(frame: FrameEvent): void {
    this.#frame = frame;
    const dragged = this.#dragged;
    if (!dragged) return;
    // The model still approaches the dragged pose if it has not received the newest, or has not been sent elsewhere
    // since.
    const onItsWay = frame.poseId < dragged.poseId || samePose(frame.pose, dragged.pose);
    if (!onItsWay || samePose(frame.ellipsoids, dragged.pose)) this.#dragged = undefined;
    else this.#deform();
  }

  /** Displays the surface of the model itself, once nothing moves. */
  stop(): void {
    if (!this.#dragged) return;
    this.#dragged = undefined;
    this.#place((surface) => surface.positions);
  }

  /** Forgets the frame and the pose, for another scene. */
  clear(): void {
    this.#frame = undefined;
    this.#dragged = undefined;
  }

  #deform(): boolean {
    const [before, after] = [this.#frame?.ellipsoids, this.#dragged?.pose];
    // While ellipsoids vanish, the poses do not correspond.
    if (!before || !after || before.length !== after.length) return false;
    this.#place(({ positions, vertices }) => deformPoints(positions, before, after, vertices));
    return true;
  }

  #place(placesOf: (surface: Surface) => Float32Array): void {
    if (!this.#frame) return;
    const { result, base } = this.#frame;
    this.#view.move('S1dash', placesOf(result));
    if (base) this.#view.move('S0dash', placesOf(base));
  }
}
