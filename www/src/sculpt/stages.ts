/** Meshes beside each other: the levels of the solver, and what restructuring does. Used by the worker only. */
import { Mesh, type MultiresolutionModel } from 'vesicle';
import { surfaceOf } from './model';
import type { Stage, StageKind, Surface } from './protocol';

/** Most meshes that a row has room for. */
const MOST = 5;

/** The meshes that the skin was solved on, from coarse to fine; the finest ones where there are too many. */
export function levelsOf(model: MultiresolutionModel): Stage[] {
  const levels = model.levelMeshes();
  try {
    return levels.slice(-MOST).map((mesh) => ({ caption: sizeOf(mesh), surface: surfaceOf(mesh) }));
  } finally {
    for (const mesh of levels) mesh.free();
  }
}

function sizeOf(mesh: Mesh): string {
  const { edge, triangles } = mesh.info();
  return `${triangles} triangles, mean edge ${edge.mean.toPrecision(2)}`;
}

/** What stands under a mesh: how many triangles, and how bad the worst of them are; 1 is equilateral. */
function staged(mesh: Mesh, what: string): Stage {
  const surface = surfaceOf(mesh);
  const shapes = shapesOf(surface).sort();
  const worst = shapes[Math.floor(WORST * shapes.length)] ?? 0;
  return { caption: `${what}: ${mesh.triangleCount} triangles, the worst below ${worst.toFixed(2)}`, surface };
}

/** The share of triangles that are called the worst. */
const WORST = 0.05;

/** Of each triangle, its area over that of an equilateral one with the same mean square of its edges. */
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

/** Edge of the ball that is pulled. */
const EDGE = 0.16;
/** Rounds until hardly an edge is out of bounds. */
const ROUNDS = 6;

export function stagesOf(kind: StageKind): Stage[] {
  const mesh = pulledBall();
  try {
    return kind === 'passes' ? passes(mesh) : restructured(mesh);
  } finally {
    mesh.free();
  }
}

/** A ball whose cap was pulled out and drawn together: its neck has long thin triangles, its tip short edges. */
function pulledBall(): Mesh {
  const ball = Mesh.icosphere([0, 0, 0], 1, EDGE);
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

/** Figure 3: as pulled, refined everywhere, and restructured. */
function restructured(mesh: Mesh): Stage[] {
  const [refined, good] = [mesh.clone(), mesh.clone()];
  try {
    refined.refine();
    for (let round = 0; round < ROUNDS; round++) good.restructure(BOUNDS);
    return [staged(mesh, 'Moved'), staged(refined, 'Refined everywhere'), staged(good, 'Restructured')];
  } finally {
    refined.free();
    good.free();
  }
}

const BOUNDS = { min: 0.6 * EDGE, max: 1.35 * EDGE };

/** Figure 6: one pass after the other, then all of them until hardly an edge is out of bounds. */
function passes(mesh: Mesh): Stage[] {
  const at = mesh.clone();
  try {
    const stages = [staged(at, '1 Moved')];
    for (const [pass, name] of [
      ['collapse', '2 Collapsed'],
      ['split', '3 Split'],
      ['flip', '4 Flipped'],
    ] as const) {
      at.restructure(BOUNDS, [pass]);
      stages.push(staged(at, name));
    }
    for (let round = 1; round < ROUNDS; round++) at.restructure(BOUNDS);
    return [...stages, staged(at, `${ROUNDS} rounds`)];
  } finally {
    at.free();
  }
}
