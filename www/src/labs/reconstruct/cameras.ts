import { Vector3 } from 'three';
import { Lines } from '../../scene/lines';
import { type PinholeCamera, poseOf } from '../../scene/pinhole';

/**
 * Cameras in the 3D view as small pyramids: the apex is the camera centre, the base its image, with a mark at the upper
 * side.
 */
export class CameraMarks {
  readonly #all = new Lines('#888');
  readonly #chosen = new Lines('#888');
  readonly object = this.#all.object;
  readonly chosenObject = this.#chosen.object;
  #cameras: readonly PinholeCamera[] = [];
  #depth = 1;
  #visible = false;

  set colors({ all, chosen }: { all: string; chosen: string }) {
    this.#all.object.material.color.set(all);
    this.#chosen.object.material.color.set(chosen);
  }

  /** Replaces the cameras shown, none of them highlighted, by pyramids of height `depth`, world units. */
  show(cameras: readonly PinholeCamera[], depth: number): void {
    this.#cameras = cameras;
    this.#depth = depth;
    this.choose(undefined);
    this.visible = this.#visible;
  }

  set visible(visible: boolean) {
    this.#visible = visible;
    this.#all.show(visible ? this.#cameras.flatMap((camera) => pyramid(camera, this.#depth)) : []);
    this.#chosen.object.visible &&= visible;
  }

  choose(index: number | undefined): void {
    const camera = index === undefined ? undefined : this.#cameras[index];
    this.#chosen.show(camera && this.#visible ? pyramid(camera, this.#depth) : []);
  }

  /** Camera centres in world space, to fit the view to. */
  get centres(): Vector3[] {
    return this.#cameras.map((camera) => poseOf(camera).centre);
  }

  dispose(): void {
    this.#all.dispose();
    this.#chosen.dispose();
  }
}

/** Returns the edges of a camera's pyramid of height `depth`, as pairs of world points, packed xyz. */
function pyramid(camera: PinholeCamera, depth: number): number[] {
  const { centre, right, down, forward, focal, principalPoint } = poseOf(camera);
  const at = (x: number, y: number) =>
    new Vector3()
      .copy(centre)
      .addScaledVector(forward, depth)
      .addScaledVector(right, (depth * (x - principalPoint[0])) / focal[0])
      .addScaledVector(down, (depth * (y - principalPoint[1])) / focal[1]);
  const { width, height } = camera;
  const corners = [at(0, 0), at(width, 0), at(width, height), at(0, height)];
  const mark = [at(0.35 * width, 0), at(0.5 * width, -0.2 * height), at(0.65 * width, 0)];
  const [a, b, c] = mark;
  const lines = corners.flatMap((corner, i) => [centre, corner, corner, corners[(i + 1) % 4] ?? corner]);
  if (a && b && c) lines.push(a, b, b, c);
  return lines.flatMap((point) => point.toArray());
}
