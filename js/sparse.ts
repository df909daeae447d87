// Volumes of which only parts are in memory, as the models see them.
import { endingTogether } from './abort.js';
import type { DataOptions, LengthUnit, Vec3, VoxelArray } from './data.js';
import type { Handle } from './runtime.js';
import type { RawSparseVolume } from './vesicle.js';
import type { Warning } from './warning.js';

/**
 * Key of the method by which a volume offers its {@link SparseSource}. Each module of the package has its own, so that a
 * model never gets a volume of another module.
 */
export const SPARSE_SOURCE: unique symbol = Symbol('sparse source');

/** A box of voxels of a level. */
export interface SparseBox {
  /** Index of the level; 0 is the finest. */
  level: number;
  /** Index of the first voxel along x, y and z. */
  min: Vec3;
  /** Number of voxels along x, y and z. */
  dims: Vec3;
}

/** Voxels in several resolutions, which are read when they are needed. */
export interface SparseSource {
  /** Size of each level, its transform from voxel index to world, and the voxels of its chunks, finest first. */
  levels: { dims: Vec3; affine: Float64Array; chunks: Vec3 }[];
  /** Type of the voxels. */
  type: 'u8' | 'i8' | 'u16' | 'i16' | 'u32' | 'i32' | 'f32';
  /** Smallest and largest finite intensity of the coarsest level. */
  range: [number, number];
  /** Voxels of the coarsest level, x fastest. */
  coarsest: VoxelArray;
  /** Intensity of voxels that are not stored. */
  fill: number;
  /** Length of a world unit, if it is known. */
  unit: LengthUnit | undefined;
  /** Warnings about assumptions on the volume. */
  warnings: readonly Warning[];
  /** Creates the WebAssembly object that holds the voxels of one model, with the coarsest level, which is freed with it. */
  create(): Handle<RawSparseVolume>;
  /** Reads a box. */
  read(box: SparseBox, signal: AbortSignal | undefined): Promise<VoxelArray>;
  /** Number of chunks that are read at the same time. */
  concurrency: number;
  /** Returns the number of bytes of chunks that have been read, as they are stored. */
  stored(): number;
  /** Returns the numbers of chunks and bytes that have been read from all levels. */
  loaded(): { chunks: number; bytes: number };
}

/** Returns what a volume offers to models, or undefined if it is not larger than memory. */
export function sparseSource(volume: unknown): SparseSource | undefined {
  const offer = (Object(volume) as { [SPARSE_SOURCE]?: () => SparseSource })[SPARSE_SOURCE];
  return offer?.call(volume);
}

/**
 * Reads boxes and passes each to `insert` as it arrives, in any order. Neighbours are read together, so that a chunk that
 * several of them touch is read once.
 *
 * @throws Errors of the source, of `insert` and of `onData`; `signal.reason` when aborted. Boxes inserted before stay.
 */
export async function supply(
  source: SparseSource,
  boxes: readonly SparseBox[],
  insert: (box: SparseBox, voxels: VoxelArray) => void,
  { signal, onData }: DataOptions = {},
): Promise<void> {
  const left = inOrder(boxes, source).values();
  let waiting = boxes.length;
  await endingTogether(signal, (signal) => {
    const take = async () => {
      // All take from the same iterator.
      for (const box of left) {
        const voxels = await source.read(box, signal);
        insert(box, voxels);
        waiting -= 1;
        onData?.({ ...source.loaded(), waiting });
      }
    };
    return Promise.all(Array.from({ length: source.concurrency }, take));
  });
}

/** Least number of voxels along the edge of the blocks within which boxes are read together. */
const BLOCK = 128;

/** Returns boxes ordered by level, then by the block that they begin in: a chunk, unless chunks are small. */
function inOrder(boxes: readonly SparseBox[], { levels }: SparseSource): SparseBox[] {
  const block = ({ level, min }: SparseBox, axis: 0 | 1 | 2) =>
    Math.floor(min[axis] / Math.max(BLOCK, levels[level]?.chunks[axis] ?? 0));
  const compare = (one: SparseBox, other: SparseBox) =>
    one.level - other.level ||
    block(one, 2) - block(other, 2) ||
    block(one, 1) - block(other, 1) ||
    block(one, 0) - block(other, 0);
  return [...boxes].sort(compare);
}
