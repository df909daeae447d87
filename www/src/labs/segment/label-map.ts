import { arrayLike, type LabelArray } from '../../engine/labels';
import type { LabelBlock, Region, Vec3 } from './protocol';
import { boxOf, forEachRow } from './region';

/** Voxels that a change of a label map affects, with their other values: those before it, or when undone those after. */
export interface Patch {
  indices: Uint32Array;
  values: LabelArray;
}

/** The page's copy of the label map, which the tools change, stroke by stroke. */
export class LabelMap {
  readonly dims: Vec3;
  readonly voxels: LabelArray;
  /** Voxels changed since {@link begin}, and the label that each had then. */
  #indices: number[] = [];
  #values: number[] = [];

  /** Takes over `voxels`, x fastest. */
  constructor(dims: Vec3, voxels: LabelArray) {
    this.dims = dims;
    this.voxels = voxels;
  }

  /** Returns the label of a voxel of the grid. */
  at([x, y, z]: Vec3): number | undefined {
    return this.voxels[(z * this.dims[1] + y) * this.dims[0] + x];
  }

  /** Sets the label of a voxel, as part of the present stroke; returns whether it has changed. */
  set(index: number, value: number): boolean {
    const before = this.voxels[index];
    if (before === undefined || before === value) return false;
    this.#indices.push(index);
    this.#values.push(before);
    this.voxels[index] = value;
    return true;
  }

  /** Whether a stroke has changed voxels and has not ended. */
  get isChanging(): boolean {
    return this.#indices.length > 0;
  }

  /** Ends the stroke; returns what undoes it, or undefined if it has changed no voxel. */
  end(): Patch | undefined {
    const [indices, values] = [Uint32Array.from(this.#indices), arrayLike(this.voxels, this.#values.length)];
    values.set(this.#values);
    this.#indices = [];
    this.#values = [];
    return indices.length > 0 ? { indices, values } : undefined;
  }

  /**
   * Exchanges the labels of the voxels of a patch with those in it, so that the same patch reverts this; returns the box
   * of these voxels.
   */
  exchange({ indices, values }: Patch): Region | undefined {
    // From the last to the first: a voxel that a stroke has changed twice gets the label it had at first.
    for (let k = indices.length - 1; k >= 0; k--) {
      const index = indices[k] ?? 0;
      const value = values[k] ?? 0;
      values[k] = this.voxels[index] ?? 0;
      this.voxels[index] = value;
    }
    indices.reverse();
    values.reverse();
    return boxOf(indices, this.dims);
  }

  /** Returns the box of the voxels of a patch. */
  boxOf({ indices }: Patch): Region | undefined {
    return boxOf(indices, this.dims);
  }

  /** Returns a copy of the labels in a box. */
  block({ min, dims }: Region): LabelBlock {
    const data = arrayLike(this.voxels, dims[0] * dims[1] * dims[2]);
    let at = 0;
    forEachRow({ min, dims }, this.dims, (first) => {
      data.set(this.voxels.subarray(first, first + dims[0]), at);
      at += dims[0];
    });
    return { min, dims, data };
  }
}
