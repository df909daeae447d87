import { deformSurface } from './deform';
import { samePose } from './ellipsoids';
import type { FrameEvent, Pose, Surface } from './protocol';
import type { SculptureView } from './scene';

/**
 * Deforms the displayed surface along with dragged ellipsoids at once, without waiting for the model; each frame that
 * the model computes replaces this approximation.
 */
export class SurfaceCarrier {
  readonly #view: SculptureView;
  /** Last displayed frame of the model, whose surface is deformed; undefined before the first. */
  #frame: FrameEvent | undefined;
  /** Pose of the ellipsoids under the pointer, and its id, until the model has reached it. */
  #dragged: { pose: Pose; poseId: number } | undefined;

  constructor(view: SculptureView) {
    this.#view = view;
  }

  /**
   * Deforms the displayed surface to a dragged pose of the ellipsoids; returns false if that was not possible, because
   * there is no frame of the model yet or the number of ellipsoids has changed.
   */
  dragTo(pose: Pose, poseId: number): boolean {
    this.#dragged = { pose, poseId };
    return this.#deform();
  }

  /**
   * Called when a frame of the model is displayed: deforms its surface to the pose under the pointer if the model has
   * not reached that pose.
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

  /** Displays the model's own surface in place of the approximation, once the run has stopped. */
  stop(): void {
    if (!this.#dragged) return;
    this.#dragged = undefined;
    this.#place((surface) => surface.positions);
  }

  /** Forgets the model's frame and the dragged pose, for another scene. */
  clear(): void {
    this.#frame = undefined;
    this.#dragged = undefined;
  }

  #deform(): boolean {
    const [before, after] = [this.#frame?.ellipsoids, this.#dragged?.pose];
    // While ellipsoids vanish, the poses do not correspond.
    if (!before || !after || before.length !== after.length) return false;
    this.#place((surface) => deformSurface(surface, before, after));
    return true;
  }

  #place(placesOf: (surface: Surface) => Float32Array): void {
    if (!this.#frame) return;
    const { result, base } = this.#frame;
    this.#view.move('S1dash', placesOf(result));
    if (base) this.#view.move('S0dash', placesOf(base));
  }
}
