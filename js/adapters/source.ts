// What the adapters share: a mesh that is read when it has changed, and checks of what a host gives.
import { choice, invalid } from '../check.js';
import type { MeshArrays } from '../mesh.js';
import type { Space, Vec3, VolumeInit, VoxelArray } from '../volume.js';

/** Anything with a surface that changes: a `Mesh`, the `mesh` of a model, or arrays of your own with two counters. */
export interface MeshSource {
  /** Counts up when connectivity changes. */
  readonly topologyVersion: number;
  /** Counts up when any vertex moves. */
  readonly geometryVersion: number;
  /** The surface as it is now. */
  arrays(): MeshArrays;
  /** The same into buffers that are there; used where it exists. */
  copyTo?(out: MeshArrays): { vertices: number; triangles: number };
}

/** A surface as it is to be shown. The arrays are good until the next one is read. */
export interface Frame extends MeshArrays {
  /** Connectivity changed, or the mesh is another one. */
  topology: boolean;
}

/** Reads a mesh when it has changed since the last time. */
export class Reader {
  readonly #turned: boolean;
  #arrays: MeshArrays = { positions: new Float32Array(), normals: new Float32Array(), indices: new Uint32Array() };
  #mesh: MeshSource | undefined;
  #topology = 0;
  #geometry = 0;

  /** From the mesh's space to the host's: the two differ by half a turn about z, which keeps the outside outside. */
  constructor(space: Space | undefined, host: Space | undefined) {
    const spaces = [space, host].filter((one) => one !== undefined);
    for (const one of spaces) choice('space', one, ['RAS', 'LPS']);
    this.#turned = spaces[0] !== spaces.at(-1);
  }

  /** The surface, or nothing where it is as it was. */
  read(mesh: MeshSource): Frame | undefined {
    checkSource(mesh);
    const topology = mesh !== this.#mesh || mesh.topologyVersion !== this.#topology;
    if (!topology && mesh.geometryVersion === this.#geometry) return undefined;
    const frame = this.#take(mesh);
    [this.#mesh, this.#topology, this.#geometry] = [mesh, mesh.topologyVersion, mesh.geometryVersion];
    if (this.#turned) for (const values of [frame.positions, frame.normals]) turn(values);
    return { ...frame, topology };
  }

  #take(mesh: MeshSource): MeshArrays {
    if (!mesh.copyTo) return copied(mesh.arrays());
    const { vertices, triangles } = mesh.copyTo(this.#arrays);
    return cut(this.#arrays, vertices, triangles);
  }

  /** Forgets the mesh. */
  clear(): void {
    this.#mesh = undefined;
  }
}

function checkSource(mesh: MeshSource): void {
  const { topologyVersion, geometryVersion, arrays } = Object(mesh) as Partial<MeshSource>;
  if (typeof arrays === 'function' && Number.isFinite(topologyVersion) && Number.isFinite(geometryVersion)) return;
  throw invalid('mesh', 'a Mesh is needed, or an object with arrays(), topologyVersion and geometryVersion');
}

// Arrays of somebody else's are not ours to turn.
function copied({ positions, normals, ...rest }: MeshArrays): MeshArrays {
  return { ...rest, positions: positions.slice(), normals: normals.slice() };
}

/** The part of the buffers that is in use. */
function cut(
  { positions, normals, indices, uvs, colors }: MeshArrays,
  vertices: number,
  triangles: number,
): MeshArrays {
  return {
    positions: positions.subarray(0, 3 * vertices),
    normals: normals.subarray(0, 3 * vertices),
    indices: indices.subarray(0, 3 * triangles),
    ...(uvs && { uvs: uvs.subarray(0, 2 * vertices) }),
    ...(colors && { colors: colors.subarray(0, 3 * vertices) }),
  };
}

function turn(vectors: Float32Array): void {
  for (let i = 0; i < vectors.length; i += 3) {
    vectors[i] = -(vectors[i] as number);
    vectors[i + 1] = -(vectors[i + 1] as number);
  }
}

/** The corners of the box around packed points; of no points, a box at the origin. */
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

/** Voxels with one number each, and their counts: so many frames as there are. */
export function voxels(data: unknown, sizes: readonly number[]): Pick<VolumeInit, 'data' | 'dims'> {
  if (!ELEMENTS.some((kind) => data instanceof kind)) {
    throw invalid('volume', `has no voxels of a kind that is taken: ${ELEMENTS.map(({ name }) => name).join(', ')}`);
  }
  const { length } = data as VoxelArray;
  const [x = 0, y = 0, z = 0] = sizes;
  const frames = length / (x * y * z);
  if (Number.isInteger(frames) && frames > 0) return { data: data as VoxelArray, dims: [x, y, z, frames] };
  throw invalid('volume', `${length} numbers for ${x} x ${y} x ${z} voxels; one for each voxel and frame is needed`);
}

/** The index-to-world matrix of columns and the place of the first voxel. */
export function affineOf(columns: readonly ArrayLike<number>[], origin: ArrayLike<number>): Float64Array {
  const column = (values: ArrayLike<number> | undefined, last: number) => [
    ...Array.from({ length: 3 }, (_, row) => Number(values?.[row])),
    last,
  ];
  const [x, y, z] = columns;
  return Float64Array.from([x, y, z, origin].flatMap((values, index) => column(values, index === 3 ? 1 : 0)));
}
