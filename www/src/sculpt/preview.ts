import type { MultiresolutionModel, MultiresParams } from 'vesicle';

/** Milliseconds a frame may take while a hand drags; beyond, the hand is ahead of what it sees. */
const SLOW = 60;
/** Edges of the preview are so many times as long: a quarter of the triangles. */
const COARSER = 2;

/** Detail no finer than the skin while anything moves, longer edges while a hand drags and frames take too long; all as it was set at rest. */
export class Preview {
  /** What was set, as far as it differs now. */
  #fine: MultiresParams | undefined;
  #coarse = false;

  get on(): boolean {
    return this.#fine !== undefined;
  }

  /** Before a step; `took`: milliseconds of the last. */
  prepare(model: MultiresolutionModel, motion: 'none' | 'course' | 'hand', took: number): void {
    if (motion === 'none') this.end(model);
    else if (motion === 'hand' && !this.#coarse && took > SLOW) this.#coarsen(model);
    else if (!this.#fine && model.params.supersample > 0) this.#change(model, { supersample: 0 });
  }

  end(model: MultiresolutionModel): void {
    if (this.#fine) model.setParams(this.#fine);
    this.#fine = undefined;
    this.#coarse = false;
  }

  #coarsen(model: MultiresolutionModel): void {
    const { edgeMin, edgeMax } = model.params;
    this.#coarse = true;
    this.#change(model, { edgeMin: COARSER * edgeMin, edgeMax: COARSER * edgeMax, supersample: 0 });
  }

  #change(model: MultiresolutionModel, params: MultiresParams): void {
    const { edgeMin, edgeMax, supersample } = model.params;
    model.setParams(params);
    this.#fine = { edgeMin, edgeMax, supersample, ...this.#fine };
  }
}
