import type { Raycaster } from 'three';
import type { Surface, SurfacePoint, Vec3 } from '../engine/protocol';
import { token } from '../kit/dom';
import { Legend } from './legend';
import { Lines } from './lines';
import { diverging, QUANTITIES, quantityTitle } from './shading';
import type { SurfaceObject } from './surface';
import type { Viewport } from './viewport';

/** Shows an edited surface in place of the one in a lab's 3D view, draws lines, and takes clicks on the surface. */
export class EditedView {
  /** Legend of the distances from a reference. */
  readonly legend = new Legend(diverging);
  /** Unit of length, or empty. */
  unit = '';
  readonly #viewport: Viewport;
  readonly #surface: SurfaceObject;
  readonly #onChange: () => void;
  readonly #lines = new Lines(token('--attractor'));
  /** The view's own handler of clicks, while these are taken here. */
  #onClick: ((ray: Raycaster) => void) | undefined;

  /** `onChange` is called when another surface is shown, to update legend and outlines. */
  constructor(viewport: Viewport, surface: SurfaceObject, onChange: () => void) {
    this.#viewport = viewport;
    this.#surface = surface;
    this.#onChange = onChange;
    // In front of the surface, through which a straight line passes.
    this.#lines.object.material.depthTest = false;
    this.#lines.object.renderOrder = 1;
    surface.object.add(this.#lines.object);
  }

  /** Shows an edited surface, with its values as colours if it has some; undefined shows the lab's own again. */
  show(edited: Surface | undefined): void {
    if (!edited && !this.#surface.edited) return;
    this.#surface.edited = edited;
    const range = this.#surface.editedRange;
    if (range > 0) this.legend.show({ ...QUANTITIES.deviation, title: quantityTitle('deviation', this.unit) }, range);
    else this.legend.hide();
    this.#onChange();
    this.#viewport.invalidate();
  }

  /** The origin of the lab's own surface; undefined if there is none. */
  get origin(): Vec3 | undefined {
    return this.#surface.own?.origin;
  }

  /** Draws line segments, pairs of points in world space. */
  showLines(points: ArrayLike<number>): void {
    this.#lines.show(points);
    this.#viewport.invalidate();
  }

  /** Passes clicks on the surface to `take`; undefined ends that. */
  pick(take: ((at: SurfacePoint) => void) | undefined): void {
    this.#onClick ??= this.#viewport.onClick;
    this.#viewport.onClick = take ? (ray) => this.#click(ray, take) : this.#onClick;
  }

  dispose(): void {
    this.#lines.dispose();
  }

  #click(ray: Raycaster, take: (at: SurfacePoint) => void): void {
    const hit = this.#surface.hit(ray);
    const local = hit && this.#surface.object.worldToLocal(hit.point.clone());
    // Not on the cap of a cut, which has no triangles.
    if (local && typeof hit.faceIndex === 'number') take({ triangle: hit.faceIndex, point: local.toArray() });
  }
}
