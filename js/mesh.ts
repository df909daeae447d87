import {
  boolean,
  checkProperties,
  choice,
  denseCopy,
  finite,
  integer,
  invalid,
  number,
  numbers,
  pointArray,
  positive,
  shallowCopy,
  typedArray,
  vec3,
} from './check.js';
import type {
  Bytes,
  LengthUnit,
  MeshExtra,
  MeshFileOptions,
  MeshTexture,
  PointArray,
  Space,
  SpaceOptions,
  Vec3,
} from './data.js';
import { mark, notA } from './kind.js';
import {
  checkedFileOptions,
  checkedSpaceOptions,
  checkStated,
  frameOf,
  type MeshFrame,
  SPACE_OPTIONS,
  sayingHow,
  stated,
} from './mesh-file.js';
import { copyWithRoom, roomFor } from './room.js';
import { call, Handle } from './runtime.js';
import { isOfSmall, limitOf, MOST_TRIANGLES_OF_SMALL } from './small-files.js';
import { checkedSlices, finishInSlices, type SliceOptions } from './stepper.js';
import { checkTexture, rawTexture, textureOf } from './texture.js';
// Entry points without readers of files lack `RawMeshFile`, which an import by name would demand.
import * as glue from './vesicle.js';
import { type RawArrays, RawExtra, RawMesh, type RawMeshWork, type RawVolume } from './vesicle.js';
import { type Volume, volumeHandle, withWarnings, wrapVolume } from './volume.js';
import type { Warning } from './warning.js';
import { beyondRange, checkedWarnings, mergedWarnings, notesOf, recentred } from './warnings.js';

/** Vertices and triangles of a mesh as packed arrays, for drawing and further processing; see {@link Mesh.arrays}. */
export interface MeshArrays {
  /** Position of each vertex, packed xyz; in world space, or relative to `origin` if that was asked for. */
  positions: Float32Array;
  /** The origin in world space that `positions` are relative to; set with `relative` only. */
  origin?: Vec3;
  /** Unit outward normal of each vertex, packed xyz. */
  normals: Float32Array;
  /** Vertex indices of each triangle, packed abc, counter-clockwise seen from outside. */
  indices: Uint32Array;
  /**
   * Texture coordinates of each vertex, packed uv, if the mesh has them; at a seam those of one side: see
   * {@link Mesh.splitAtSeams}.
   */
  uvs?: Float32Array;
  /** Colour of each vertex, packed rgb, 0..1, if the mesh has colours. */
  colors?: Float32Array;
}

/**
 * The state of a mesh at one moment, for drawing: arrays that may be longer than what they hold, so that the next one fits
 * into the same buffers of the GPU; see {@link Mesh.snapshot}.
 */
export interface MeshSnapshot extends MeshArrays {
  /** Number of vertices in the arrays. */
  vertices: number;
  /** Number of triangles in `indices`. */
  triangles: number;
  /** The origin in world space that `positions` are relative to: that of world space unless asked for. */
  origin: Vec3;
}

/**
 * Measures of a mesh, as returned by {@link Mesh.info}. Volume, centroid and second moments, which are those of the
 * enclosed solid, are meaningful for a closed mesh only.
 */
export interface MeshInfo {
  vertices: number;
  triangles: number;
  components: number;
  /** Euler characteristic: vertices - edges + triangles. */
  euler: number;
  /** Genus, summed over components; valid for a closed, orientable mesh, where euler = 2 * components - 2 * genus. */
  genus: number;
  /** Surface area, world units squared. */
  area: number;
  /** Enclosed volume, world units cubed; positive if triangles are counter-clockwise seen from outside. */
  volume: number;
  /** Centroid of the enclosed solid, in the mesh's coordinates; that of the surface if the volume is negligible. */
  centroid: Vec3;
  /**
   * Second moments of the enclosed solid about its centroid c: ∫ (x − c)(x − c)ᵀ dV, row-major 3x3. Not the inertia
   * tensor.
   */
  inertia: number[];
  /** Shortest, mean and longest length of an edge, world units. */
  edge: { min: number; mean: number; max: number };
  /** Smallest angle in any triangle, degrees. */
  minAngleDegrees: number;
  bounds: { min: Vec3; max: Vec3 };
}

/** Result of {@link Mesh.check}; a valid mesh is closed, oriented and has all counts at 0. */
export interface MeshReport {
  /**
   * Whether the mesh has no boundary: no edge with only one triangle. An edge with more than two is counted in
   * `nonManifoldEdges`.
   */
  closed: boolean;
  /** Whether all neighbouring triangles have the same orientation. */
  oriented: boolean;
  /** Number of edges with more than two triangles. */
  nonManifoldEdges: number;
  /** Number of vertices whose triangles do not form a single fan. */
  nonManifoldVertices: number;
  /** Number of triangles with equal or collinear corners, tested exactly. */
  degenerateTriangles: number;
  /**
   * Number of pairs of triangles that intersect beyond their common corners and edges, tested with exact predicates.
   */
  selfIntersections: number;
  /**
   * Present, and true, if not all pairs of triangles were tested, so that there may be more self-intersections than were
   * counted, also where `selfIntersections` is 0. The search ends at 100,000, and after 20 million pairs of triangles near
   * each other, or 60 for each triangle: where many lie on each other, or thousands meet in a vertex, more would take
   * minutes.
   */
  hasMore?: true;
}

/** Options of what returns positions in single precision, such as {@link Mesh.arrays}. */
export interface PositionOptions {
  /**
   * Whether positions are relative to {@link Mesh.origin}, which keeps their precision however far the mesh is from the
   * origin of world space. Default false: in world space.
   */
  relative?: boolean;
}

/** A sphere for {@link Mesh.icosphere}, in world units. */
export interface Icosphere {
  center: Vec3;
  radius: number;
  /** No edge is longer. */
  maxEdge: number;
}

/** File formats that {@link Mesh.toBytes} writes. */
export type MeshFormat = 'glb' | 'ply' | 'stl' | 'obj' | 'vtp' | 'mz3';

/** Intersection of a ray with a mesh, as returned by {@link Mesh.pick}. */
export interface MeshHit {
  /** Index of the triangle that the ray hits; its corners start at 3 × `triangle` in {@link MeshArrays.indices}. */
  triangle: number;
  /** Barycentric coordinates of `point` in the triangle, one for each corner in order; they sum to 1. */
  barycentric: Vec3;
  /** Point in which the ray intersects the mesh, in the mesh's coordinates. */
  point: Vec3;
  /** Distance of `point` from the ray's origin, world units. */
  distance: number;
}

/**
 * Kind of curvature, for {@link Mesh.curvature}; κ₁ and κ₂ are the principal curvatures, the largest and smallest
 * normal curvature at a point.
 */
export type CurvatureKind =
  /** Mean curvature, H = (κ₁ + κ₂) / 2. */
  | 'mean'
  /** Gaussian curvature, K = κ₁ κ₂. */
  | 'gaussian';

/**
 * Distances between two surfaces, as returned by {@link Mesh.distanceTo}, world units. All but `perVertex` cover both
 * directions and are symmetric.
 */
export interface SurfaceDistance {
  /**
   * Distance from each vertex of the mesh on which {@link Mesh.distanceTo} was called to the closest point of the other
   * surface; not negative.
   */
  perVertex: Float32Array;
  /** Mean distance between the two surfaces: the mean of the mean distances in the two directions. */
  mean: number;
  /**
   * Root mean square distance between the two surfaces: the root of the mean of the mean squares in the two directions.
   */
  rms: number;
  /** 95th percentile of the distances between the two surfaces: the larger of those in the two directions. */
  p95: number;
  /** Hausdorff distance: the largest of all distances between the two surfaces, in both directions. */
  hausdorff: number;
}

/** Quantity per voxel, for {@link Mesh.toVolume}. */
export type VoxelKind =
  /** A value where the voxel centre is inside the mesh, 0 elsewhere. */
  | 'mask'
  /** Fraction of the voxel inside the mesh, 0..1. */
  | 'coverage'
  /** Signed distance of the voxel centre from the surface, world units, negative inside. */
  | 'distance';

/**
 * Long operations of a mesh in slices of work, as returned by {@link Mesh.inSlices}: each is the method of {@link Mesh} of
 * the same name, but for the promise.
 */
export interface MeshInSlices {
  /** As {@link Mesh.remesh}. */
  remesh(edge: { min: number; max: number }): Promise<void>;
  /** As {@link Mesh.restructure}. */
  restructure(edge: { min: number; max: number }, passes?: readonly RestructurePass[]): Promise<number>;
  /** As {@link Mesh.decimate}. */
  decimate(targetTriangles: number): Promise<void>;
  /** As {@link Mesh.decimateWithin}. */
  decimateWithin(maxDistance: number, options?: { targetTriangles?: number }): Promise<void>;
  /** As {@link Mesh.smooth}. */
  smooth(options: { iterations: number; keepVolume?: boolean }): Promise<void>;
  /** As {@link Mesh.cut}. */
  cut(plane: { origin: Vec3; normal: Vec3 }): Promise<void>;
  /** As {@link Mesh.removeCavities}. */
  removeCavities(): Promise<void>;
  /** As {@link Mesh.contains}, for the surface at the time of the call. */
  contains(points: PointArray): Promise<Uint8Array>;
  /** As {@link Mesh.toVolume}, for the surface at the time of the call. */
  toVolume(like: Volume, options?: { kind?: VoxelKind; value?: number }): Promise<Volume>;
  /** As {@link Mesh.check}, for the surface at the time of the call. */
  check(): Promise<MeshReport>;
  /** As {@link Mesh.distanceTo}, for the two surfaces as they are when it is called. */
  distanceTo(other: Mesh): Promise<SurfaceDistance>;
}

const VOXEL_KINDS: readonly VoxelKind[] = ['mask', 'coverage', 'distance'];

/** A pass of {@link Mesh.restructure}, named by what it does to edges. */
export type RestructurePass = 'collapse' | 'split' | 'flip';

const RESTRUCTURE_PASSES: readonly RestructurePass[] = ['collapse', 'split', 'flip'];

const CURVATURES: readonly CurvatureKind[] = ['mean', 'gaussian'];

const FORMATS: readonly MeshFormat[] = ['glb', 'ply', 'stl', 'obj', 'vtp', 'mz3'];

/**
 * Returns the handle of the WebAssembly object behind a mesh, for the other modules of the library; throws
 * `invalid-argument` if `mesh` is no {@link Mesh}.
 */
export let meshHandle: (parameter: string, mesh: Mesh) => Handle<RawMesh>;
/**
 * Creates a mesh from the handle of a WebAssembly object, for the other modules of the library. A live mesh belongs to
 * its model, which frees it. `warnings` returns those of the mesh.
 */
export let wrapMesh: (
  handle: Handle<RawMesh>,
  live: boolean,
  warnings: () => readonly Warning[],
  frame?: MeshFrame,
) => Mesh;

/**
 * A triangle mesh.
 *
 * Files and arrays may contain an open mesh, or one with self-intersections; {@link Mesh.check} reports both, and
 * methods that need a closed mesh throw `not-closed`. The mesh of a model is live: it follows the model, and can be
 * read and copied but not edited.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link Mesh.free}.
 */
export class Mesh {
  readonly #handle: Handle<RawMesh>;
  readonly #live: boolean;
  readonly #warnings: () => readonly Warning[];
  #frame: MeshFrame;
  /** Whether an operation in slices is changing the mesh. */
  #isChanging = false;

  static {
    wrapMesh = (...parts) => new Mesh(...parts);
    meshHandle = (parameter, mesh) => {
      if (mesh instanceof Mesh) return mesh.#handle;
      throw notA('Mesh', parameter, mesh);
    };
    mark(Mesh.prototype, 'Mesh');
  }

  private constructor(
    handle: Handle<RawMesh>,
    live: boolean,
    warnings: () => readonly Warning[],
    frame: MeshFrame = {},
  ) {
    if (!(handle instanceof Handle)) {
      throw invalid('Mesh', 'has no public constructor; use icosphere, fromArrays, parse or marchingCubes');
    }
    this.#handle = handle;
    this.#live = live;
    this.#warnings = warnings;
    this.#frame = frame;
  }

  /**
   * Creates a sphere of nearly equilateral triangles.
   *
   * @param sphere - Its centre, radius and longest edge. The three as arguments of their own are deprecated.
   * @throws {@link VesicleError} `invalid-argument`; `too-large` for more than four million vertices.
   */
  static icosphere(sphere: Icosphere | Vec3, radius?: number, maxEdge?: number): Mesh {
    const given = radius === undefined && maxEdge === undefined ? sphere : { center: sphere, radius, maxEdge };
    const options = checkProperties('sphere', shallowCopy('sphere', given as Icosphere), [
      'center',
      'radius',
      'maxEdge',
    ]);
    const center = vec3('center', options.center);
    const sizes = [positive('radius', options.radius), positive('maxEdge', options.maxEdge)] as const;
    return made(() => RawMesh.icosphere(center, ...sizes));
  }

  /**
   * Creates a mesh from packed arrays, which are copied unchanged.
   *
   * @param positions - xyz of each vertex; a `Float64Array` where single precision would be too coarse.
   * @param indices - abc of each triangle, counter-clockwise seen from outside.
   * @param extra - What else the mesh has.
   * @throws {@link VesicleError} `invalid-argument`: a wrong length, a number that is not finite, an index out of
   *   range, a texture without texture coordinates, bytes that are no image of the stated type.
   */
  static fromArrays(positions: PointArray, indices: Uint32Array, extra: MeshExtra = {}): Mesh {
    const vertices = pointArray('positions', positions).length / 3;
    checkIndices(typedArray('indices', indices, Uint32Array, 3), vertices);
    const given = checkExtra(extra, vertices, indices.length / 3);
    const { normals, uvs, cornerUvs, colors, texture } = given;
    const warnings = checkedWarnings('warnings', given.warnings);
    return made(
      () => {
        const rest = new RawExtra(normals, uvs, cornerUvs, colors, rawTexture(texture));
        return RawMesh.fromArrays(positions, indices, rest);
      },
      { ...given, warnings },
    );
  }

  /**
   * Parses a mesh file: glb, gltf, ply, stl or obj, detected from the bytes. Duplicate positions are welded; polygons
   * become triangles, by ear clipping where they are concave. A glb has the shape that a viewer shows without animation:
   * instances, skins and default morph weights are applied. What was left out or assumed is in {@link Mesh.warnings}.
   *
   * Entry points with one method lack it: use `parseMesh` of `vesicle/import`.
   *
   * The base colour texture inside a glb (png, jpeg or webp) becomes {@link Mesh.texture}. Texture coordinates are
   * those of the file: v points downwards in glb, and upwards in obj and ply.
   *
   * A file may state the directions of its axes: see {@link Mesh.space}. Positions are as in the file; those of a glb
   * that {@link Mesh.toBytes} wrote with `space` or `unit` are as they were before.
   *
   * @param options - `texture`: the image of a file that has it in a separate file. `files`: those beside a gltf. See
   *   {@link MeshFileOptions}.
   * @throws {@link VesicleError} `bad-file` naming the format and the field, also for a texture where the file has no
   *   texture coordinates, and naming the file with a buffer that is missing; `too-large`; `invalid-argument`.
   */
  static parse(bytes: Uint8Array, options?: MeshFileOptions): Mesh {
    typedArray('bytes', bytes, Uint8Array);
    const { texture, files } = checkedFileOptions(options);
    const file = sayingHow(() =>
      call(() => {
        const beside = files.map(({ name, bytes }) => new glue.NamedFile(name, bytes));
        return glue.RawMeshFile.parse(bytes, rawTexture(texture), beside);
      }),
    );
    const facts = call(() => stated(file));
    return made(() => RawMesh.fromFile(file), facts);
  }

  /**
   * Extracts the iso-surface of a volume by marching cubes, in its world space, closed at the volume's border;
   * topologically consistent. Inside is where the intensity is at least `iso`.
   *
   * @param options - `frame`: frame of a 4D volume; default 0. `maxTriangles`: largest number of triangles; by default, and
   *   at most, 8 million, or 1.2 million by default if the files of the volume have at most 128 KiB, all together.
   * @throws {@link VesicleError} `invalid-argument`: no such frame; `too-large`.
   */
  static marchingCubes(volume: Volume, iso: number, options: { frame?: number; maxTriangles?: number } = {}): Mesh {
    const { frame = 0, maxTriangles } = checkProperties('options', options, ['frame', 'maxTriangles']);
    number('iso', iso);
    integer('frame', frame);
    if (maxTriangles !== undefined) integer('maxTriangles', maxTriangles, { min: 1 });
    const most = limitOf(maxTriangles, isOfSmall(volume), MOST_TRIANGLES_OF_SMALL);
    const handle = volumeHandle('volume', volume);
    return handle.use((raw) =>
      made(() => RawMesh.marchingCubes(raw, iso, frame, most), {
        ...frameOf(volume),
        warnings: [...inFrame(volume.warnings, frame), ...beyondRange(volume, iso)],
      }),
    );
  }

  /** Number of vertices. */
  get vertexCount(): number {
    return this.#handle.use((raw) => raw.vertexCount());
  }

  /** Number of triangles. */
  get triangleCount(): number {
    return this.#handle.use((raw) => raw.triangleCount());
  }

  /**
   * Counter that increases when the connectivity changes, so that copies know whether they are out of date; for the
   * mesh of an implicit surface, also when anything else changes.
   */
  get topologyVersion(): number {
    return this.#handle.use((raw) => raw.topologyVersion());
  }

  /**
   * Counter that increases when any vertex moves, so that copies know whether they are out of date; for the mesh of an
   * implicit surface, also when its colours change.
   */
  get geometryVersion(): number {
    return this.#handle.use((raw) => raw.geometryVersion());
  }

  /**
   * Copy of the texture of the mesh; undefined if it has none. Edits of the mesh remove the texture together with the
   * texture coordinates.
   */
  get texture(): MeshTexture | undefined {
    const raw = this.#handle.use((mesh) => mesh.texture());
    return raw && call(() => textureOf(raw));
  }

  /**
   * The point of world space that the mesh keeps its positions relative to, in double precision: `[0, 0, 0]`, unless the
   * mesh is more than 16 times its size away from that, as surveyed coordinates are.
   */
  get origin(): Vec3 {
    return this.#handle.use((raw) => triple(raw.origin()));
  }

  /**
   * The directions of the axes: those of the volume that the mesh or its model is from, or those that its file states, in
   * the way of 3D Slicer or as {@link Mesh.toBytes} does; undefined if neither is there. Copies and edits keep it, but for
   * {@link Mesh.transform}.
   */
  get space(): Space | undefined {
    return this.#handle.use(() => this.#frame.space);
  }

  /** The length of a unit that the volume or the file of the mesh states, as for {@link Mesh.space}. */
  get unit(): LengthUnit | undefined {
    return this.#handle.use(() => this.#frame.unit);
  }

  /**
   * Warnings: things to know about the mesh before relying on it; empty if there are none. The mesh of a model has those of
   * its data and of its last report (after `restore`, of the next one), the mesh of a file those of its reader; copies
   * and edits keep them, and {@link Mesh.toBytes} writes them.
   */
  get warnings(): Warning[] {
    // Throws if the mesh was freed.
    this.#handle.use(() => undefined);
    return this.#warnings().map((warning) => ({ ...warning }));
  }

  /**
   * Returns the mesh in its present state as newly allocated arrays.
   *
   * @throws {@link VesicleError} `precision` if single precision in world space would change an edge by more than a
   *   thousandth; not if positions are `relative`. Edges of less than a tenth of the mean count as that long.
   */
  arrays(options?: PositionOptions): MeshArrays {
    const arrays = { positions: new Float32Array(), normals: new Float32Array(), indices: new Uint32Array() };
    this.copyTo(arrays, options);
    return arrays;
  }

  /**
   * Copies the mesh into the caller's arrays, which are replaced only when too small; returns the numbers of vertices
   * and triangles written. `uvs`, `colors` and `origin` are set if the mesh has them, or positions are `relative`, and
   * deleted otherwise.
   *
   * @throws {@link VesicleError} `invalid-argument` if `out` is no such object; `precision` as {@link Mesh.arrays}.
   */
  copyTo(out: MeshArrays, options?: PositionOptions): { vertices: number; triangles: number } {
    if (out === undefined) throw invalid('out', 'must be an object with positions, normals and indices, got undefined');
    checkProperties('out', out, ARRAY_PROPERTIES);
    const relative = isRelative(options);
    const arrays = this.#handle.use((raw) => raw.arrays(relative));
    try {
      const counts = call(() => copyArrays(arrays, out));
      if (relative) out.origin = this.origin;
      else delete out.origin;
      return counts;
    } finally {
      arrays.free();
    }
  }

  /**
   * Copies the mesh for drawing, into arrays with spare capacity: their lengths grow in steps of a quarter, so that a
   * changing mesh mostly fits into the arrays of `reuse`, and into the same buffers of the GPU. `ThreeSurface` of
   * `vesicle/three` draws a snapshot without another copy.
   *
   * @param reuse - A snapshot that is drawn no more, whose arrays are used again if they are long enough, and not four
   *   times too long; with `vesicle/worker`, they are transferred to the worker and back.
   * @throws {@link VesicleError} `invalid-argument` if `reuse` is no such object; `precision` as {@link Mesh.arrays}.
   */
  snapshot(reuse: Partial<MeshSnapshot> = {}, options?: PositionOptions): MeshSnapshot {
    const given = checkProperties('reuse', reuse, SNAPSHOT_PROPERTIES);
    const relative = isRelative(options);
    const arrays = this.#handle.use((raw) => raw.arrays(relative));
    try {
      return { ...call(() => snapshotOf(arrays, given)), origin: relative ? this.origin : [0, 0, 0] };
    } finally {
      arrays.free();
    }
  }

  /** Computes measures of the mesh: counts, topology, area, volume, moments, edge lengths and angles. */
  info(): MeshInfo {
    return this.#handle.use((raw) => raw.info() as MeshInfo);
  }

  /**
   * Reports whether the mesh is closed and oriented, and counts non-manifold elements, degenerate triangles and
   * self-intersections, from its arrays alone, independently of the code that edits it.
   */
  check(): MeshReport {
    return this.#handle.use((raw) => raw.check() as MeshReport);
  }

  /**
   * Returns a copy for drawing with the texture: a vertex on a texture seam, which has several texture coordinates, is
   * split into as many vertices, so that {@link Mesh.arrays} has `uvs`. The copy is open along the seams. A mesh
   * without seams is copied unchanged.
   */
  splitAtSeams(): Mesh {
    return this.#handle.use((raw) => made(() => raw.splitAtSeams(), this.#facts()));
  }

  /** Returns the connected components, each as a mesh of its own. */
  components(): Mesh[] {
    return this.#handle.use((raw) => raw.components()).map((part) => made(() => part, this.#facts()));
  }

  /**
   * Refines the mesh by one pass of √3 subdivision, which replaces each triangle by three.
   *
   * @throws {@link VesicleError} `not-closed`; `invalid-argument` for the mesh of a model: `clone()` it first;
   *   `too-large` for more than four million vertices.
   */
  refine(): void {
    this.#edit('refine', (raw) => raw.refine());
  }

  /**
   * Runs one round of restructuring, pass by pass: collapses edges shorter than `min`, splits those longer than `max`,
   * and flips edges where that brings valences closer to six. The mesh stays closed, with the same components and
   * genus; its shape changes a little, and self-intersections may arise: {@link Mesh.remesh} avoids both.
   *
   * @param edge - Bounds of edge lengths, `max` more than twice `min`.
   * @param passes - The passes in order; default each of the three once.
   * @returns The number of edges collapsed, split or flipped.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first;
   *   `too-large` where more than four million vertices would be needed. The mesh is then unchanged.
   */
  restructure(edge: { min: number; max: number }, passes: readonly RestructurePass[] = RESTRUCTURE_PASSES): number {
    const [min, max] = edgeBounds(edge);
    const codes = passCodes(passes);
    return this.#edit('restructure', (raw) => raw.restructure(min, max, codes));
  }

  /**
   * Decimates the mesh to at most `targetTriangles` triangles by edge collapses, in the order of their quadric error.
   * The mesh stays closed, keeps its components and their genus, no triangle flips over, and a mesh without
   * self-intersections remains free of them.
   *
   * Stops early if no edge can be collapsed safely: a component keeps at least four triangles, and more with handles.
   * Vertices are renumbered. Texture coordinates and colours are removed. A target of at least the present number of
   * triangles changes nothing.
   *
   * @param targetTriangles - At least 1; fractions are truncated.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first.
   */
  decimate(targetTriangles: number): void {
    number('targetTriangles', targetTriangles, { min: 1 });
    this.#edit('decimate', (raw) => raw.decimate(targetTriangles));
  }

  /**
   * Decimates the mesh as {@link Mesh.decimate} does, as far as the surface stays near what it was: each vertex of the
   * mesh before is within `maxDistance` of the surface after, and each vertex after is within it of the surface before
   * (after Klein, Liebich and Straßer 1996). So it bounds the `hausdorff` of {@link Mesh.distanceTo}.
   *
   * Entry points with one method lack it.
   *
   * @param maxDistance - At least 0, in world units; with 0, only flat parts are coarsened.
   * @param options - `targetTriangles`: where to stop before the bound is reached, at least 1; default 1.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first.
   */
  decimateWithin(maxDistance: number, options: { targetTriangles?: number } = {}): void {
    const [target, distance] = decimationBounds(maxDistance, options);
    this.#edit('decimateWithin', (raw) => raw.decimateWithin(target, distance));
  }

  /**
   * Remeshes isotropically: brings edge lengths into bounds and valences towards six by collapse, split, flip and
   * tangential relaxation, with edges of about √(min · max). The shape is kept, mostly to within a quarter of such an
   * edge. The mesh stays closed, keeps its components and their genus, and a mesh without self-intersections remains
   * free of them.
   *
   * Some edges stay shorter than `min` in parts that are thinner than that, or where the shape would be lost. Regions
   * that already intersect themselves are mostly left unchanged. Vertices are renumbered, and all of them may move.
   * Texture coordinates and colours are removed.
   *
   * @param edge - Bounds of edge lengths, world units: `min` above 0, `max` more than twice `min`.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first;
   *   `too-large` where more than four million vertices would be needed, or as in {@link Mesh.smooth}; `precision` where
   *   `max` is below 64 times the spacing of single-precision numbers at the largest coordinate.
   */
  remesh(edge: { min: number; max: number }): void {
    const [min, max] = edgeBounds(edge);
    this.#edit('remesh', (raw) => raw.remesh(min, max));
  }

  /**
   * Smooths the mesh by Taubin's method: each iteration moves every vertex half of the way to the mean of its
   * neighbours, then slightly further away from it. Noise is removed, and shapes that extend over ten edges or more
   * are kept. The mesh stays closed, keeps its topology, and a mesh without self-intersections remains free of them:
   * displacements are shortened where triangles would intersect. Regions that already intersect themselves are left
   * unchanged.
   *
   * Texture coordinates and colours are removed.
   *
   * Entry points with one method lack it.
   *
   * @param options - `iterations`: 0 to 10,000. `keepVolume`: whether each connected component keeps the volume that it
   *   encloses; default true. Volume is given back where it was lost, so that thin parts stay and lengths are kept. Where
   *   vertices cannot move without self-intersections, the volume may differ.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first;
   *   `too-large` where more pairs of vertices are near each other than there is memory to test, as in a mesh that
   *   intersects itself everywhere. The mesh is then unchanged.
   */
  smooth(options: { iterations: number; keepVolume?: boolean }): void {
    const [count, keepVolume] = smoothing(options);
    this.#edit('smooth', (raw) => raw.smooth(count, keepVolume));
  }

  /**
   * Transforms the mesh by an affine map. A reflection reverses the triangles, so that they still face outwards.
   * Normals of a file are transformed, too, and texture coordinates and colours stay. {@link Mesh.space} and
   * {@link Mesh.unit} become undefined, since they may no longer be those of the positions.
   *
   * Entry points with one method lack it.
   *
   * @param matrix - 4x4, column-major, with last row 0, 0, 0, 1, as in three.js and WebGL.
   * @throws {@link VesicleError} `invalid-argument`: another last row, a number that is not finite, a singular matrix
   *   (the determinant of its normalised columns is below 1e-8), positions beyond the range of single precision, or the
   *   mesh of a model: `clone()` it first. The mesh is then unchanged.
   */
  transform(matrix: ArrayLike<number>): void {
    const entries = numbers('matrix', matrix, 16);
    this.#edit('transform', (raw) => raw.transform(entries));
    this.#frame = {};
  }

  /**
   * Cuts the mesh by a plane and closes it along the plane: keeps the side away from the normal. New triangles face
   * along the normal, and are a Delaunay triangulation of the cross-section. The mesh stays closed, and one without
   * self-intersections remains free of them; nothing changes if all of it is on the side that is kept.
   *
   * The plane is moved by less than 0.01 % of the largest coordinate where a vertex is on it. Vertices are renumbered.
   * Texture coordinates and colours are removed.
   *
   * Entry points with one method lack it.
   *
   * @param plane - `origin`: a point on the plane. `normal`: of any length but 0.
   * @throws {@link VesicleError} `not-closed`; `self-intersecting` if the mesh intersects itself at the plane, parts
   *   of it are too near each other there, or one is inside another that faces the same way; `invalid-argument`, also if
   *   nothing would be left, and for the mesh of a model: `clone()` it first. The mesh is then unchanged.
   */
  cut(plane: { origin: Vec3; normal: Vec3 }): void {
    const [origin, normal] = checkedPlane(plane);
    this.#edit('cut', (raw) => raw.cut(origin, normal));
  }

  /**
   * Removes all connected components but those of the given indices, as numbered by {@link Mesh.components}. Texture
   * coordinates and colours of these stay. The mesh may be open.
   *
   * Entry points with one method lack it.
   *
   * @throws {@link VesicleError} `invalid-argument`: no index, an index of no component, or the mesh of a model:
   *   `clone()` it first.
   */
  keepComponents(indices: readonly number[]): void {
    const kept = denseCopy('indices', indices).map((index) => integer('indices', index));
    if (kept.length === 0) throw invalid('indices', 'must name at least one component');
    this.#edit('keepComponents', (raw) => raw.keepComponents(Uint32Array.from(kept)));
  }

  /**
   * Fills all cavities: removes the connected components that a larger one encloses, whether they face outwards or
   * inwards. The mesh must be closed.
   *
   * Entry points with one method lack it.
   *
   * @throws {@link VesicleError} `not-closed`; `invalid-argument` for the mesh of a model: `clone()` it first.
   */
  removeCavities(): void {
    this.#edit('removeCavities', (raw) => raw.removeCavities());
  }

  /**
   * Tests for each point whether it is inside the mesh; returns 1 for inside and 0 for outside. Inside is where the
   * winding number, the number of times the surface encloses a point, is not 0, whether triangles face outwards or
   * inwards. The mesh must be closed, but may intersect itself.
   *
   * Exact, for points in single or double precision. A point on the surface counts as if it were moved by an
   * infinitesimal amount along x, y and z, so that of two meshes that share a wall exactly one contains it.
   *
   * Entry points with one method lack it.
   *
   * @param points - Packed xyz of each point, in the mesh's coordinates.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`: a length that is no multiple of 3, or a number that
   *   is not finite.
   */
  contains(points: PointArray): Uint8Array {
    const array = pointArray('points', points);
    return this.#handle.use((raw) => raw.contains(array));
  }

  /**
   * Voxelises the mesh on the grid of a volume: returns a volume with the dimensions, affine and space of `like`, and
   * one frame. Inside is defined as for {@link Mesh.contains}; the mesh must be closed, but may intersect itself.
   *
   * - `'mask'` (default): `value` in each voxel whose centre is inside, 0 elsewhere, in the smallest unsigned integer
   *   type that holds `value`. Exact for vertices mapped to voxel indices in double precision; a centre on the surface
   *   counts as moved by an infinitesimal amount along the grid's axes.
   * - `'coverage'`: the fraction of each voxel inside, 0..1, 32-bit floats. Triangles are clipped to the voxels, so it
   *   is exact to single precision; only in voxels where the surface intersects itself may it be wrong.
   * - `'distance'`: the signed distance of each voxel centre from the surface, in world units, negative inside, 32-bit
   *   floats. Exact to single precision. Takes longest: up to a microsecond a voxel.
   *
   * Entry points with one method lack it.
   *
   * @param like - Volume whose grid is used; its intensities have no influence.
   * @param options - `value`: of a mask, 1 to 4,294,967,295; default 1.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for distances from a mesh without triangles;
   *   `too-large`.
   */
  toVolume(like: Volume, options: { kind?: VoxelKind; value?: number } = {}): Volume {
    const [kind, inside] = voxelQuantity(options);
    const handle = volumeHandle('like', like);
    const { warnings } = this;
    return wrapVolume(() =>
      this.#handle.use((raw) => handle.use((grid) => withWarnings(raw.toVolume(grid, kind, inside), warnings))),
    );
  }

  /**
   * Computes the curvature at each vertex, in the order of {@link Mesh.arrays}. `mean` is positive on convex parts: 1/r
   * on a ball of radius r, -1/r on a cavity. `gaussian` is 1/r² on both and negative on a saddle.
   *
   * Computed from the triangles around each vertex, and therefore as noisy as these: smooth the values for display if
   * need be. Always finite; 0 on the boundary of an open mesh and at isolated vertices.
   *
   * @throws {@link VesicleError} `invalid-argument`: `kind` is neither 'mean' nor 'gaussian'.
   */
  curvature(kind: CurvatureKind): Float32Array {
    choice('kind', kind, CURVATURES);
    return this.#handle.use((raw) => (kind === 'mean' ? raw.meanCurvature() : raw.gaussianCurvature()));
  }

  /**
   * Computes the geodesic distance from one vertex to each, in the order of {@link Mesh.arrays}, world units;
   * `Infinity` on other components.
   *
   * Exact on flat parts. On curved ones, and where paths from two sides meet, up to half an edge too short; never
   * shorter than the straight line.
   *
   * @param fromVertex - Index of the source vertex.
   * @throws {@link VesicleError} `invalid-argument`: there is no such vertex.
   */
  geodesic(fromVertex: number): Float32Array {
    integer('fromVertex', fromVertex);
    return this.#handle.use((raw) => raw.geodesic(fromVertex));
  }

  /**
   * Computes the unsigned distance from each vertex of this mesh to the other's surface, and summaries over both
   * directions: from this mesh's vertices to the other's surface, and from the other's vertices to this one's surface.
   *
   * In the summaries each vertex is weighted by the area around it. `a.distanceTo(b)` and `b.distanceTo(a)` give the
   * same summaries.
   *
   * @throws {@link VesicleError} `invalid-argument`: `other` is no mesh, or one of the two has no triangle.
   */
  distanceTo(other: Mesh): SurfaceDistance {
    const handle = meshHandle('other', other);
    return this.#handle.use((raw) => handle.use((rawOther) => raw.distanceTo(rawOther) as SurfaceDistance));
  }

  /**
   * Returns the first intersection of the ray from `origin` along `direction` with the surface, from either side, or
   * undefined if the ray misses it.
   *
   * @param direction - Any length but 0.
   * @throws {@link VesicleError} `invalid-argument`.
   */
  pick(origin: Vec3, direction: Vec3): MeshHit | undefined {
    const start = vec3('origin', origin);
    const ray = nonZero('direction', vec3('direction', direction));
    return this.#handle.use((raw) => raw.pick(start, ray) as MeshHit | undefined);
  }

  /**
   * Computes the cross-section of the surface with the plane through `origin` as line segments: pairs of points, six
   * numbers a segment.
   *
   * @param origin - A point of the plane in world space, whatever the options.
   * @param normal - Any length but 0.
   * @throws {@link VesicleError} `invalid-argument`; `precision` as {@link Mesh.arrays}.
   */
  crossSection(origin: Vec3, normal: Vec3, options?: PositionOptions): Float32Array {
    const point = vec3('origin', origin);
    const across = nonZero('normal', vec3('normal', normal));
    const relative = isRelative(options);
    return this.#handle.use((raw) => raw.crossSection(point, across, relative));
  }

  /**
   * Encodes the mesh as the bytes of a file: glb (binary glTF), ply and stl (binary), obj, vtp or mz3. Only a glb
   * contains the texture; obj, ply and vtp of a mesh with a texture contain its coordinates with the usual orientation
   * of those formats, 1 - v.
   *
   * Where the mesh has an {@link Mesh.origin} of its own, ply and vtp have positions in double precision, and a glb a
   * node at the origin. stl and mz3 have single precision only.
   *
   * Its {@link Mesh.warnings}, and `recentred` if it is moved, are written as comments, which readers ignore: lines of
   * the header of ply, of obj and of vtp, `extras.warnings` of a glb's `asset`, and their codes, as far as there is room,
   * in the header of stl. mz3 has no room for them. Without any, the bytes are the same as ever.
   *
   * A file says which way its axes point, if the {@link Mesh.space} is known or `space` is given, as 3D Slicer reads it:
   * `SPACE=RAS` or `SPACE=LPS` in the header of stl, a comment of ply and obj, the field data of vtp. Slicer takes files
   * that do not say it for LPS, and so turns a surface in RAS by 180° about z. mz3 has no room for it; NiiVue takes it
   * for RAS, which `as` gives.
   *
   * If the {@link Mesh.unit} is known, or `unit` or `space` is given, a glb is as glTF wants it: in metres, y upwards, z to
   * the front. One root node maps to that what is beneath it in the units and space of the mesh, and says in its `extras`
   * from what, so that {@link Mesh.parse} gives back positions as they were. Without a unit, lengths are not scaled;
   * without a space, axes are kept. Else there is no such node, and a glb has positions as they are.
   *
   * @param options - `recentre`: write positions relative to the origin of the mesh, which moves it there. Default false.
   *   `warnings`: further ones to write. `space`, `as` and `unit`: what to state, {@link SpaceOptions}; default what is
   *   known.
   * @throws {@link VesicleError} `invalid-argument`: no such format, space or unit; `precision` for stl and mz3, as
   *   {@link Mesh.arrays}, unless it is recentred.
   */
  toBytes(
    format: MeshFormat,
    options: SpaceOptions & { recentre?: boolean; warnings?: readonly Warning[] } = {},
  ): Bytes {
    choice('format', format, FORMATS);
    const known = ['recentre', 'warnings', ...SPACE_OPTIONS];
    const { recentre = false, warnings, ...given } = checkProperties('options', options, known);
    boolean('recentre', recentre);
    const frame = checkedSpaceOptions(given, this.#frame, format === 'glb');
    const moved = recentre ? recentred(this.origin) : [];
    const notes = notesOf(mergedWarnings(moved, this.#warnings(), checkedWarnings('warnings', warnings)));
    return this.#handle.use((raw) => raw.toBytes(format, recentre, notes, ...frame) as Bytes);
  }

  /**
   * Returns long operations of this mesh that yield to the event loop between slices of work and can be aborted:
   * `await mesh.inSlices({ signal }).remesh({ min: 1, max: 2 })`. Arguments, results and errors are those of the
   * methods of the same name, bit for bit.
   *
   * An operation works on a copy. The mesh is unchanged until the end, and if the operation fails or is aborted; it can
   * be read and copied meanwhile, and freed, whereupon the operation rejects with `freed`. Calls that would change it
   * are refused until then.
   *
   * Entry points with one method lack it.
   *
   * @param options - `signal`: aborts operations, which reject with `signal.reason`; `budgetMs`: duration of a slice of
   *   work, milliseconds, default 12.
   * @throws {@link VesicleError} `invalid-argument`. What changes the mesh throws it, too, naming its method, while an
   *   operation in slices changes this mesh.
   */
  inSlices(options?: SliceOptions): MeshInSlices {
    const slices = checkedSlices(options);
    // Throws if the mesh was freed.
    this.#handle.use(() => undefined);
    const change = <T>(what: string, begin: (raw: RawMesh) => RawMeshWork) => this.#change<T>(what, begin, slices);
    return {
      remesh: async (edge) => {
        const [min, max] = edgeBounds(edge);
        return change('remesh', (raw) => raw.remeshInSlices(min, max));
      },
      restructure: async (edge, passes = RESTRUCTURE_PASSES) => {
        const [min, max] = edgeBounds(edge);
        const codes = passCodes(passes);
        return change('restructure', (raw) => raw.restructureInSlices(min, max, codes));
      },
      decimate: async (targetTriangles) => {
        number('targetTriangles', targetTriangles, { min: 1 });
        return change('decimate', (raw) => raw.decimateInSlices(targetTriangles));
      },
      decimateWithin: async (maxDistance, within = {}) => {
        const [target, distance] = decimationBounds(maxDistance, within);
        return change('decimateWithin', (raw) => raw.decimateWithinInSlices(target, distance));
      },
      smooth: async (options) => {
        const [count, keepVolume] = smoothing(options);
        return change('smooth', (raw) => raw.smoothInSlices(count, keepVolume));
      },
      cut: async (plane) => {
        const [origin, normal] = checkedPlane(plane);
        return change('cut', (raw) => raw.cutInSlices(origin, normal));
      },
      removeCavities: async () => change('removeCavities', (raw) => raw.removeCavitiesInSlices()),
      contains: async (points) => {
        const array = pointArray('points', points);
        return this.#work((raw) => raw.containsInSlices(array), slices);
      },
      toVolume: async (like, options = {}) => {
        const [kind, inside] = voxelQuantity(options);
        const handle = volumeHandle('like', like);
        const { warnings } = this;
        const begin = (raw: RawMesh) => handle.use((grid) => raw.toVolumeInSlices(grid, kind, inside));
        const made = await this.#work<RawVolume>(begin, slices);
        return wrapVolume(() => withWarnings(made, warnings));
      },
      check: async () => this.#work((raw) => raw.checkInSlices(), slices),
      distanceTo: async (other) => {
        const handle = meshHandle('other', other);
        return this.#work((raw) => handle.use((rawOther) => raw.distanceToInSlices(rawOther)), slices);
      },
    };
  }

  /** Changes the mesh by the operation that `begin` begins; other changes are refused until then. */
  async #change<T>(what: string, begin: (raw: RawMesh) => RawMeshWork, slices: SliceOptions): Promise<T> {
    slices.signal?.throwIfAborted();
    this.#refuseWhileChanging(what);
    this.#isChanging = true;
    try {
      return await this.#work<T>(begin, slices);
    } finally {
      this.#isChanging = false;
    }
  }

  /** Does the work that `begin` begins in slices; returns its value. */
  async #work<T>(begin: (raw: RawMesh) => RawMeshWork, slices: SliceOptions): Promise<T> {
    slices.signal?.throwIfAborted();
    const work = new Handle('Mesh', () => this.#handle.use(begin));
    const [value] = await finishInSlices(work, (one) => this.#handle.use((raw) => one.advance(raw)), slices);
    return value as T;
  }

  #refuseWhileChanging(what: string): void {
    if (!this.#isChanging) return;
    throw invalid(what, 'not allowed while this mesh is changed in slices: abort that, or wait for its end');
  }

  /** Calls `work`, which changes the mesh. */
  #edit<T>(what: string, work: (raw: RawMesh) => T): T {
    this.#refuseWhileChanging(what);
    return this.#handle.use(work);
  }

  /** Returns an independent copy; for a model's live mesh, of its present state. */
  clone(): Mesh {
    return this.#handle.use((raw) => made(() => raw.clone(), this.#facts()));
  }

  /** Returns what copies of the mesh keep. */
  #facts(): Facts {
    return { ...this.#frame, warnings: this.warnings };
  }

  /**
   * Frees the memory; the mesh cannot be used afterwards. A model's mesh belongs to the model and is freed with it:
   * freeing it alone does nothing.
   */
  free(): void {
    if (!this.#live) this.#handle.free();
  }

  /** The same as {@link Mesh.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function isRelative(options: PositionOptions | undefined): boolean {
  return boolean('relative', checkProperties('options', options, ['relative']).relative ?? false);
}

function triple(numbers: Float64Array): Vec3 {
  return Array.from(numbers) as Vec3;
}

function passCodes(passes: readonly RestructurePass[]): Uint8Array {
  const code = (pass: RestructurePass) => RESTRUCTURE_PASSES.indexOf(choice('passes', pass, RESTRUCTURE_PASSES));
  return Uint8Array.from(denseCopy('passes', passes).map(code));
}

/** Returns the origin and the normal of a plane once they are checked. */
function checkedPlane(plane: { origin: Vec3; normal: Vec3 }) {
  const { origin, normal } = checkProperties('plane', shallowCopy('plane', plane), ['origin', 'normal']);
  return [vec3('plane.origin', origin), nonZero('plane.normal', vec3('plane.normal', normal))] as const;
}

/** Returns the quantity that {@link Mesh.toVolume} is asked for, and the value inside a mask, once they are checked. */
function voxelQuantity(options: { kind?: VoxelKind; value?: number }): [VoxelKind, number] {
  const { kind = 'mask', value } = checkProperties('options', options, ['kind', 'value']);
  choice('kind', kind, VOXEL_KINDS);
  if (value !== undefined && kind !== 'mask') throw invalid('value', `only a mask has a value, not a ${kind} volume`);
  return [kind, integer('value', value ?? 1, { min: 1 })];
}

/** Returns the options of {@link Mesh.smooth} once they are checked. */
function smoothing(options: { iterations: number; keepVolume?: boolean }): [number, boolean] {
  const copy = checkProperties('options', shallowCopy('options', options), ['iterations', 'keepVolume']);
  const { iterations, keepVolume = true } = copy;
  const count = integer('iterations', iterations, { max: 10_000 });
  if (typeof keepVolume !== 'boolean') throw invalid('keepVolume', 'must be true or false');
  return [count, keepVolume];
}

/** Returns the target and the largest distance of {@link Mesh.decimateWithin} once they are checked. */
function decimationBounds(maxDistance: number, options: { targetTriangles?: number }): [number, number] {
  const distance = number('maxDistance', maxDistance, { min: 0 });
  const copy = checkProperties('options', shallowCopy('options', options), ['targetTriangles']);
  return [number('targetTriangles', copy.targetTriangles ?? 1, { min: 1 }), distance];
}

function edgeBounds(edge: { min: number; max: number }): [number, number] {
  const { min, max } = checkProperties('edge', shallowCopy('edge', edge), ['min', 'max']);
  positive('edge.min', min);
  if (number('edge.max', max) > 2 * (min as number)) return [min as number, max as number];
  throw invalid('edge.max', `must be more than twice edge.min, ${min}, got ${max}`);
}

/** Properties of a mesh besides its triangles. */
type Facts = MeshFrame & Pick<MeshExtra, 'warnings'>;

function made(make: () => RawMesh, { space, unit, warnings = [] }: Facts = {}): Mesh {
  const frame = { ...(space && { space }), ...(unit && { unit }) };
  return wrapMesh(new Handle('Mesh', make), false, () => warnings, frame);
}

/** Returns the warnings of a volume that concern one of its frames. */
function inFrame(warnings: readonly Warning[], frame: number): Warning[] {
  return warnings.filter(({ where }) => !where || !('frame' in where) || where.frame === frame);
}

/** Properties of {@link MeshArrays}. */
const ARRAY_PROPERTIES = ['positions', 'origin', 'normals', 'indices', 'uvs', 'colors'] as const;
/** Properties of a {@link MeshSnapshot}. */
const SNAPSHOT_PROPERTIES = [...ARRAY_PROPERTIES, 'vertices', 'triangles'] as const;

/** Arrays of a {@link MeshExtra}: name, and how many numbers they have per vertex or per triangle. */
const EXTRA_ARRAYS = [
  ['normals', 3, 'vertex'],
  ['uvs', 2, 'vertex'],
  ['cornerUvs', 6, 'triangle'],
  ['colors', 3, 'vertex'],
] as const;

function checkExtra(extra: MeshExtra, vertices: number, triangles: number): MeshExtra {
  const others = ['texture', 'warnings', 'space', 'unit'];
  const given = checkProperties('extra', extra, [...EXTRA_ARRAYS.map(([name]) => name), ...others]);
  checkStated(given);
  for (const [name, stride, part] of EXTRA_ARRAYS) {
    const array = given[name];
    const length = stride * (part === 'vertex' ? vertices : triangles);
    if (array === undefined || finite(name, array, 1).length === length) continue;
    throw invalid(name, `must have ${stride} numbers per ${part}, ${length}, got ${array.length}`);
  }
  const { uvs, cornerUvs, texture } = given;
  if (texture !== undefined && !(uvs ?? cornerUvs)) throw invalid('texture', 'needs texture coordinates, uvs');
  checkTexture(texture);
  return given;
}

function checkIndices(indices: Uint32Array, vertices: number): void {
  const wrong = indices.findIndex((index) => index >= vertices);
  if (wrong < 0) return;
  throw invalid('indices', `${indices[wrong]} at index ${wrong}; there are ${vertices} vertices`);
}

function nonZero(parameter: string, vector: Float64Array<ArrayBuffer>): Float64Array<ArrayBuffer> {
  if (vector.some((entry) => entry !== 0)) return vector;
  throw invalid(parameter, 'must not be the zero vector');
}

function copyArrays(from: RawArrays, out: MeshArrays): { vertices: number; triangles: number } {
  const vertices = from.vertices();
  const triangles = from.triangles();
  out.positions = longEnough(out.positions, 3 * vertices, Float32Array);
  out.normals = longEnough(out.normals, 3 * vertices, Float32Array);
  out.indices = longEnough(out.indices, 3 * triangles, Uint32Array);
  from.positions(out.positions);
  from.normals(out.normals);
  from.indices(out.indices);
  copyExtra(out, 'uvs', from.uvs());
  copyExtra(out, 'colors', from.colors());
  return { vertices, triangles };
}

function longEnough<T extends Float32Array | Uint32Array>(
  array: T,
  length: number,
  kind: new (length: number) => T,
): T {
  return array instanceof kind && array.length >= length ? array : new kind(length);
}

function snapshotOf(from: RawArrays, reuse: Partial<MeshArrays>): Omit<MeshSnapshot, 'origin'> {
  const vertices = from.vertices();
  const triangles = from.triangles();
  const positions = roomFor(reuse.positions, vertices, 3, Float32Array);
  const normals = roomFor(reuse.normals, vertices, 3, Float32Array);
  const indices = roomFor(reuse.indices, triangles, 3, Uint32Array);
  from.positions(positions);
  from.normals(normals);
  from.indices(indices);
  const [uvs, colors] = [from.uvs(), from.colors()];
  return {
    ...{ positions, normals, indices, vertices, triangles },
    ...(uvs && { uvs: copyWithRoom(reuse.uvs, uvs, 2, Float32Array) }),
    ...(colors && { colors: copyWithRoom(reuse.colors, colors, 3, Float32Array) }),
  };
}

function copyExtra(out: MeshArrays, name: 'uvs' | 'colors', values: Float32Array | undefined): void {
  const room = out[name];
  if (!values) delete out[name];
  else if (room && room.length >= values.length) room.set(values);
  else out[name] = values;
}
