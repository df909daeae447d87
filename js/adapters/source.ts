// Shared by the adapters: reads a mesh when it has changed, and validates the host's volumes.
import { choice, invalid } from '../check.js';
import type { Space, Vec3, VolumeInit, VoxelArray } from '../data.js';
import { VesicleError } from '../error.js';
import { isProxy, notA } from '../kind.js';
import type { MeshArrays, MeshSnapshot, PositionOptions } from '../mesh.js';
import { copyWithRoom } from '../room.js';
import type { Warning } from '../warning.js';

/**
 * A changing surface that an adapter can show: a `Mesh`, the `mesh` of a model, or arrays of your own with two
 * counters.
 */
export interface MeshSource {
  /** Counter that increases when the connectivity changes, so that adapters know when to update the triangles. */
  readonly topologyVersion: number;
  /** Counter that increases when any vertex moves, so that adapters know when to update the positions. */
  readonly geometryVersion: number;
  /** Warnings about the surface, for the `warnings` of the adapter. */
  readonly warnings?: readonly Warning[];
  /**
   * Returns the surface in its present state; if positions are to be `relative`, they may be so to the `origin` that is
   * returned with them.
   */
  arrays(options?: PositionOptions): MeshArrays;
  /**
   * Copies the surface into the arrays of `out`, replacing those that are too small, and returns the numbers of
   * vertices and triangles written; used instead of `arrays` if present.
   */
  copyTo?(out: MeshArrays, options?: PositionOptions): { vertices: number; triangles: number };
  /** Copies the surface into arrays with spare capacity, those of `reuse` if they fit; used instead of both if present. */
  snapshot?(reuse: Partial<MeshSnapshot>, options?: PositionOptions): MeshSnapshot;
}

/** A changing surface in a worker that an adapter can show: a `Mesh` of `vesicle/worker`, or the `mesh` of a model there. */
export interface RemoteMeshSource {
  /** As that of a {@link MeshSource}. */
  readonly topologyVersion: Promise<number>;
  /** As that of a {@link MeshSource}. */
  readonly geometryVersion: Promise<number>;
  /** As those of a {@link MeshSource}. */
  readonly warnings?: Promise<readonly Warning[]>;
  /** Resolves with the surface in its present state, as that of a {@link MeshSource}. */
  arrays(options?: PositionOptions): Promise<MeshArrays>;
  /** Resolves with the surface as that of a {@link MeshSource}; used instead of `arrays` if present. */
  snapshot?(reuse: Partial<MeshSnapshot>, options?: PositionOptions): Promise<MeshSnapshot>;
}

/** A surface that an adapter shows: one that changes, here or in a worker, or a snapshot of it, whose arrays become the adapter's. */
export type AnyMesh = MeshSource | MeshSnapshot | RemoteMeshSource;

/** Returns whether a surface is in a worker. */
function isRemote(mesh: AnyMesh): mesh is RemoteMeshSource {
  // Each property of a proxy that is read is a request.
  return isProxy(mesh) || Object(mesh).topologyVersion instanceof Promise;
}

/** Returns whether a surface is a snapshot, which has arrays where a mesh has methods. */
function isSnapshot(mesh: MeshSource | MeshSnapshot): mesh is MeshSnapshot {
  return Object(mesh).positions instanceof Float32Array;
}

/**
 * A surface ready to be shown, in the world space of the host (NiiVue, three.js or vtk.js). The arrays are valid until
 * the next {@link MeshReader.read}.
 */
export interface SurfaceArrays extends MeshArrays {
  /** The origin in the world space of the host that positions are relative to. */
  origin: Vec3;
  /** Whether the connectivity has changed since the last read, or no or another mesh was read then. */
  topology: boolean;
  /** The same arrays with their spare capacity. */
  room: MeshArrays;
}

const noArrays = (): MeshArrays => ({
  positions: new Float32Array(),
  normals: new Float32Array(),
  indices: new Uint32Array(),
});

/**
 * Reads a mesh if it has changed since the last read, and converts it to the world space of the host (NiiVue, three.js
 * or vtk.js).
 */
export class MeshReader {
  readonly #rotated: boolean;
  readonly #remedy: string | undefined;
  /** The arrays of the last read. */
  #room = noArrays();
  /** The arrays of the read before, which no host uses any more, for the next one from a worker. */
  #spare = noArrays();
  #mesh: MeshSource | RemoteMeshSource | undefined;
  /** Number of reads, so that a surface that arrives late does not replace a newer one. */
  #reads = 0;
  #warnings: readonly Warning[] = [];
  #topology = 0;
  #geometry = 0;

  /**
   * Sets the space of the mesh and that of the host. If both are given and differ, each surface read is rotated by 180°
   * about z, which maps RAS to LPS and back and preserves orientation. Positions are relative to an origin if the host
   * can put the surface there; else they are in world space, in single precision, and `remedy` says in an error what
   * to do where that does not suffice.
   */
  constructor(space: Space | undefined, host: Space | undefined, remedy?: string) {
    this.#remedy = remedy;
    const spaces = [space, host].filter((one) => one !== undefined);
    for (const one of spaces) choice('space', one, ['RAS', 'LPS']);
    this.#rotated = spaces[0] !== spaces.at(-1);
  }

  /** Has `show` show a mesh, here or in a worker, if it has changed since the last read; returns whether it had. */
  update(mesh: AnyMesh, show: (frame: SurfaceArrays) => void): boolean | Promise<boolean> {
    const shown = (frame: SurfaceArrays | undefined) => {
      if (frame) show(frame);
      return frame !== undefined;
    };
    const frame = this.readOrFetch(mesh);
    return frame instanceof Promise ? frame.then(shown) : shown(frame);
  }

  /** Does what {@link read} does; with a surface in a worker, a promise of it. */
  readOrFetch(mesh: AnyMesh): SurfaceArrays | undefined | Promise<SurfaceArrays | undefined> {
    return isRemote(mesh) ? this.#fetch(mesh) : this.read(mesh);
  }

  /**
   * Returns the surface in the host's space, or undefined if it has not changed since the last read; throws `precision`
   * with the remedy if single precision in world space does not suffice.
   */
  read(mesh: MeshSource | MeshSnapshot): SurfaceArrays | undefined {
    if (isSnapshot(mesh)) return this.#readSnapshot(mesh);
    checkSource(mesh);
    this.#reads += 1;
    this.#warnings = mesh.warnings ?? [];
    const topology = mesh !== this.#mesh || mesh.topologyVersion !== this.#topology;
    if (!topology && mesh.geometryVersion === this.#geometry) return undefined;
    const frame = this.#takeOrAdvise(mesh);
    this.#spare = noArrays();
    [this.#mesh, this.#topology, this.#geometry] = [mesh, mesh.topologyVersion, mesh.geometryVersion];
    return this.#placed(frame, topology);
  }

  #readSnapshot(snapshot: MeshSnapshot): SurfaceArrays {
    this.clear();
    if (this.#remedy && snapshot.origin.some((coordinate) => coordinate !== 0))
      throw invalid('mesh', `a snapshot relative to an origin: ${this.#remedy}, or take it in world space`);
    const frame = this.#placed(snapshot, true);
    // Its arrays are the caller's again, once there is another surface.
    this.#room = noArrays();
    this.#spare = noArrays();
    return frame;
  }

  /** Does what {@link read} does, with a surface in a worker; undefined, too, if another one was read meanwhile. */
  async #fetch(mesh: RemoteMeshSource): Promise<SurfaceArrays | undefined> {
    this.#reads += 1;
    const own = this.#reads;
    const [before, geometry, warnings] = await Promise.all([mesh.topologyVersion, mesh.geometryVersion, mesh.warnings]);
    if (own !== this.#reads) return undefined;
    this.#warnings = warnings ?? [];
    if (mesh === this.#mesh && before === this.#topology && geometry === this.#geometry) return undefined;
    const arriving = Promise.all([this.#takeFrom(mesh), mesh.topologyVersion]);
    const [frame, after] = await arriving.catch((error) => this.#advise(error));
    if (own !== this.#reads) return undefined;
    const topology = mesh !== this.#mesh || before !== after || after !== this.#topology;
    // Triangles that have changed between the two are read again the next time.
    [this.#mesh, this.#topology, this.#geometry] = [mesh, before === after ? after : Number.NaN, geometry];
    this.#spare = this.#room;
    return this.#placed(frame, topology);
  }

  #placed(frame: MeshSnapshot, topology: boolean): SurfaceArrays {
    const { vertices, triangles, ...room } = frame;
    this.#room = room;
    const used = usedPart(frame);
    const origin: Vec3 = [...frame.origin];
    if (this.#rotated) for (const values of [used.positions, used.normals, origin]) rotate180(values);
    return { ...used, origin, topology, room };
  }

  /** Warnings of the mesh last read. */
  get warnings(): Warning[] {
    return [...this.#warnings];
  }

  #takeOrAdvise(mesh: MeshSource): MeshSnapshot {
    try {
      return this.#take(mesh);
    } catch (error) {
      return this.#advise(error);
    }
  }

  #advise(error: unknown): never {
    const { code, message } = Object(error) as Partial<VesicleError>;
    if (code !== 'precision' || !this.#remedy) throw error;
    throw new VesicleError('precision', `${message?.split(': ')[0]}: ${this.#remedy}`);
  }

  get #options(): PositionOptions {
    return { relative: this.#remedy === undefined };
  }

  #take(mesh: MeshSource): MeshSnapshot {
    // Arrays that a host draws may be written to until it draws again.
    if (mesh.snapshot) return mesh.snapshot(this.#room, this.#options);
    if (!mesh.copyTo) return withRoom(mesh.arrays(this.#options), this.#room);
    const arrays = { ...this.#room };
    const counts = mesh.copyTo(arrays, this.#options);
    return { ...arrays, ...counts, origin: arrays.origin ?? [0, 0, 0] };
  }

  async #takeFrom(mesh: RemoteMeshSource): Promise<MeshSnapshot> {
    if (!mesh.snapshot) return withRoom(await mesh.arrays(this.#options), this.#spare);
    const spare = this.#spare;
    this.#spare = noArrays();
    return mesh.snapshot(spare, this.#options);
  }

  /** Forgets the mesh last read, so that the next read returns it in full. */
  clear(): void {
    this.#reads += 1;
    this.#mesh = undefined;
    this.#warnings = [];
  }
}

function checkSource(mesh: MeshSource): void {
  const { topologyVersion, geometryVersion, arrays } = Object(mesh) as Partial<MeshSource>;
  if (typeof arrays === 'function' && Number.isFinite(topologyVersion) && Number.isFinite(geometryVersion)) return;
  throw notA('Mesh', 'mesh', mesh, ', a snapshot, or an object with arrays(), topologyVersion and geometryVersion');
}

/** Copies a surface whose arrays are owned by others into arrays with spare capacity: those of `reuse` that are as long. */
function withRoom({ positions, normals, indices, uvs, colors, origin }: MeshArrays, reuse: MeshArrays): MeshSnapshot {
  return {
    positions: copyWithRoom(reuse.positions, positions, 3, Float32Array),
    normals: copyWithRoom(reuse.normals, normals, 3, Float32Array),
    indices: copyWithRoom(reuse.indices, indices, 3, Uint32Array),
    ...(uvs && { uvs: copyWithRoom(reuse.uvs, uvs, 2, Float32Array) }),
    ...(colors && { colors: copyWithRoom(reuse.colors, colors, 3, Float32Array) }),
    vertices: positions.length / 3,
    triangles: indices.length / 3,
    origin: origin ?? [0, 0, 0],
  };
}

/** Returns views of the used part of the arrays, which may be longer than the mesh needs. */
function usedPart({ positions, normals, indices, uvs, colors, vertices, triangles }: MeshSnapshot): MeshArrays {
  return {
    positions: positions.subarray(0, 3 * vertices),
    normals: normals.subarray(0, 3 * vertices),
    indices: indices.subarray(0, 3 * triangles),
    ...(uvs && { uvs: uvs.subarray(0, 2 * vertices) }),
    ...(colors && { colors: colors.subarray(0, 3 * vertices) }),
  };
}

function rotate180(vectors: Float32Array | number[]): void {
  for (let i = 0; i < vectors.length; i += 3) {
    vectors[i] = -(vectors[i] as number);
    vectors[i + 1] = -(vectors[i + 1] as number);
  }
}

/** Returns the bounding box of packed points; for no points, a box at the origin. */
export function bounds(positions: Float32Array): { min: Vec3; max: Vec3 } {
  if (positions.length === 0) return { min: [0, 0, 0], max: [0, 0, 0] };
  const min: Vec3 = [Infinity, Infinity, Infinity];
  const max: Vec3 = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i += 3) {
    for (let axis = 0 as 0 | 1 | 2; axis < 3; axis++) {
      const value = positions[i + axis] as number;
      if (value < min[axis]) min[axis] = value;
      if (value > max[axis]) max[axis] = value;
    }
  }
  return { min, max };
}

const ELEMENTS = [
  ...[Uint8Array, Int8Array, Uint16Array, Int16Array],
  ...[Uint32Array, Int32Array, Float32Array, Float64Array],
];

/**
 * Returns a host's voxels, one number each, as options of a `Volume`: `sizes` are the numbers of voxels along x, y and
 * z, and the number of frames follows from the length. Throws `invalid-argument` for other types and lengths.
 */
export function voxels(data: unknown, sizes: readonly number[]): Pick<VolumeInit, 'data' | 'dims'> {
  if (!ELEMENTS.some((kind) => data instanceof kind)) {
    throw invalid('volume', `unsupported voxel type; supported: ${ELEMENTS.map(({ name }) => name).join(', ')}`);
  }
  const { length } = data as VoxelArray;
  const [x = 0, y = 0, z = 0] = sizes;
  const frames = length / (x * y * z);
  if (Number.isInteger(frames) && frames > 0) return { data: data as VoxelArray, dims: [x, y, z, frames] };
  throw invalid('volume', `must have one number per voxel and frame, got ${length} for ${x} × ${y} × ${z} voxels`);
}

/**
 * Returns the column-major affine matrix from voxel index to world, given its first three columns and the position of
 * the first voxel.
 */
export function affineOf(columns: readonly ArrayLike<number>[], origin: ArrayLike<number>): Float64Array {
  const column = (values: ArrayLike<number> | undefined, last: number) => [
    ...Array.from({ length: 3 }, (_, row) => Number(values?.[row])),
    last,
  ];
  const [x, y, z] = columns;
  return Float64Array.from([x, y, z, origin].flatMap((values, index) => column(values, index === 3 ? 1 : 0)));
}

/** Returns the triangles as vtk cells: each preceded by its number of corners. */
export function polygons({ indices }: Pick<MeshArrays, 'indices'>): Uint32Array {
  const cells = new Uint32Array((indices.length / 3) * 4);
  for (let from = 0, to = 0; from < indices.length; from += 3, to += 4) {
    cells[to] = 3;
    cells[to + 1] = indices[from] as number;
    cells[to + 2] = indices[from + 1] as number;
    cells[to + 3] = indices[from + 2] as number;
  }
  return cells;
}
