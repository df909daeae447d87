// Shows a surface in NiiVue that follows a mesh.
import { boolean, invalid, number } from '../check.js';
import type { Space, Vec3 } from '../data.js';
import { VesicleError } from '../error.js';
import type { MeshArrays } from '../mesh.js';
import type { Warning } from '../warning.js';
import { Outline, type Outlines, outlinesOf } from './niivue-outline.js';
import { type AnyMesh, bounds, MeshReader, type SurfaceArrays } from './source.js';

/** The members of NiiVue's class `Niivue` (`NiiVueGPU` in 1.0) that {@link NiivueSurface} uses. */
export interface Niivue {
  addMesh(mesh: object): unknown;
  /** Removes a mesh from NiiVue, given by itself in 0.69 and by its index in `meshes` in 1.0. */
  removeMesh(mesh: object | number): unknown;
  readonly meshes: readonly object[];
}

/** Constructor of the class `NVMesh` of NiiVue 0.69, which {@link NiivueSurface} needs there. */
export type NVMeshClass = new (
  pts: Float32Array<ArrayBuffer>,
  tris: Uint32Array<ArrayBuffer>,
  name: string,
  rgba255: Uint8Array<ArrayBuffer>,
  opacity: number,
  visible: boolean,
  gl: WebGL2RenderingContext,
) => object;

/** Options of {@link NiivueSurface}. */
export interface NiivueSurfaceOptions {
  /** The class `NVMesh` of NiiVue; required by NiiVue 0.69, not used by 1.0. */
  NVMesh?: NVMeshClass;
  /** Name of the surface in NiiVue's list of meshes; default 'vesicle'. */
  name?: string;
  /** Colour of the surface as rgba, 0..1; default a warm white. Vertex colours of the mesh replace its rgb. */
  color?: readonly [number, number, number, number];
  /** World space of the mesh, which is that of its volume; default RAS, as in NiiVue. */
  space?: Space;
  /**
   * Width of the surface's outline in slices, CSS pixels; default 1.5. 0 leaves slices to NiiVue, which draws the part of
   * the mesh that is within `meshThicknessOn2D` of the slice.
   */
  outline?: number;
  /**
   * Whether a mesh that is far from the origin for its size is shown at the origin, with a warning. NiiVue draws positions
   * in world space in single precision, in which such a mesh would jitter. Not beside a volume that is as far away, since
   * NiiVue's view of both would be empty. Default false: `update` throws `precision`.
   */
  recentre?: boolean;
}

const REMEDY = 'NiiVue cannot draw it there; the option `recentre` shows it at the origin';

/** A volume that is this many times its size away from the origin is far from it. */
const FAR = 16;

/**
 * A mesh in NiiVue that follows a mesh of this library, through all changes of connectivity.
 *
 * ```js
 * const surface = new NiivueSurface(nv, { NVMesh }); // 1.0: without NVMesh
 * if (await surface.update(model.mesh)) nv.drawScene(); // after every step
 * ```
 */
export class NiivueSurface {
  readonly #nv: Niivue;
  readonly #reader: MeshReader;
  readonly #adapter: MeshAdapter;
  readonly #outline: Outline | undefined;
  readonly #outlines: Outlines | undefined;
  #origin: Vec3 = [0, 0, 0];

  /**
   * Creates a surface that NiiVue shows from the first update on.
   *
   * @param nv - A NiiVue attached to its canvas.
   * @throws `VesicleError` `invalid-argument`: no NiiVue, one without a canvas, or 0.69 without `NVMesh`.
   */
  constructor(nv: Niivue, options: NiivueSurfaceOptions = {}) {
    const { NVMesh, name = 'vesicle', color = [1, 0.88, 0.75, 1], space = 'RAS', outline = 1.5 } = options;
    if (typeof Object(nv).addMesh !== 'function') throw invalid('nv', 'must be a Niivue');
    const { gl, view } = nv as { gl?: WebGL2RenderingContext; view?: View10 };
    if (!gl && !view) throw invalid('nv', 'has no canvas yet; attach one first');
    this.#nv = nv;
    this.#reader = new MeshReader(space, 'RAS', boolean('recentre', options.recentre ?? false) ? undefined : REMEDY);
    if (number('outline', outline, { min: 0 }) > 0) {
      this.#outlines = outlinesOf(nv);
      this.#outline = new Outline(color, outline);
    }
    const look = { name, color };
    if (view) this.#adapter = new Niivue10(nv, view, look);
    else if (NVMesh && gl) this.#adapter = new Niivue069(nv, gl, NVMesh, look);
    else throw invalid('NVMesh', "NiiVue 0.69 needs its class: import { Niivue, NVMesh } from '@niivue/niivue'");
  }

  /** The mesh in NiiVue's list `nv.meshes` that shows the surface; undefined before the first update. */
  get mesh(): object | undefined {
    return this.#adapter.mesh;
  }

  /**
   * Warnings about the surface: those of the mesh, and `recentred` if it is shown where the mesh is not; empty if there are
   * none.
   */
  get warnings(): Warning[] {
    const { warnings } = this.#reader;
    if (this.#origin.every((coordinate) => coordinate === 0)) return warnings;
    const text =
      `NiiVue cannot draw the surface where it is, too far from the origin: ` +
      `the point ${this.#origin.join(', ')} is shown at the origin.`;
    return [...warnings, { code: 'recentred', text, where: { point: this.#origin } }];
  }

  /**
   * Updates NiiVue's mesh if `mesh` has changed since the last call; draw to show it. Resolves with whether `mesh` had
   * changed.
   *
   * Unless `mesh` is in a worker, the work is done synchronously and the promise resolves at once, except in 1.0 on the
   * first call, and with WebGPU possibly on each: there NiiVue uploads its volumes again, too.
   *
   * @throws `VesicleError` `invalid-argument`: no mesh; `precision`: a mesh so far from the origin that single precision
   *   is too coarse there, unless it may be recentred and NiiVue has no volume as far away. What was shown stays.
   */
  async update(mesh: AnyMesh): Promise<boolean> {
    const read = this.#reader.readOrFetch(mesh);
    const frame = read instanceof Promise ? await read : read;
    if (!frame) return false;
    await this.#moveTo(frame.origin);
    // NiiVue keeps the arrays for later use, so they are copied.
    const [positions, indices] = [frame.positions.slice(), frame.indices.slice()];
    this.#outline?.set(positions, indices);
    const shown = this.#adapter.show({ ...frame, positions, indices });
    if (this.mesh && this.#outline) this.#outlines?.add(this.mesh, this.#outline);
    await shown;
    return true;
  }

  /** Sets the point that is shown at the origin. */
  async #moveTo(origin: Vec3): Promise<void> {
    const [was, is] = [this.#origin, origin].map(isZero);
    if (!is && volumesOf(this.#nv).some(isFar)) {
      this.#reader.clear();
      const text = 'NiiVue has a volume far from the origin, and draws nothing if a surface is shown there';
      throw new VesicleError('precision', `${text}: remove the volume, or move it and the mesh to the origin`);
    }
    // NiiVue 1.0 centres its view on a mesh when that is added.
    if (was !== is) await this.#remove();
    this.#origin = origin;
  }

  async #remove(): Promise<void> {
    if (this.mesh) this.#outlines?.remove(this.mesh);
    await this.#adapter.remove();
  }

  /** Removes the mesh from NiiVue. */
  async dispose(): Promise<void> {
    this.#reader.clear();
    this.#origin = [0, 0, 0];
    await this.#remove();
  }
}

const isZero = (point: Vec3): boolean => point.every((coordinate) => coordinate === 0);

/** The properties of a NiiVue volume that tell where it is. */
interface PlacedVolume {
  hdr?: { dims: ArrayLike<number>; affine: ArrayLike<number>[] } | null;
}

const volumesOf = (nv: Niivue): PlacedVolume[] => (nv as { volumes?: PlacedVolume[] }).volumes ?? [];

/** Returns whether a volume is as far from the origin, for its size, as a mesh that gets an origin of its own. */
function isFar({ hdr }: PlacedVolume): boolean {
  if (!hdr?.affine) return false;
  const rows = [0, 1, 2].map((row) => Array.from({ length: 4 }, (_, k) => Number(hdr.affine[row]?.[k])));
  const sides = [1, 2, 3].map((axis) => Number(hdr.dims[axis]));
  const center = rows.map((row) => sides.reduce((sum, n, k) => sum + (row[k] ?? 0) * (n / 2), row[3] ?? 0));
  const size = rows.map((row) => sides.reduce((sum, n, k) => sum + Math.abs(row[k] ?? 0) * n, 0));
  return Math.hypot(...center) > FAR * Math.hypot(...size);
}

/** A surface whose arrays NiiVue may keep. */
interface OwnArrays extends SurfaceArrays {
  positions: Float32Array<ArrayBuffer>;
  indices: Uint32Array<ArrayBuffer>;
}

interface Appearance {
  name: string;
  color: readonly [number, number, number, number];
}

/** Shows and removes one mesh in NiiVue; implemented once for 0.69 and once for 1.0. */
interface MeshAdapter {
  readonly mesh: object | undefined;
  show(frame: OwnArrays): unknown;
  remove(): unknown;
}

/**
 * Returns the colours of the vertices for NiiVue, four bytes each, rgba: rgb are the vertex colours if the mesh has
 * them, else those of `color`; alpha is always that of `color`.
 */
function paint({ positions, colors }: MeshArrays, color: ArrayLike<number>): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array((positions.length / 3) * 4);
  const all = Array.from(color, (share) => Math.round(255 * share));
  for (let i = 0, from = 0; i < bytes.length; i += 4, from += 3) {
    for (let k = 0; k < 3; k++)
      bytes[i + k] = colors ? Math.round(255 * (colors[from + k] as number)) : (all[k] as number);
    bytes[i + 3] = all[3] as number;
  }
  return bytes;
}

/** The properties of an `NVMesh` of NiiVue 0.69 that the adapter reads or sets. */
interface Mesh069 {
  pts: Float32Array;
  tris: Uint32Array;
  rgba255: Uint8Array;
  layers: unknown[];
  extentsMin: unknown;
  extentsMax: unknown;
  furthestVertexFromOrigin: number;
  f32PerVertex: number;
  vertexCount: number;
  indexCount: number;
  vao: WebGLVertexArrayObject;
  vertexBuffer: WebGLBuffer;
  indexBuffer: WebGLBuffer;
  updateMesh(gl: WebGL2RenderingContext): void;
}

class Niivue069 implements MeshAdapter {
  mesh: Mesh069 | undefined;
  readonly #nv: Niivue;
  readonly #gl: WebGL2RenderingContext;
  readonly #NVMesh: NVMeshClass;
  readonly #appearance: Appearance;

  constructor(nv: Niivue, gl: WebGL2RenderingContext, NVMesh: NVMeshClass, appearance: Appearance) {
    [this.#nv, this.#gl, this.#NVMesh, this.#appearance] = [nv, gl, NVMesh, appearance];
  }

  show(frame: OwnArrays): void {
    if (this.mesh) this.#change(this.mesh, frame);
    else this.#add(frame);
  }

  #change(mesh: Mesh069, frame: OwnArrays): void {
    const { positions, indices } = frame;
    if (frame.topology) Object.assign(mesh, { tris: indices, layers: [] });
    const { min, max } = bounds(positions);
    Object.assign(mesh, { pts: positions, extentsMin: min, extentsMax: max });
    mesh.furthestVertexFromOrigin = furthest(positions);
    if (frame.colors) mesh.rgba255 = paint(frame, this.#appearance.color);
    // Packing the vertex records here takes a fifth of the time of `updateMesh`, which is used if their format is
    // another one.
    if (mesh.f32PerVertex === 5 && mesh.layers.length === 0) this.#upload(mesh, frame);
    else mesh.updateMesh(this.#gl);
  }

  #add(frame: OwnArrays): void {
    const { positions, indices } = frame;
    const { name, color } = this.#appearance;
    const rgba = frame.colors ? paint(frame, color) : Uint8Array.from(color, (share) => Math.round(255 * share));
    const mesh = new this.#NVMesh(positions, indices, name, rgba, 1, true, this.#gl);
    this.mesh = mesh as Mesh069;
    this.#nv.addMesh(mesh);
  }

  #upload(mesh: Mesh069, frame: SurfaceArrays): void {
    const gl = this.#gl;
    gl.bindVertexArray(mesh.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertexBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertexRecords069(frame, mesh.rgba255), gl.DYNAMIC_DRAW);
    if (frame.topology) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indexBuffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.tris, gl.DYNAMIC_DRAW);
    }
    gl.bindVertexArray(null);
    // Counts as set by updateMesh: indices, and numbers of positions.
    [mesh.indexCount, mesh.vertexCount] = [mesh.tris.length, mesh.pts.length];
  }

  remove(): void {
    if (this.mesh) this.#nv.removeMesh(this.mesh);
    this.mesh = undefined;
  }
}

/** Packs the vertex records of NiiVue 0.69's vertex buffer, 20 bytes each: position, normal in signed bytes, colour. */
function vertexRecords069({ positions, normals }: SurfaceArrays, rgba: Uint8Array): ArrayBuffer {
  const vertices = positions.length / 3;
  const buffer = new ArrayBuffer(20 * vertices);
  const [floats, signed, words] = [new Float32Array(buffer), new Int8Array(buffer), new Uint32Array(buffer)];
  const colors = new Uint32Array(rgba.slice().buffer);
  const each = colors.length === 1 ? 0 : 1;
  for (let v = 0; v < vertices; v++) {
    for (let k = 0; k < 3; k++) {
      floats[5 * v + k] = positions[3 * v + k] as number;
      signed[20 * v + 12 + k] = 127 * (normals[3 * v + k] as number);
    }
    words[5 * v + 4] = colors[each * v] as number;
  }
  return buffer;
}

function furthest(positions: Float32Array): number {
  let most = 0;
  for (let i = 0; i < positions.length; i += 3) {
    const x = positions[i] as number;
    const y = positions[i + 1] as number;
    const z = positions[i + 2] as number;
    const squared = x * x + y * y + z * z;
    if (squared > most) most = squared;
  }
  return Math.sqrt(most);
}

/** The properties of a mesh of NiiVue 1.0 that the adapter reads or sets. */
interface Mesh10 {
  positions: Float32Array;
  indices: Uint32Array;
  colors: Uint32Array;
  color: [number, number, number, number];
  extentsMin: ArrayLike<number>;
  extentsMax: ArrayLike<number>;
  mz3: { positions: Float32Array; indices: Uint32Array };
  layers: unknown[];
  perVertexColors: Uint32Array | null;
}

/** WebGL buffers of a mesh in the view of NiiVue 1.0. */
interface Buffers10 {
  vao: WebGLVertexArrayObject | null;
  vertexBuffer: WebGLBuffer | null;
  indexBuffer: WebGLBuffer | null;
  indexCount: number;
}

/** The view of NiiVue 1.0 with its private properties; some are missing with WebGPU. */
interface View10 {
  gl?: WebGL2RenderingContext | null;
  meshResources?: Map<object, Buffers10>;
  _rebuildMeshResources?: () => void;
}

class Niivue10 implements MeshAdapter {
  mesh: Mesh10 | undefined;
  readonly #nv: Niivue;
  readonly #view: View10;
  readonly #appearance: Appearance;
  #known: Buffers10 | undefined;

  constructor(nv: Niivue, view: View10, appearance: Appearance) {
    [this.#nv, this.#view, this.#appearance] = [nv, view, appearance];
  }

  show(frame: OwnArrays): unknown {
    const geometry = this.#geometry(frame);
    if (!this.mesh) {
      this.mesh = { ...this.#plain(), ...geometry, layers: [] };
      return this.#nv.addMesh(this.mesh);
    }
    const buffers = this.#buffers(this.mesh);
    Object.assign(this.mesh, geometry, frame.topology && { layers: [] });
    return buffers ? this.#upload(buffers, frame, geometry) : this.#rebuild();
  }

  // NiiVue's public method uploads its volumes again, too.
  #rebuild(): unknown {
    const { _rebuildMeshResources } = this.#view;
    if (_rebuildMeshResources) return _rebuildMeshResources.call(this.#view);
    return (this.#nv as { updateGLVolume?: () => unknown }).updateGLVolume?.();
  }

  /**
   * Returns NiiVue's own WebGL buffers of `mesh`, which still has its previous arrays, for direct uploads, if the size
   * of the vertex buffer matches the record format of `vertexRecords10`; else undefined.
   */
  #buffers(mesh: Mesh10): Buffers10 | undefined {
    const { gl, meshResources } = this.#view;
    const buffers = meshResources?.get(mesh);
    if (!gl || !buffers?.vertexBuffer) return undefined;
    if (buffers === this.#known) return buffers;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers.vertexBuffer);
    const size: unknown = gl.getBufferParameter(gl.ARRAY_BUFFER, gl.BUFFER_SIZE);
    if (size !== (28 * mesh.positions.length) / 3) return undefined;
    this.#known = buffers;
    return buffers;
  }

  #upload(
    buffers: Buffers10,
    frame: SurfaceArrays,
    { indices, colors }: { indices: Uint32Array; colors: Uint32Array },
  ): void {
    const gl = this.#view.gl as WebGL2RenderingContext;
    gl.bindVertexArray(buffers.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers.vertexBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertexRecords10(frame, colors), gl.DYNAMIC_DRAW);
    if (frame.topology) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.indexBuffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.DYNAMIC_DRAW);
    }
    gl.bindVertexArray(null);
    buffers.indexCount = indices.length;
  }

  #geometry(frame: OwnArrays) {
    const { positions, indices } = frame;
    const colors = new Uint32Array(paint(frame, this.mesh?.color ?? this.#appearance.color).buffer);
    const { min, max } = bounds(positions);
    const own = frame.colors ? colors : null;
    return {
      ...{ positions, indices, colors, mz3: { positions, indices }, perVertexColors: own },
      ...{ extentsMin: Float32Array.from(min), extentsMax: Float32Array.from(max) },
    };
  }

  /** Returns the properties of a new NiiVue 1.0 mesh that are not geometry: name, colour, shader and unused ones. */
  #plain() {
    const { name, color } = this.#appearance;
    const [r, g, b, a] = color;
    return {
      ...{ kind: 'mesh', name, color: [r, g, b, a] as [number, number, number, number], opacity: 1 },
      ...{ shaderType: 'phong', clipPlane: new Float32Array(4), isColorbarVisible: false },
      ...{ trx: null, jcon: null, tractOptions: null, connectomeOptions: null },
    };
  }

  remove(): unknown {
    const place = this.mesh ? this.#nv.meshes.indexOf(this.mesh) : -1;
    this.mesh = undefined;
    return place < 0 ? undefined : this.#nv.removeMesh(place);
  }
}

/** Packs the vertex records of NiiVue 1.0's vertex buffer, 28 bytes each: position, normal, colour. */
function vertexRecords10({ positions, normals }: SurfaceArrays, colors: Uint32Array): ArrayBuffer {
  const buffer = new ArrayBuffer(28 * colors.length);
  const [floats, words] = [new Float32Array(buffer), new Uint32Array(buffer)];
  for (let v = 0; v < colors.length; v++) {
    for (let k = 0; k < 3; k++) {
      floats[7 * v + k] = positions[3 * v + k] as number;
      floats[7 * v + 3 + k] = normals[3 * v + k] as number;
    }
    words[7 * v + 6] = colors[v] as number;
  }
  return buffer;
}
