import {
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  WireframeGeometry,
} from 'three';
import type { Attractor, UncoveredRegion } from '../engine/protocol';

/** Radius of the ball drawn at an attractor's point, as a fraction of its radius of influence. */
const POINT = 0.12;

/** Smallest and largest radius of the mark of an uncovered region, as a fraction of the volume's smallest side. */
const MARK_RADII = [0.008, 0.04] as const;

/**
 * Marks of uncovered regions in the 3D view, drawn over everything: a ball where a part of the object lies outside the
 * surface, a wireframe where background lies inside it.
 */
export class UncoveredMarks {
  readonly object = new Group();
  readonly #ball = new SphereGeometry(1, 16, 10);
  readonly #net = new WireframeGeometry(new SphereGeometry(1, 8, 6));
  readonly #matter = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.8 });
  readonly #cavity = new LineBasicMaterial({ depthTest: false, transparent: true });

  set colors({ matter, cavity }: Record<UncoveredRegion['kind'], string>) {
    this.#matter.color.set(matter);
    this.#cavity.color.set(cavity);
  }

  /**
   * Shows a mark for each uncovered region: half as large as a disc of the region's area, within {@link MARK_RADII}
   * times `side`, the volume's smallest side.
   */
  show(parts: readonly UncoveredRegion[], side: number): void {
    this.object.clear();
    const [least, most] = MARK_RADII;
    for (const { position, area, kind } of parts) {
      const mark = kind === 'matter' ? new Mesh(this.#ball, this.#matter) : new LineSegments(this.#net, this.#cavity);
      mark.scale.setScalar(Math.min(most * side, Math.max(least * side, Math.sqrt(area / Math.PI) / 2)));
      mark.position.set(...position);
      mark.renderOrder = 1;
      this.object.add(mark);
    }
  }
}

/**
 * Attractors in the 3D view: a ball at the point, drawn over everything, and a wireframe sphere of its radius of
 * influence.
 */
export class AttractorMarks {
  readonly object = new Group();
  readonly #ball = new SphereGeometry(1, 16, 10);
  readonly #net = new WireframeGeometry(new SphereGeometry(1, 16, 8));
  readonly #points = new MeshBasicMaterial({ depthTest: false, transparent: true });
  readonly #lines = new LineBasicMaterial({ transparent: true, opacity: 0.35 });

  set color(color: string) {
    this.#points.color.set(color);
    this.#lines.color.set(color);
  }

  show(attractors: Attractor[]): void {
    this.object.clear();
    for (const { point, radius } of attractors) {
      const ball = new Mesh(this.#ball, this.#points);
      ball.scale.setScalar(POINT * radius);
      // Rendered last, because nothing hides it.
      ball.renderOrder = 1;
      const net = new LineSegments(this.#net, this.#lines);
      net.scale.setScalar(radius);
      for (const part of [ball, net]) part.position.set(...point);
      this.object.add(ball, net);
    }
  }
}
