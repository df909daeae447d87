/**
 * Adapter for three.js: converts the volumes of its `NRRDLoader`, and shows a surface in its scene that follows a mesh.
 *
 * Nothing of three.js is imported: the caller passes its classes.
 *
 * @module vesicle/three
 */
import { choice, invalid } from '../check.js';
import type { Space, Vec3, VolumeInit } from '../data.js';
import type { MeshArrays, MeshSnapshot } from '../mesh.js';
import type { Warning } from '../warning.js';
import {
  type AnyMesh,
  affineOf,
  bounds,
  MeshReader,
  type MeshSource,
  type RemoteMeshSource,
  type SurfaceArrays,
  voxels,
} from './source.js';

export type { AnyMesh, MeshSource, RemoteMeshSource } from './source.js';

/** The properties of a volume of three's `NRRDLoader` that {@link volumeFromThree} reads. */
export interface ThreeVolume {
  data: ArrayLike<number>;
  xLength: number;
  yLength: number;
  zLength: number;
  /**
   * Transform from voxel index to world without the position of the first voxel; 3 x 3 where the volume was made by
   * hand.
   */
  matrix: { elements: ArrayLike<number> };
}

/** The fields of the header of an NRRD file, as parsed by `NRRDLoader`, that {@link volumeFromThree} reads. */
interface Header {
  space?: string;
  vectors?: number[][];
  space_origin?: string[];
  sizes?: number[];
  kinds?: string;
  endian?: string;
  encoding?: string;
}

/**
 * Converts a volume of three's `NRRDLoader` to the options of a `Volume`: `new Volume(volumeFromThree(volume))`.
 *
 * @param options - `world`: `'file'`, the default, is the world space of the file, with its origin; LPS or RAS as
 *   stated there (LAS is mirrored to RAS), RAS if nothing is. `'slices'` is the space in which `volume.extractSlice()`
 *   draws: the middle of the volume at the origin, RAS.
 * @throws `VesicleError` `invalid-argument`: not such a volume, several numbers a voxel, a voxel type that a `Volume`
 *   does not store, a byte order that the loader does not read, or no such `world`.
 */
export function volumeFromThree(volume: ThreeVolume, options: { world?: 'file' | 'slices' } = {}): VolumeInit {
  const { data, xLength, yLength, zLength, matrix } = checkVolume(volume);
  const header = (volume as { header?: Header }).header ?? {};
  checkHeader(header, data);
  const grid = voxels(data, [xLength, yLength, zLength]);
  const columns = columnsOf(matrix.elements);
  if (choice('world', options.world ?? 'file', ['file', 'slices']) === 'slices') {
    return { ...grid, affine: affineOf(columns, centred(columns, grid.dims)), space: 'RAS' };
  }
  // The loader's matrix omits the origin, and for LPS files it flips the index instead of the world axes.
  const { vectors = columns, space_origin = [0, 0, 0] } = header;
  return { ...grid, ...inSpace(header.space ?? '', vectors, space_origin.map(Number)) };
}

function checkVolume(volume: ThreeVolume): ThreeVolume {
  const { data, xLength, yLength, zLength, matrix } = Object(volume) as ThreeVolume;
  if (data && matrix?.elements && xLength > 0 && yLength > 0 && zLength > 0) return volume;
  throw invalid('volume', 'must be a loaded volume of NRRDLoader, with data, xLength, yLength, zLength and matrix');
}

function checkHeader({ sizes = [], kinds = '', endian, encoding }: Header, data: unknown): void {
  if (sizes.length > 3 && !/(list|time)$/.test(kinds.trim())) {
    throw invalid(
      'volume',
      `${sizes.length} axes, kinds '${kinds}'; only one number per voxel is supported, with frames last`,
    );
  }
  const bytes = (data as { BYTES_PER_ELEMENT?: number }).BYTES_PER_ELEMENT ?? 1;
  const written = /^(ascii|te?xt|hex)$/.test(encoding ?? '');
  if (endian !== 'big' || bytes === 1 || written) return;
  throw invalid('volume', 'big-endian, which NRRDLoader reads as little-endian; use Volume.parse instead');
}

/** Returns the columns of the linear part of a column-major 4 x 4 or 3 x 3 matrix. */
function columnsOf(elements: ArrayLike<number>): number[][] {
  const rows = elements.length === 9 ? 3 : 4;
  return [0, 1, 2].map((column) => [0, 1, 2].map((row) => Number(elements[rows * column + row])));
}

/** Returns the position of the first voxel that puts the middle of the grid at the origin. */
function centred(columns: number[][], dims: readonly number[]): number[] {
  const half = dims.slice(0, 3).map((count) => (count - 1) / 2);
  return [0, 1, 2].map((row) => -columns.reduce((sum, column, k) => sum + (column[row] ?? 0) * (half[k] ?? 0), 0));
}

function inSpace(name: string, vectors: number[][], origin: number[]): { affine: Float64Array; space: Space } {
  const plain = name.toLowerCase().replace(/-time$/, '');
  const space = plain === 'left-posterior-superior' || plain === 'lps' ? 'LPS' : 'RAS';
  // The third of NRRD's named spaces, LAS, is a mirrored RAS.
  const mirrored = plain === 'left-anterior-superior' || plain === 'las';
  const world = ([x = 0, y = 0, z = 0]: number[]) => [mirrored ? -x : x, y, z];
  return { affine: affineOf(vectors.map(world), world(origin)), space };
}

/** The members of a three.js `BufferAttribute` that the adapter uses. */
interface Attribute {
  array: object;
  needsUpdate: boolean;
  clearUpdateRanges(): void;
  addUpdateRange(start: number, count: number): void;
}

/** The members of a three.js `BufferGeometry` that the adapter uses. */
interface Geometry {
  boundingSphere: object | null;
  boundingBox: object | null;
  setAttribute(name: string, attribute: object): unknown;
  setIndex(attribute: object | null): unknown;
  setDrawRange(start: number, count: number): void;
  dispose(): void;
}

interface Vector {
  set(x: number, y: number, z: number): unknown;
}

const REMEDY = 'the object needs a `position`, which is then set to the origin of the mesh';

/** The classes of three.js that {@link ThreeSurface} needs; the whole module, `THREE`, can be passed. */
export interface ThreeClasses {
  BufferGeometry: new () => Geometry;
  BufferAttribute: new (array: Float32Array | Uint32Array, itemSize: number) => Attribute;
  Sphere: new () => { center: Vector; radius: number };
  Box3: new () => { min: Vector; max: Vector };
}

/** An object to which {@link ThreeSurface} gives its geometry, usually a `Mesh` of three.js. */
export interface ThreeObject {
  geometry: Geometry;
  /** Receives the origin of a mesh that is far from that of world space for its size. */
  position?: Vector;
}

type ArrayName = Exclude<keyof MeshArrays, 'origin'>;

/** Arrays of a mesh with values per vertex, each with its attribute name in three.js and its numbers per vertex. */
const ATTRIBUTES = [
  ['positions', 'position', 3],
  ['normals', 'normal', 3],
  ['uvs', 'uv', 2],
  ['colors', 'color', 3],
] as const;

/**
 * A surface in a three.js scene that follows a mesh, through all changes of connectivity.
 *
 * ```js
 * const object = new THREE.Mesh(undefined, new THREE.MeshStandardMaterial());
 * const surface = new ThreeSurface(THREE, object);
 * surface.update(model.mesh); // after every step
 * ```
 *
 * The object's `geometry` is replaced by the first update, and whenever its buffers have to grow or the mesh gains or
 * loses colours or texture coordinates; material and transform in the scene are the caller's. Positions are those of
 * the mesh, in its volume's world space unless `worldSpace` is another one.
 *
 * Of a mesh that is far from the origin for its size, they are relative to `mesh.origin`, which becomes the `position`
 * of the object: transform a parent of it instead, and add what belongs to the surface, such as its edges, as its
 * children. `WebGLRenderer` then draws it without jitter, `WebGPURenderer` with `highPrecision = true`. Shadows need a
 * parent whose position is −`mesh.origin`, and camera and lights relative to that.
 */
export class ThreeSurface {
  readonly #three: ThreeClasses;
  readonly #object: ThreeObject;
  readonly #reader: MeshReader;
  #buffers: Buffers | undefined;
  #moved = false;

  /**
   * Creates a surface whose geometry `object` receives at the first update.
   *
   * @param three - The classes of three.js.
   * @param object - Receives the geometry; its previous geometry is not disposed of.
   * @param options - `space` of the mesh and `worldSpace` of the scene: if both are given and differ, the signs of x
   *   and y are flipped.
   * @throws `VesicleError` `invalid-argument`: classes that are missing, no such object, no such space.
   */
  constructor(three: ThreeClasses, object: ThreeObject, options: { space?: Space; worldSpace?: Space } = {}) {
    for (const name of ['BufferGeometry', 'BufferAttribute', 'Sphere', 'Box3'] as const) {
      if (typeof Object(three)[name] !== 'function') throw invalid('three', `has no ${name}; pass THREE`);
    }
    if (!Object(object).geometry) throw invalid('object', 'must be an object with a geometry, such as a THREE.Mesh');
    this.#three = three;
    this.#object = object;
    const remedy = typeof object.position?.set === 'function' ? undefined : REMEDY;
    this.#reader = new MeshReader(options.space, options.worldSpace, remedy);
  }

  /** Warnings of the mesh of the last update; empty if there are none. */
  get warnings(): Warning[] {
    return this.#reader.warnings;
  }

  /**
   * Updates the geometry if `mesh` has changed since the last call; the next rendering uploads it. Returns whether
   * `mesh` had changed.
   *
   * @throws `VesicleError` `invalid-argument`: no mesh; `precision`: a mesh so far from the origin that single precision
   *   is too coarse there, and an object without a `position`.
   */
  update(mesh: MeshSource): boolean;
  /**
   * The same for a snapshot, whose arrays become the buffers without a copy: they are the caller's again, and can be those
   * of a new snapshot, after the next update.
   */
  update(snapshot: MeshSnapshot): boolean;
  /** The same for a mesh in a worker: resolves when it is there, with false, too, if a later call was there before. */
  update(mesh: RemoteMeshSource): Promise<boolean>;
  update(mesh: AnyMesh): boolean | Promise<boolean> {
    return this.#reader.update(mesh, (frame) => this.#show(frame));
  }

  #show(frame: SurfaceArrays): void {
    this.#move(frame.origin);
    if (!this.#buffers?.fit(frame.room)) this.#replace(frame.room);
    this.#buffers?.write(frame);
  }

  // A mesh near the origin has none of its own; then the position is the caller's.
  #move([x, y, z]: Vec3): void {
    const moved = x !== 0 || y !== 0 || z !== 0;
    if (moved || this.#moved) this.#object.position?.set(x, y, z);
    this.#moved = moved;
  }

  #replace(room: MeshArrays): void {
    this.#buffers?.geometry.dispose();
    this.#buffers = new Buffers(this.#three, room);
    this.#object.geometry = this.#buffers.geometry;
  }

  /** Frees the buffers. The object stays in the caller's scene; `update` would allocate new buffers. */
  dispose(): void {
    this.#buffers?.geometry.dispose();
    this.#buffers = undefined;
    this.#reader.clear();
  }
}

/** A three.js geometry whose buffers have spare capacity, so that a changing mesh fits for a while. */
class Buffers {
  readonly geometry: Geometry;
  readonly #parts = new Map<ArrayName, { length: number; attribute: Attribute }>();
  readonly #sphere: { center: Vector; radius: number };
  readonly #box: { min: Vector; max: Vector };
  #filled = false;

  constructor({ BufferGeometry, BufferAttribute, Sphere, Box3 }: ThreeClasses, room: MeshArrays) {
    this.geometry = new BufferGeometry();
    // Bounds are set by hand: three would include stale values beyond the contents.
    this.geometry.boundingSphere = this.#sphere = new Sphere();
    this.geometry.boundingBox = this.#box = new Box3();
    const part = (name: ArrayName, array: Float32Array | Uint32Array, size: number): Attribute => {
      const attribute = new BufferAttribute(array, size);
      this.#parts.set(name, { length: array.length, attribute });
      return attribute;
    };
    for (const [name, called, size] of ATTRIBUTES) {
      const array = room[name];
      if (array) this.geometry.setAttribute(called, part(name, array, size));
    }
    this.geometry.setIndex(part('indices', room.indices, 1));
  }

  /** Returns whether arrays are as long as the buffers, with exactly the same attributes, so that they can be reused. */
  fit(room: MeshArrays): boolean {
    return (['indices', ...ATTRIBUTES.map(([name]) => name)] as const).every(
      (name) => this.#parts.get(name)?.length === room[name]?.length,
    );
  }

  write(frame: SurfaceArrays): void {
    for (const [name] of ATTRIBUTES) this.#fill(name, frame);
    this.#fill('indices', frame, frame.topology || !this.#filled);
    this.#filled = true;
    this.geometry.setDrawRange(0, frame.indices.length);
    const { min, max } = bounds(frame.positions);
    this.#box.min.set(...min);
    this.#box.max.set(...max);
    this.#sphere.center.set((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2);
    this.#sphere.radius = Math.hypot(max[0] - min[0], max[1] - min[1], max[2] - min[2]) / 2;
  }

  /** Makes the arrays of a surface those of the buffers; of those to upload, what is used. */
  #fill(name: ArrayName, { [name]: used, room }: SurfaceArrays, uploads = true): void {
    const [attribute, array] = [this.#parts.get(name)?.attribute, room[name]];
    if (!attribute || !used || !array) return;
    attribute.array = array;
    if (!uploads) return;
    attribute.clearUpdateRanges();
    attribute.addUpdateRange(0, used.length);
    attribute.needsUpdate = true;
  }
}
