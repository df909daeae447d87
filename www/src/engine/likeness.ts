/** Tells label maps from images. */

/** Most labels of what counts as a label map. */
const MOST_LABELS = 256;
/** Least share of voxels that have the value of their neighbour along x: labels are in one piece, intensities are noisy. */
const LEAST_EQUAL = 0.9;

/**
 * Returns the number of labels if voxels look like those of a label map with several: whole numbers from 0 on, few
 * different ones, in pieces; else 0. A map of a single label, a mask, counts if `least` is 1.
 */
export function labelsLike(voxels: ArrayLike<number>, least = 2): number {
  if (voxels instanceof Float32Array || voxels instanceof Float64Array) return 0;
  const found = new Set<number>();
  let [equal, before] = [0, Number.NaN];
  for (let k = 0; k < voxels.length; k++) {
    const value = voxels[k] ?? 0;
    if (value === before) {
      equal += 1;
      continue;
    }
    before = value;
    if (value < 0) return 0;
    if (value !== 0) found.add(value);
    if (found.size > MOST_LABELS) return 0;
  }
  return found.size >= least && equal >= LEAST_EQUAL * voxels.length ? found.size : 0;
}
