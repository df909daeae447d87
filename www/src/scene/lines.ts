import { BufferAttribute, BufferGeometry, type ColorRepresentation, LineBasicMaterial, LineSegments } from 'three';
import { placed } from '../engine/placing';

/** Line segments in the 3D view that change every frame, in a GPU buffer with spare capacity. */
export class Lines {
  readonly object: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor(color: ColorRepresentation) {
    this.object = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color }));
    this.object.frustumCulled = false;
    this.object.visible = false;
  }

  /** Shows segments given as pairs of points in world space, packed xyz; they are copied. */
  show(points: ArrayLike<number>): void {
    const count = points.length / 3;
    this.object.visible = count > 0;
    if (count === 0) return;
    const position = this.#reserve(count);
    const drawn = placed(points);
    this.object.position.set(...drawn.origin);
    (position.array as Float32Array).set(drawn.points);
    position.clearUpdateRanges();
    position.addUpdateRange(0, points.length);
    position.needsUpdate = true;
    this.object.geometry.setDrawRange(0, count);
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }

  #reserve(count: number): BufferAttribute {
    const present = this.object.geometry.getAttribute('position') as BufferAttribute | undefined;
    if (present && present.count >= count) return present;
    this.object.geometry.dispose();
    this.object.geometry = new BufferGeometry();
    const grown = new BufferAttribute(new Float32Array(3 * Math.ceil(1.5 * count)), 3);
    this.object.geometry.setAttribute('position', grown);
    return grown;
  }
}
