/** Pinhole cameras of photogrammetry, and conversion to an equivalent camera of three.js. */
import { Matrix4, type PerspectiveCamera, Vector3 } from 'three';
import type { Vec3 } from '../engine/protocol';

/** A pinhole camera: a 3 × 4 projection matrix, and width and height of its image in pixels. */
export interface PinholeCamera {
  /**
   * 3 × 4 matrix from world to pixel coordinates, row-major; x to the right, y down, the centre of the first pixel at
   * (0, 0).
   */
  projection: ArrayLike<number>;
  width: number;
  height: number;
}

/** Decomposition of a projection matrix: camera centre, orientation and intrinsic parameters. */
export interface Pose {
  centre: Vector3;
  right: Vector3;
  down: Vector3;
  forward: Vector3;
  /** Focal lengths along x and y, in pixels like the principal point. */
  focal: [number, number];
  principalPoint: [number, number];
}

/** Decomposes a projection matrix: its left 3 × 3 part is an upper triangular matrix times a rotation. */
export function poseOf({ projection }: PinholeCamera): Pose {
  const row = (i: number) => new Vector3(...([0, 1, 2].map((j) => projection[4 * i + j] ?? 0) as Vec3));
  const [m1, m2, m3] = [row(0), row(1), row(2)];
  const scale = m3.length();
  const forward = m3.clone().divideScalar(scale);
  const middleY = m2.dot(forward) / scale;
  const down = m2.clone().addScaledVector(forward, -m2.dot(forward));
  const focalY = down.length() / scale;
  down.normalize();
  const middleX = m1.dot(forward) / scale;
  const across = m1.clone().addScaledVector(forward, -m1.dot(forward));
  const right = across.addScaledVector(down, -across.dot(down));
  const focalX = right.length() / scale;
  right.normalize();
  return {
    centre: centreOf(projection),
    right,
    down,
    forward,
    focal: [focalX, focalY],
    principalPoint: [middleX, middleY],
  };
}

/** Returns the camera centre: the point that the projection matrix maps to the zero vector. */
function centreOf(p: ArrayLike<number>): Vector3 {
  const at = (i: number) => p[i] ?? 0;
  const left = new Matrix4();
  left.set(at(0), at(1), at(2), 0, at(4), at(5), at(6), 0, at(8), at(9), at(10), 0, 0, 0, 0, 1);
  return new Vector3(-at(3), -at(7), -at(11)).applyMatrix4(left.invert());
}

/**
 * Gives `target`, a camera of three.js, the pose and projection of `camera`. If the view's `aspect` differs from that
 * of the camera's image, the view shows more at the left and right, or at the top and bottom. `world` maps the camera's
 * world space to the scene.
 */
export function applyPinhole(
  target: PerspectiveCamera,
  camera: PinholeCamera,
  world: Matrix4,
  aspect: number,
  [near, far]: [number, number],
): void {
  const { centre, right, down, forward, focal, principalPoint } = poseOf(camera);
  target.matrix.makeBasis(right, down.clone().negate(), forward.clone().negate()).setPosition(centre);
  target.matrix.premultiply(world);
  target.matrixWorldNeedsUpdate = true;
  const [width, height] = [camera.width, camera.height];
  let [x0, x1] = [(-0.5 - principalPoint[0]) / focal[0], (width - 0.5 - principalPoint[0]) / focal[0]];
  let [y0, y1] = [(-0.5 - principalPoint[1]) / focal[1], (height - 0.5 - principalPoint[1]) / focal[1]];
  const wider = aspect / ((x1 - x0) / (y1 - y0));
  if (wider > 1) [x0, x1] = stretched(x0, x1, wider);
  else [y0, y1] = stretched(y0, y1, 1 / wider);
  target.projectionMatrix.makePerspective(near * x0, near * x1, -near * y0, -near * y1, near, far);
  target.projectionMatrixInverse.copy(target.projectionMatrix).invert();
}

function stretched(low: number, high: number, factor: number): [number, number] {
  const [centre, half] = [(low + high) / 2, ((high - low) / 2) * factor];
  return [centre - half, centre + half];
}
