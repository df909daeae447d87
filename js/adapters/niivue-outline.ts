// Outlines of surfaces in the slices of NiiVue, as lines. NiiVue draws the part of a mesh within some distance of the
// slice: broken where the mesh is steep, wide where it is flat.
import type { Vec3 } from '../data.js';

/** A plane of points x with normal · x = offset. */
interface Plane {
  normal: Vec3;
  offset: number;
}

/** Most planes whose segments are kept; a mosaic has more slices than the usual three. */
const KEPT = 32;

/** A surface that is drawn as its outline in slices. */
export class Outline {
  /** Colour, rgb, 0..1. */
  readonly color: readonly number[];
  /** Width in CSS pixels. */
  readonly width: number;
  #positions = new Float32Array();
  #indices = new Uint32Array();
  readonly #kept = new Map<string, Float32Array>();

  constructor(color: readonly number[], width: number) {
    [this.color, this.width] = [color, width];
  }

  /** Sets the surface: arrays that are not modified afterwards. */
  set(positions: Float32Array<ArrayBuffer>, indices: Uint32Array<ArrayBuffer>): void {
    [this.#positions, this.#indices] = [positions, indices];
    this.#kept.clear();
  }

  /** Returns the intersection with a plane as segments: six numbers each, the two ends. */
  segments(plane: Plane): Float32Array {
    const key = [...plane.normal, plane.offset].join();
    let found = this.#kept.get(key);
    if (!found) {
      if (this.#kept.size === KEPT) this.#kept.clear();
      found = intersect(this.#positions, this.#indices, plane);
      this.#kept.set(key, found);
    }
    return found;
  }
}

/**
 * Vertices on the plane count as above it, so that a closed surface has closed outlines wherever the plane passes.
 */
function intersect(positions: Float32Array, indices: Uint32Array, { normal, offset }: Plane): Float32Array {
  const [nx, ny, nz] = normal;
  const heights = new Float64Array(positions.length / 3);
  for (let v = 0, i = 0; v < heights.length; v++, i += 3) {
    const [x, y, z] = [positions[i] as number, positions[i + 1] as number, positions[i + 2] as number];
    heights[v] = nx * x + ny * y + nz * z - offset;
  }
  const ends: number[] = [];
  // From the lower index to the higher one, so that both triangles at an edge have the same point.
  const cross = (j: number, k: number) => {
    const [a, b] = j < k ? [j, k] : [k, j];
    const [above, below] = [heights[a] as number, heights[b] as number];
    const share = above / (above - below);
    for (let k = 0; k < 3; k++) {
      const [from, to] = [positions[3 * a + k] as number, positions[3 * b + k] as number];
      ends.push(from + share * (to - from));
    }
  };
  for (let i = 0; i < indices.length; i += 3) {
    const corners = [indices[i] as number, indices[i + 1] as number, indices[i + 2] as number] as const;
    const above = corners.map((corner) => (heights[corner] as number) >= 0);
    if (above[0] === above[1] && above[1] === above[2]) continue;
    for (const [j, k] of [
      [0, 1],
      [1, 2],
      [2, 0],
    ] as const) {
      if (above[j] !== above[k]) cross(corners[j], corners[k]);
    }
  }
  return Float32Array.from(ends);
}

/** A slice as NiiVue draws it. */
interface Slice {
  /** Transform from world to clip space, column-major. */
  mvp: ArrayLike<number>;
  plane: Plane;
  /** Size of the viewport in pixels. */
  width: number;
  height: number;
}

const VERTEX = `#version 300 es
in vec3 from;
in vec3 to;
uniform mat4 mvp;
uniform vec2 size; // Of the viewport, half, in pixels.
uniform float reach; // Half the width of the line and of its soft border.
out vec2 at;
flat out float length;
void main() {
  vec2 a = (mvp * vec4(from, 1.0)).xy * size;
  vec2 b = (mvp * vec4(to, 1.0)).xy * size;
  length = distance(a, b);
  vec2 along = length > 0.0 ? (b - a) / length : vec2(1.0, 0.0);
  // The corners of a rectangle around the segment.
  at = vec2(gl_VertexID < 2 ? -reach : length + reach, (gl_VertexID & 1) == 0 ? -reach : reach);
  gl_Position = vec4((a + at.x * along + at.y * vec2(-along.y, along.x)) / size, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 at;
flat in float length;
uniform float reach;
uniform vec3 color;
out vec4 painted;
void main() {
  float away = distance(at, vec2(clamp(at.x, 0.0, length), 0.0));
  painted = vec4(color, clamp(reach - away, 0.0, 1.0));
}`;

interface Program {
  program: WebGLProgram;
  buffer: WebGLBuffer;
  array: WebGLVertexArrayObject;
}

/** Draws outlines into the current viewport of a WebGL context. */
class OutlineRenderer {
  readonly #gl: WebGL2RenderingContext;
  #made: Program | undefined;

  constructor(gl: WebGL2RenderingContext) {
    this.#gl = gl;
  }

  draw(outline: Outline, { mvp, plane, width, height }: Slice): void {
    const segments = outline.segments(plane);
    if (segments.length === 0) return;
    const gl = this.#gl;
    this.#made ??= makeProgram(gl);
    const { program, buffer, array } = this.#made;
    const restore = overlay(gl);
    gl.useProgram(program);
    const uniform = (name: string) => gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(uniform('mvp'), false, Float32Array.from(mvp));
    gl.uniform2f(uniform('size'), width / 2, height / 2);
    gl.uniform1f(uniform('reach'), (outline.width * pixelRatio(gl)) / 2 + 0.5);
    gl.uniform3f(uniform('color'), outline.color[0] ?? 1, outline.color[1] ?? 1, outline.color[2] ?? 1);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, segments, gl.STREAM_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, segments.length / 6);
    gl.bindVertexArray(null);
    restore();
  }

  free(): void {
    if (!this.#made) return;
    this.#gl.deleteProgram(this.#made.program);
    this.#gl.deleteBuffer(this.#made.buffer);
    this.#gl.deleteVertexArray(this.#made.array);
    this.#made = undefined;
  }
}

/** Number of the canvas's pixels in a CSS pixel. */
function pixelRatio({ canvas }: WebGL2RenderingContext): number {
  const { clientWidth = 0 } = canvas as Partial<HTMLCanvasElement>;
  return clientWidth > 0 ? canvas.width / clientWidth : 1;
}

function makeProgram(gl: WebGL2RenderingContext): Program {
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, VERTEX],
    [gl.FRAGMENT_SHADER, FRAGMENT],
  ] as const) {
    const shader = gl.createShader(kind) as WebGLShader;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  const [buffer, array] = [gl.createBuffer(), gl.createVertexArray()];
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  for (const [name, offset] of [
    ['from', 0],
    ['to', 12],
  ] as const) {
    const place = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, offset);
    gl.vertexAttribDivisor(place, 1);
  }
  gl.bindVertexArray(null);
  return { program, buffer, array };
}

/** Lets lines be blended over the picture, whatever the depth; returns what restores NiiVue's settings. */
function overlay(gl: WebGL2RenderingContext): () => void {
  const wanted = [
    [gl.BLEND, true],
    [gl.DEPTH_TEST, false],
    [gl.CULL_FACE, false],
  ] as const;
  const before = wanted.map(([name]) => [name, gl.isEnabled(name)] as const);
  const set = ([name, on]: readonly [number, boolean]) => (on ? gl.enable(name) : gl.disable(name));
  wanted.forEach(set);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  return () => before.forEach(set);
}

/** The meshes of one NiiVue that are drawn as outlines in its slices. */
export class Outlines {
  readonly #all = new Map<object, Outline>();
  readonly #renderer: OutlineRenderer;
  readonly #hook: (outlines: Outlines) => () => void;
  #unhook: (() => void) | undefined;

  constructor(gl: WebGL2RenderingContext, hook: (outlines: Outlines) => () => void) {
    this.#renderer = new OutlineRenderer(gl);
    this.#hook = hook;
  }

  add(mesh: object, outline: Outline): void {
    this.#all.set(mesh, outline);
    this.#unhook ??= this.#hook(this);
  }

  remove(mesh: object): void {
    this.#all.delete(mesh);
    if (this.#all.size > 0) return;
    this.#unhook?.();
    this.#unhook = undefined;
    this.#renderer.free();
  }

  has(mesh: object): boolean {
    return this.#all.has(mesh);
  }

  meshes(): Iterable<object> {
    return this.#all.keys();
  }

  draw(mesh: object, slice: Slice): void {
    const outline = this.#all.get(mesh);
    if (outline) this.#renderer.draw(outline, slice);
  }
}

/** By NiiVue, which several surfaces share. */
const KNOWN = new WeakMap<object, Outlines>();

/** Returns the outlines of a NiiVue; undefined if it does not draw meshes in the way that is known. */
export function outlinesOf(nv: object): Outlines | undefined {
  const { drawMesh3D, gl, view } = nv as Partial<Drawing069> & { view?: View10 };
  let outlines = KNOWN.get(view ?? nv);
  if (outlines) return outlines;
  if (view?.gl && view._getMeshGpu) outlines = new Outlines(view.gl, (all) => hook10(view, all));
  else if (!view && gl && drawMesh3D) outlines = new Outlines(gl, (all) => hook069(nv as Drawing069, all));
  if (outlines) KNOWN.set(view ?? nv, outlines);
  return outlines;
}

const dot = (a: ArrayLike<number>, b: ArrayLike<number>): number =>
  [0, 1, 2].reduce((sum, k) => sum + Number(a[k]) * Number(b[k]), 0);

/** The members of NiiVue 0.69 that draw slices. */
interface Drawing069 {
  gl: WebGL2RenderingContext;
  scene: { crosshairPos: ArrayLike<number> };
  screenSlices: { axCorSag: number; sliceFrac: number; leftTopWidthHeight: number[] }[];
  frac2mm(frac: number[], volume: number, isForceSliceMM: boolean): ArrayLike<number>;
  drawMesh3D(...given: DrawMesh3D): void;
}

type DrawMesh3D = [
  depth?: boolean,
  alpha?: number,
  mvp?: ArrayLike<number>,
  model?: unknown,
  normal?: unknown,
  is2D?: boolean,
];

/** Draws outlines in place of meshes in slices, each time that NiiVue 0.69 draws the meshes of a slice. */
function hook069(nv: Drawing069, outlines: Outlines): () => void {
  const { drawMesh3D } = nv;
  nv.drawMesh3D = (...given) => {
    const [, , mvp, , , is2D] = given;
    const slice = is2D && mvp ? slice069(nv, mvp) : undefined;
    if (!slice) return drawMesh3D.apply(nv, given);
    const visible = [...outlines.meshes()].filter((mesh) => (mesh as { visible: boolean }).visible);
    for (const mesh of visible) Object.assign(mesh, { visible: false });
    drawMesh3D.apply(nv, given);
    for (const mesh of visible) {
      Object.assign(mesh, { visible: true });
      outlines.draw(mesh, slice);
    }
  };
  // Uncovers the method of the class.
  return () => delete (nv as Partial<Drawing069>).drawMesh3D;
}

function slice069(nv: Drawing069, mvp: ArrayLike<number>): Slice | undefined {
  const tile = nv.screenSlices.at(-1);
  if (!tile || tile.axCorSag > 2) return undefined;
  // Axial, coronal and sagittal slices are across the third, second and first axis.
  const place = Array.from(nv.scene.crosshairPos);
  place[2 - tile.axCorSag] = tile.sliceFrac;
  // All points of a slice are at the same depth.
  const normal: Vec3 = [Number(mvp[2]), Number(mvp[6]), Number(mvp[10])];
  const offset = dot(normal, nv.frac2mm(place, 0, true));
  const [, , width = 0, height = 0] = tile.leftTopWidthHeight;
  return width > 0 && height > 0 ? { mvp, plane: { normal, offset }, width, height } : undefined;
}

/** The members of the view of NiiVue 1.0 that draw slices. */
interface View10 {
  gl?: WebGL2RenderingContext | null;
  canvas?: HTMLCanvasElement;
  _boundsOffsetX?: number;
  _boundsOffsetY?: number;
  screenSlices?: {
    leftTopWidthHeight: number[];
    mvpMatrix?: ArrayLike<number>;
    planeNormal?: ArrayLike<number>;
    planePoint?: ArrayLike<number>;
  }[];
  _getMeshGpu?: (mesh: object) => unknown;
}

/** Draws outlines in place of meshes in slices, each time that NiiVue 1.0 looks up the buffers of a mesh to draw it. */
function hook10(view: View10, outlines: Outlines): () => void {
  const { _getMeshGpu } = view;
  view._getMeshGpu = (mesh) => {
    const slice = outlines.has(mesh) ? slice10(view) : undefined;
    if (!slice) return _getMeshGpu?.call(view, mesh);
    outlines.draw(mesh, slice);
    return null;
  };
  return () => delete view._getMeshGpu;
}

/** Returns the slice that the viewport shows; undefined if that is the 3D view. */
function slice10(view: View10): Slice | undefined {
  const { gl, canvas, screenSlices = [], _boundsOffsetX: x = 0, _boundsOffsetY: y = 0 } = view;
  if (!gl || !canvas) return undefined;
  const viewport: ArrayLike<number> = gl.getParameter(gl.VIEWPORT);
  for (const { leftTopWidthHeight, mvpMatrix, planeNormal, planePoint } of screenSlices) {
    const [left = 0, top = 0, width = 0, height = 0] = leftTopWidthHeight;
    const wanted = [x + left, canvas.height - y - top - height, width, height];
    // WebGL rounds.
    if (!mvpMatrix || !planeNormal || !planePoint || wanted.some((one, k) => Math.abs(one - Number(viewport[k])) > 1))
      continue;
    const normal: Vec3 = [Number(planeNormal[0]), Number(planeNormal[1]), Number(planeNormal[2])];
    return { mvp: mvpMatrix, plane: { normal, offset: dot(normal, planePoint) }, width, height };
  }
  return undefined;
}
