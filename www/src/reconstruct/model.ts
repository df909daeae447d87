/** Builds point clouds and models for the page's requests. Used by the worker only. */
import { type ImplicitOptions, ImplicitSurface, type PointEdits, parsePoints } from 'vesicle';
import type { Vec3 } from '../protocol';
import { computedCloud } from './clouds';
import { distances, span } from './nearest';
import type { CameraView, Cloud, CloudSource, Edits, Fit, PointQuantity, Setup } from './protocol';

/** Least number of voxels along each side of an exported grid. */
const LEAST_DIM = 8;

/** Returns the points of a source: computed, or read from a file. */
export function cloudFrom(source: CloudSource): Cloud {
  return 'shape' in source ? computedCloud(source.shape) : parsePoints(source.file.bytes);
}

/** Builds a model of the points and applies the edits. */
export function buildModel({ points, normals, colors }: Cloud, cameras: CameraView[], setup: Setup): ImplicitSurface {
  const { params, maxPoints, keepComponents, edits } = setup;
  const options: ImplicitOptions = { points, cameras, params };
  if (normals) options.normals = normals;
  if (colors) options.colors = colors;
  if (maxPoints !== undefined) options.maxPoints = maxPoints;
  if (keepComponents !== undefined) options.keepComponents = keepComponents;
  const model = new ImplicitSurface(options);
  try {
    model.setEdits(toPointEdits(edits));
    return model;
  } catch (error) {
    model.free();
    throw error;
  }
}

/** Converts edits to the typed arrays that the model expects. */
export function toPointEdits({ added, removed, outside }: Edits): Required<PointEdits> {
  return {
    added: Float32Array.from(added.flat()),
    removed: Uint32Array.from(removed),
    exterior: Float32Array.from(outside.flat()),
  };
}

/** Returns the loaded points without the removed ones, followed by the added ones. */
export function applyEdits(points: Float32Array, { added, removed }: Edits): Float32Array {
  if (added.length + removed.length === 0) return points;
  const gone = new Set(removed);
  const kept = points.filter((_, i) => !gone.has(Math.floor(i / 3)));
  const all = new Float32Array(kept.length + 3 * added.length);
  all.set(kept);
  all.set(added.flat(), kept.length);
  return all;
}

/** For each quantity, a function that returns one value per vertex, in the order of the mesh's arrays. */
const QUANTITIES: Record<PointQuantity, (model: ImplicitSurface, points: Float32Array) => Float32Array> = {
  'mean curvature': ({ mesh }) => mesh.curvature('mean'),
  distance: ({ mesh }, points) => distances(mesh.arrays().positions, points),
};

/**
 * Returns the values of a quantity at the vertices, to colour the surface by. `points` are the points in use, after
 * edits.
 */
export function valuesFor(model: ImplicitSurface, points: Float32Array, quantity: PointQuantity): Float32Array {
  return QUANTITIES[quantity](model, points);
}

/**
 * Returns the level of the fitted function f at which the surface is extracted: 0, or the mean of f over the surface
 * constraints.
 */
export function levelOf(model: ImplicitSurface): number {
  if (model.params.level === 'zero') return 0;
  const values = model.evaluate(model.constraints().surface);
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}

/**
 * Returns the dimensions of a grid around the points with nearly cubic voxels: `size` of them along the longest side,
 * and at least `LEAST_DIM` along each.
 */
export function cubicDims(points: Float32Array, size: number): Vec3 {
  const sides = [0, 1, 2].map((axis) => {
    const [low, high] = span(points, axis);
    return high - low;
  });
  const longest = Math.max(...sides);
  return sides.map((side) => Math.max(LEAST_DIM, Math.round((size * side) / longest))) as Vec3;
}

/**
 * Collects the facts about the fit that the page displays. `complete` tells whether there is a complete surface; only
 * then the distances of the points from it are included.
 */
export function fitOf(model: ImplicitSurface, residual: number, complete: boolean): Fit {
  const { surface, exterior } = model.constraints();
  const { cell, spacing, duplicates, spuriousComponents, warning } = model;
  return {
    ...(complete && { fitness: model.fitness() }),
    surfaceConstraints: surface.length / 3,
    exteriorConstraints: exterior.length / 3,
    cell,
    spacing,
    duplicates,
    spuriousComponents,
    residual,
    ...(warning !== undefined && { warning }),
  };
}
