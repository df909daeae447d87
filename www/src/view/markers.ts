import {
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  WireframeGeometry,
} from 'three';
import type { Attractor, UncoveredPart } from '../protocol';

/** Of the point itself, as a part of the reach. */
const POINT = 0.12;

/** Least and largest radius of the mark of an uncovered part, as a share of the volume's smallest side. */
const MARK_RADII = [0.008, 0.04] as const;

/** Uncovered parts in the 3D view, seen through everything: a ball where matter is missing, a net where a hollow is. */
export class UncoveredMarks {
  readonly object = new Group();
  readonly #ball = new SphereGeometry(1, 16, 10);
  readonly #net = new WireframeGeometry(new SphereGeometry(1, 8, 6));
  readonly #matter = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.8 });
  readonly #hollow = new LineBasicMaterial({ depthTest: false, transparent: true });

  set colors({ matter, hollow }: Record<UncoveredPart['kind'], string>) {
    this.#matter.color.set(matter);
    this.#hollow.color.set(hollow);
  }

  /** Sizes go by the area of each part, within bounds that `side`, the volume's smallest, gives. */
  show(parts: readonly UncoveredPart[], side: number): void {
    this.object.clear();
    const [least, most] = MARK_RADII;
    for (const { position, area, kind } of parts) {
      const mark = kind === 'matter' ? new Mesh(this.#ball, this.#matter) : new LineSegments(this.#net, this.#hollow);
      mark.scale.setScalar(Math.min(most * side, Math.max(least * side, Math.sqrt(area / Math.PI) / 2)));
      mark.position.set(...position);
      mark.renderOrder = 1;
      this.object.add(mark);
    }
  }
}

/** Attractors in the 3D view: a ball at the point, seen through everything, and a net at its reach. */
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
      // After everything else, as it is not hidden by it.
      ball.renderOrder = 1;
      const net = new LineSegments(this.#net, this.#lines);
      net.scale.setScalar(radius);
      for (const part of [ball, net]) part.position.set(...point);
      this.object.add(ball, net);
    }
  }
}
