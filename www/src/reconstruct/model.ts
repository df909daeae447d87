/** Points and models as the page asks for them. Used by the worker only. */
import { type ImplicitOptions, ImplicitSurface, parsePoints } from 'vesicle';
import type { Vec3 } from '../protocol';
import { computedCloud } from './clouds';
import { distances, span } from './nearest';
import type { CameraView, Cloud, CloudSource, Edits, Fit, PointShade, Setup } from './protocol';

/** The method itself adds so many exterior points around everything, after all others. */
const AROUND = 16;
/** Voxels along the shortest side at least. */
const LEAST_DIM = 8;

export function cloudFrom(source: CloudSource): Cloud {
  return 'shape' in source ? computedCloud(source.shape) : parsePoints(source.file.bytes);
}

/** The points without those that were removed, and with those that were added, which take after their nearest. */
export function edited({ points, normals, colors }: Cloud, { added, removed }: Edits): Cloud {
  const gone = new Set(removed);
  const models = added.map((point) => nearestOf(points, point));
  const like = (values: Float32Array) => models.flatMap((i) => [...values.subarray(3 * i, 3 * i + 3)]);
  const changed = (values: Float32Array, more: number[]) => {
    const kept = values.filter((_, i) => !gone.has(Math.floor(i / 3)));
    const out = new Float32Array(kept.length + more.length);
    out.set(kept);
    out.set(more, kept.length);
    return out;
  };
  return {
    points: changed(points, added.flat()),
    ...(normals && { normals: changed(normals, like(normals)) }),
    ...(colors && { colors: changed(colors, like(colors)) }),
  };
}

function nearestOf(points: Float32Array, [x, y, z]: Vec3): number {
  let best = 0;
  let least = Number.POSITIVE_INFINITY;
  for (let i = 0; i < points.length / 3; i++) {
    const distance = Math.hypot((points[3 * i] ?? 0) - x, (points[3 * i + 1] ?? 0) - y, (points[3 * i + 2] ?? 0) - z);
    if (distance >= least) continue;
    least = distance;
    best = i;
  }
  return best;
}

/**
 * A model of the points with the changes made by hand: for now always a new one. `exterior` are those that
 * the method makes by itself, to which points outside by hand are added.
 */
export function buildModel(cloud: Cloud, cameras: CameraView[], setup: Setup, exterior: Float32Array): ImplicitSurface {
  const { params, maxPoints, keepComponents, edits } = setup;
  const options: ImplicitOptions = { ...edited(cloud, edits), cameras, params };
  if (maxPoints !== undefined) options.maxPoints = maxPoints;
  if (keepComponents !== undefined) options.keepComponents = keepComponents;
  if (edits.outside.length > 0) options.exterior = Float32Array.of(...exterior, ...edits.outside.flat());
  return new ImplicitSurface(options);
}

/** The exterior points that a model makes by itself; none where none by hand go with them, as it then will. */
export function ownExterior(cloud: Cloud, cameras: CameraView[], setup: Setup): Float32Array {
  if (setup.edits.outside.length === 0) return new Float32Array(0);
  const edits = { ...setup.edits, outside: [] };
  const model = buildModel(cloud, cameras, { ...setup, edits }, new Float32Array(0));
  try {
    while (model.constraints().exterior.length === 0) model.step(1);
    return model.constraints().exterior.slice(0, -3 * AROUND);
  } finally {
    model.free();
  }
}

/** One number a vertex for each shade, in the order of the mesh's arrays. */
const SHADES: Record<PointShade, (model: ImplicitSurface, cloud: Cloud) => Float32Array> = {
  'mean curvature': ({ mesh }) => mesh.curvature('mean'),
  distance: ({ mesh }, { points }) => distances(mesh.arrays().positions, points),
};

export function valuesFor(model: ImplicitSurface, cloud: Cloud, shade: PointShade): Float32Array {
  return SHADES[shade](model, cloud);
}

/** The value of f that the surface is taken at. */
export function levelOf(model: ImplicitSurface): number {
  if (model.params.level === 'zero') return 0;
  const values = model.evaluate(model.constraints().surface);
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}

/** Sizes of a grid around the points whose voxels are nearly cubes, with so many along the longest side. */
export function cubicDims(points: Float32Array, size: number): Vec3 {
  const sides = [0, 1, 2].map((axis) => {
    const [low, high] = span(points, axis);
    return high - low;
  });
  const longest = Math.max(...sides);
  return sides.map((side) => Math.max(LEAST_DIM, Math.round((size * side) / longest))) as Vec3;
}

/** What there is to tell of the fit; `whole` where there is a surface to measure. */
export function fitOf(model: ImplicitSurface, residual: number, whole: boolean): Fit {
  const { surface, exterior } = model.constraints();
  const { cell, spacing, duplicates, strays, warning } = model;
  return {
    ...(whole && { fitness: model.fitness() }),
    surfaceConstraints: surface.length / 3,
    exteriorConstraints: exterior.length / 3,
    cell,
    spacing,
    duplicates,
    strays,
    residual,
    ...(warning !== undefined && { warning }),
  };
}
