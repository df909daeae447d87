/**
 * Computed volumes for examples and the figures of the deformable model's paper. Intensities 0..255, x fastest, cubic
 * voxels; identical on every machine.
 */
import { cell, markedNucleus } from './cells';
import { chain, linkedRings, spongeVoxels } from './geometric';
import { headPhantom } from './head';
import type { ShapeVoxels } from './sampling';
import { vesselTree } from './vessels';

export type { ShapeVoxels } from './sampling';

const MAKERS = {
  'linked rings': linkedRings,
  chain,
  sponge: () => spongeVoxels(2),
  'deep sponge': () => spongeVoxels(3),
  'head phantom': headPhantom,
  'vessel tree': vesselTree,
  'marked nucleus': markedNucleus,
  cell,
} satisfies Record<string, () => ShapeVoxels>;

export type Shape = keyof typeof MAKERS;

export function shapeVoxels(shape: Shape): ShapeVoxels {
  return MAKERS[shape]();
}
