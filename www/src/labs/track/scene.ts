import { Box3, Vector3 } from 'three';
import type { LevelView, Surface, Vec3, VolumeView } from '../../engine/protocol';
import { token } from '../../kit/dom';
import { type Axis, nearestVoxel, slicePlane, toWorld } from '../../scene/anatomy';
import { PointCloud } from '../../scene/cloud';
import { crossSection } from '../../scene/cross-section';
import { EditedView } from '../../scene/edited-view';
import { Lines } from '../../scene/lines';
import { type Grip, SlicePanel } from '../../scene/panel';
import type { PictureSubject } from '../../scene/pictures';
import { greysOf, pictureSize, projectSegments } from '../../scene/slicing';
import type { StageView } from '../../scene/stage';
import { SurfaceObject } from '../../scene/surface';
import { Viewport } from '../../scene/viewport';
import { VolumeScene } from '../../scene/volume-scene';
import type { VoxelBox } from './box';
import { sliceVotes } from './clusters';
import type { BoundaryVotes } from './protocol';
import { RegionGrips, regionEdges } from './region';
import type { TrackViewOptions } from './view';
import { drawFaces, drawVotes, voteColors, votesNear } from './votes';

/** Diameter of the disc that marks a boundary vote, as a fraction of the voxel's shortest side. */
const DISC = 1.1;
/** Distance from a vertex of the surface within which boundary votes count as near it, in shortest voxel sides. */
const NEAR_DISTANCE = 2;
/**
 * Half the fraction of the region of interest's sides to which the view is fitted; below ½, because the object leaves a
 * margin in the region.
 */
const FIT_SCALE = 0.44;

/** The 3D view and the slices of the Track lab for one frame at a time, synchronised by a common crosshair. */
export class TrackView {
  /** Called when a drag of the region of interest ends, with the region in voxels. */
  onRegion: (region: VoxelBox) => void = () => undefined;
  /** Called whenever the crosshair, and with it the slices, may have moved. */
  onMoved: () => void = () => undefined;
  /** Called with the point that was clicked; if set, clicks in slices pick a point, and drags draw the region anew. */
  onPick: ((point: Vec3) => void) | undefined;
  readonly #viewport: Viewport;
  readonly #slices: HTMLElement;
  readonly #surface: SurfaceObject;
  readonly #cloud = new PointCloud();
  readonly #box = new Lines('#fff');
  readonly #grips = new RegionGrips(
    () => this.#redraw(),
    (region) => this.onRegion(region),
  );
  /** Shows an edited surface in place of that of the displayed frame. */
  readonly editing: EditedView;
  #options: TrackViewOptions;
  #scene: VolumeScene | undefined;
  #shown: Surface | undefined;
  #votes: BoundaryVotes | undefined;
  #frame = 0;
  /**
   * Preview of the boundary votes for an edge threshold that is being chosen, by voxel axis across the slice; empty if
   * there is none.
   */
  #preview: ReturnType<typeof sliceVotes>[] = [];
  #crosshair: Vec3 = [0, 0, 0];

  constructor(canvas: HTMLCanvasElement, slices: HTMLElement, options: TrackViewOptions) {
    this.#viewport = new Viewport(canvas);
    this.#surface = new SurfaceObject(this.#viewport.clipping);
    this.#slices = slices;
    this.#options = options;
    for (const { object } of [this.#surface, this.#cloud, this.#box]) this.#viewport.add(object);
    this.#viewport.onDraw = (viewer) => this.#placeSlices(viewer);
    this.editing = new EditedView(this.#viewport, this.#surface, () => this.#updateSections());
    this.#recolor();
    this.#viewport.onScheme = () => this.#recolor();
  }

  /**
   * Shows another image, or, with `keep`, the same after another preparation: slices and camera then stay unchanged in
   * world space.
   */
  setVolume(volume: VolumeView, keep: boolean): void {
    const at = keep && this.#scene ? toWorld(this.#scene.volume.affine, this.#crosshair) : undefined;
    this.#clear();
    this.#scene = new VolumeScene(this.#viewport, this.#slices, volume, (orientation, inverse) => {
      const panel: SlicePanel = new SlicePanel(volume, orientation, inverse, {
        onIndex: (index) => this.#moveSlice(orientation.axis, index),
        onPoint: (index) => this.#moveTo(index),
        grab: (place, slack) => this.#gripAt(place, slack, orientation.axis),
      });
      panel.overlay = (context, scaleX, scaleY) => this.#drawOver(panel, context, scaleX, scaleY);
      return panel;
    });
    this.#cloud.size = DISC * Math.min(...volume.spacing);
    if (!keep) this.#viewport.fitVolume(volume);
    this.#moveTo(volume.dims.map((n) => (n - 1) >> 1) as Vec3);
    this.showFrame(0, undefined);
    if (at) this.goTo(at);
  }

  /** Fits a box of voxels, the region of interest, closely into the 3D view. */
  fitRegion(region: VoxelBox): void {
    if (!this.#scene) return;
    const { space, affine } = this.#scene.volume;
    const all = new Box3().setFromArray(regionEdges(region, affine));
    const [middle, size] = [all.getCenter(new Vector3()), all.getSize(new Vector3()).multiplyScalar(2 * FIT_SCALE)];
    this.#viewport.fitBox(new Box3().setFromCenterAndSize(middle, size), space === 'LPS' ? 1 : -1, 0.5);
  }

  /** Shows the slices of a frame, and its surface if it has one. */
  showFrame(frame: number, surface: Surface | undefined): void {
    this.#frame = frame;
    this.#shown = surface;
    if (surface) this.#surface.show(surface);
    this.#scene?.showLevel(this.#level);
    this.#updateSections();
    this.#apply();
  }

  /** Shows the boundary votes of a frame, or none. */
  showVotes(votes: BoundaryVotes | undefined): void {
    this.#votes = votes;
    this.#showCloud();
    this.#apply();
    this.#redraw();
  }

  #showCloud(): void {
    const { votes } = this.#options;
    if (!this.#votes || votes === 'none') return;
    const reach = NEAR_DISTANCE * Math.min(...(this.#scene?.volume.spacing ?? [1]));
    const near = votes === 'near' && this.#shown ? votesNear(this.#votes, this.#shown, reach) : this.#votes;
    this.#cloud.show(near.points, voteColors(near.weights));
  }

  /**
   * Previews the boundary votes for an edge threshold (intensity units), found in each slice separately with windows of
   * half width `halfWidth` (pixels); undefined removes the preview.
   */
  preview(threshold: number | undefined, halfWidth: number): void {
    const level = this.#level;
    this.#preview = [];
    for (const { orientation } of threshold !== undefined && level ? (this.#scene?.panels ?? []) : []) {
      const [low, high] = this.#scene?.volume.window ?? [0, 1];
      const values = greysOf(level as LevelView, orientation, this.#crosshair[orientation.axis]);
      const { width, height } = pictureSize(level as LevelView, orientation);
      const leastDifference = ((threshold ?? 0) * 255) / (high - low || 1);
      this.#preview[orientation.axis] = sliceVotes({ width, height, values }, halfWidth, leastDifference);
    }
    this.#redraw();
  }

  /** Returns the grip at a position on a slice across the axis `across`, in voxels, by which to move or draw the region. */
  #gripAt(place: Vec3, slack: Vec3, across: Axis): Grip | undefined {
    const { dims } = this.#scene?.volume ?? {};
    if (!dims) return undefined;
    const { region } = this.#grips;
    // The sides of the whole image are no aim: an object may be there.
    const hasSides = !this.onPick || (region && !isWhole(region, dims));
    const side = this.#options.region && hasSides ? this.#grips.grab(place, slack, across, dims) : undefined;
    if (side || !this.onPick || !isInside(place, dims)) return side;
    return this.#grips.draw(place, slack, across, dims, () => {
      this.#moveTo(nearestVoxel(place, dims));
      this.onPick?.(this.crosshair.point);
    });
  }

  /** Sets the region of interest, shown if the view options include it. */
  showRegion(region: VoxelBox): void {
    this.#grips.region = region;
    this.#redraw();
  }

  /** The objects shown, for pictures and films. */
  get subject(): PictureSubject {
    return { viewport: this.#viewport, panels: () => this.#scene?.panels ?? [] };
  }

  setOptions(options: TrackViewOptions): void {
    this.#options = { ...options };
    this.#showCloud();
    this.#apply();
    this.#redraw();
  }

  goTo(point: Vec3): void {
    const scene = this.#scene;
    if (!scene) return;
    this.#moveTo(nearestVoxel(toWorld(scene.inverse, point), scene.volume.dims));
  }

  goToVoxel(voxel: Vec3): void {
    this.#moveTo(voxel);
  }

  /** Pose of the camera and position of the crosshair, to return to. */
  get pose(): StageView {
    return { camera: this.#viewport.pose, crosshair: this.crosshair.point };
  }

  set pose({ camera, crosshair }: StageView) {
    this.goTo(crosshair);
    this.#viewport.pose = camera;
  }

  /** The crosshair, where the three slices intersect: as a world point and as a voxel index. */
  get crosshair(): { point: Vec3; voxel: Vec3 } {
    const voxel: Vec3 = [...this.#crosshair];
    return { point: this.#scene ? toWorld(this.#scene.volume.affine, voxel) : [0, 0, 0], voxel };
  }

  /** Redraws the slices with their overlays, and the region of interest in the 3D view. */
  refresh(): void {
    this.#redraw();
  }

  /**
   * Returns the cross-section of a surface with the present slice across the given voxel axis: x y x y per segment, in
   * pixels of the slice's image.
   */
  outlineIn(surface: Surface, axis: 0 | 1 | 2): Float32Array {
    const scene = this.#scene;
    const panel = scene?.panels[axis];
    if (!scene || !panel) return new Float32Array(0);
    const plane = slicePlane(scene.volume.affine, scene.inverse, axis, this.#crosshair[axis]);
    return projectSegments(crossSection(surface, plane), scene.inverse, scene.volume, panel.orientation);
  }

  dispose(): void {
    this.#clear();
    this.editing.dispose();
    for (const part of [this.#surface, this.#cloud, this.#box]) part.dispose();
    this.#viewport.dispose();
  }

  /** Voxels of the displayed frame as a volume of its own; undefined if there is no image. */
  get #level(): LevelView | undefined {
    const volume = this.#scene?.volume;
    return volume && frameOf(volume, this.#frame);
  }

  #moveSlice(axis: 0 | 1 | 2, index: number): void {
    const at: Vec3 = [...this.#crosshair];
    at[axis] = index;
    this.#moveTo(at);
  }

  #moveTo(index: Vec3): void {
    this.#crosshair = index;
    this.#scene?.moveTo(index);
    this.#updateSections();
    this.onMoved();
  }

  /** Updates the surface's outlines on the slices, both in the slice panels and in the 3D view. */
  #updateSections(): void {
    const scene = this.#scene;
    if (!scene) return;
    const shown = this.#surface.edited ?? this.#shown;
    for (const axis of [0, 1, 2] as const) {
      const plane = slicePlane(scene.volume.affine, scene.inverse, axis, this.#crosshair[axis]);
      const section = shown ? crossSection(shown, plane) : new Float32Array(0);
      scene.panels[axis]?.setOutline(section);
      scene.planes[axis]?.showSection(section);
    }
    this.#viewport.invalidate();
  }

  #apply(): void {
    const { surface, edges, votes, region } = this.#options;
    this.#surface.solid = surface && this.#shown !== undefined;
    this.#surface.edges = edges && this.#shown !== undefined;
    this.#cloud.object.visible = votes !== 'none' && this.#votes !== undefined;
    this.#box.object.visible = region;
    this.#viewport.invalidate();
  }

  #redraw(): void {
    const scene = this.#scene;
    for (const panel of scene?.panels ?? []) panel.draw();
    if (scene && this.#grips.region) this.#box.show(regionEdges(this.#grips.region, scene.volume.affine));
    this.#box.object.visible = this.#options.region;
    this.#viewport.invalidate();
  }

  #drawOver(panel: SlicePanel, context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    const scene = this.#scene;
    if (!scene) return;
    const { volume, inverse } = scene;
    const slice = this.#crosshair[panel.orientation.axis];
    const preview = this.#preview[panel.orientation.axis];
    if (preview) drawFaces(context, preview, scaleX, scaleY);
    else if (this.#options.votes !== 'none' && this.#votes)
      drawVotes(context, this.#votes, { volume, inverse, orientation: panel.orientation, slice, scaleX, scaleY });
    if (this.#options.region) this.#grips.drawOn(context, panel.orientation, volume.dims, scaleX, scaleY);
  }

  #placeSlices(viewer: Vector3): void {
    this.#scene?.placeSlices(this.#options.slices, viewer);
  }

  #recolor(): void {
    this.#surface.edgeColor = token('--wire');
    this.#box.object.material.color.set(token('--region'));
    this.#redraw();
  }

  #clear(): void {
    this.#scene?.dispose();
    this.#scene = undefined;
    this.#votes = undefined;
  }
}

const isWhole = ({ low, high }: VoxelBox, dims: Vec3) =>
  dims.every((size, axis) => low[axis] === 0 && high[axis] === size - 1);

const isInside = (place: Vec3, dims: Vec3) => place.every((at, axis) => at >= -0.5 && at <= (dims[axis] ?? 0) - 0.5);

/** Returns one frame of an image as a volume of its own, without a copy of its voxels. */
export function frameOf({ dims, voxels, window }: VolumeView, frame: number): LevelView {
  const size = dims[0] * dims[1] * dims[2];
  return { dims, voxels: voxels.subarray(frame * size, (frame + 1) * size), window };
}
