import {
  Group,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Object3D,
  Quaternion,
  type Raycaster,
  SphereGeometry,
  Vector3,
  WireframeGeometry,
} from 'three';
import type { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { ControlEllipsoid } from './protocol';

/** The transformation of an ellipsoid that dragging a handle applies. */
export type HandleMode = 'move' | 'turn' | 'size';

const MODES = { move: 'translate', turn: 'rotate', size: 'scale' } as const;
/**
 * Opacity of the surface of an ellipsoid that is not selected: high enough to find it, low enough to see through it.
 */
const ELLIPSOID_OPACITY = 0.05;
/** Opacity of the surface of the selected ellipsoid. */
const SELECTED_OPACITY = 0.16;
/** Opacity of the ellipsoids' wireframes. */
const WIRE_OPACITY = 0.13;

/**
 * Control ellipsoids in the 3D view, transparent and visible through the surface, with transform handles on the
 * selected one.
 */
export class EllipsoidHandles {
  readonly object = new Group();
  /** Called with the selected ellipsoid's new pose while a handle is dragged, and once more when it is released. */
  onDrag: (ellipsoid: ControlEllipsoid, dragging: boolean) => void = () => undefined;
  /** Called when a handle is pressed, before it is moved. */
  onDragStart: () => void = () => undefined;
  /** Called when the pointer enters or leaves a handle. */
  onHover: (hovered: boolean) => void = () => undefined;
  readonly #handles: TransformControls;
  readonly #ball = new SphereGeometry(1, 32, 20);
  readonly #wireframe = new WireframeGeometry(new SphereGeometry(1, 16, 8));
  readonly #material = transparentMaterial(ELLIPSOID_OPACITY);
  readonly #selectedMaterial = transparentMaterial(SELECTED_OPACITY);
  readonly #lines = new LineBasicMaterial({ transparent: true, opacity: WIRE_OPACITY, depthTest: false });
  /** The object the handles are attached to: it receives position, rotation and scale of the selected ellipsoid. */
  readonly #proxy = new Object3D();
  readonly #marks = new Group();
  #ellipsoids: ControlEllipsoid[] = [];
  #chosen: number | undefined;

  constructor(handles: TransformControls) {
    this.#handles = handles;
    this.object.add(this.#proxy, this.#marks);
    handles.setSpace('local');
    handles.addEventListener('axis-changed', () => this.onHover(handles.axis !== null));
    handles.addEventListener('objectChange', () => this.#moved(true));
    handles.addEventListener('mouseDown', () => this.onDragStart());
    handles.addEventListener('mouseUp', () => this.#moved(false));
    this.#placeHandles();
  }

  set mode(mode: HandleMode) {
    this.#handles.setMode(MODES[mode]);
    // Along the world axes a rotated ellipsoid is easier to move.
    this.#handles.setSpace(mode === 'move' ? 'world' : 'local');
  }

  set color(color: string) {
    for (const material of [this.#material, this.#selectedMaterial, this.#lines]) material.color.set(color);
  }

  /** Whether a handle is being dragged. */
  get dragging(): boolean {
    return this.#handles.dragging;
  }

  /** Whether the pointer is over a handle, so that a click does not select the ellipsoid behind it. */
  get hovered(): boolean {
    return this.#handles.axis !== null;
  }

  set visible(visible: boolean) {
    this.object.visible = visible;
    this.#placeHandles();
  }

  /** Shows the ellipsoids; the handles are attached to the one with the index `chosen`. */
  show(ellipsoids: ControlEllipsoid[], chosen: number | undefined): void {
    this.#ellipsoids = ellipsoids;
    this.#chosen = chosen !== undefined && chosen < ellipsoids.length ? chosen : undefined;
    while (this.#marks.children.length > ellipsoids.length) this.#marks.children.pop();
    while (this.#marks.children.length < ellipsoids.length) this.#marks.add(this.#mark());
    ellipsoids.forEach((ellipsoid, index) => {
      const mark = this.#marks.children[index];
      const solid = mark?.children[0] as Mesh | undefined;
      if (!mark || !solid) return;
      mark.matrix.copy(matrixOf(ellipsoid));
      mark.matrixWorldNeedsUpdate = true;
      solid.material = index === this.#chosen ? this.#selectedMaterial : this.#material;
    });
    if (!this.dragging) this.#placeHandles();
  }

  /**
   * Returns the index of the ellipsoid that a ray intersects first; undefined if it intersects none or they are hidden.
   */
  pick(ray: Raycaster): number | undefined {
    if (!this.object.visible) return undefined;
    const solids = this.#marks.children.flatMap(({ children: [solid] }) => (solid ? [solid] : []));
    const [hit] = ray.intersectObjects(solids, false);
    const index = hit ? solids.indexOf(hit.object) : -1;
    return index < 0 ? undefined : index;
  }

  dispose(): void {
    this.#handles.detach();
    this.#handles.dispose();
    for (const part of [this.#ball, this.#wireframe, this.#material, this.#selectedMaterial, this.#lines])
      part.dispose();
  }

  #mark(): Group {
    const mark = new Group();
    mark.matrixAutoUpdate = false;
    const solid = new Mesh(this.#ball, this.#material);
    const net = new LineSegments(this.#wireframe, this.#lines);
    // Rendered after the surface, which does not hide them.
    solid.renderOrder = 1;
    net.renderOrder = 2;
    mark.add(solid, net);
    return mark;
  }

  #placeHandles(): void {
    const ellipsoid = this.#chosen === undefined ? undefined : this.#ellipsoids[this.#chosen];
    if (!ellipsoid || !this.object.visible) {
      this.#handles.detach();
      return;
    }
    matrixOf(ellipsoid).decompose(this.#proxy.position, this.#proxy.quaternion, this.#proxy.scale);
    this.#handles.attach(this.#proxy);
  }

  #moved(dragging: boolean): void {
    if (this.#chosen === undefined) return;
    // Negative factors, from scaling through the centre, would turn the ellipsoid inside out.
    const { scale } = this.#proxy;
    scale.set(Math.abs(scale.x), Math.abs(scale.y), Math.abs(scale.z)).max(TINY);
    this.onDrag(ellipsoidOf(this.#proxy), dragging);
  }
}

const TINY = new Vector3(1, 1, 1).multiplyScalar(1e-6);

function transparentMaterial(opacity: number): MeshBasicMaterial {
  return new MeshBasicMaterial({ transparent: true, opacity, depthTest: false, depthWrite: false });
}

function matrixOf({ center, axes }: ControlEllipsoid): Matrix4 {
  const [x, y, z] = axes.map((axis) => new Vector3(...axis)) as [Vector3, Vector3, Vector3];
  return new Matrix4().makeBasis(x, y, z).setPosition(...center);
}

function ellipsoidOf({ position, quaternion, scale }: Object3D): ControlEllipsoid {
  const axis = (x: number, y: number, z: number, length: number) =>
    new Vector3(x, y, z).applyQuaternion(new Quaternion().copy(quaternion)).multiplyScalar(length).toArray();
  return {
    center: position.toArray(),
    axes: [axis(1, 0, 0, scale.x), axis(0, 1, 0, scale.y), axis(0, 0, 1, scale.z)],
  };
}
