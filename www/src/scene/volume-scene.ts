import { Plane, Vector3 } from 'three';
import type { LevelView, Vec3, VolumeView } from '../engine/protocol';
import { token } from '../kit/dom';
import { count, figure, place } from '../kit/format';
import type { SlicePlacement } from '../kit/view';
import { text } from '../texts';
import { type Axis, anatomyOf, invert, type SliceOrientation, sliceOrientations, slicePlane, toWorld } from './anatomy';
import { AXIS_TOKENS, type SlicePanel } from './panel';
import { SlicePlane } from './planes';
import { type CutSide, SliceBar } from './slice-bar';
import type { Drag } from './slice-gestures';
import type { DisplayWindow } from './slicing';
import type { Viewport } from './viewport';
import { VolumeBox } from './volume-box';

/** Returns the longest side of a volume. */
const sizeOf = ({ dims, spacing }: VolumeView) => Math.max(...dims.map((n, axis) => n * (spacing[axis] ?? 1)));

/** Pixels of a drag that double or halve the width of the displayed window, or move its level by its width. */
const WINDOW_DRAG = 150;
/** Ends of the anatomical axes, negative one first, as the choices of the side that is cut away. */
const CUT_ENDS = ['LR', 'PA', 'IS'];

/**
 * The display of one volume: a panel per slice with a common crosshair, controls of all of them, and the slices and the
 * volume's box in the 3D view.
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
  readonly #bar: SliceBar;
  /** Called when the slices show other intensities. */
  onWindow: () => void = () => undefined;
  #window: DisplayWindow;
  #crosshair: Vec3 = [0, 0, 0];
  /** The volume whose voxels the slices show, in the same grid: the volume itself, or one of its frames. */
  #shown: LevelView;
  #cut: CutSide = 'none';

  /**
   * Adds the slices and the box of a volume to a 3D view, and its panels, which `createPanel` makes, to the element
   * `slices`: axial first, as in radiology; then controls of all of them.
   */
  constructor(
    viewport: Viewport,
    slices: HTMLElement,
    volume: VolumeView,
    createPanel: (orientation: SliceOrientation, inverse: Float64Array) => SlicePanel,
  ) {
    this.#viewport = viewport;
    this.volume = volume;
    this.#shown = volume;
    this.#window = volume.window;
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
    this.#bar = new SliceBar(volume.range, volume.window, {
      onWindow: (window) => this.#show(window),
      onCut: (side) => {
        this.#cut = side;
        this.#applyCut();
      },
      onResetZoom: () => {
        for (const panel of this.panels) panel.resetZoom();
      },
    });
    for (const panel of this.panels) this.#connect(panel);
    slices.append(...byName.map((panel) => panel.element), this.#bar.element);
  }

  /** Intensities that are displayed as black and as white. */
  get window(): DisplayWindow {
    return this.#window;
  }

  /** Takes over window and cut from the display of another volume. */
  takeOver(other: VolumeScene): void {
    this.#cut = other.#cut;
    this.#bar.cut.value = other.#cut;
    this.#show(other.#window);
  }

  /** Moves the crosshair to a voxel, and with it the slices. */
  moveTo(index: Vec3): void {
    this.#crosshair = index;
    for (const panel of this.panels) panel.setCrosshair(index);
    this.#placePlanes();
    this.#readOut();
    this.#applyCut();
  }

  /** Shows a coarser pyramid level or a frame in the slices; undefined returns to the volume. */
  showLevel(level: LevelView | undefined): void {
    const isFrame = level?.dims.every((size, axis) => size === this.volume.dims[axis]);
    this.#shown = level && isFrame ? level : this.volume;
    for (const panel of this.panels) panel.setLevel(level);
    this.#placePlanes();
    this.#readOut();
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

  #placePlanes(): void {
    for (const [axis, plane] of this.planes.entries()) plane.moveTo(this.#crosshair[axis] ?? 0);
    this.#viewport.invalidate();
  }

  #connect(panel: SlicePanel): void {
    panel.host = {
      onProbe: (voxel) => this.#readOut(voxel),
      onZoom: () => {
        this.#bar.isZoomed.value = this.panels.some(({ isZoomed }) => isZoomed);
      },
      adjustWindow: (event) => this.#adjustWindow(event),
      isAdjusting: () => this.#bar.adjusts.peek(),
    };
  }

  #show(window: DisplayWindow): void {
    this.#window = window;
    this.#bar.show(window);
    for (const panel of this.panels) panel.window = window;
    for (const plane of this.planes) plane.refresh();
    this.#viewport.invalidate();
    this.onWindow();
  }

  /** Returns the drag that changes the width of the window from left to right, and its level from top to bottom. */
  #adjustWindow(from: PointerEvent): Drag {
    const [low, high] = this.#window;
    const [width, level] = [high - low, (low + high) / 2];
    const move = (to: PointerEvent) => {
      const half = (width / 2) * 2 ** ((to.offsetX - from.offsetX) / WINDOW_DRAG);
      const middle = level + (width * (to.offsetY - from.offsetY)) / WINDOW_DRAG;
      this.#show([middle - half, middle + half]);
    };
    return { move };
  }

  /** Shows position and intensity of the voxel under the pointer, or else at the crosshair. */
  #readOut(pointed?: Vec3): void {
    const voxel = pointed ?? this.#crosshair;
    this.#bar.readout.value = text('slices.readout', {
      place: text(pointed ? 'slices.atPointer' : 'slices.atCrosshair'),
      voxel: voxel.join(', '),
      space: this.volume.space,
      world: place(toWorld(this.volume.affine, voxel), sizeOf(this.volume)),
      intensity: this.#intensityAt(voxel),
    });
    if (pointed) return;
    const intensity = this.#intensityAt(voxel);
    for (const panel of this.panels)
      panel.spoken = text('slices.spoken', { slice: voxel[panel.orientation.axis], intensity });
  }

  #intensityAt([x, y, z]: Vec3): string {
    const { dims, voxels } = this.#shown;
    const value = voxels[(z * dims[1] + y) * dims[0] + x] ?? Number.NaN;
    return Number.isInteger(value) ? count(value) : figure(value);
  }

  /** Cuts the surfaces in the 3D view open along the slice through the crosshair, on the chosen side. */
  #applyCut(): void {
    this.#viewport.cut(this.#cut === 'none' ? undefined : this.#cutPlane(this.#cut));
  }

  /** Returns the plane of the slice whose lower or upper side is cut away; its normal points to what remains. */
  #cutPlane(side: Exclude<CutSide, 'none'>): Plane {
    const anatomical = CUT_ENDS.findIndex((ends) => ends.includes(side));
    const anatomy = anatomyOf(this.volume);
    const axis = anatomy.findIndex((one) => one.anatomical === anatomical) as Axis;
    const { origin, normal } = slicePlane(this.volume.affine, this.inverse, axis, this.#crosshair[axis]);
    const isUpper = CUT_ENDS[anatomical]?.[1] === side;
    const sign = isUpper === anatomy[axis]?.positive ? -1 : 1;
    const direction = new Vector3(...normal).multiplyScalar(sign);
    return new Plane().setFromNormalAndCoplanarPoint(direction, new Vector3(...origin));
  }

  dispose(): void {
    this.#viewport.cut(undefined);
    this.#bar.element.remove();
    for (const item of [...this.planes, this.#box]) {
      this.#viewport.remove(item.object);
      item.dispose();
    }
    for (const panel of this.panels) panel.dispose();
  }
}
