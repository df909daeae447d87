/** Distances between two surfaces in each direction, and the grid in which they are compared as solids. */
import { type Mesh, Volume } from 'vesicle';
import type { Vec3 } from '../engine/protocol';
import { triangleArea } from '../engine/triangle-area';
import type { Distances } from './protocol';

/** Number of voxels along the longest side of the grid in which the Dice coefficient of two meshes is computed. */
const VOXELS = 160;

/** Returns the distances in both directions, and together. `values` are those from each vertex of `mesh`. */
export function distancesBetween(mesh: Mesh, reference: Mesh) {
  const there = mesh.distanceTo(reference);
  const back = reference.distanceTo(mesh);
  const { mean, rms, p95, hausdorff } = there;
  return {
    toReference: summary(there.perVertex, weightsOf(mesh)),
    fromReference: summary(back.perVertex, weightsOf(reference)),
    both: { mean, rms, p95, max: hausdorff },
    values: there.perVertex,
  };
}

/** Summarises values at vertices, each weighted. */
export function summary(values: Float32Array, weights: Float64Array): Distances {
  const order = [...values.keys()].sort((i, j) => (values[i] ?? 0) - (values[j] ?? 0));
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  let [mean, square, below] = [0, 0, 0];
  let p95: number | undefined;
  for (const vertex of order) {
    const [value, weight] = [values[vertex] ?? 0, weights[vertex] ?? 0];
    mean += value * weight;
    square += value ** 2 * weight;
    below += weight;
    if (below >= 0.95 * total) p95 ??= value;
  }
  const max = values[order.at(-1) ?? 0] ?? 0;
  return { mean: mean / total, rms: Math.sqrt(square / total), p95: p95 ?? max, max };
}

/** Returns the area around each vertex, times three: that of all its triangles. */
function weightsOf(mesh: Mesh): Float64Array {
  const { positions, indices } = mesh.arrays({ relative: true });
  const weights = new Float64Array(positions.length / 3);
  for (let at = 0; at < indices.length; at += 3) {
    const area = triangleArea(positions, indices, at);
    for (const v of indices.subarray(at, at + 3)) weights[v] = (weights[v] ?? 0) + area;
  }
  return weights;
}

/** Returns an empty volume of cubic voxels around two meshes. */
export function gridAround(mesh: Mesh, reference: Mesh): Volume {
  const boxes = [mesh, reference].map((one) => one.info().bounds);
  const min = [0, 1, 2].map((axis) => Math.min(...boxes.map((box) => box.min[axis] ?? 0)));
  const max = [0, 1, 2].map((axis) => Math.max(...boxes.map((box) => box.max[axis] ?? 0)));
  const sizes = min.map((low, axis) => (max[axis] ?? 0) - low);
  const side = Math.max(...sizes) / VOXELS;
  const dims = sizes.map((size) => Math.ceil(size / side) + 1) as Vec3;
  const data = new Uint8Array(dims[0] * dims[1] * dims[2]);
  return new Volume({ data, dims, spacing: [side, side, side], origin: min as Vec3 });
}
