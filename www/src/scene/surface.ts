import {
  BackSide,
  Box3,
  BufferAttribute,
  BufferGeometry,
  type ColorRepresentation,
  Group,
  type Intersection,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  type Plane,
  type Raycaster,
  Sphere,
  type Texture,
  Vector3,
} from 'three';
import { ThreeSurface } from 'vesicle/three';
import type { Surface } from '../engine/protocol';
import type { ColorMode } from '../kit/view';
import { componentColors } from './components';
import { isQuantity, linearColors, QUANTITIES, robustRange, type ShownQuantity, shadeColors } from './shading';
import { simplifiedIndices } from './simplify';

const BONE: ColorRepresentation = '#e9dcc3';
/** Layer of the cut faces of surfaces, drawn by cameras that show a cut. */
export const CUT_LAYER = 1;
/** Brightness of a cut face, compared with the surface. */
const CUT_SHADE = 0.3;
/**
 * Factor by which a surface's own colours are brightened under lighting. Colours from photographs already contain
 * shading; lit again, white would appear grey.
 */
const OWN_GAIN = 1.6;

/**
 * Largest number of triangles that a software renderer still rotates smoothly; larger surfaces are simplified to about
 * this number during the rotation.
 */
const SMOOTH = 10_000;

/** Colouring of a surface: 'own' are the vertex colours it came with, 'texture' an image. */
export type SurfaceColor = ColorMode | ShownQuantity | 'own' | 'texture';

/** The classes of three.js that a surface is made of. */
const CLASSES = { BufferGeometry, BufferAttribute, Sphere, Box3 };

/**
 * A surface in the 3D view whose vertices and triangles change every frame. Its arrays are uploaded to the GPU without
 * a copy in between.
 */
export class SurfaceObject {
  /** In the coordinates of the world. */
  readonly object = new Group();
  /** The parts of the object, at the origin of the surface. */
  readonly #placed = new Group();
  readonly #material = new MeshStandardMaterial({
    color: BONE,
    roughness: 0.62,
    metalness: 0,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
  /** Material that shows vertex colours unlit. */
  readonly #plainMaterial = new MeshBasicMaterial({ vertexColors: true });
  #lit = true;
  readonly #edgeMaterial = new LineBasicMaterial({ transparent: true, opacity: 0.4 });
  /** Geometry of the surface in full. */
  #fine = new BufferGeometry();
  /** Simplified geometry, drawn in place of the full one while it exists. */
  #coarse: BufferGeometry | undefined;
  readonly #mesh: Mesh<BufferGeometry, Material> = new Mesh(this.#fine, this.#material);
  /**
   * Back faces, in a plain colour: where a closed surface is cut open they are seen through the cut, so that it looks
   * filled.
   */
  readonly #inside = new Mesh(this.#fine, new MeshBasicMaterial({ side: BackSide }));
  readonly #drawn: ThreeSurface;
  /** Planes that cut the surface; the array is shared, and changes. */
  readonly #clipping: Plane[];
  readonly #edges = new LineSegments(new BufferGeometry(), this.#edgeMaterial);
  /** Number of vertices in use in the buffers, which may be longer. */
  #vertices = 0;
  /** Number of triangle corners in use in the buffers: three times the triangles. */
  #corners = 0;
  #color: SurfaceColor = 'plain';
  #plain: ColorRepresentation = BONE;
  #texture: Texture | null = null;
  /** Whether the current surface has texture coordinates. */
  #hasUvs = false;
  /** Values at the vertices that are shown as colours; empty if there are none. */
  #values: Float32Array = new Float32Array(0);
  /** The surface's own colours, sRGB of each vertex, 0..1; empty if it has none. */
  #colors: Float32Array = new Float32Array(0);
  /** Magnitude of the values at the ends of the colour scale; 0 if no values are shown. */
  #range = 0;
  /** The surface shown last, and an edited one that is shown in its place, if there is one. */
  #own: Surface | undefined;
  #edited: Surface | undefined;

  /** `clipping` are the planes that cut the surface, as in `Viewport.clipping`. */
  constructor(clipping: Plane[] = []) {
    this.#clipping = clipping;
    this.#drawn = new ThreeSurface(CLASSES, this.#target());
    // A shader compiled for a surface without normals would always draw flat triangles.
    this.#drawn.update(noSurface());
    this.#inside.layers.set(CUT_LAYER);
    this.#edges.visible = false;
    for (const part of [this.#mesh, this.#inside, this.#edges]) {
      // No culling: the surface nearly always fills the view, and bounding spheres are infinite.
      part.frustumCulled = false;
      this.#placed.add(part);
    }
    this.object.add(this.#placed);
    for (const material of [this.#material, this.#plainMaterial, this.#inside.material, this.#edgeMaterial])
      material.clippingPlanes = clipping;
  }

  /** Shows another surface; its arrays are used without a copy until the next one is shown. */
  show(surface: Surface): void {
    this.#own = surface;
    if (!this.#edited) this.#display(surface);
  }

  /** An edited surface, shown in place of the other until it is undefined again. Its values are distances. */
  set edited(surface: Surface | undefined) {
    this.#edited = surface;
    const shown = surface ?? this.#own;
    if (shown) this.#display(shown);
  }

  /** The surface shown last, without edits. */
  get own(): Surface | undefined {
    return this.#own;
  }

  get edited(): Surface | undefined {
    return this.#edited;
  }

  #display({ values, colors, ...surface }: Surface): void {
    this.#dropCoarse();
    this.#vertices = surface.vertices;
    this.#corners = 3 * surface.triangles;
    this.#drawn.update(surface);
    if (this.#edges.visible) this.#fillEdges();
    this.#hasUvs = surface.uvs !== undefined;
    this.#values = values ?? new Float32Array(0);
    this.#colors = colors?.subarray(0, 3 * this.#vertices) ?? new Float32Array(0);
    this.#fillColors();
  }

  /** Returns what receives the geometry and the origin of the surface. */
  #target(): ConstructorParameters<typeof ThreeSurface>[1] {
    const [fine, replace] = [() => this.#fine, (geometry: BufferGeometry) => this.#replaceBy(geometry)];
    return {
      position: this.#placed.position,
      get geometry() {
        return fine();
      },
      set geometry(geometry) {
        replace(geometry as BufferGeometry);
      },
    };
  }

  /**
   * Moves the vertices to other positions relative to the surface's origin, packed xyz, in an array of the same length. Normals stay unchanged, since
   * this is only a preview until the next surface is shown.
   */
  move(positions: Float32Array): void {
    if (this.#edited) return;
    // Its bounds are not those of the surface any more.
    this.#fine.boundingSphere?.set(new Vector3(), Number.POSITIVE_INFINITY);
    this.#fine.boundingBox = null;
    refill(this.#fine.getAttribute('position') as BufferAttribute, positions, 3 * this.#vertices);
  }

  /**
   * Whether a surface with more than {@link SMOOTH} triangles is drawn simplified, for rotating it in a software
   * renderer.
   */
  set coarse(on: boolean) {
    if (!on) this.#dropCoarse();
    else if (this.#corners > 3 * SMOOTH && !this.#coarse) this.#makeCoarse();
  }

  /**
   * Magnitude of the values at the ends of the colour scale, for the legend; 0 if the colours represent no values, or
   * those of an edited surface.
   */
  get range(): number {
    return this.#edited ? 0 : this.#range;
  }

  /** The same as `range` for the distances of an edited surface from its reference. */
  get editedRange(): number {
    return this.#edited ? this.#range : 0;
  }

  /** The full mesh, to test for intersections with a ray; reading this ends the drawing of a simplified one. */
  get target(): Mesh {
    this.#dropCoarse();
    return this.#mesh;
  }

  /**
   * Returns the point that a ray from the viewer hits first: of the part of the surface that is not cut away, or of the
   * cut.
   */
  hit(ray: Raycaster): Pick<Intersection, 'point' | 'distance' | 'faceIndex'> | undefined {
    const [cut] = this.#clipping;
    const hits: Intersection[] = [];
    for (const part of cut ? [this.target, this.#inside] : [this.target]) part.raycast(ray, hits);
    const [first] = hits
      .filter(({ point }) => !cut || cut.distanceToPoint(point) >= 0)
      .sort((one, other) => one.distance - other.distance);
    if (!cut || first?.object !== this.#inside) return first;
    const point = ray.ray.intersectPlane(cut, new Vector3()) ?? first.point;
    return { point, distance: point.distanceTo(ray.ray.origin) };
  }

  set edges(visible: boolean) {
    this.#edges.visible = visible;
    if (visible) this.#fillEdges();
  }

  set edgeColor(color: ColorRepresentation) {
    this.#edgeMaterial.color.set(color);
  }

  /** Image that the colouring 'texture' shows on the surface; null for none. Owned and disposed of by the caller. */
  set texture(texture: Texture | null) {
    this.#texture = texture;
    this.#fillColors();
  }

  /** Whether the surface's own colours are drawn with lighting; colours from photographs already contain shading. */
  set lit(lit: boolean) {
    this.#lit = lit;
    this.#fillColors();
  }

  set solid(visible: boolean) {
    this.#mesh.visible = visible;
    this.#inside.visible = visible;
  }

  /** Colour of the surface where the colouring is 'plain'. */
  set plainColor(color: ColorRepresentation) {
    this.#plain = color;
    this.#fillColors();
  }

  set color(mode: SurfaceColor) {
    if (mode === this.#color) return;
    this.#color = mode;
    if (!this.#edited) this.#values = new Float32Array(0);
    this.#fillColors();
  }

  dispose(): void {
    this.#dropCoarse();
    this.#drawn.dispose();
    this.#edges.geometry.dispose();
    this.#material.dispose();
    this.#plainMaterial.dispose();
    this.#inside.material.dispose();
    this.#edgeMaterial.dispose();
  }

  #makeCoarse(): void {
    const { attributes, index } = this.#fine;
    const [positions, normals] = [attributes.position?.array, attributes.normal?.array] as Float32Array[];
    if (!positions || !normals || !index) return;
    const indices = index.array as Uint32Array;
    const [vertices, corners] = [this.#vertices, this.#corners];
    const list = simplifiedIndices({ positions, normals, indices, vertices, corners }, SMOOTH);
    this.#coarse = new BufferGeometry();
    for (const [name, attribute] of Object.entries(attributes)) this.#coarse.setAttribute(name, attribute);
    this.#coarse.setIndex(new BufferAttribute(list, 1));
    this.#coarse.boundingSphere = this.#fine.boundingSphere;
    this.#mesh.geometry = this.#coarse;
    this.#inside.geometry = this.#coarse;
  }

  #dropCoarse(): void {
    const coarse = this.#coarse;
    if (!coarse) return;
    this.#coarse = undefined;
    this.#mesh.geometry = this.#fine;
    this.#inside.geometry = this.#fine;
    // The shared attributes stay on the GPU.
    for (const name of Object.keys(coarse.attributes)) coarse.deleteAttribute(name);
    coarse.dispose();
  }

  #replaceBy(geometry: BufferGeometry): void {
    this.#edges.geometry.dispose();
    this.#fine = geometry;
    this.#mesh.geometry = geometry;
    this.#inside.geometry = geometry;
    this.#edges.geometry = new BufferGeometry();
  }

  #fillEdges(): void {
    const corners = this.#fine.index;
    if (!corners) return;
    if (!this.#edges.geometry.index) this.#edges.geometry = edgeGeometry(this.#fine);
    const { geometry } = this.#edges;
    const ends = geometry.index as BufferAttribute;
    const count = listEdges(corners.array as Uint32Array, this.#corners, ends.array as Uint32Array);
    refill(ends, ends.array as Uint32Array, count);
    geometry.setDrawRange(0, count);
  }

  /** Colours the surface as chosen. A quantity whose values have not arrived yet is drawn plain. */
  #fillColors(): void {
    const mode = this.#edited?.values ? 'deviation' : this.#color;
    const shaded = isQuantity(mode) && this.#values.length === this.#vertices;
    const own = mode === 'own' && this.#colors.length === 3 * this.#vertices;
    const on = shaded || own || mode === 'component';
    const map = mode === 'texture' && this.#hasUvs ? this.#texture : null;
    this.#mesh.material = own && !this.#lit ? this.#plainMaterial : this.#material;
    if (this.#material.vertexColors !== on || this.#material.map !== map) {
      this.#material.vertexColors = on;
      this.#material.map = map;
      this.#material.needsUpdate = true;
    }
    this.#material.color.set(on || map ? '#ffffff' : this.#plain).multiplyScalar(own ? OWN_GAIN : 1);
    this.#inside.material.color.set(this.#plain).multiplyScalar(CUT_SHADE);
    this.#range = shaded ? robustRange(this.#values, QUANTITIES[mode].least) : 0;
    const geometry = this.#fine;
    if (!on || !geometry.index) return;
    const colors = colorsOf(geometry);
    const out = colors.array as Float32Array;
    if (shaded) shadeColors(this.#values, this.#range, out);
    else if (own) linearColors(this.#colors, out);
    else componentColors(geometry.index.array as Uint32Array, this.#corners, this.#vertices, out);
    refill(colors, out, 3 * this.#vertices);
  }
}

const noSurface = (): Surface => ({
  ...{ positions: new Float32Array(3), normals: new Float32Array(3), indices: new Uint32Array(3) },
  ...{ vertices: 0, triangles: 0, origin: [0, 0, 0] },
});

/** Returns the vertex colours of a geometry, created on first use, since most surfaces are plain. */
function colorsOf(geometry: BufferGeometry): BufferAttribute {
  const there = geometry.getAttribute('color') as BufferAttribute | undefined;
  if (there) return there;
  const colors = new BufferAttribute(new Float32Array(geometry.getAttribute('position').array.length), 3);
  geometry.setAttribute('color', colors);
  return colors;
}

/**
 * Creates a geometry of lines for the surface's edges, which uses the same vertices. Its index has room for all edges:
 * a closed surface has half as many as triangle corners.
 */
function edgeGeometry(surface: BufferGeometry): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', surface.getAttribute('position'));
  geometry.setIndex(new BufferAttribute(new Uint32Array(surface.index?.count ?? 0), 1));
  geometry.boundingSphere = surface.boundingSphere;
  return geometry;
}

/**
 * Writes the ends of each edge of a closed surface into `out`, each edge once: from the one of its two triangles that
 * traverses it from the smaller to the larger index. The first `length` of `indices` are used. Returns the number of
 * indices written.
 */
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

/**
 * Replaces the array of a buffer attribute by one of the same length; only its first `length` entries are uploaded to
 * the GPU.
 */
function refill(buffer: BufferAttribute, array: Float32Array | Uint32Array, length: number): void {
  buffer.array = array;
  buffer.clearUpdateRanges();
  buffer.addUpdateRange(0, length);
  buffer.needsUpdate = true;
}
