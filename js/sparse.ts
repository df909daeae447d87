// Volumes of which only parts are in memory, as the models see them.
import type { Vec3, VoxelArray } from './data.js';

/** Key of the method by which a volume offers its {@link SparseSource}; the same in all entry points of the package. */
export const SPARSE_SOURCE: unique symbol = Symbol.for('vesicle.sparse-source') as never;

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
  /** Size of each level, and its transform from voxel index to world, finest first. */
  levels: { dims: Vec3; affine: Float64Array }[];
  /** Type of the voxels. */
  type: 'u8' | 'i8' | 'u16' | 'i16' | 'u32' | 'i32' | 'f32';
  /** Smallest and largest finite intensity of the coarsest level. */
  range: [number, number];
  /** Voxels of the coarsest level, x fastest. */
  coarsest: VoxelArray;
  /** Intensity of voxels that are not stored. */
  fill: number;
  /** Reads a box. */
  read(box: SparseBox, signal: AbortSignal | undefined): Promise<VoxelArray>;
  /** Number of boxes that are read at the same time. */
  concurrency: number;
  /** Returns the numbers of chunks and bytes that have been read from all levels. */
  loaded(): { chunks: number; bytes: number };
}
