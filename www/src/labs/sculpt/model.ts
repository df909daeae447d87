/** Opens meshes and builds models for the requests of the Sculpt lab's page. Used by the worker only. */

import { type Mesh, MultiresolutionModel, type MultiresParams } from 'vesicle';
import type { Surface } from '../../engine/protocol';
import { snapshotOf } from '../../engine/surface';
import { scaled } from './ellipsoids';
import { fitted } from './fit';
import type { Facts, MeshSource, Pose, SavedPose, SceneSource, SculptQuantity, Setup } from './protocol';
import { computedMesh, readMesh } from './shapes';

/**
 * Ellipsoids of a model for which neither a mesh nor ellipsoids are given: a unit ball, since the membrane needs at
 * least one.
 */
const DEFAULT_ELLIPSOIDS: Pose = [
  {
    center: [0, 0, 0],
    axes: [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ],
  },
];

/** The meshes that a model is built from, detailed surface and base if given; their owner must free them. */
export interface Scene {
  detail: Mesh | undefined;
  base: Mesh | undefined;
}

/** Reads or computes the meshes of a scene: detailed surface and base, if the source has them. */
export async function sceneFrom({ detail, base }: SceneSource): Promise<Scene> {
  const finest = detail && (await meshFrom(detail));
  try {
    return { detail: finest, base: base && (await meshFrom(base)) };
  } catch (error) {
    finest?.free();
    throw error;
  }
}

async function meshFrom(source: MeshSource): Promise<Mesh> {
  if ('shape' in source) return computedMesh(source.shape);
  return readMesh(source.file.bytes, source.texture, source.beside);
}

export function freeScene({ detail, base }: Scene): void {
  detail?.free();
  base?.free();
}

/**
 * Scale factors for ellipsoids fitted to a mesh, tried in this order until a model can be built: the largest preserves
 * the shape best.
 */
const FIT_SCALES = [1, 0.8, 0.6, 0.4];

/**
 * Builds the first model of a scene; also returns the ellipsoids it starts with: those in `setup`, else those that a
 * surface that holds itself proposes, or for a membrane fitted to the mesh or, without a mesh, a unit ball.
 */
export function firstModel(scene: Scene, setup: Setup): { model: MultiresolutionModel; start: Pose } {
  const mesh = scene.detail ?? scene.base;
  if (setup.support === 'surface') {
    const model = buildModel(scene, setup.start ?? [], setup);
    return { model, start: setup.start ?? model.ellipsoids };
  }
  if (setup.start || !mesh) {
    const start = setup.start ?? DEFAULT_ELLIPSOIDS;
    return { model: buildModel(scene, start, setup), start };
  }
  const row = fitted(mesh);
  let refusal: unknown;
  for (const size of FIT_SCALES) {
    const start = row.map((one) => scaled(one, [size, size, size]));
    try {
      return { model: buildModel(scene, start, setup), start };
    } catch (error) {
      refusal = error;
    }
  }
  throw refusal;
}

/** Builds the first model of a scene with the state of a saved one. */
export function restoredModel(scene: Scene, setup: Setup, { state, start }: SavedPose): ReturnType<typeof firstModel> {
  const model = buildModel(scene, start, setup);
  try {
    model.restore(state);
  } catch (error) {
    model.free();
    throw error;
  }
  return { model, start };
}

/** Builds a model of a scene's meshes with its ellipsoids in the pose `start`; the caller then sets the target pose. */
export function buildModel({ detail, base }: Scene, start: Pose, { params, support }: Setup): MultiresolutionModel {
  return new MultiresolutionModel({
    support,
    ellipsoids: start,
    params: params as MultiresParams,
    ...(detail && { detail }),
    ...(base && { base }),
  });
}

/** Returns a copy of a mesh for the page to draw, with the `values` to colour it by if there is one for each vertex. */
export function surfaceOf(mesh: Mesh, values?: Float32Array): Surface {
  const { uvs: _, ...surface } = snapshotOf(mesh);
  // Values computed for another mesh do not belong to these vertices.
  return values && values.length === surface.vertices ? { ...surface, values: values.slice() } : surface;
}

/** Returns a copy of a mesh for the page to draw with its texture; vertices on texture seams are duplicated. */
export function texturedSurfaceOf(mesh: Mesh): Surface {
  const split = mesh.splitAtSeams();
  try {
    return snapshotOf(split);
  } finally {
    split.free();
  }
}

/**
 * Returns one value per vertex to colour the surfaces by: the mean curvature of the result, or log₂ of the area or
 * angle distortion of the deformed base, 0 where area or angles are preserved.
 */
export function valuesFor(model: MultiresolutionModel, quantity: SculptQuantity): Float32Array {
  if (quantity === 'mean curvature') return model.mesh.curvature('mean');
  const { area, angle } = model.distortion();
  return (quantity === 'area distortion' ? area : angle).map(Math.log2);
}

/**
 * Collects the facts that the page displays about the detail and the map T, which takes the deformed base to the
 * undeformed one.
 */
export function factsOf(model: MultiresolutionModel): Facts {
  const { bandCount: bands, folded, unmatchedVertices: missed, heldVertices: held } = model;
  const { area, angle } = model.distortion();
  return {
    ...{ bands, folded, missed, held },
    areaLow: quantile(area, 0.05),
    areaHigh: quantile(area, 0.95),
    angleHigh: quantile(angle, 0.95),
  };
}

function quantile(values: Float32Array, part: number): number {
  const sorted = values.slice().sort();
  return sorted[Math.round(part * (sorted.length - 1))] ?? Number.NaN;
}
