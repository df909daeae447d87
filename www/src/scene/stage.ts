import type { Raycaster, Vector3 } from 'three';
import type {
  Attractor,
  LevelView,
  Plane,
  PointArray,
  Surface,
  UncoveredRegion,
  Vec3,
  VolumeView,
} from '../engine/protocol';
import { token } from '../kit/dom';
import type { ColorMode, SlicePlacement } from '../kit/view';
import { nearestVoxel, slicePlane, toWorld } from './anatomy';
import { crossSection } from './cross-section';
import { EditedView } from './edited-view';
import { Legend } from './legend';
import { AttractorMarks, UncoveredMarks } from './markers';
import { SlicePanel } from './panel';
import type { PictureSubject } from './pictures';
import { diverging, QUANTITIES, quantityTitle } from './shading';
import { levelIndex, slicePicture } from './slicing';
import { SurfaceObject } from './surface';
import { type CameraPose, Viewport } from './viewport';
import { VolumeScene } from './volume-scene';

/** Camera and crosshair of a {@link Stage}. */
export interface StageView {
  camera: CameraPose;
  /** World position of the crosshair. */
  crosshair: Vec3;
}

/** Options of a {@link Stage}. */
export interface StageOptions {
  surface: boolean;
  edges: boolean;
  color: ColorMode;
  slices: SlicePlacement;
}

/** The 3D view and the three slices of a volume in the Extract lab, synchronised by a common crosshair. */
export class Stage {
  readonly #viewport: Viewport;
  readonly #slices: HTMLElement;
  readonly #surface: SurfaceObject;
  readonly #marks = new AttractorMarks();
  readonly #uncoveredMarks = new UncoveredMarks();
  /** Shows an edited surface in place of that of the run. */
  readonly editing: EditedView;
  /** Legend of the surface's colours. */
  readonly legend = new Legend(diverging);
  /** If set, receives the world point clicked in a slice or on the surface; used for placing attractors. */
  onPlace: ((point: Vec3) => void) | undefined;
  /** Unit of length in the volume's world space, for the legend. */
  unit = '';
  /** Called whenever the crosshair, and with it the slices, may have moved. */
  onMoved: () => void = () => undefined;
  readonly #onPlanes: (planes: Plane[]) => void;
  #options: StageOptions;
  #scene: VolumeScene | undefined;
  #attractors: Attractor[] = [];
  /** Index of the voxel in which the three slices intersect. */
  #crosshair: Vec3 = [0, 0, 0];

  /**
   * `onPlanes` is called with the planes of the three slices whenever they move, so that the surface's cross-sections
   * can be computed.
   */
  constructor(
    canvas: HTMLCanvasElement,
    slices: HTMLElement,
    options: StageOptions,
    onPlanes: (planes: Plane[]) => void,
  ) {
    this.#viewport = new Viewport(canvas);
    this.#surface = new SurfaceObject(this.#viewport.clipping);
    this.#slices = slices;
    this.#onPlanes = onPlanes;
    this.#options = options;
    this.#viewport.add(this.#surface.object);
    this.#viewport.add(this.#marks.object);
    this.#viewport.add(this.#uncoveredMarks.object);
    this.#viewport.onClick = (ray) => this.#placeOnSurface(ray);
    this.#viewport.onDraw = (viewer, hurried) => {
      this.#surface.coarse = hurried;
      this.#placeSlices(viewer);
    };
    this.editing = new EditedView(this.#viewport, this.#surface, () => {
      this.#showLegend();
      this.#updateSections();
    });
    this.#recolor();
    this.#viewport.onScheme = () => this.#recolor();
  }

  /** Shows another volume; crosshair, camera and display stay if it is another frame of the one before. */
  setVolume(volume: VolumeView): void {
    const before = this.#scene;
    const isFrame = before !== undefined && isSameImage(before.volume, volume);
    this.#clear();
    this.#scene = new VolumeScene(
      this.#viewport,
      this.#slices,
      volume,
      (orientation, inverse) =>
        new SlicePanel(volume, orientation, inverse, {
          onIndex: (index) => this.#moveSlice(orientation.axis, index),
          onPoint: (index, pressed) => this.#point(index, pressed),
        }),
    );
    this.#scene.onWindow = () => this.onMoved();
    this.setOptions(this.#options);
    this.showAttractors(this.#attractors);
    if (isFrame) this.#scene.takeOver(before);
    else this.#viewport.fitVolume(volume);
    this.#moveTo(isFrame ? this.#crosshair : (volume.dims.map((n) => (n - 1) >> 1) as Vec3));
  }

  /** Shows another surface; its arrays are used without a copy until the next one is shown. */
  showSurface(surface: Surface): void {
    this.#surface.show(surface);
    this.#showLegend();
    this.#viewport.invalidate();
  }

  /** Shows the cross-sections of the surface with the slice planes last passed to `onPlanes`, in the same order. */
  showSections(sections: PointArray[]): void {
    if (!this.#surface.edited) this.#drawSections(sections);
  }

  #drawSections(sections: PointArray[]): void {
    sections.forEach((section, axis) => {
      this.#scene?.panels[axis]?.setOutline(section);
      this.#scene?.planes[axis]?.showSection(section);
    });
    this.#viewport.invalidate();
  }

  /** The objects shown, for pictures and films. */
  get subject(): PictureSubject {
    return { viewport: this.#viewport, legend: this.legend, panels: () => this.#scene?.panels ?? [] };
  }

  setOptions(options: StageOptions): void {
    this.#options = options;
    this.#surface.edges = options.edges;
    this.#surface.solid = options.surface;
    this.#surface.color = options.color;
    this.#showLegend();
    this.#viewport.invalidate();
  }

  showAttractors(attractors: Attractor[]): void {
    this.#attractors = attractors;
    this.#marks.show(attractors);
    for (const panel of this.#scene?.panels ?? []) panel.setAttractors(attractors);
    this.#viewport.invalidate();
  }

  /** Marks the regions of the iso-surface that the surface does not cover. */
  showUncovered(parts: readonly UncoveredRegion[]): void {
    const { dims = [1, 1, 1], spacing = [1, 1, 1] } = this.#scene?.volume ?? {};
    this.#uncoveredMarks.show(parts, Math.min(...dims.map((n, axis) => n * (spacing[axis] ?? 1))));
    for (const panel of this.#scene?.panels ?? []) panel.setUncovered(parts);
    this.#viewport.invalidate();
  }

  /** Moves the crosshair to a world point, and centres the 3D view on it. */
  lookAt(point: Vec3): void {
    this.goTo(point);
    this.#viewport.setPivot(point);
  }

  /** Shows a coarser pyramid level in the slices, or with undefined the volume itself. */
  showLevel(level: LevelView | undefined): void {
    this.#scene?.showLevel(level);
  }

  /**
   * Returns the axial slice through the crosshair as a small image, of a coarser pyramid level or, with undefined, of
   * the volume; undefined if there is no volume.
   */
  thumbnail(level: LevelView | undefined): HTMLCanvasElement | undefined {
    const scene = this.#scene;
    const frame = scene?.panels.find((panel) => panel.orientation.name === 'Axial')?.orientation;
    if (!scene || !frame) return undefined;
    const index = this.#crosshair[frame.axis];
    if (!level) return slicePicture(scene.volume, frame, index, scene.window);
    return slicePicture(level, frame, levelIndex(scene.volume, level, frame, index), scene.window);
  }

  /** Moves the crosshair to the voxel nearest to a world point, and with it the slices. */
  goTo(point: Vec3): void {
    const scene = this.#scene;
    if (!scene) return;
    this.#moveTo(nearestVoxel(toWorld(scene.inverse, point), scene.volume.dims));
  }

  /** Pose of the camera and position of the crosshair, to return to. */
  get view(): StageView {
    return { camera: this.#viewport.pose, crosshair: this.crosshair };
  }

  set view({ camera, crosshair }: StageView) {
    this.goTo(crosshair);
    this.#viewport.pose = camera;
  }

  /** World position of the crosshair, the voxel in which the three slices intersect. */
  get crosshair(): Vec3 {
    return this.#scene ? toWorld(this.#scene.volume.affine, this.#crosshair) : [0, 0, 0];
  }

  /** Releases all resources; the stage cannot be used afterwards. */
  dispose(): void {
    this.#clear();
    this.#surface.dispose();
    this.editing.dispose();
    this.#viewport.dispose();
  }

  #moveSlice(axis: 0 | 1 | 2, index: number): void {
    const at: Vec3 = [...this.#crosshair];
    at[axis] = index;
    this.#moveTo(at);
  }

  #moveTo(index: Vec3): void {
    const scene = this.#scene;
    if (!scene) return;
    this.#crosshair = index;
    scene.moveTo(index);
    this.onMoved();
    this.#updateSections();
  }

  /** Updates the cross-sections of the surface: that of the run is in the worker. */
  #updateSections(): void {
    if (!this.#scene) return;
    const { volume, inverse } = this.#scene;
    const planes = ([0, 1, 2] as const).map((axis) => slicePlane(volume.affine, inverse, axis, this.#crosshair[axis]));
    const { edited } = this.#surface;
    if (edited) this.#drawSections(planes.map((plane) => crossSection(edited, plane)));
    else this.#onPlanes(planes);
  }

  /**
   * Handles the pointer on the voxel `index` of a slice: moves the crosshair there; while attractors are being placed,
   * only a press counts, and also places one.
   */
  #point(index: Vec3, pressed: boolean): void {
    if (this.onPlace && !pressed) return;
    this.#moveTo(index);
    this.onPlace?.(this.crosshair);
  }

  #placeOnSurface(ray: Raycaster): void {
    if (!this.onPlace) return;
    const hit = this.#surface.hit(ray);
    if (!hit) return;
    const point = hit.point.toArray();
    this.goTo(point);
    this.onPlace?.(point);
  }

  #showLegend(): void {
    const { color } = this.#options;
    const { range } = this.#surface;
    if (color === 'plain' || color === 'component' || range === 0) this.legend.hide();
    else this.legend.show({ ...QUANTITIES[color], title: quantityTitle(color, this.unit) }, range);
  }

  #placeSlices(viewer: Vector3): void {
    this.#scene?.placeSlices(this.#options.slices, viewer);
  }

  #recolor(): void {
    this.#surface.edgeColor = token('--wire');
    this.#marks.color = token('--attractor');
    this.#uncoveredMarks.colors = { matter: token('--matter'), cavity: token('--cavity') };
    for (const panel of this.#scene?.panels ?? []) panel.draw();
    this.#viewport.invalidate();
  }

  #clear(): void {
    this.#scene?.dispose();
    this.#scene = undefined;
  }
}

/** Whether two volumes are frames of the same image. */
function isSameImage(one: VolumeView, other: VolumeView): boolean {
  return other.frames > 1 && one.name === other.name && one.dims.join() === other.dims.join();
}
