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
} from 'three';
import type { Vec3 } from '../protocol';
import { type Grid, type SliceFrame, toWorld } from './anatomy';

/** A slice as a textured rectangle where it lies in the world, with a coloured frame. */
export class SlicePlane {
  readonly object = new Group();
  readonly #grid: Grid;
  readonly #frame: SliceFrame;
  readonly #texture: CanvasTexture;
  readonly #geometry = new BufferGeometry();
  readonly #outline = new BufferGeometry();
  readonly #material: MeshBasicMaterial;
  readonly #line: LineBasicMaterial;

  /** `picture` shows the slice in reading order, turned as `frame` says. */
  constructor(grid: Grid, frame: SliceFrame, picture: HTMLCanvasElement, color: ColorRepresentation) {
    this.#grid = grid;
    this.#frame = frame;
    this.#texture = new CanvasTexture(picture);
    this.#texture.colorSpace = SRGBColorSpace;
    this.#texture.minFilter = LinearFilter;
    this.#texture.generateMipmaps = false;
    this.#material = new MeshBasicMaterial({ map: this.#texture, side: DoubleSide });
    this.#line = new LineBasicMaterial({ color });
    this.#geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
    this.#geometry.setAttribute('uv', new BufferAttribute(new Float32Array([0, 1, 1, 1, 1, 0, 0, 0]), 2));
    this.#geometry.setIndex([0, 3, 2, 0, 2, 1]);
    this.#outline.setAttribute('position', this.#geometry.getAttribute('position'));
    this.object.add(new Mesh(this.#geometry, this.#material), new LineLoop(this.#outline, this.#line));
  }

  /** Moves to the slice with the given index; the picture has been repainted. */
  moveTo(index: number): void {
    const position = this.#geometry.getAttribute('position') as BufferAttribute;
    const corners = [
      [0, 0],
      [1, 0],
      [1, 1],
      [0, 1],
    ] as const;
    for (const [i, [u, v]] of corners.entries()) position.setXYZ(i, ...this.#corner(index, u, v));
    position.needsUpdate = true;
    this.#geometry.computeBoundingSphere();
    this.#outline.boundingSphere = this.#geometry.boundingSphere;
    this.#texture.needsUpdate = true;
  }

  dispose(): void {
    this.#texture.dispose();
    this.#geometry.dispose();
    this.#outline.dispose();
    this.#material.dispose();
    this.#line.dispose();
  }

  /** World position of a corner of the picture: u, v = 0 or 1 from its left and top. */
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
