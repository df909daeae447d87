import type { Surface } from '../../engine/protocol';
import { slicePlane } from '../../scene/anatomy';
import { crossSection } from '../../scene/cross-section';
import { drawSegments, type SlicePanel } from '../../scene/panel';
import { projectSegments } from '../../scene/slicing';
import type { VolumeScene } from '../../scene/volume-scene';

/** An outline, with what it was computed from. */
interface Outline {
  surface: Surface;
  index: number;
  points: Float32Array;
}

/** The outlines of the surfaces of labels on the slices; those of which neither slice nor surface has changed are kept. */
export class LabelOutlines {
  readonly #scene: VolumeScene;
  /** Outlines by label, on the slices across the three voxel axes. */
  readonly #known = [new Map<number, Outline>(), new Map<number, Outline>(), new Map<number, Outline>()] as const;

  constructor(scene: VolumeScene) {
    this.#scene = scene;
  }

  /** Draws the outline of a label's surface on the slice with the given index. */
  draw(
    { orientation }: SlicePanel,
    index: number,
    label: number,
    surface: Surface,
    color: string,
    ...[context, scaleX, scaleY]: [CanvasRenderingContext2D, number, number]
  ): void {
    const known = this.#known[orientation.axis];
    let outline = known.get(label);
    if (outline?.surface !== surface || outline.index !== index) {
      const { volume, inverse } = this.#scene;
      const plane = slicePlane(volume.affine, inverse, orientation.axis, index);
      const points = projectSegments(crossSection(surface, plane), inverse, volume, orientation);
      outline = { surface, index, points };
      known.set(label, outline);
    }
    drawSegments(context, outline.points, scaleX, scaleY, color);
  }

  /** Forgets the outlines of a label that has no surface any more. */
  drop(label: number): void {
    for (const known of this.#known) known.delete(label);
  }
}
