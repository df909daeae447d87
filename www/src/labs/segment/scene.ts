import type { Raycaster } from 'three';
import type { Surface, Vec3, VolumeView } from '../../engine/protocol';
import { token } from '../../kit/dom';
import { type Axis, nearestVoxel, toWorld } from '../../scene/anatomy';
import { type Grip, SlicePanel } from '../../scene/panel';
import type { PictureSubject } from '../../scene/pictures';
import { SurfaceObject } from '../../scene/surface';
import { type CameraPose, Viewport } from '../../scene/viewport';
import { VolumeScene } from '../../scene/volume-scene';
import { count, text } from '../../texts';
import { LabelOutlines } from './label-outlines';
import { LabelPicture, type Overlays } from './label-overlay';
import type { SegmentViewOptions } from './view';

export interface SegmentViewEvents {
  /** Called when a slice across `axis` is pressed, with the position in voxels; a returned grip follows the pointer. */
  press: (at: Vec3, axis: Axis) => Grip | undefined;
  /** Called when the surface of a label is clicked in the 3D view. */
  onPick: (label: number) => void;
}

/** The surface of a label, as it is drawn. */
interface Shown {
  object: SurfaceObject;
  surface: Surface;
}

/** The 3D view and the three slices of the Segment lab, synchronised by a common crosshair. */
export class SegmentView {
  readonly #viewport: Viewport;
  readonly #slices: HTMLElement;
  readonly #events: SegmentViewEvents;
  readonly #surfaces = new Map<number, Shown>();
  #options: SegmentViewOptions;
  #scene: VolumeScene | undefined;
  #pictures: LabelPicture[] = [];
  /** Axes of the slices whose labels may have changed since they were painted. */
  readonly #stale = new Set<Axis>();
  #outlines: LabelOutlines | undefined;
  #overlays: Omit<Overlays, 'opacity'> | undefined;
  #hidden: ReadonlySet<number> = new Set();
  #colors = new Map<number, string>();
  /** Radius of the brush in world units, drawn around the pointer; undefined for none. */
  #brush: { radius: number; disc: boolean } | undefined;
  #pointer: { at: Vec3; axis: Axis } | undefined;
  #crosshair: Vec3 = [0, 0, 0];

  constructor(canvas: HTMLCanvasElement, slices: HTMLElement, options: SegmentViewOptions, events: SegmentViewEvents) {
    this.#viewport = new Viewport(canvas);
    this.#slices = slices;
    this.#options = options;
    this.#events = events;
    this.#viewport.onClick = (ray) => this.#pick(ray);
    this.#viewport.onDraw = (viewer, interactive) => {
      for (const { object } of this.#surfaces.values()) object.coarse = interactive;
      this.#scene?.placeSlices(this.#options.slices, viewer);
    };
    this.#viewport.onScheme = () => this.#recolor();
  }

  /** Shows another volume, with its label map, and no surfaces yet. */
  setVolume(volume: VolumeView, overlays: Omit<Overlays, 'opacity'>): void {
    this.#clear();
    this.#overlays = overlays;
    const scene = new VolumeScene(this.#viewport, this.#slices, volume, (orientation, inverse) => {
      const { axis } = orientation;
      const panel: SlicePanel = new SlicePanel(volume, orientation, inverse, {
        onIndex: (index) => this.#moveTo(this.#crosshair.map((x, one) => (one === axis ? index : x)) as Vec3),
        onPoint: (index) => this.#moveTo(index),
        grab: (at) => this.#events.press(at, axis),
        onHover: (at) => this.#hover(at, axis),
      });
      this.#pictures[axis] = new LabelPicture(volume.dims, orientation);
      this.#stale.add(axis);
      panel.overlay = (context, scaleX, scaleY) => this.#drawOver(panel, context, scaleX, scaleY);
      return panel;
    });
    this.#scene = scene;
    this.#outlines = new LabelOutlines(scene);
    this.#viewport.fitVolume(volume);
    this.#moveTo(volume.dims.map((size) => (size - 1) >> 1) as Vec3);
  }

  /** Shows what the tools have changed in the label map, or its colours, or the mask of the threshold brush. */
  showLabels(changed: Partial<Omit<Overlays, 'opacity'>> = {}): void {
    if (!this.#overlays) return;
    this.#overlays = { ...this.#overlays, ...changed };
    this.#paint();
  }

  /** Shows other surfaces of labels, or none; their arrays are used without a copy until the next ones are shown. */
  showSurfaces(surfaces: Iterable<{ value: number; surface: Surface | undefined }>): void {
    for (const { value, surface } of surfaces) {
      const shown = this.#surfaces.get(value);
      if (surface) {
        const object = shown?.object ?? this.#newSurface(value);
        this.#surfaces.set(value, { object, surface });
        object.show(surface);
      } else if (shown) this.#drop(value, shown);
    }
    if (this.#options.outlines) this.#redraw();
    this.#viewport.invalidate();
  }

  /** The surfaces shown, by label. */
  surfaces(): Map<number, Surface> {
    return new Map(Array.from(this.#surfaces, ([label, { surface }]) => [label, surface]));
  }

  /** Sets the colours of the surfaces, and the labels whose surfaces are hidden. */
  setAppearance(colors: Map<number, string>, hidden: ReadonlySet<number>): void {
    this.#colors = colors;
    this.#hidden = hidden;
    for (const [label, { object }] of this.#surfaces) this.#dress(label, object);
    this.#viewport.invalidate();
  }

  /** The objects shown, for pictures and films. */
  get subject(): PictureSubject {
    return { viewport: this.#viewport, panels: () => this.#scene?.panels ?? [] };
  }

  setOptions(options: SegmentViewOptions): void {
    this.#options = options;
    for (const { object } of this.#surfaces.values()) object.edges = options.edges;
    this.#paint();
    this.#viewport.invalidate();
  }

  /** Sets the brush that is drawn around the pointer: its radius in world units, and whether it is a disc. */
  setBrush(brush: { radius: number; disc: boolean } | undefined): void {
    this.#brush = brush;
    this.#redraw();
  }

  /** Camera and crosshair, for a session. */
  get pose(): { camera: CameraPose; crosshair: Vec3 } {
    return { camera: this.#viewport.pose, crosshair: this.crosshair };
  }

  set pose({ camera, crosshair }) {
    this.goToVoxel(crosshair);
    this.#viewport.pose = camera;
  }

  /** Index of the voxel in which the three slices intersect. */
  get crosshair(): Vec3 {
    return [...this.#crosshair];
  }

  /** Moves the crosshair to a voxel, and with it the slices. */
  goToVoxel(index: Vec3): void {
    const dims = this.#scene?.volume.dims;
    if (dims) this.#moveTo(nearestVoxel(index, dims));
  }

  /** Moves the crosshair to the voxel nearest to a point in world space. */
  goTo(point: Vec3): void {
    if (this.#scene) this.goToVoxel(toWorld(this.#scene.inverse, point));
  }

  /** Moves on by a number of axial slices. */
  goAlong(slices: number): void {
    this.goToVoxel(this.#crosshair.map((x, axis) => (axis === this.axial ? x + slices : x)) as Vec3);
  }

  /** Voxel axis across the axial slices. */
  get axial(): Axis {
    return this.#scene?.panels.find(({ orientation }) => orientation.name === 'Axial')?.orientation.axis ?? 2;
  }

  /** Calls `then` when everything changed so far has been drawn in the 3D view. */
  afterDrawing(then: () => void): void {
    this.#viewport.changeAndDraw(() => setTimeout(then));
  }

  /** Releases all resources; the view cannot be used afterwards. */
  dispose(): void {
    this.#clear();
    this.#viewport.dispose();
  }

  #newSurface(label: number): SurfaceObject {
    const object = new SurfaceObject(this.#viewport.clipping);
    object.edgeColor = token('--wire');
    object.edges = this.#options.edges;
    this.#dress(label, object);
    this.#viewport.add(object.object);
    return object;
  }

  #dress(label: number, object: SurfaceObject): void {
    object.plainColor = this.#colorOf(label);
    object.object.visible = !this.#hidden.has(label);
  }

  #colorOf(label: number): string {
    return this.#colors.get(label) ?? '#888888';
  }

  #drop(label: number, { object }: Shown): void {
    this.#surfaces.delete(label);
    this.#outlines?.drop(label);
    this.#viewport.remove(object.object);
    object.dispose();
  }

  #moveTo(index: Vec3): void {
    const scene = this.#scene;
    if (!scene) return;
    const moved = ([0, 1, 2] as const).filter((axis) => this.#crosshair[axis] !== index[axis]);
    this.#crosshair = index;
    for (const axis of moved) this.#stale.add(axis);
    scene.moveTo(index);
  }

  /** Has all slices drawn again, with the labels as they are then. */
  #paint(): void {
    for (const axis of [0, 1, 2] as const) this.#stale.add(axis);
    this.#redraw();
  }

  /** Paints the labels of a slice if they may have changed: once for a frame, however many movements of the pen it has. */
  #refresh(panel: SlicePanel, picture: LabelPicture): void {
    const { axis } = panel.orientation;
    if (!this.#overlays || !this.#stale.delete(axis)) return;
    const counts = picture.paint({ ...this.#overlays, opacity: this.#options.opacity }, this.#crosshair[axis]);
    if (counts) panel.content = describe(counts, this.#overlays.names);
  }

  #redraw(): void {
    for (const panel of this.#scene?.panels ?? []) panel.draw();
  }

  #hover(at: Vec3 | undefined, axis: Axis): void {
    this.#pointer = at && { at, axis };
    if (this.#brush) this.#redraw();
  }

  #drawOver(panel: SlicePanel, context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    const picture = this.#pictures[panel.orientation.axis];
    if (!picture) return;
    this.#refresh(panel, picture);
    context.imageSmoothingEnabled = false;
    context.drawImage(picture.canvas, 0, 0, picture.canvas.width * scaleX, picture.canvas.height * scaleY);
    if (this.#options.outlines) this.#drawOutlines(panel, context, scaleX, scaleY);
    this.#drawBrush(panel, context, scaleX, scaleY);
  }

  /** Draws the outlines of the visible surfaces, each in the colour of its label. */
  #drawOutlines(panel: SlicePanel, ...canvas: [CanvasRenderingContext2D, number, number]): void {
    const index = this.#crosshair[panel.orientation.axis];
    for (const [label, { surface }] of this.#surfaces) {
      if (this.#hidden.has(label)) continue;
      this.#outlines?.draw(panel, index, label, surface, this.#colorOf(label), ...canvas);
    }
  }

  /** Draws the outline of the brush: on all slices that it reaches, or for a disc on the one under the pointer. */
  #drawBrush(panel: SlicePanel, context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    const { volume } = this.#scene ?? {};
    const { axis, horizontal, vertical } = panel.orientation;
    if (!this.#brush || !this.#pointer || !volume || (this.#brush.disc && axis !== this.#pointer.axis)) return;
    const { at } = this.#pointer;
    const off = (at[axis] - this.#crosshair[axis]) * volume.spacing[axis];
    const radius = Math.sqrt(this.#brush.radius ** 2 - off ** 2);
    if (!(radius > 0)) return;
    const [x, y] = [horizontal, vertical].map(
      (side) => (side.flip ? volume.dims[side.axis] - 1 - at[side.axis] : at[side.axis]) + 0.5,
    ) as [number, number];
    context.beginPath();
    context.ellipse(
      x * scaleX,
      y * scaleY,
      (radius / volume.spacing[horizontal.axis]) * scaleX,
      (radius / volume.spacing[vertical.axis]) * scaleY,
      0,
      0,
      2 * Math.PI,
    );
    // A light line on a dark one is visible on any intensity.
    for (const [width, color] of [
      [3, '#000a'],
      [1.2, '#fff'],
    ] as const) {
      context.lineWidth = width;
      context.strokeStyle = color;
      context.stroke();
    }
  }

  /** Makes the label whose surface was clicked known, and moves the crosshair there. */
  #pick(ray: Raycaster): void {
    const scene = this.#scene;
    if (!scene) return;
    const hits = [...this.#surfaces].flatMap(([label, { object }]) => {
      const hit = this.#hidden.has(label) ? undefined : object.hit(ray);
      return hit ? [{ label, hit }] : [];
    });
    const [first] = hits.sort((one, other) => one.hit.distance - other.hit.distance);
    if (!first) return;
    const point = this.#viewport.toWorld(first.hit.point).toArray();
    this.goToVoxel(toWorld(scene.inverse, point));
    this.#events.onPick(first.label);
  }

  #recolor(): void {
    for (const { object } of this.#surfaces.values()) object.edgeColor = token('--wire');
    this.#redraw();
    this.#viewport.invalidate();
  }

  #clear(): void {
    for (const [label, shown] of [...this.#surfaces]) this.#drop(label, shown);
    this.#scene?.dispose();
    this.#scene = undefined;
    this.#pictures = [];
    this.#outlines = undefined;
    this.#pointer = undefined;
  }
}

/** Describes the labels in a slice, for screen readers. */
function describe(counts: ReadonlyMap<number, number>, names: ReadonlyMap<number, string>): string {
  const known = [...counts].filter(([label]) => names.has(label));
  if (known.length === 0) return text('segment.sliceEmpty');
  const labels = known.map(([label, voxels]) =>
    text('segment.sliceLabel', { name: names.get(label) ?? '', voxels: count(voxels) }),
  );
  return text('segment.sliceLabels', { labels: labels.join(', ') });
}
