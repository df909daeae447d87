import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  type ColorRepresentation,
  DoubleSide,
  Group,
  LinearFilter,
  LineBasicMaterial,
  LineLoop,
  Mesh,
  MeshBasicMaterial,
  SRGBColorSpace,
  Vector3,
} from 'three';
import { placed } from '../engine/placing';
import type { PointArray, Vec3 } from '../engine/protocol';
import { type Grid, type SliceOrientation, toWorld } from './anatomy';
import { Lines } from './lines';

export interface PlaneColors {
  frame: ColorRepresentation;
  section: ColorRepresentation;
}

/**
 * A slice in the 3D view: a textured rectangle with a coloured frame and the surface's outline, either at its position
 * in the volume or on a side of the volume's box behind it.
 */
export class SlicePlane {
  readonly object = new Group();
  readonly #grid: Grid;
  readonly #frame: SliceOrientation;
  readonly #texture: CanvasTexture;
  readonly #geometry = new BufferGeometry();
  readonly #outline = new BufferGeometry();
  readonly #material: MeshBasicMaterial;
  readonly #line: LineBasicMaterial;
  readonly #section: Lines;
  /** The rectangle and its frame. */
  readonly #slice = new Group();
  #index = 0;

  /** `picture` contains the slice image, oriented as specified by `orientation`; it is the rectangle's texture. */
  constructor(grid: Grid, orientation: SliceOrientation, picture: HTMLCanvasElement, colors: PlaneColors) {
    this.#grid = grid;
    this.#frame = orientation;
    this.#texture = new CanvasTexture(picture);
    this.#texture.colorSpace = SRGBColorSpace;
    this.#texture.minFilter = LinearFilter;
    this.#texture.generateMipmaps = false;
    this.#material = new MeshBasicMaterial({
      map: this.#texture,
      side: DoubleSide,
      // The outline in the same plane has to be drawn over it.
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
    this.#line = new LineBasicMaterial({ color: colors.frame });
    this.#section = new Lines(colors.section);
    this.#geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
    this.#geometry.setAttribute('uv', new BufferAttribute(new Float32Array([0, 1, 1, 1, 1, 0, 0, 0]), 2));
    this.#geometry.setIndex([0, 3, 2, 0, 2, 1]);
    this.#outline.setAttribute('position', this.#geometry.getAttribute('position'));
    const rectangle = new Mesh(this.#geometry, this.#material);
    this.#slice.add(rectangle, new LineLoop(this.#outline, this.#line));
    this.object.add(this.#slice, this.#section.object);
  }

  /** Moves the rectangle to the slice with the given index, and uploads its texture, which the caller has repainted. */
  moveTo(index: number): void {
    this.#index = index;
    const position = this.#geometry.getAttribute('position') as BufferAttribute;
    const corners = [
      [0, 0],
      [1, 0],
      [1, 1],
      [0, 1],
    ] as const;
    const { points, origin } = placed(corners.flatMap(([u, v]) => this.#corner(index, u, v)));
    position.copyArray(points);
    this.#slice.position.set(...origin);
    position.needsUpdate = true;
    this.#geometry.computeBoundingSphere();
    this.#outline.boundingSphere = this.#geometry.boundingSphere;
    this.#texture.needsUpdate = true;
  }

  /** Uploads the texture again, after the caller has repainted it. */
  refresh(): void {
    this.#texture.needsUpdate = true;
  }

  /** Shows the cross-section of the surface with this slice, given as pairs of world points, packed xyz. */
  showSection(segments: PointArray): void {
    this.#section.show(segments);
  }

  /** Places the slice at its position in the volume, or on the wall of the volume's box farther from the viewer. */
  stand(place: 'in place' | 'walls', viewer: Vector3): void {
    this.object.position.set(0, 0, 0);
    if (place === 'in place') return;
    const { axis } = this.#frame;
    const across = new Vector3().fromArray(this.#grid.affine, 4 * axis);
    const middle = new Vector3(...toWorld(this.#grid.affine, this.#grid.dims.map((n) => (n - 1) / 2) as Vec3));
    const viewerIsHigh = viewer.clone().sub(middle).dot(across) > 0;
    const wall = viewerIsHigh ? -0.5 : this.#grid.dims[axis] - 0.5;
    this.object.position.copy(across).multiplyScalar(wall - this.#index);
  }

  dispose(): void {
    this.#section.dispose();
    this.#texture.dispose();
    this.#geometry.dispose();
    this.#outline.dispose();
    this.#material.dispose();
    this.#line.dispose();
  }

  /**
   * Returns the world position of a corner of the slice with the given index: u = 0 at its left, 1 at its right; v = 0
   * at its top, 1 at its bottom.
   */
  #corner(index: number, u: 0 | 1, v: 0 | 1): Vec3 {
    const at: Vec3 = [0, 0, 0];
    at[this.#frame.axis] = index;
    for (const [side, end] of [
      [this.#frame.horizontal, u],
      [this.#frame.vertical, v],
    ] as const) {
      const last = end === 1 ? !side.flip : side.flip;
      at[side.axis] = last ? this.#grid.dims[side.axis] - 0.5 : -0.5;
    }
    return toWorld(this.#grid.affine, at);
  }
}
