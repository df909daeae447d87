import {
  BufferAttribute,
  BufferGeometry,
  type ColorRepresentation,
  Group,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Sphere,
  type Texture,
  Vector3,
} from 'three';
import type { Surface } from '../protocol';
import type { ColorMode } from '../ui/view-options';
import { componentColors } from './components';
import { isShade, linearColors, robustRange, SHADES, shadeColors, type ValueShade } from './shading';

/** Room beyond what is needed now, so that a growing surface gets new GPU buffers only now and then. */
const SPARE = 1.5;
const BONE: ColorRepresentation = '#e9dcc3';
/** Colours from photographs hold their light already: lit once more as they are, white comes out grey. */
const OWN_GAIN = 1.6;

/** What the colour of a surface tells; 'own' are the colours that its vertices came with, 'texture' a picture on it. */
export type SurfaceColor = ColorMode | ValueShade | 'own' | 'texture';

/** A surface whose vertices and triangles change every frame: over-allocated GPU buffers, drawn as far as they are filled. */
export class SurfaceObject {
  readonly object = new Group();
  readonly #material = new MeshStandardMaterial({
    color: BONE,
    roughness: 0.62,
    metalness: 0,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
  /** Colours as they are, whatever the light. */
  readonly #plainMaterial = new MeshBasicMaterial({ vertexColors: true });
  #lit = true;
  readonly #edgeMaterial = new LineBasicMaterial({ transparent: true, opacity: 0.4 });
  /** With normals from the start: a shader that is made for a surface without them draws flat triangles for ever. */
  readonly #mesh: Mesh<BufferGeometry, Material> = new Mesh(allocate(1, 1), this.#material);
  readonly #edges = new LineSegments(new BufferGeometry(), this.#edgeMaterial);
  /** How much of the buffers is in use: vertices, and corners of triangles. */
  #vertices = 0;
  #corners = 0;
  #color: SurfaceColor = 'plain';
  #texture: Texture | null = null;
  /** The surface shown has places in the picture. */
  #hasUvs = false;
  /** The numbers at the vertices, where the surface came with some. */
  #values: Float32Array = new Float32Array(0);
  /** rgb of the vertices, where the surface came with them. */
  #colors: Float32Array = new Float32Array(0);
  /** The number at the ends of the colours; 0 where no numbers are shown. */
  #range = 0;

  constructor() {
    // The bounding sphere is kept by hand; the surface nearly always fills the view.
    this.#mesh.frustumCulled = false;
    this.#edges.frustumCulled = false;
    this.#edges.visible = false;
    this.object.add(this.#mesh, this.#edges);
  }

  /** Copies the surface; its arrays may be given away as soon as this returns. */
  show(surface: Surface): void {
    this.#vertices = surface.vertices;
    this.#corners = 3 * surface.triangles;
    this.#reserve();
    const { geometry } = this.#mesh;
    fill(geometry, 'position', surface.positions, 3 * this.#vertices);
    fill(geometry, 'normal', surface.normals, 3 * this.#vertices);
    fillIndex(geometry, surface.indices, this.#corners);
    if (this.#edges.visible) this.#fillEdges();
    this.#hasUvs = surface.uvs !== undefined;
    if (surface.uvs) fill(geometry, 'uv', surface.uvs, 2 * this.#vertices);
    this.#values = surface.values ?? new Float32Array(0);
    this.#colors = surface.colors ?? new Float32Array(0);
    this.#fillColors();
  }

  /** Other places for the vertices that are shown. What light they had they keep: it is for a moment. */
  move(positions: Float32Array): void {
    fill(this.#mesh.geometry, 'position', positions, 3 * this.#vertices);
  }

  /** The number that the strongest colours stand for; 0 where colours stand for no number. */
  get range(): number {
    return this.#range;
  }

  /** What a ray can hit. */
  get target(): Mesh {
    return this.#mesh;
  }

  set edges(visible: boolean) {
    this.#edges.visible = visible;
    if (visible) this.#fillEdges();
  }

  set edgeColor(color: ColorRepresentation) {
    this.#edgeMaterial.color.set(color);
  }

  /** The picture on the surface; it belongs to whoever gives it. */
  set texture(texture: Texture | null) {
    this.#texture = texture;
    this.#fillColors();
  }

  /** Whether colours of the surface's own are lit. */
  set lit(lit: boolean) {
    this.#lit = lit;
    this.#fillColors();
  }

  set solid(visible: boolean) {
    this.#mesh.visible = visible;
  }

  set color(mode: SurfaceColor) {
    if (mode === this.#color) return;
    this.#color = mode;
    this.#values = new Float32Array(0);
    this.#fillColors();
  }

  dispose(): void {
    this.#mesh.geometry.dispose();
    this.#edges.geometry.dispose();
    this.#material.dispose();
    this.#plainMaterial.dispose();
    this.#edgeMaterial.dispose();
  }

  #reserve(): void {
    const { geometry } = this.#mesh;
    const hasVertices = (geometry.getAttribute('position')?.count ?? 0) >= this.#vertices;
    const hasTriangles = (geometry.index?.count ?? 0) >= this.#corners;
    if (hasVertices && hasTriangles && geometry.index) return;
    // GPU buffers cannot grow: a new geometry replaces the old one.
    geometry.dispose();
    this.#edges.geometry.dispose();
    const grown = allocate(Math.ceil(SPARE * this.#vertices), Math.ceil((SPARE * this.#corners) / 3));
    this.#mesh.geometry = grown;
    this.#edges.geometry = edgeGeometry(grown);
  }

  #fillEdges(): void {
    const corners = this.#mesh.geometry.index;
    const { geometry } = this.#edges;
    if (!corners || !geometry.index) return;
    const count = listEdges(corners.array as Uint32Array, this.#corners, geometry.index.array as Uint32Array);
    upload(geometry.index, count);
    geometry.setDrawRange(0, count);
  }

  /** A shade whose numbers have not come yet is plain. */
  #fillColors(): void {
    const mode = this.#color;
    const shaded = isShade(mode) && this.#values.length === this.#vertices;
    const own = mode === 'own' && this.#colors.length === 3 * this.#vertices;
    const on = shaded || own || mode === 'component';
    const map = mode === 'texture' && this.#hasUvs ? this.#texture : null;
    this.#mesh.material = own && !this.#lit ? this.#plainMaterial : this.#material;
    if (this.#material.vertexColors !== on || this.#material.map !== map) {
      this.#material.vertexColors = on;
      this.#material.map = map;
      this.#material.needsUpdate = true;
    }
    this.#material.color.set(on || map ? '#ffffff' : BONE).multiplyScalar(own ? OWN_GAIN : 1);
    this.#range = shaded ? robustRange(this.#values, SHADES[mode].least) : 0;
    const { geometry } = this.#mesh;
    if (!on || !geometry.index) return;
    const colors = geometry.getAttribute('color') as BufferAttribute;
    const out = colors.array as Float32Array;
    if (shaded) shadeColors(this.#values, this.#range, out);
    else if (own) linearColors(this.#colors, out);
    else componentColors(geometry.index.array as Uint32Array, this.#corners, this.#vertices, out);
    upload(colors, 3 * this.#vertices);
  }
}

function allocate(vertices: number, triangles: number): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const name of ['position', 'normal', 'color']) {
    geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * vertices), 3));
  }
  geometry.setAttribute('uv', new BufferAttribute(new Float32Array(2 * vertices), 2));
  geometry.setIndex(new BufferAttribute(new Uint32Array(3 * triangles), 1));
  geometry.boundingSphere = new Sphere(new Vector3(), Number.POSITIVE_INFINITY);
  geometry.setDrawRange(0, 0);
  return geometry;
}

/** The same vertices, drawn as lines. A closed surface has as many edges as half its triangles' corners. */
function edgeGeometry(surface: BufferGeometry): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', surface.getAttribute('position'));
  geometry.setIndex(new BufferAttribute(new Uint32Array(surface.index?.count ?? 0), 1));
  geometry.boundingSphere = surface.boundingSphere;
  return geometry;
}

/** Each edge of a closed surface once: of the two triangles on it, the one that runs along it upwards lists it. */
function listEdges(indices: Uint32Array, length: number, out: Uint32Array): number {
  let count = 0;
  for (let i = 0; i < length; i += 3) {
    for (let side = 0; side < 3; side++) {
      const from = indices[i + side] ?? 0;
      const to = indices[i + ((side + 1) % 3)] ?? 0;
      if (from > to) continue;
      out[count++] = from;
      out[count++] = to;
    }
  }
  return count;
}

function fill(geometry: BufferGeometry, name: string, values: Float32Array, length: number): void {
  const attribute = geometry.getAttribute(name) as BufferAttribute;
  (attribute.array as Float32Array).set(values.subarray(0, length));
  upload(attribute, length);
}

function fillIndex(geometry: BufferGeometry, indices: Uint32Array, length: number): void {
  const { index } = geometry;
  if (!index) return;
  (index.array as Uint32Array).set(indices.subarray(0, length));
  upload(index, length);
  geometry.setDrawRange(0, length);
}

/** Only the part in use goes up. */
function upload(attribute: BufferAttribute, length: number): void {
  attribute.clearUpdateRanges();
  attribute.addUpdateRange(0, length);
  attribute.needsUpdate = true;
}
