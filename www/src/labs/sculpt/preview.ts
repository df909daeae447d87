import type { MultiresolutionModel, MultiresParams } from 'vesicle';
import type { Pose } from './protocol';

/**
 * Longest duration of a step of the model during a drag, milliseconds; after a slower one the preview uses longer
 * edges.
 */
const SLOW_FRAME_MS = 60;
/** Factor by which the preview lengthens edges after a slow step of a drag: 2 means a quarter of the triangles. */
const EDGE_FACTOR = 2;

/**
 * Reduces the model's resolution during motion: the result is no finer than the base surface and, after a slow step of
 * a drag, edges are longer. Restores the user's parameters when the motion has ended.
 */
export class Preview {
  /** Parameters as the user set them, while the preview has changed them in the model; else undefined. */
  #saved: MultiresParams | undefined;
  #coarse = false;

  get on(): boolean {
    return this.#saved !== undefined;
  }

  /**
   * Adjusts the model's resolution before a step. `motion`: 'drag' while the pointer drags ellipsoids, 'path' while
   * they move by themselves, 'none' at rest; `durationMs`: duration of the last step in milliseconds.
   */
  prepare(model: MultiresolutionModel, motion: 'none' | 'path' | 'drag', durationMs: number): void {
    if (motion === 'none') this.end(model);
    else if (motion === 'drag' && !this.#coarse && durationMs > SLOW_FRAME_MS) this.#coarsen(model);
    else if (!this.#saved && model.params.supersample > 0) this.#change(model, { supersample: 0 });
  }

  /** Sets the model's target pose; one that is refused for the longer edges of the preview ends it. */
  aim(model: MultiresolutionModel, pose: Pose): void {
    try {
      model.setEllipsoids(pose);
    } catch (error) {
      if (!this.#coarse) throw error;
      this.end(model);
      model.setEllipsoids(pose);
    }
  }

  /** Ends the preview: restores the model's parameters as the user set them. */
  end(model: MultiresolutionModel): void {
    if (this.#saved) model.setParams(this.#saved);
    this.#saved = undefined;
    this.#coarse = false;
  }

  #coarsen(model: MultiresolutionModel): void {
    const { edgeMin, edgeMax } = model.params;
    this.#coarse = true;
    try {
      this.#change(model, { edgeMin: EDGE_FACTOR * edgeMin, edgeMax: EDGE_FACTOR * edgeMax, supersample: 0 });
    } catch {
      // The surface would slip off the tips of the ellipsoids.
      this.#change(model, { supersample: 0 });
    }
  }

  #change(model: MultiresolutionModel, params: MultiresParams): void {
    const { edgeMin, edgeMax, supersample } = model.params;
    model.setParams(params);
    this.#saved = { edgeMin, edgeMax, supersample, ...this.#saved };
  }
}
