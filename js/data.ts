// Volumes, meshes and points as plain data: what is passed between modules, and to and from other libraries.
import type { Warning } from './warning.js';

/** Three numbers: a point, a direction, or one number for each of x, y and z. */
export type Vec3 = [number, number, number];

/**
 * Points in world space, packed xyz. In double precision where single is too coarse: far from the origin for their extent,
 * as surveyed coordinates are.
 */
export type PointArray = Float32Array | Float64Array;

/** Bytes of a file or a saved state in memory of their own, as `Blob` and `postMessage` take them. */
export type Bytes = Uint8Array<ArrayBuffer>;

/** The typed arrays in which voxels can be given; a {@link Volume} stores them in the same type. */
export type VoxelArray =
  | Uint8Array
  | Int8Array
  | Uint16Array
  | Int16Array
  | Uint32Array
  | Int32Array
  | Float32Array
  | Float64Array;

/** Orientation of the world axes: right-anterior-superior, or left-posterior-superior. */
export type Space = 'RAS' | 'LPS';

/** Length of one unit of world coordinates: metres, millimetres or micrometres. */
export type LengthUnit = 'm' | 'mm' | 'um';

/** A file beside another one. */
export interface NamedFile {
  /** Name of the file, with or without folders. */
  name: string;
  /** Its content. */
  bytes: Uint8Array;
}

/** Options of reading a volume file. */
export interface VolumeFileOptions {
  /** Content of the file with the voxels, if the header is a file of its own; of several ones, one after the other. */
  data?: Uint8Array;
  /**
   * Files beside the header, in place of `data`: those that it names are found by their names without folders, as they
   * are written or else in upper or lower case. For a `.hdr` it is the only one with the ending `.img` or `.img.gz`.
   * Others are ignored.
   */
  files?: readonly NamedFile[];
  /**
   * Orientation of the world axes for files that do not tell it: some NRRD, which are otherwise LPS with a warning, or RAS
   * without one if they have spacings alone; Analyze 7.5, and NIfTI without a transform (`qform_code` and `sform_code` are
   * 0), otherwise RAS.
   */
  space?: Space;
}

/** Constructor options of a {@link Volume}. */
export interface VolumeInit {
  /** Stored value of each voxel: x fastest, then y, z, t. Copied once. */
  data: VoxelArray;
  /** Number of voxels along x, y, z, and the number of frames of a 4D volume. */
  dims: Vec3 | [number, number, number, number];
  /** Transform from voxel index to world: 16 numbers, column-major. Default from `spacing` and `origin`. */
  affine?: ArrayLike<number>;
  /** Voxel size, world units; default 1. Not together with `affine`. */
  spacing?: Vec3;
  /** World position of the centre of the first voxel; default 0. Not together with `affine`. */
  origin?: Vec3;
  /** Slope of intensity = stored value * slope + intercept. Default 1; not 0. */
  slope?: number;
  /** Intercept of intensity = stored value * slope + intercept. Default 0. */
  intercept?: number;
  /** Seconds from one frame to the next; 4D only. */
  frameSeconds?: number;
  /** Orientation of the world axes. Default RAS; meshes are returned in the same space. */
  space?: Space;
  /** Length of a world unit, if it is known. */
  unit?: LengthUnit;
  /** Findings of the file's reader, for {@link Volume.warnings}; kinds of its own have the code `reader`. */
  warnings?: readonly Warning[];
}

/**
 * A volume larger than memory, in several resolutions, of which a model reads only what it needs: that of `openZarr` of
 * `vesicle/zarr`.
 */
export interface LargeVolume {
  /** Number and size of the voxels of each level along x, y and z, finest first. */
  readonly levels: readonly { readonly dims: Vec3; readonly spacing: Vec3 }[];
  /** Aborts all requests and frees the memory. */
  free(): void;
}

/** How much of a {@link LargeVolume} has been read, while a model waits for more. */
export interface DataReport {
  /** Size of all chunks that have been read from all levels, decoded, bytes. */
  bytes: number;
  /** Number of these chunks. */
  chunks: number;
  /** Number of boxes that the model still waits for; 0 when it goes on. */
  waiting: number;
}

/** Options of reading what a model waits for. */
export interface DataOptions {
  /** Aborts all requests; the promise then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /** Called whenever something that the model waits for has been read. */
  onData?: (report: DataReport) => void;
}

/** Image formats of a {@link MeshTexture}, as media types. */
export type TextureType = 'image/png' | 'image/jpeg' | 'image/webp';

/**
 * The texture of a mesh, as an image file. Texture coordinates start at its upper left corner, u to the right and v
 * downwards, 1 at the far edges, and the image repeats beyond, as in glTF: in three.js, with `flipY = false`.
 */
export interface MeshTexture {
  /** Image format of `bytes`. */
  type: TextureType;
  /** Content of the image file. */
  bytes: Uint8Array;
}

/** Arrays and texture of a mesh, besides positions and triangles, for `Mesh.fromArrays`. */
export interface MeshExtra {
  /** Unit outward normal of each vertex, packed xyz. */
  normals?: Float32Array;
  /** Texture coordinates of each vertex, packed uv. */
  uvs?: Float32Array;
  /**
   * Texture coordinates of the three corners of each triangle, packed uv, instead of `uvs`: vertices on texture seams
   * have several.
   */
  cornerUvs?: Float32Array;
  /** Colour of each vertex, packed rgb, 0..1. */
  colors?: Float32Array;
  /** The image that texture coordinates refer to. */
  texture?: MeshTexture;
  /** The directions of the axes, if they are known, for `Mesh.space`. */
  space?: Space;
  /** The length of a unit, if it is known, for `Mesh.unit`. */
  unit?: LengthUnit;
  /** Findings of the file's reader, for `Mesh.warnings`; kinds of its own have the code `reader`. */
  warnings?: readonly Warning[];
}

/** Options of reading a mesh file. */
export interface MeshFileOptions {
  /**
   * The image of a file that has it in a separate file (obj, ply). Then v points downwards for all formats: that of an
   * obj or ply becomes 1 - v. It replaces a glb's own texture.
   */
  texture?: MeshTexture;
  /** Buffers and images beside a gltf (or glb), found by their names. */
  files?: readonly NamedFile[];
}

/** Statements about positions in a file. */
export interface SpaceOptions {
  /** Directions of the axes of the mesh; default `Mesh.space`; null to state none. */
  space?: Space | null;
  /**
   * Directions of the axes in the file, if they are to be others: x and y are then negated, a rotation by 180° about z.
   * Not without a space.
   */
  as?: Space;
  /** Length of a unit of positions; default `Mesh.unit`; null to state none. */
  unit?: LengthUnit | null;
}

/** The content of a mesh file: the arguments of `Mesh.fromArrays`. */
export interface MeshData extends MeshExtra {
  /** Position of each vertex, packed xyz; in double precision if the mesh is far from the origin for its size. */
  positions: PointArray;
  /** Vertex indices of each triangle, packed abc, counter-clockwise seen from outside. */
  indices: Uint32Array;
}

/** The content of a point file, as packed arrays: xyz, xyz and rgb of each point in turn. */
export interface PointData {
  /** In double precision if the points are far from the origin for their extent. */
  points: PointArray;
  /** Unit normals, if the file has them. */
  normals?: Float32Array;
  /** Colours, 0..1, if the file has them. */
  colors?: Float32Array;
  /** Findings of the file's reader, if there are any. */
  warnings?: readonly Warning[];
}
