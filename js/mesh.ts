import { choice, finite, invalid, knownOnly, list, number, plain, positive, typed, vec3, whole } from './check.js';
import { call, Handle } from './runtime.js';
import { type RawArrays, RawMesh, RawTexture } from './vesicle.js';
import { type Vec3, type Volume, volumeHandle } from './volume.js';

/** A mesh's vertices and triangles, packed. */
export interface MeshArrays {
  /** xyz of each vertex. */
  positions: Float32Array;
  /** Unit normal of each vertex, outwards. */
  normals: Float32Array;
  /** abc of each triangle, counter-clockwise seen from outside. */
  indices: Uint32Array;
  /** Texture coordinates of each vertex, where the mesh has them; at a seam those of one side: see `splitAtSeams`. */
  uvs?: Float32Array;
  /** Colour of each vertex, rgb, 0..1, where the mesh has them. */
  colors?: Float32Array;
}

/** Encodings of a picture that {@link MeshTexture} may have. */
export type TextureType = 'image/png' | 'image/jpeg' | 'image/webp';

/**
 * The picture on a mesh, as an image file. Texture coordinates count from its upper left corner, u to the right and v
 * downwards, 1 at the far edges, and it repeats beyond, as in glTF: in three.js, with `flipY = false`.
 */
export interface MeshTexture {
  /** How the picture is encoded. */
  type: TextureType;
  /** The image file. */
  bytes: Uint8Array;
}

/** Measures of a mesh. Those of the enclosed solid mean something for a closed mesh only. */
export interface MeshInfo {
  vertices: number;
  triangles: number;
  components: number;
  /** Vertices - edges + triangles. */
  euler: number;
  /** Sum over components; closed orientable, so euler = 2 * components - 2 * genus. */
  genus: number;
  /** World units squared. */
  area: number;
  /** World units cubed. */
  volume: number;
  /** Of the enclosed solid. */
  centroid: Vec3;
  /** Second moments about the centroid of the enclosed solid, row-major 3x3. */
  inertia: number[];
  /** Lengths, world units. */
  edge: { min: number; mean: number; max: number };
  /** The sharpest corner of all triangles. */
  minAngleDegrees: number;
  bounds: { min: Vec3; max: Vec3 };
}

/** What an independent look at the mesh finds; a healthy one is closed, oriented and has all counts at 0. */
export interface MeshReport {
  /** Every edge has two triangles. */
  closed: boolean;
  /** Neighbouring triangles turn the same way. */
  oriented: boolean;
  /** Edges with more than two triangles. */
  nonManifoldEdges: number;
  /** Vertices whose triangles form more than one fan. */
  nonManifoldVertices: number;
  /** Triangles without area. */
  degenerateTriangles: number;
  /** Pairs of triangles that cross, counted exactly. */
  selfIntersections: number;
}

/** File formats a mesh can be written in. */
export type MeshFormat = 'glb' | 'ply' | 'stl' | 'obj' | 'vtp' | 'mz3';

/** Where a ray meets a mesh. */
export interface MeshHit {
  /** Index of the triangle in {@link MeshArrays.indices}. */
  triangle: number;
  /** Weights of the triangle's corners; they sum to 1. */
  barycentric: Vec3;
  /** The point itself. */
  point: Vec3;
  /** From the ray's origin, world units. */
  distance: number;
}

/** Which curvature: κ₁ and κ₂ are the principal ones. */
export type CurvatureKind =
  /** H = (κ₁ + κ₂) / 2. */
  | 'mean'
  /** K = κ₁ κ₂. */
  | 'gaussian';

/** How far two surfaces are from each other, world units. Summaries are of both ways, and the same both ways. */
export interface SurfaceDistance {
  /** From each vertex of the mesh to the nearest point of the other's surface; not negative. */
  perVertex: Float32Array;
  /** Mean of the two one-way means. */
  mean: number;
  /** Root of the mean of the two one-way mean squares. */
  rms: number;
  /** The larger of the two one-way 95th percentiles. */
  p95: number;
  /** The largest distance of all, both ways. */
  hausdorff: number;
}

/** A pass of {@link Mesh.restructure}. */
export type RestructurePass = 'collapse' | 'split' | 'flip';

const RESTRUCTURE_PASSES: readonly RestructurePass[] = ['collapse', 'split', 'flip'];

const CURVATURES: readonly CurvatureKind[] = ['mean', 'gaussian'];

const TEXTURES: readonly TextureType[] = ['image/png', 'image/jpeg', 'image/webp'];

const FORMATS: readonly MeshFormat[] = ['glb', 'ply', 'stl', 'obj', 'vtp', 'mz3'];

/** The handle of a mesh; for the library's own modules. */
export let meshHandle: (parameter: string, mesh: Mesh) => Handle<RawMesh>;
/** A mesh of a raw one. A live one belongs to its model, which frees it. For the library's own modules. */
export let wrapMesh: (handle: Handle<RawMesh>, live?: boolean) => Mesh;

/**
 * A triangle mesh.
 *
 * Files and arrays may hold an open mesh, or one that crosses itself; {@link Mesh.check} says so, and what needs a
 * closed one refuses it with `not-closed`. The mesh of a model follows the model; it can be read and copied but not
 * edited.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link Mesh.free}.
 */
export class Mesh {
  readonly #handle: Handle<RawMesh>;
  readonly #live: boolean;

  static {
    wrapMesh = (handle, live = false) => new Mesh(handle, live);
    meshHandle = (parameter, mesh) => {
      if (mesh instanceof Mesh) return mesh.#handle;
      throw invalid(parameter, 'a Mesh is needed');
    };
  }

  private constructor(handle: Handle<RawMesh>, live: boolean) {
    if (!(handle instanceof Handle)) {
      throw invalid('Mesh', 'made by icosphere, fromArrays, parse or marchingCubes, not by `new`');
    }
    this.#handle = handle;
    this.#live = live;
  }

  /**
   * A sphere of nearly equal triangles with no edge longer than `maxEdge`.
   *
   * @throws {@link VesicleError} `invalid-argument`; `too-large` for more triangles than there is memory for.
   */
  static icosphere(center: Vec3, radius: number, maxEdge: number): Mesh {
    const middle = vec3('center', center);
    positive('radius', radius);
    positive('maxEdge', maxEdge);
    return made(() => RawMesh.icosphere(middle, radius, maxEdge));
  }

  /**
   * A mesh of packed arrays, which are copied as they are.
   *
   * @param positions - xyz of each vertex.
   * @param indices - abc of each triangle, counter-clockwise seen from outside.
   * @param extra - `uvs`: texture coordinates of each vertex; `texture`: the picture they lie in.
   * @throws {@link VesicleError} `invalid-argument`: a wrong length, a number that is not finite, an index of no vertex,
   *   a texture without `uvs`, bytes that are no picture of the type that is named.
   */
  static fromArrays(
    positions: Float32Array,
    indices: Uint32Array,
    extra: { uvs?: Float32Array; texture?: MeshTexture } = {},
  ): Mesh {
    const { uvs, texture } = knownOnly('extra', extra, ['uvs', 'texture']);
    const vertices = finite('positions', positions, 3).length / 3;
    checkIndices(typed('indices', indices, Uint32Array, 3), vertices);
    if (uvs !== undefined && finite('uvs', uvs, 2).length !== 2 * vertices) {
      throw invalid('uvs', `length ${uvs.length}; two numbers a vertex are needed, ${2 * vertices}`);
    }
    if (texture !== undefined && uvs === undefined) throw invalid('texture', 'needs texture coordinates, uvs');
    checkTexture(texture);
    return made(() => RawMesh.fromArrays(positions, indices, uvs, rawTexture(texture)));
  }

  /**
   * The mesh in a file: glb, ply, stl or obj, detected from the bytes. Duplicate positions are welded.
   *
   * A glb that has its base colour texture in it (png, jpeg or webp) brings it along as {@link Mesh.texture}. Texture
   * coordinates are as in the file: v counts from above in glb, and from below in obj and ply.
   *
   * @param options - `texture`: the picture for a file that has it beside it (obj, ply). Then v counts from above in all
   *   of them: that of an obj or ply becomes 1 - v. It takes the place of a glb's own.
   * @throws {@link VesicleError} `bad-file` naming the format and the field, also for a texture where the file has no
   *   texture coordinates; `too-large`; `invalid-argument`.
   */
  static parse(bytes: Uint8Array, options: { texture?: MeshTexture } = {}): Mesh {
    typed('bytes', bytes, Uint8Array);
    const { texture } = knownOnly('options', options, ['texture']);
    checkTexture(texture);
    return made(() => RawMesh.parse(bytes, rawTexture(texture)));
  }

  /**
   * Iso-surface of a volume in its world space, closed at the volume's border; topologically consistent. Inside is
   * where the intensity is at least `iso`.
   *
   * @param options - `frame`: which one of a 4D volume; default 0.
   * @throws {@link VesicleError} `invalid-argument`: no such frame; `too-large`.
   */
  static marchingCubes(volume: Volume, iso: number, options: { frame?: number } = {}): Mesh {
    const { frame = 0 } = knownOnly('options', options, ['frame']);
    number('iso', iso);
    whole('frame', frame);
    const handle = volumeHandle('volume', volume);
    return handle.use((raw) => made(() => RawMesh.marchingCubes(raw, iso, frame)));
  }

  /** Number of vertices. */
  get vertexCount(): number {
    return this.#handle.use((raw) => raw.vertexCount());
  }

  /** Number of triangles. */
  get triangleCount(): number {
    return this.#handle.use((raw) => raw.triangleCount());
  }

  /** Counts up when connectivity changes. */
  get topologyVersion(): number {
    return this.#handle.use((raw) => raw.topologyVersion());
  }

  /** Counts up when any vertex moves. */
  get geometryVersion(): number {
    return this.#handle.use((raw) => raw.geometryVersion());
  }

  /**
   * The picture on the mesh, a copy of the caller's own, or nothing. Edits take it away, as they do texture coordinates.
   */
  get texture(): MeshTexture | undefined {
    const raw = this.#handle.use((mesh) => mesh.texture());
    if (!raw) return undefined;
    try {
      return call(() => ({ type: raw.kind() as TextureType, bytes: raw.bytes() }));
    } finally {
      raw.free();
    }
  }

  /** The mesh as it is now, in arrays of the caller's own. */
  arrays(): MeshArrays {
    const arrays = { positions: new Float32Array(), normals: new Float32Array(), indices: new Uint32Array() };
    this.copyTo(arrays);
    return arrays;
  }

  /**
   * Into the caller's buffers, which are replaced only when too small; returns the counts written. `uvs` and `colors`
   * are set where the mesh has them, and deleted where it has none.
   *
   * @throws {@link VesicleError} `invalid-argument` where `out` is no such object.
   */
  copyTo(out: MeshArrays): { vertices: number; triangles: number } {
    if (out === undefined) throw invalid('out', 'undefined; an object with positions, normals and indices is needed');
    knownOnly('out', out, ['positions', 'normals', 'indices', 'uvs', 'colors']);
    const arrays = this.#handle.use((raw) => raw.arrays());
    try {
      return call(() => copyArrays(arrays, out));
    } finally {
      arrays.free();
    }
  }

  /** Measures of the mesh. */
  info(): MeshInfo {
    return this.#handle.use((raw) => raw.info() as MeshInfo);
  }

  /** An independent look at the mesh, from its arrays alone. */
  check(): MeshReport {
    return this.#handle.use((raw) => raw.check() as MeshReport);
  }

  /**
   * The mesh to be drawn with its texture: along the seams of the texture a vertex has several texture coordinates, and
   * becomes as many vertices, so that {@link Mesh.arrays} has `uvs`. It is open there. A mesh without seams comes back
   * as it is.
   */
  splitAtSeams(): Mesh {
    return this.#handle.use((raw) => made(() => raw.splitAtSeams()));
  }

  /** The connected parts, each as a mesh of its own. */
  components(): Mesh[] {
    return this.#handle.use((raw) => raw.components()).map((part) => made(() => part));
  }

  /**
   * One sqrt(3) refinement pass: three triangles for each.
   *
   * @throws {@link VesicleError} `not-closed`; `invalid-argument` for the mesh of a model: `clone()` it first;
   *   `too-large`.
   */
  refine(): void {
    this.#handle.use((raw) => raw.refine());
  }

  /**
   * One round of restructuring, pass by pass: edges shorter than `min` are drawn together, those longer than `max` split, and
   * edges flipped where that brings valences nearer to six. The mesh stays closed, with the same components and genus; its
   * shape suffers a little, and it may come to cross itself: {@link Mesh.remesh} keeps both.
   *
   * @param edge - Bounds of edges, `max` more than twice `min`.
   * @param passes - In the order they are to run; default all three once.
   * @returns How many edges were drawn together, split or flipped.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first; `too-large`.
   */
  restructure(edge: { min: number; max: number }, passes: readonly RestructurePass[] = RESTRUCTURE_PASSES): number {
    const [min, max] = edgeBounds(edge);
    const codes = list('passes', passes).map((pass) =>
      RESTRUCTURE_PASSES.indexOf(choice('passes', pass, RESTRUCTURE_PASSES)),
    );
    return this.#handle.use((raw) => raw.restructure(min, max, Uint8Array.from(codes)));
  }

  /**
   * Draws edges together, those first whose loss is felt least (by quadric errors), until at most so many triangles
   * are left. The mesh stays closed, keeps its components and their genus, no triangle turns over, and where it did
   * not cross itself it does not afterwards.
   *
   * Stops early where no edge can be drawn together safely: a component keeps four triangles at least, a handle some
   * more. Vertices are numbered anew. Texture coordinates and colours are not kept. A target of as many triangles as
   * there are, or more, changes nothing.
   *
   * @param targetTriangles - At least 1; a fraction is cut off.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first.
   */
  decimate(targetTriangles: number): void {
    number('targetTriangles', targetTriangles, { min: 1 });
    this.#handle.use((raw) => raw.decimate(targetTriangles));
  }

  /**
   * Brings the lengths of edges into bounds and the number of edges at each vertex towards six, so that triangles become
   * alike, with edges of about √(min · max): by collapse, split and flip, and by moves along the surface. The shape is
   * kept, mostly to within a quarter of such an edge. The mesh stays closed, keeps its components and their genus, and
   * where it did not cross itself it does not afterwards.
   *
   * Some edges stay shorter than `min` where parts are thinner than that, or the shape would be lost. What crosses itself
   * already is left much as it is. Vertices are numbered anew, and all of them may move. Texture coordinates and colours
   * are not kept.
   *
   * @param edge - Lengths, world units: `min` above 0, `max` more than twice as much.
   * @throws {@link VesicleError} `not-closed`; `invalid-argument`, also for the mesh of a model: `clone()` it first;
   *   `too-large` where more than eight million vertices would be needed.
   */
  remesh(edge: { min: number; max: number }): void {
    const [min, max] = edgeBounds(edge);
    this.#handle.use((raw) => raw.remesh(min, max));
  }

  /**
   * Curvature at each vertex, in the order of {@link Mesh.arrays}. `mean` is positive where the surface bulges outwards:
   * 1/r on a ball of radius r, -1/r on a cavity. `gaussian` is 1/r² on both and negative on a saddle.
   *
   * Of the triangles around a vertex, so rough where they are: smooth the values for display if need be. Always finite;
   * 0 on the rim of an open mesh and at vertices of no triangle.
   *
   * @throws {@link VesicleError} `invalid-argument`: neither of the two.
   */
  curvature(kind: CurvatureKind): Float32Array {
    choice('kind', kind, CURVATURES);
    return this.#handle.use((raw) => (kind === 'mean' ? raw.meanCurvature() : raw.gaussianCurvature()));
  }

  /**
   * Distance along the surface from one vertex to each, in the order of {@link Mesh.arrays}, world units; `Infinity`
   * where no triangles lead, as on other components.
   *
   * Exact on flat parts. On curved ones, and where ways from two sides meet, up to half an edge short; never shorter
   * than the straight line.
   *
   * @param fromVertex - Index of the vertex.
   * @throws {@link VesicleError} `invalid-argument`: there is no such vertex.
   */
  geodesic(fromVertex: number): Float32Array {
    whole('fromVertex', fromVertex);
    return this.#handle.use((raw) => raw.geodesic(fromVertex));
  }

  /**
   * Unsigned distance from each of this mesh's vertices to the other's surface, and summaries of both ways: from this
   * mesh's vertices to the other's surface, and from the other's vertices to this one's surface.
   *
   * In the summaries each vertex counts by the area around it. `a.distanceTo(b)` and `b.distanceTo(a)` give the same
   * summaries.
   *
   * @throws {@link VesicleError} `invalid-argument`: `other` is no mesh, or one of the two has no triangle.
   */
  distanceTo(other: Mesh): SurfaceDistance {
    const handle = meshHandle('other', other);
    return this.#handle.use((raw) => handle.use((rawOther) => raw.distanceTo(rawOther) as SurfaceDistance));
  }

  /**
   * The nearest place where a ray meets the surface, from either side, or nothing.
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
   * Line segments where a plane cuts the surface: pairs of points, six numbers a segment.
   *
   * @param normal - Any length but 0.
   * @throws {@link VesicleError} `invalid-argument`.
   */
  crossSection(origin: Vec3, normal: Vec3): Float32Array {
    const point = vec3('origin', origin);
    const across = nonZero('normal', vec3('normal', normal));
    return this.#handle.use((raw) => raw.crossSection(point, across));
  }

  /**
   * The mesh as the bytes of a file: glb (binary glTF), ply and stl (binary), obj, vtp or mz3. Only a glb has the
   * texture in it; obj, ply and vtp of a mesh with one have its texture coordinates as programs expect them, 1 - v.
   *
   * @throws {@link VesicleError} `invalid-argument`: no such format.
   */
  toBytes(format: MeshFormat): Uint8Array {
    choice('format', format, FORMATS);
    return this.#handle.use((raw) => raw.toBytes(format));
  }

  /** A copy that nothing else changes; of a model's mesh, the surface as it is now. */
  clone(): Mesh {
    return this.#handle.use((raw) => made(() => raw.clone()));
  }

  /**
   * Gives the memory back; the mesh cannot be used afterwards. A model's mesh belongs to the model and goes with it:
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

function edgeBounds(edge: { min: number; max: number }): [number, number] {
  const { min, max } = knownOnly('edge', plain('edge', edge), ['min', 'max']);
  positive('edge.min', min);
  if (number('edge.max', max) > 2 * (min as number)) return [min as number, max as number];
  throw invalid('edge.max', `${max}; more than twice edge.min, ${min}, is needed`);
}

function made(make: () => RawMesh): Mesh {
  return wrapMesh(new Handle('Mesh', make));
}

function checkIndices(indices: Uint32Array, vertices: number): void {
  const wrong = indices.findIndex((index) => index >= vertices);
  if (wrong < 0) return;
  throw invalid('indices', `${indices[wrong]} at index ${wrong}; there are ${vertices} vertices`);
}

function checkTexture(texture: MeshTexture | undefined): void {
  if (texture === undefined) return;
  const { type, bytes } = knownOnly('texture', texture, ['type', 'bytes']);
  choice('texture.type', type, TEXTURES);
  typed('texture.bytes', bytes, Uint8Array);
}

/** A copy inside the module, which takes it over. */
function rawTexture(texture: MeshTexture | undefined): RawTexture | undefined {
  return texture && new RawTexture(texture.type, texture.bytes);
}

function nonZero(parameter: string, vector: Float64Array<ArrayBuffer>): Float64Array<ArrayBuffer> {
  if (vector.some((entry) => entry !== 0)) return vector;
  throw invalid(parameter, 'has no length');
}

function copyArrays(from: RawArrays, out: MeshArrays): { vertices: number; triangles: number } {
  const vertices = from.vertices();
  const triangles = from.triangles();
  out.positions = roomFor(out.positions, 3 * vertices, Float32Array);
  out.normals = roomFor(out.normals, 3 * vertices, Float32Array);
  out.indices = roomFor(out.indices, 3 * triangles, Uint32Array);
  from.positions(out.positions);
  from.normals(out.normals);
  from.indices(out.indices);
  copyExtra(out, 'uvs', from.uvs());
  copyExtra(out, 'colors', from.colors());
  return { vertices, triangles };
}

function roomFor<T extends Float32Array | Uint32Array>(array: T, length: number, kind: new (length: number) => T): T {
  return array instanceof kind && array.length >= length ? array : new kind(length);
}

function copyExtra(out: MeshArrays, name: 'uvs' | 'colors', values: Float32Array | undefined): void {
  const room = out[name];
  if (!values) delete out[name];
  else if (room && room.length >= values.length) room.set(values);
  else out[name] = values;
}
