/** Builds point clouds and surface models for the requests of the Reconstruct lab's page. Used by the worker only. */
import {
  type ImplicitChoice,
  type ImplicitOptions,
  type ImplicitParams,
  ImplicitSurface,
  type PointEdits,
} from 'vesicle';
import startReaders, { parsePoints } from 'vesicle/import';
import { likewise, relativeTo } from '../../engine/placing';
import type { PointArray, Vec3 } from '../../engine/protocol';
import { computedCloud } from './clouds';
import { distances, span } from './nearest';
import { withoutRemoved } from './picking';
import type { CameraView, ChosenParams, Cloud, CloudSource, Edits, Fit, PointQuantity, Setup } from './protocol';

/** Least number of voxels along each side of the grid on which the fitted function is exported as a volume. */
const LEAST_DIM = 8;

/** Returns the point cloud of a source: computed from a shape, or read from a file. */
export async function cloudFrom(source: CloudSource): Promise<Cloud> {
  if ('shape' in source) return computedCloud(source.shape);
  await startReaders();
  return parsePoints(source.file.bytes);
}

/**
 * Builds the model that reconstructs a surface from a point cloud, with the settings and the manual point edits in
 * `setup`, and restores a saved state, if given.
 */
export function buildModel(
  { points, normals, colors, warnings = [] }: Cloud,
  cameras: CameraView[],
  setup: Setup,
  state?: Uint8Array,
): ImplicitSurface {
  const { params, maxPoints, keepComponents, edits } = setup;
  const options: ImplicitOptions = { points, cameras, params, warnings };
  if (normals) options.normals = normals;
  if (colors) options.colors = colors;
  if (maxPoints !== undefined) options.maxPoints = maxPoints;
  if (keepComponents !== undefined) options.keepComponents = keepComponents;
  const model = new ImplicitSurface(options);
  try {
    model.setEdits(toPointEdits(edits));
    if (state) model.restore(state);
    return model;
  } catch (error) {
    model.free();
    throw error;
  }
}

/** Converts the user's point edits to the typed arrays that the model expects. */
export function toPointEdits({ added, removed, outside }: Edits): Required<PointEdits> {
  return {
    added: Float64Array.from(added.flat()),
    removed: Uint32Array.from(removed),
    exterior: Float64Array.from(outside.flat()),
  };
}

/** Returns the points in use, packed xyz: the loaded `points` without the removed ones, followed by the added ones. */
export function applyEdits(points: PointArray, { added, removed }: Edits): PointArray {
  if (added.length + removed.length === 0) return points;
  const kept = withoutRemoved(points, removed);
  const all = likewise(points, kept.length + 3 * added.length);
  all.set(kept);
  all.set(added.flat(), kept.length);
  return all;
}

/**
 * For each quantity by which the surface can be coloured, a function that computes one value per vertex, in the order
 * of the mesh's arrays.
 */
const QUANTITIES: Record<PointQuantity, (model: ImplicitSurface, points: PointArray) => Float32Array> = {
  'mean curvature': ({ mesh }) => mesh.curvature('mean'),
  distance: ({ mesh }, points) => distances(mesh.arrays({ relative: true }).positions, relativeTo(mesh.origin, points)),
};

/**
 * Returns one value of the quantity per vertex of the model's surface, to colour it by. `points` are the points in use,
 * with the user's edits applied.
 */
export function valuesFor(model: ImplicitSurface, points: PointArray, quantity: PointQuantity): Float32Array {
  return QUANTITIES[quantity](model, points);
}

/**
 * Returns the level of the fitted function f at which the surface is extracted, for the export of f as a volume: 0, or
 * the mean of f over the surface constraints.
 */
export function levelOf(model: ImplicitSurface): number {
  if (model.params.level === 'zero') return 0;
  const values = model.evaluate(model.constraints().surface);
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}

/**
 * Returns the dimensions of a grid around the points, for the export of the fitted function as a volume with nearly
 * cubic voxels: `size` along the longest side, and at least `LEAST_DIM` along each.
 */
export function cubicDims(points: PointArray, size: number): Vec3 {
  const sides = [0, 1, 2].map((axis) => {
    const [low, high] = span(points, axis);
    return high - low;
  });
  const longest = Math.max(...sides);
  return sides.map((side) => Math.max(LEAST_DIM, Math.round((size * side) / longest))) as Vec3;
}

/** Returns what the model chose from the points; undefined before that, and if no parameter is automatic. */
export function choiceIn({ params, choice }: ImplicitSurface): ImplicitChoice | undefined {
  return Object.values(params).includes('auto') ? choice : undefined;
}

/** Returns the values in force of the parameters that may be automatic; those chosen are missing until they are. */
export function inForce(params: ImplicitParams, choice: ImplicitChoice | undefined): Partial<ChosenParams> {
  const value = (name: keyof ChosenParams) => {
    const given = params[name];
    const known = typeof given === 'number' ? given : choice?.[name];
    return known === undefined ? {} : { [name]: known };
  };
  const delta = params.kernel === 'multi-order' ? value('delta') : {};
  return { ...delta, ...value('lambdaSurface'), ...value('lambdaExterior') };
}

/**
 * Collects the facts about the fitted model that the page displays. `residual` is the relative error of the solution;
 * point-to-surface distances are included only if the surface is `complete`.
 */
export function fitOf(model: ImplicitSurface, residual: number, complete: boolean): Fit {
  const { surface, exterior, interior } = model.constraints();
  const { cell, spacing, duplicates, outliers, spuriousComponents, choice, warning } = model;
  return {
    ...(complete && { fitness: model.fitness() }),
    surfaceConstraints: surface.length / 3,
    exteriorConstraints: exterior.length / 3,
    interiorConstraints: interior.length / 3,
    ...(choice && { choice }),
    inForce: inForce(model.params, choice),
    cell,
    spacing,
    duplicates,
    outliers,
    spuriousComponents,
    residual,
    ...(warning !== undefined && { warning }),
  };
}
