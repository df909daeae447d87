import { Box3, Group, type Raycaster, type Texture, Vector3 } from 'three';
import type { Surface, Vec3 } from '../../engine/protocol';
import { token } from '../../kit/dom';
import { EditedView } from '../../scene/edited-view';
import { Legend } from '../../scene/legend';
import type { PictureSubject } from '../../scene/pictures';
import { diverging, isQuantity, QUANTITIES, quantityTitle } from '../../scene/shading';
import { SurfaceObject } from '../../scene/surface';
import { type CameraPose, Viewport } from '../../scene/viewport';
import { text } from '../../texts';
import { boxOf } from './ellipsoids';
import { EllipsoidHandles, type HandleMode } from './handles';
import type { ControlEllipsoid, Layout, Pose } from './protocol';
import type { SculptViewOptions } from './view';

/** Distance between the centres of adjacent meshes shown in a row, relative to their width. */
const ROW_SPACING = 1.25;
/**
 * Tangent of the angle by which the initial view is rotated to the side; small, so that a face is seen almost from the
 * front.
 */
const VIEW_ANGLE = 0.35;

/**
 * Names of the meshes that the Sculpt lab's view can show: as in the paper, with `dash` for the prime of the deformed
 * ones, and A to E for up to five stages of a computation.
 */
const MESHES = ['S1', 'S0', 'T', 'S0dash', 'S1dash', 'A', 'B', 'C', 'D', 'E'] as const;
type MeshName = (typeof MESHES)[number];

/** Names of the meshes that show the stages of a computation, from left to right. */
const STAGES: readonly MeshName[] = ['A', 'B', 'C', 'D', 'E'];
const ROWS: Record<Exclude<Layout, 'stages' | 'levels'>, readonly MeshName[]> = {
  result: ['S1dash'],
  base: ['S0dash'],
  pair: ['S0dash', 'S1dash'],
  row: ['S1', 'S0', 'T', 'S0dash', 'S1dash'],
};

/** Captions of the meshes shown in a row; those of the stages A to E come with the stages. */
const CAPTIONS: Partial<Record<MeshName, string>> = {
  S1: text('view.meshOriginal'),
  S0: text('view.meshBase'),
  T: text('view.meshLink'),
  S0dash: text('view.meshDeformedBase'),
  S1dash: text('view.meshResult'),
};

/**
 * The 3D view of the Sculpt lab: the surface with its control ellipsoids, or a row of the meshes it is computed from.
 */
export class SculptureView {
  readonly legend = new Legend(diverging);
  /** Shows an edited surface in place of the deformed one. */
  readonly editing: EditedView;
  readonly handles: EllipsoidHandles;
  /** Called when the view is clicked, with the index of the ellipsoid there, or undefined if there is none. */
  onPick: (index: number | undefined) => void = () => undefined;
  /**
   * Called whenever the captions of the meshes in the row may have changed; with an empty list if a single mesh is
   * shown.
   */
  onCaptions: (captions: string[]) => void = () => undefined;
  readonly #viewport: Viewport;
  readonly #meshes = new Map<MeshName, { holder: Group; surface: SurfaceObject; has: boolean }>();
  #options: SculptViewOptions;
  /** Captions of the stages of a computation that are shown, from left to right. */
  #stages: string[] = [];
  /** Whether the scene's upward axis is y, not z. */
  #upright = false;
  #box = new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));

  constructor(canvas: HTMLCanvasElement, options: SculptViewOptions) {
    this.#viewport = new Viewport(canvas);
    this.#options = options;
    for (const name of MESHES) {
      const mesh = { holder: new Group(), surface: new SurfaceObject(), has: false };
      mesh.holder.add(mesh.surface.object);
      this.#meshes.set(name, mesh);
      this.#viewport.add(mesh.holder);
    }
    this.handles = new EllipsoidHandles(this.#viewport.addHandles());
    this.handles.onHover = (hovered) => canvas.toggleAttribute('data-handle', hovered);
    this.#viewport.add(this.handles.object);
    this.#viewport.onClick = (ray) => this.#pick(ray);
    const deformed = this.#meshes.get('S1dash')?.surface ?? new SurfaceObject();
    this.editing = new EditedView(this.#viewport, deformed, () => this.#showLegend());
    this.#viewport.onDraw = (_, hurried) => {
      for (const { surface } of this.#meshes.values()) surface.coarse = hurried;
      this.#placeInRow();
    };
    this.#recolor();
    this.#viewport.onScheme = () => this.#recolor();
  }

  /**
   * Handler called first for key events, with the directions in the scene to the right, upwards and towards the viewer;
   * returns whether it has handled the key, which the view then ignores.
   */
  set takesKey(takes: (event: KeyboardEvent, directions: Vec3[]) => boolean) {
    this.#viewport.takesKey = (event) =>
      takes(
        event,
        this.#viewport.directions().map((direction) => direction.toArray()),
      );
  }

  /** Pose of the camera. */
  get pose(): CameraPose {
    return this.#viewport.pose;
  }

  set pose(pose: CameraPose) {
    this.#viewport.pose = pose;
  }

  /**
   * Opens another scene and discards everything of the previous one. `box` is the bounding box of the surface in the
   * pose `start` of the ellipsoids; the view is fitted to the surface in this pose and in all `poses`.
   */
  setScene(box: { min: Vec3; max: Vec3 }, up: 'y' | 'z', start: Pose, poses: Pose[]): void {
    this.#box = boxOfAllPoses(box, start, poses);
    this.#viewport.up = up;
    this.#upright = up === 'y';
    for (const mesh of this.#meshes.values()) mesh.has = false;
    this.#stages = [];
    this.setOptions(this.#options);
    this.#fitView();
  }

  /**
   * Shows a surface as the mesh `name`, or does nothing without one; its arrays are used without a copy until the next
   * one is shown.
   */
  show(name: MeshName, surface: Surface | undefined): void {
    const mesh = this.#meshes.get(name);
    if (!mesh || !surface) return;
    mesh.surface.show(surface);
    if (!mesh.has) {
      mesh.has = true;
      this.#apply();
    }
    this.#showLegend();
    this.#viewport.invalidate();
  }

  /** Moves the vertices of a surface that is shown to other positions, packed xyz, until the next surface is shown. */
  move(name: MeshName, positions: Float32Array): void {
    this.#meshes.get(name)?.surface.move(positions);
    this.#viewport.invalidate();
  }

  /** Shows stages of a computation as meshes in a row, with their captions. */
  showStages(stages: { caption: string; surface: Surface }[]): void {
    const refit = stages.length !== this.#stages.length;
    this.#stages = stages.map(({ caption }) => caption);
    for (const [index, name] of STAGES.entries()) {
      const mesh = this.#meshes.get(name);
      if (mesh) mesh.has = index < stages.length;
      this.show(name, stages[index]?.surface);
    }
    this.#apply();
    if (refit) this.#fitView();
  }

  /** Calls `change` at the next animation frame, and renders the scene in the same frame. */
  change(change: () => void): void {
    this.#viewport.changeAndDraw(change);
  }

  /** Texture of all meshes shown that have texture coordinates; null for none. */
  set texture(texture: Texture | null) {
    for (const { surface } of this.#meshes.values()) surface.texture = texture;
    this.#viewport.invalidate();
  }

  showEllipsoids(ellipsoids: ControlEllipsoid[], chosen: number | undefined): void {
    this.handles.show(ellipsoids, chosen);
    this.#viewport.invalidate();
  }

  set mode(mode: HandleMode) {
    this.handles.mode = mode;
    this.#viewport.invalidate();
  }

  /** The objects shown, for pictures and films. */
  get subject(): PictureSubject {
    return { viewport: this.#viewport, legend: this.legend };
  }

  setOptions(options: SculptViewOptions): void {
    const refit = options.layout !== this.#options.layout;
    this.#options = { ...options };
    this.#apply();
    if (refit) this.#fitView();
  }

  /** Diagonal of the estimated bounding box of the surface in all poses with which the scene was opened. */
  get size(): number {
    return this.#box.getSize(new Vector3()).length();
  }

  /** Centre of the estimated bounding box of the surface in all poses with which the scene was opened. */
  get middle(): Vec3 {
    return this.#box.getCenter(new Vector3()).toArray();
  }

  dispose(): void {
    this.handles.dispose();
    for (const { surface } of this.#meshes.values()) surface.dispose();
    this.#viewport.dispose();
  }

  #apply(): void {
    const { layout, edges, ellipsoids, color } = this.#options;
    const row = this.#row;
    const staged = layout === 'stages' || layout === 'levels';
    for (const [name, { surface, has }] of this.#meshes) {
      const on = has && row.includes(name);
      // The base meshes are always shown with their edges.
      const isBase = name === 'S0' || name === 'T' || name === 'S0dash' || staged;
      surface.solid = on;
      surface.edges = on && (edges || (isBase && layout !== 'result'));
      surface.color = name === 'S1' || name === 'S0' ? 'plain' : color;
    }
    this.handles.visible = ellipsoids && !staged;
    this.onCaptions(staged ? this.#stages : row.length > 1 ? row.map((name) => CAPTIONS[name] ?? '') : []);
    this.#showLegend();
    this.#viewport.invalidate();
  }

  /**
   * Places the meshes of the row side by side along the view's horizontal direction, and the handles at the mesh they
   * deform.
   */
  #placeInRow(): void {
    const row = this.#row;
    const [right] = this.#viewport.directions();
    const apart = ROW_SPACING * this.#width;
    for (const [name, { holder }] of this.#meshes) {
      const at = row.indexOf(name) - (row.length - 1) / 2;
      holder.position.copy(right).multiplyScalar(row.includes(name) ? at * apart : 0);
    }
    const carrier = row.includes('S1dash') ? 'S1dash' : 'S0dash';
    const place = this.#meshes.get(carrier)?.holder.position;
    if (place) this.handles.object.position.copy(place);
  }

  get #row(): readonly MeshName[] {
    const { layout } = this.#options;
    return layout === 'stages' || layout === 'levels'
      ? STAGES.slice(0, Math.max(1, this.#stages.length))
      : ROWS[layout];
  }

  get #width(): number {
    const size = this.#box.getSize(new Vector3());
    // Width of an ellipse seen at this angle.
    const turn = Math.atan(VIEW_ANGLE);
    return Math.hypot(size.x * Math.cos(turn), (this.#upright ? size.z : size.y) * Math.sin(turn));
  }

  #fitView(): void {
    const { length } = this.#row;
    const box = this.#box.clone();
    const { aspect } = this.#viewport;
    // A row is wider than one mesh by the aspect of the view; the rest is compensated by distance.
    const wider = Math.max(1, (ROW_SPACING * length * this.#width) / (this.size * Math.max(1, aspect)));
    const [middle, half] = [box.getCenter(new Vector3()), box.getSize(new Vector3()).multiplyScalar(wider / 2)];
    box.set(middle.clone().sub(half), middle.clone().add(half));
    this.#viewport.fitBox(box, 1, VIEW_ANGLE);
  }

  #pick(ray: Raycaster): void {
    if (!this.handles.hovered) this.onPick(this.handles.pick(ray));
  }

  #showLegend(): void {
    const { color } = this.#options;
    const ranges = this.#row.map((name) => this.#meshes.get(name)?.surface.range ?? 0);
    const range = Math.max(...ranges);
    if (range > 0 && isQuantity(color))
      this.legend.show({ ...QUANTITIES[color], title: quantityTitle(color, '') }, range);
    else this.legend.hide();
  }

  #recolor(): void {
    for (const { surface } of this.#meshes.values()) surface.edgeColor = token('--wire');
    this.handles.color = token('--attractor');
    this.#viewport.invalidate();
  }
}

/**
 * Returns an estimated bounding box of the surface in the pose `start` of the ellipsoids, where it is `box`, and in all
 * `poses`, with the same margin around the ellipsoids as in the start pose; the view is fitted to it.
 */
function boxOfAllPoses(box: { min: Vec3; max: Vec3 }, start: Pose, poses: Pose[]): Box3 {
  const all = new Box3(new Vector3(...box.min), new Vector3(...box.max));
  const first = boxOf(start);
  for (const pose of poses) {
    const { min, max } = boxOf(pose);
    const corner = (at: Vec3, from: Vec3, of: Vec3) =>
      new Vector3(...of.map((x, k) => x + (at[k] ?? 0) - (from[k] ?? 0)));
    all.expandByPoint(corner(min, first.min, box.min)).expandByPoint(corner(max, first.max, box.max));
  }
  return all;
}
