import type { Vector3 } from 'three';
import type { VolumeView } from '../protocol';
import { token } from '../ui/dom';
import type { SlicePlacement } from '../ui/view-options';
import { invert, type SliceOrientation, sliceOrientations } from './anatomy';
import { AXIS_TOKENS, type SlicePanel } from './panel';
import { SlicePlane } from './planes';
import type { Viewport } from './viewport';
import { VolumeBox } from './volume-box';

/**
 * The display of one volume in the Extract and Track labs: a panel per slice, and the slices and the volume's box in
 * the 3D view.
 */
export class VolumeScene {
  readonly volume: VolumeView;
  /** The map from world space to voxel indices. */
  readonly inverse: Float64Array;
  /** The panels of the slices across the three voxel axes, in the order of the axes. */
  readonly panels: SlicePanel[];
  /** The slices across the three voxel axes in the 3D view, in the order of the axes. */
  readonly planes: SlicePlane[];
  readonly #box: VolumeBox;
  readonly #viewport: Viewport;

  /**
   * Adds the slices and the box of a volume to a 3D view, and its panels, which `createPanel` makes, to the element
   * `slices`: axial first, as in radiology.
   */
  constructor(
    viewport: Viewport,
    slices: HTMLElement,
    volume: VolumeView,
    createPanel: (orientation: SliceOrientation, inverse: Float64Array) => SlicePanel,
  ) {
    this.#viewport = viewport;
    this.volume = volume;
    this.inverse = invert(volume.affine);
    this.panels = sliceOrientations(volume).map((orientation) => createPanel(orientation, this.inverse));
    this.planes = this.panels.map(
      ({ orientation, picture }) =>
        new SlicePlane(volume, orientation, picture, {
          frame: token(AXIS_TOKENS[orientation.axis]),
          section: token('--outline'),
        }),
    );
    this.#box = new VolumeBox(volume, token('--muted'));
    for (const { object } of [...this.planes, this.#box]) viewport.add(object);
    const byName = [...this.panels].sort((a, b) => a.orientation.name.localeCompare(b.orientation.name));
    slices.append(...byName.map((panel) => panel.element));
  }

  /**
   * Places the slices in the 3D view: in place, on the walls of the volume's box that are farther from the viewer, or
   * hidden.
   */
  placeSlices(placement: SlicePlacement, viewer: Vector3): void {
    for (const plane of this.planes) {
      plane.object.visible = placement !== 'hidden';
      if (placement !== 'hidden') plane.stand(placement, viewer);
    }
  }

  dispose(): void {
    for (const item of [...this.planes, this.#box]) {
      this.#viewport.remove(item.object);
      item.dispose();
    }
    for (const panel of this.panels) panel.dispose();
  }
}
