import { Box3, Plane, type Raycaster, Vector3 } from 'three';
import type { PointArray, Surface, Vec3 } from '../../engine/protocol';
import { token } from '../../kit/dom';
import { PointCloud } from '../../scene/cloud';
import { EditedView } from '../../scene/edited-view';
import { Legend } from '../../scene/legend';
import type { PictureSubject } from '../../scene/pictures';
import type { PinholeCamera } from '../../scene/pinhole';
import { diverging, isQuantity, QUANTITIES, quantityTitle } from '../../scene/shading';
import { SurfaceObject } from '../../scene/surface';
import { type CameraPose, Viewport } from '../../scene/viewport';
import { CameraMarks } from './cameras';
import type { CloudViewOptions } from './view';

/** Fraction of the points ignored at either end of each axis when the view is fitted, so that outliers do not count. */
const OUTLIER_FRACTION = 0.02;
/**
 * Diameter of a point's disc, as a fraction of the diagonal of the points' bounding box: two to three pixels. Smaller
 * discs are hard to see, larger ones hide the surface.
 */
const DISC = 0.014;
/** Number of points above which their discs are drawn smaller, so that they do not cover everything. */
const MANY = 10_000;
const CAMERA_LENGTH = 0.12;

/** Points to show in the Reconstruct lab's 3D view, their cameras, and the orientation of the view. */
export interface ShownCloud {
  points: PointArray;
  /** Colours of the points, packed sRGB, 0..1; missing if there are none. */
  colors?: Float32Array | undefined;
  cameras: readonly PinholeCamera[];
  up: 'y' | 'z';
  /** Side shown at first: 1 for objects that face −y, or z where y is up; −1 for the opposite side. */
  front: 1 | -1;
}

/** Position of a click in the Reconstruct lab's 3D view, in world space, for editing points. */
export interface Hit {
  point: Vec3;
  /** Outward normal of the surface at the point; missing if the click missed the surface. */
  normal?: Vec3;
}

/** The 3D view of the Reconstruct lab: points, constraints, cameras and the surface. */
export class ReconstructionView {
  readonly #viewport: Viewport;
  readonly #surface = new SurfaceObject();
  readonly #points = new PointCloud();
  readonly #inside = new PointCloud();
  readonly #outside = new PointCloud();
  readonly #addedByHand = new PointCloud();
  readonly #outsideByHand = new PointCloud();
  readonly #cameras = new CameraMarks();
  readonly legend = new Legend(diverging);
  /** Shows an edited surface in place of the reconstructed one. */
  readonly editing: EditedView;
  /** Called with the position of a click on the surface or beside it; undefined if clicks have no effect. */
  onPick: ((hit: Hit) => void) | undefined;
  #options: CloudViewOptions;
  #box = new Box3();
  #hasSurface = false;
  #front: 1 | -1 = 1;

  constructor(canvas: HTMLCanvasElement, options: CloudViewOptions) {
    this.#viewport = new Viewport(canvas);
    this.#options = options;
    for (const { object } of [this.#surface, ...this.#clouds, this.#cameras]) this.#viewport.add(object);
    this.#viewport.add(this.#cameras.chosenObject);
    this.#viewport.onClick = (ray) => this.#pick(ray);
    this.editing = new EditedView(this.#viewport, this.#surface, () => this.#showLegend());
    this.#viewport.onDraw = (_, hurried) => {
      this.#surface.coarse = hurried;
    };
    this.#recolor();
    this.#viewport.onScheme = () => this.#recolor();
  }

  /** Callback for when the view leaves the pose of a photograph's camera. */
  set onLeave(callback: () => void) {
    this.#viewport.onLeave = callback;
  }

  /** Shows other points and discards everything that belonged to the previous ones. */
  setCloud({ points, colors, cameras, up, front }: ShownCloud): void {
    this.#box = robustBox(points);
    const length = this.#box.getSize(new Vector3()).length();
    const disc = DISC * length * Math.min(1, Math.sqrt((3 * MANY) / points.length));
    for (const cloud of [this.#points, this.#inside]) cloud.size = disc;
    this.#outside.size = 1.6 * DISC * length;
    for (const cloud of [this.#addedByHand, this.#outsideByHand]) cloud.size = 3 * DISC * length;
    this.#cameras.show(cameras, CAMERA_LENGTH * length);
    this.#viewport.up = up;
    this.#front = front;
    this.showPoints(points, colors);
    this.showByHand([], []);
    this.showConstraints(new Float32Array(0), new Float32Array(0));
    this.clearSurface();
    this.#fitView();
  }

  showPoints(points: PointArray, colors: Float32Array | undefined): void {
    this.#points.show(points, colors);
    this.#viewport.invalidate();
  }

  /** Shows the user's edits of the points, emphasised: points added, and points marked as outside. */
  showByHand(added: readonly Vec3[], outside: readonly Vec3[]): void {
    this.#addedByHand.show(added.flat());
    this.#outsideByHand.show(outside.flat());
    this.#viewport.invalidate();
  }

  showConstraints(surface: PointArray, exterior: PointArray): void {
    this.#inside.show(surface);
    this.#outside.show(exterior);
    this.#viewport.invalidate();
  }

  showSurface(surface: Surface): void {
    this.#hasSurface = true;
    this.#surface.show(surface);
    this.setOptions(this.#options);
  }

  clearSurface(): void {
    this.#hasSurface = false;
    this.setOptions(this.#options);
  }

  /** Pose of the camera. */
  get pose(): CameraPose {
    return this.#viewport.pose;
  }

  set pose(pose: CameraPose) {
    this.#viewport.pose = pose;
  }

  /** The objects shown, for pictures and films. */
  get subject(): PictureSubject {
    return { viewport: this.#viewport, legend: this.legend };
  }

  setOptions(options: CloudViewOptions): void {
    const refit = options.cameras !== this.#options.cameras;
    this.#options = { ...options };
    this.#surface.solid = options.surface && this.#hasSurface;
    this.#surface.edges = options.edges && this.#hasSurface;
    this.#surface.color = options.color;
    // The points' own colours would hide the kinds of constraints.
    this.#points.object.visible = options.points && !options.constraints;
    this.#inside.object.visible = options.constraints;
    this.#outside.object.visible = options.constraints;
    for (const { object } of [this.#addedByHand, this.#outsideByHand])
      object.visible = options.points || options.constraints;
    this.#cameras.visible = options.cameras;
    this.#showLegend();
    if (refit) this.#fitView();
    this.#viewport.invalidate();
  }

  /**
   * Sets the view to the pose of a camera and highlights the pyramid of the camera with this index; undefined returns
   * to free rotation.
   */
  lookThrough(camera: PinholeCamera | undefined, index: number | undefined): void {
    this.#cameras.choose(index);
    // Photographs contain shading already: next to one, colours are shown unlit.
    this.#surface.lit = camera === undefined;
    this.#viewport.lookThrough(camera);
    this.#viewport.invalidate();
  }

  /** Diagonal of the bounding box of the points without outliers, in world units. */
  get size(): number {
    return this.#box.getSize(new Vector3()).length();
  }

  dispose(): void {
    this.editing.dispose();
    for (const part of [this.#surface, ...this.#clouds, this.#cameras]) part.dispose();
    this.#viewport.dispose();
  }

  get #clouds(): PointCloud[] {
    return [this.#points, this.#inside, this.#outside, this.#addedByHand, this.#outsideByHand];
  }

  #fitView(): void {
    const box = this.#box.clone();
    if (this.#options.cameras) for (const centre of this.#cameras.centres) box.expandByPoint(centre);
    if (!box.isEmpty()) this.#viewport.fitBox(box, this.#front);
  }

  /**
   * Reports the point at which a ray intersects the surface or else the plane perpendicular to the ray through the
   * centre of the points' bounding box.
   */
  #pick(ray: Raycaster): void {
    if (!this.onPick) return;
    const [hit] = this.#hasSurface ? ray.intersectObject(this.#surface.target, false) : [];
    const point = hit?.point ?? this.#onMiddle(ray);
    if (!point) return;
    const normal = hit?.face?.normal.toArray();
    this.onPick({ point: this.#viewport.toWorld(point).toArray(), ...(normal && { normal }) });
  }

  #onMiddle({ ray }: Raycaster): Vector3 | null {
    const middle = this.#viewport.fromWorld(this.#box.getCenter(new Vector3()));
    return ray.intersectPlane(new Plane().setFromNormalAndCoplanarPoint(ray.direction, middle), new Vector3());
  }

  #showLegend(): void {
    const { color, surface } = this.#options;
    const { range } = this.#surface;
    if (surface && range > 0 && isQuantity(color))
      this.legend.show({ ...QUANTITIES[color], title: quantityTitle(color, '') }, range);
    else this.legend.hide();
  }

  #recolor(): void {
    this.#surface.edgeColor = token('--wire');
    this.#points.color = token('--point');
    this.#inside.color = token('--point');
    this.#outside.color = token('--exterior');
    this.#addedByHand.color = token('--attractor');
    this.#outsideByHand.color = token('--exterior');
    this.#cameras.colors = { all: token('--muted'), chosen: token('--outline') };
    this.#viewport.invalidate();
  }
}

/**
 * Returns the bounding box of the points without the outermost {@link OUTLIER_FRACTION} at either end of each axis,
 * enlarged on all sides by 3 % of its diagonal.
 */
function robustBox(points: PointArray): Box3 {
  const box = new Box3();
  const count = points.length / 3;
  const [low, high] = [new Vector3(), new Vector3()];
  for (let axis = 0; axis < 3; axis++) {
    const sorted = Float64Array.from({ length: count }, (_, i) => points[3 * i + axis] ?? 0).sort();
    const [first, last] = [Math.floor(OUTLIER_FRACTION * (count - 1)), Math.ceil((1 - OUTLIER_FRACTION) * (count - 1))];
    low.setComponent(axis, sorted[first] ?? 0);
    high.setComponent(axis, sorted[last] ?? 0);
  }
  box.set(low, high);
  // Compensates for the points cut off at the ends of a set without outliers.
  return box.expandByScalar(0.03 * box.getSize(new Vector3()).length());
}
