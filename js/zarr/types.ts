// Types of `vesicle/zarr` that need none of zarrita.
import type { Vec3 } from '../data.js';

/** How voxels are stored: integers with their number of bits, or floats of 32 bits. */
export type ZarrVoxelType = 'u8' | 'i8' | 'u16' | 'i16' | 'u32' | 'i32' | 'f32';

/** One level of an image. */
export interface ZarrLevel {
  /** Number of voxels along x, y and z. */
  readonly dims: Vec3;
  /** Voxel size along x, y and z, world units. */
  readonly spacing: Vec3;
  /** Transform from voxel index to world: 16 numbers, column-major. */
  readonly affine: Float64Array;
  /** Number of voxels of a chunk along x, y and z; that of the inner chunks if the array is sharded. */
  readonly chunks: Vec3;
  /** Type of the voxels. */
  readonly voxelType: ZarrVoxelType;
}

/** Numbers of chunks and bytes of a level: those that have been read, and all. */
export interface ZarrLoaded {
  /** Number of chunks that have been read at least once. */
  chunks: number;
  /** Size of their voxels, decoded, of the channel and the time that are read. */
  bytes: number;
  /** The whole level. */
  of: { chunks: number; bytes: number };
}

/** A box of voxels: from `min`, included, to `max`, excluded, along x, y and z. */
export interface ZarrBox {
  min: Vec3;
  max: Vec3;
}

/**
 * A store of keys and bytes, such as those of zarrita. Keys begin with a slash. A key that is missing gives
 * `undefined`; an error with a `status` from 400 to 499 is not repeated.
 */
export interface ZarrStore {
  get(key: `/${string}`, options?: { signal?: AbortSignal }): Bytes;
  /** Needed for sharded arrays. */
  getRange?(
    key: `/${string}`,
    range: { offset: number; length: number } | { suffixLength: number },
    options?: { signal?: AbortSignal },
  ): Bytes;
}

type Bytes = Promise<Uint8Array | undefined> | Uint8Array | undefined;

/**
 * Sources of an image for `openZarr`:
 *
 * - an address, whose server supports byte ranges if arrays are sharded;
 * - a store, for credentials for example: `new FetchStore(url, { fetch })` of zarrita;
 * - a folder on the page: `showDirectoryPicker()`, `webkitGetAsEntry()` of what was dropped, or `files` of an input with
 *   `webkitdirectory`;
 * - a ZIP: a `File` or `Blob`.
 */
export type ZarrSource =
  | string
  | URL
  | ZarrStore
  | FileSystemDirectoryHandle
  | FileSystemDirectoryEntry
  | ArrayLike<File>
  | Blob;
