/** Rows of meshes to compare: meshes of the membrane's solver, and stages of restructuring. Used by the worker only. */

import { Mesh, type MultiresolutionModel } from 'vesicle';
import { text } from '../../texts';
import { surfaceOf } from './model';
import type { Stage, StageKind, Surface } from './protocol';

/** Largest number of meshes of the membrane's solver displayed side by side. */
const MAX_MESHES = 5;

/**
 * Returns the meshes that the membrane was solved on, with captions, from coarse to fine; only the `MAX_MESHES` finest
 * ones if there are more.
 */
export function levelsOf(model: MultiresolutionModel): Stage[] {
  const levels = model.levelMeshes();
  try {
    return levels.slice(-MAX_MESHES).map((mesh) => ({ caption: sizeOf(mesh), surface: surfaceOf(mesh) }));
  } finally {
    for (const mesh of levels) mesh.free();
  }
}

function sizeOf(mesh: Mesh): string {
  const { edge, triangles } = mesh.info();
  return text('sculpt.stageSize', { triangles, edge: edge.mean.toPrecision(2) });
}

/**
 * Returns a mesh with a caption: `name`, the number of triangles, and the triangle quality (1 is equilateral) that is
 * not reached by a share `WORST_SHARE` of them.
 */
function withCaption(mesh: Mesh, name: string): Stage {
  const surface = surfaceOf(mesh);
  const shapes = shapesOf(surface).sort();
  const worst = shapes[Math.floor(WORST_SHARE * shapes.length)] ?? 0;
  return {
    caption: text('sculpt.stageQuality', { name: name, triangles: mesh.triangleCount, quality: worst.toFixed(2) }),
    surface,
  };
}

/** Share of the triangles whose quality lies below the value in the caption of a stage. */
const WORST_SHARE = 0.05;

/**
 * Returns the quality of each triangle, from 0 to 1: its area over that of an equilateral triangle with the same mean
 * squared edge length.
 */
function shapesOf({ positions, indices, triangles }: Surface): Float32Array {
  return Float32Array.from({ length: triangles }, (_, triangle) => {
    const at = (corner: number) => 3 * (indices[3 * triangle + corner] ?? 0);
    const squared = (one: number, other: number) =>
      [0, 1, 2].reduce((sum, k) => sum + ((positions[one + k] ?? 0) - (positions[other + k] ?? 0)) ** 2, 0);
    const [a, b, c] = [squared(at(0), at(1)), squared(at(1), at(2)), squared(at(2), at(0))];
    const area = Math.sqrt(Math.max(0, 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c))) / 4;
    return (4 * Math.sqrt(3) * area) / (a + b + c || 1);
  });
}

/** Edge length of the ball of radius 1 that is deformed to show restructuring. */
const EDGE = 0.16;
/**
 * Rounds of restructuring (collapse, split and flip passes) of the deformed ball after which hardly any edge is out of
 * bounds.
 */
const ROUNDS = 6;

/**
 * Returns the stages of restructuring a deformed ball, each with a caption: as a whole (figure 3), or pass by pass
 * (figure 6).
 */
export function stagesOf(kind: StageKind): Stage[] {
  const mesh = pulledBall();
  try {
    return kind === 'passes' ? passes(mesh) : restructured(mesh);
  } finally {
    mesh.free();
  }
}

/** Returns a ball whose cap was pulled out and narrowed: its neck has long thin triangles, its tip short edges. */
function pulledBall(): Mesh {
  const ball = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: EDGE });
  const { positions, indices } = ball.arrays();
  ball.free();
  for (let i = 0; i < positions.length; i += 3) {
    // 0 below the cap, 1 on it.
    const part = Math.min(1, Math.max(0, ((positions[i + 1] ?? 0) - 0.45) / 0.17));
    for (const [k, factor] of [1 - 0.5 * part, 1, 1 - 0.5 * part].entries())
      positions[i + k] = (positions[i + k] ?? 0) * factor;
    positions[i + 1] = (positions[i + 1] ?? 0) + 0.9 * part;
  }
  return Mesh.fromArrays(positions, indices);
}

/** Returns the stages of figure 3: the deformed ball, the ball refined everywhere, and the ball restructured. */
function restructured(mesh: Mesh): Stage[] {
  const [refined, good] = [mesh.clone(), mesh.clone()];
  try {
    refined.refine();
    for (let round = 0; round < ROUNDS; round++) good.restructure(BOUNDS);
    return [
      withCaption(mesh, text('sculpt.stageDeformed')),
      withCaption(refined, text('sculpt.stageRefined')),
      withCaption(good, text('sculpt.stageRestructured')),
    ];
  } finally {
    refined.free();
    good.free();
  }
}

/** Bounds of the edge lengths for restructuring the deformed ball. */
const BOUNDS = { min: 0.6 * EDGE, max: 1.35 * EDGE };

/**
 * Returns the stages of figure 6: the deformed ball, the ball after each pass in turn, and after further rounds of all
 * passes, when hardly any edge is out of bounds.
 */
function passes(mesh: Mesh): Stage[] {
  const at = mesh.clone();
  try {
    const stages = [withCaption(at, text('sculpt.passDeformed'))];
    for (const [pass, name] of [
      ['collapse', text('sculpt.passCollapsed')],
      ['split', text('sculpt.passSplit')],
      ['flip', text('sculpt.passFlipped')],
    ] as const) {
      at.restructure(BOUNDS, [pass]);
      stages.push(withCaption(at, name));
    }
    for (let round = 1; round < ROUNDS; round++) at.restructure(BOUNDS);
    return [...stages, withCaption(at, text('sculpt.passRounds', { rounds: ROUNDS }))];
  } finally {
    at.free();
  }
}
