import {
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  WireframeGeometry,
} from 'three';
import type { Attractor } from '../protocol';

/** Of the point itself, as a part of the reach. */
const POINT = 0.12;

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
