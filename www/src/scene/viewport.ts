import {
  Box3,
  DirectionalLight,
  Group,
  HemisphereLight,
  Matrix4,
  type Object3D,
  PerspectiveCamera,
  type Plane,
  Raycaster,
  Scene,
  Spherical,
  Vector2,
  Vector3,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { Vec3 } from '../engine/protocol';
import { onSchemeChange } from '../kit/dom';
import { anatomicalSigns, type Grid } from './anatomy';
import { applyPinhole, type PinholeCamera } from './pinhole';
import { WebGlRendering } from './rendering';
import { CUT_LAYER } from './surface';

const FIELD_OF_VIEW = 30;
/** Rotation of the view by one press of an arrow key, radians. */
const KEY_ROTATION = 0.12;
/** Factor by which the − key increases the distance of the camera, and the + key reduces it. */
const KEY_ZOOM = 1.12;
/**
 * Largest distance in CSS pixels between pointer down and up that counts as a click; beyond it the pointer rotates the
 * view.
 */
const CLICK_TOLERANCE = 4;

/** Pose of the orbit camera in a square view, in the scene's coordinates. */
export interface CameraPose {
  position: Vec3;
  /** The point that the camera looks at and rotates around. */
  target: Vec3;
}

/** A 3D view: a canvas, an orbit camera for mouse, touch and keyboard, and lights attached to the camera. */
export class Viewport {
  readonly canvas: HTMLCanvasElement;
  readonly #rendering: WebGlRendering;
  readonly #scene = new Scene();
  /** Parent of all objects shown, rotated so that their upward axis is the scene's z, as the orbit camera needs it. */
  readonly #world = new Group();
  readonly #camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 1, 1000);
  /** Camera in use while the view has the pose and projection of a photograph's camera. */
  readonly #photoCamera = new PerspectiveCamera();
  /** Lights that move with the camera. */
  readonly #lamp = new Group();
  readonly #controls: OrbitControls;
  readonly #observer = new ResizeObserver(() => this.#resize());
  readonly #spherical = new Spherical();
  /**
   * Called before each rendering, with the position of the orbit camera. `interactive`: whether the view is being
   * rotated without a GPU, so that simplified objects should be drawn.
   */
  onDraw: (viewer: Vector3, interactive: boolean) => void = () => undefined;
  /** Called after each rendering, while the canvas still holds it. */
  onDrawn: () => void = () => undefined;
  /** Called with the ray from the camera through the point of the view that was clicked. */
  onClick: (ray: Raycaster) => void = () => undefined;
  /** Handler called first for key events; returns true if it has handled the key, which the view then ignores. */
  takesKey: (event: KeyboardEvent) => boolean = () => false;
  /** Called when the view leaves the pose of a photograph's camera. */
  onLeave: () => void = () => undefined;
  /** Called when the user's preference for a light or dark scheme changes. */
  onScheme: () => void = () => undefined;
  readonly #ignoreScheme = onSchemeChange(() => this.onScheme());
  /** Planes beyond which surfaces made with them are not drawn; see {@link cut}. */
  readonly clipping: Plane[] = [];
  #through: PinholeCamera | undefined;
  /** Whether a pointer or the wheel is in use, so that camera motion comes from the user. */
  #dragged = false;
  /** Whether the camera has moved during the current drag. */
  #rotating = false;
  #disposed = false;
  #pending = 0;
  /** Functions to call before the next rendering, which change the objects shown. */
  readonly #changes: (() => void)[] = [];
  #home = { position: new Vector3(), target: new Vector3() };
  /**
   * Aspect ratio of the view, at most 1, by which the camera's distance is divided: in a narrow view the camera is
   * farther away.
   */
  #cappedAspect = 1;
  /** Size of renderings in pixels while it is not that of the canvas on the page. */
  #fixedSize: readonly [number, number] | undefined;

  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    this.#rendering = new WebGlRendering(canvas, () => this.invalidate());
    this.#camera.up.set(0, 0, 1);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener('change', () => this.#moved());
    this.#controls.addEventListener('start', () => this.#setDragged(true));
    this.#controls.addEventListener('end', () => this.#setDragged(false));
    this.#photoCamera.matrixAutoUpdate = false;
    this.#lamp.matrixAutoUpdate = false;
    this.#scene.add(this.#world);
    canvas.addEventListener('keydown', (event) => this.#onKey(event));
    this.#listenForClicks();
    this.#addLights();
    this.#observer.observe(canvas);
  }

  add(object: Object3D): void {
    this.#world.add(object);
  }

  remove(object: Object3D): void {
    this.#world.remove(object);
  }

  /**
   * Creates handles to move, rotate and scale one of the objects shown; the view does not rotate while a handle is
   * dragged.
   */
  addHandles(): TransformControls {
    const handles = new TransformControls(this.#camera, this.canvas);
    handles.addEventListener('change', () => this.invalidate());
    handles.addEventListener('dragging-changed', ({ value }) => {
      this.#controls.enabled = value !== true;
    });
    this.#scene.add(handles.getHelper());
    return handles;
  }

  /**
   * Returns the orbit camera's axes in the coordinates of the objects shown: to the right, upwards, towards the viewer.
   */
  directions(): [Vector3, Vector3, Vector3] {
    this.#camera.updateMatrixWorld();
    const inverse = this.#world.matrixWorld.clone().invert();
    const axis = (index: number) =>
      new Vector3().setFromMatrixColumn(this.#camera.matrixWorld, index).transformDirection(inverse);
    return [axis(0), axis(1), axis(2)];
  }

  /** Axis of the coordinates of the objects shown that points upwards in the view. */
  set up(axis: 'y' | 'z') {
    this.#world.rotation.x = axis === 'y' ? Math.PI / 2 : 0;
    this.#world.updateMatrixWorld();
  }

  /**
   * Transforms a point from the scene's coordinates, in which rays and their intersections are given, to those of the
   * objects shown.
   */
  toWorld(point: Vector3): Vector3 {
    return this.#world.worldToLocal(point.clone());
  }

  /** Transforms a point from the coordinates of the objects shown to the scene's, in which rays are given. */
  fromWorld(point: Vector3): Vector3 {
    return this.#world.localToWorld(point.clone());
  }

  /**
   * Shows the objects with pose and projection of a photograph's camera until the user rotates the view; undefined
   * returns to the orbit camera.
   */
  lookThrough(camera: PinholeCamera | undefined): void {
    if (camera === this.#through) return;
    this.#through = camera;
    if (!camera) this.onLeave();
    this.invalidate();
  }

  /** Cuts the surfaces open along a plane, and removes what is behind it; undefined shows them in full. */
  cut(plane: Plane | undefined): void {
    this.clipping.splice(0, 1, ...(plane ? [plane] : []));
    if (plane) this.#camera.layers.enable(CUT_LAYER);
    else this.#camera.layers.disable(CUT_LAYER);
    this.invalidate();
  }

  /** Requests a rendering at the next animation frame; repeated calls cost nothing. */
  invalidate(): void {
    if (this.#disposed) return;
    this.#pending ||= requestAnimationFrame(() => {
      // Still marked as pending, because the changes are rendered in this frame.
      for (const change of this.#changes.splice(0)) change();
      this.#pending = 0;
      this.#draw();
    });
  }

  /**
   * Calls `change`, which changes objects, at the next animation frame and renders in the same frame, not in the one
   * after.
   */
  changeAndDraw(change: () => void): void {
    this.#changes.push(change);
    this.invalidate();
  }

  /** Fits a whole volume into the view, from the front and a little from the patient's left and above. */
  fitVolume(grid: Grid): void {
    const [x, y, z] = anatomicalSigns(grid.space);
    this.#fitView(worldBox(grid), new Vector3(-0.55 * x, 1 * y, 0.32 * z));
  }

  /**
   * Fits a box, in the coordinates of the objects shown, into the view, seen a little from above and from the side.
   * `front` is 1 to look along the scene's y, −1 to look against it; `aside` is the tangent of the angle to the side.
   */
  fitBox(box: Box3, front: 1 | -1, aside = 0.7): void {
    this.#fitView(box.clone().applyMatrix4(this.#world.matrixWorld), new Vector3(-aside * front, -front, 0.32));
  }

  /** Aspect ratio of the view, width by height. */
  get aspect(): number {
    const [width, height] = this.#fixedSize ?? [this.canvas.clientWidth, this.canvas.clientHeight];
    return width / Math.max(1, height);
  }

  /** Largest width and height of renderings, in pixels. */
  get largest(): number {
    return this.#rendering.largest;
  }

  /**
   * Renders at a fixed size in pixels, for pictures and films, or with undefined at that of the canvas on the page
   * again. Returns whether renderings have this size: the memory may not suffice.
   */
  fixSize(size: readonly [number, number] | undefined): boolean {
    this.#fixedSize = size;
    this.#resize();
    return !size || this.#rendering.size.every((length, side) => length === size[side]);
  }

  /** Size of a pixel at the depth of the centre of rotation, in the coordinates of the objects shown. */
  get unitsPerPixel(): number {
    const viewer = this.#viewer();
    const depth = -this.#controls.target.clone().applyMatrix4(viewer.matrixWorldInverse).z;
    return (2 * depth) / ((viewer.projectionMatrix.elements[5] ?? 1) * this.canvas.height);
  }

  /** Rotates the view around the vertical axis through the centre of rotation, by an angle in radians. */
  turn(angle: number): void {
    this.#rotate(angle, 0);
  }

  #fitView(box: Box3, towards: Vector3): void {
    const target = box.getCenter(new Vector3());
    const radius = box.getSize(new Vector3()).length() / 2;
    const direction = towards.normalize();
    const distance = (0.97 * radius) / Math.sin((FIELD_OF_VIEW * Math.PI) / 360) / this.#cappedAspect;
    this.#home = { position: target.clone().addScaledVector(direction, distance), target };
    this.#camera.near = radius / 50;
    this.#camera.far = radius * 50;
    this.#camera.updateProjectionMatrix();
    this.resetView();
  }

  /**
   * Moves the centre of rotation and zoom to a point in the coordinates of the objects shown, keeping the viewing
   * direction.
   */
  setPivot(point: Vec3): void {
    const target = new Vector3(...point).applyMatrix4(this.#world.matrixWorld);
    this.#camera.position.sub(this.#controls.target).add(target);
    this.#controls.target.copy(target);
    this.#controls.update();
    this.invalidate();
  }

  /** Pose of the orbit camera; in a view of another shape it shows the same objects. */
  get pose(): CameraPose {
    const { target } = this.#controls;
    const position = this.#camera.position.clone().sub(target).multiplyScalar(this.#cappedAspect).add(target);
    return { position: position.toArray(), target: target.toArray() };
  }

  set pose({ position, target }: CameraPose) {
    this.lookThrough(undefined);
    this.#controls.target.fromArray(target);
    this.#camera.position.fromArray(position).sub(this.#controls.target).divideScalar(this.#cappedAspect);
    this.#camera.position.add(this.#controls.target);
    this.#controls.update();
    this.invalidate();
  }

  resetView(): void {
    this.lookThrough(undefined);
    this.#camera.position.copy(this.#home.position);
    this.#controls.target.copy(this.#home.target);
    this.#controls.update();
    this.invalidate();
  }

  /** Ends rendering and releases the GPU memory; browsers limit the number of graphics contexts of a page. */
  dispose(): void {
    this.#disposed = true;
    cancelAnimationFrame(this.#pending);
    this.#observer.disconnect();
    this.#ignoreScheme();
    this.#controls.dispose();
    this.#rendering.dispose();
  }

  #addLights(): void {
    const sky = new HemisphereLight('#ffffff', '#8d8577', 1.1);
    sky.position.set(0, 0, 1);
    const key = new DirectionalLight('#fff6e8', 2.1);
    key.position.set(-0.6, 0.9, 1);
    const fill = new DirectionalLight('#cfe2ff', 0.5);
    fill.position.set(1, -0.2, 0.4);
    this.#lamp.add(key, fill, key.target, fill.target);
    this.#scene.add(sky, this.#lamp, this.#camera);
  }

  #setDragged(dragged: boolean): void {
    this.#dragged = dragged;
    if (dragged || !this.#rotating) return;
    this.#rotating = false;
    // Objects simplified during the rotation are rendered in full.
    this.invalidate();
  }

  #moved(): void {
    if (this.#dragged) this.lookThrough(undefined);
    this.#rotating = this.#dragged;
    this.invalidate();
  }

  #listenForClicks(): void {
    let down = { x: 0, y: 0 };
    this.canvas.addEventListener('pointerdown', ({ offsetX: x, offsetY: y }) => {
      down = { x, y };
    });
    this.canvas.addEventListener('pointerup', ({ offsetX: x, offsetY: y, button }) => {
      if (button !== 0 || Math.hypot(x - down.x, y - down.y) > CLICK_TOLERANCE) return;
      const { clientWidth, clientHeight } = this.canvas;
      this.#click((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight);
    });
  }

  /** Handles a click at a position of the view, −1 to 1 from left to right and from bottom to top. */
  #click(x: number, y: number): void {
    // Includes changes since the last rendering, or before the first.
    this.#scene.updateMatrixWorld();
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x, y), this.#viewer());
    this.onClick(ray);
  }

  /** Returns the camera in use: the orbit camera, or one with the pose of a photograph. */
  #viewer(): PerspectiveCamera {
    if (!this.#through || this.canvas.clientHeight === 0) return this.#camera;
    const { near, far } = this.#camera;
    applyPinhole(this.#photoCamera, this.#through, this.#world.matrixWorld, this.aspect, [near, far]);
    this.#photoCamera.updateMatrixWorld();
    return this.#photoCamera;
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = this.#fixedSize ?? [clientWidth, clientHeight];
    if (width === 0 || height === 0 || this.#disposed) return;
    this.#rendering.setSize(width, height, this.#fixedSize && 1);
    this.#camera.aspect = width / height;
    this.#adjustDistance(Math.min(1, this.#camera.aspect));
    this.#camera.updateProjectionMatrix();
    // Resizing clears the canvas: it is rendered at once to avoid flashing.
    this.#draw();
  }

  /** Changes the camera distance so that the same objects stay visible when the window becomes narrower or wider. */
  #adjustDistance(cappedAspect: number): void {
    const factor = this.#cappedAspect / cappedAspect;
    this.#cappedAspect = cappedAspect;
    if (factor === 1) return;
    const { position, target } = this.#home;
    position.sub(target).multiplyScalar(factor).add(target);
    this.#zoom(factor);
  }

  #draw(): void {
    this.onDraw(this.#camera.position, this.#rotating && this.#rendering.inSoftware);
    const viewer = this.#viewer();
    // The eye's matrix is up to date; that of the orbit camera is updated before the lights are placed.
    if (viewer === this.#camera) viewer.updateMatrixWorld();
    this.#lamp.matrix.copy(viewer.matrixWorld);
    this.#rendering.render(this.#scene, viewer);
    this.onDrawn();
  }

  #onKey(event: KeyboardEvent): void {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    if (this.takesKey(event)) {
      event.preventDefault();
      event.stopPropagation();
      return;
    }
    const moves: Record<string, () => void> = {
      ArrowLeft: () => this.#rotate(-KEY_ROTATION, 0),
      ArrowRight: () => this.#rotate(KEY_ROTATION, 0),
      ArrowUp: () => this.#rotate(0, -KEY_ROTATION),
      ArrowDown: () => this.#rotate(0, KEY_ROTATION),
      '+': () => this.#zoom(1 / KEY_ZOOM),
      '=': () => this.#zoom(1 / KEY_ZOOM),
      '-': () => this.#zoom(KEY_ZOOM),
      Home: () => this.resetView(),
      Enter: () => this.#click(0, 0),
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    if (event.key !== 'Enter') this.lookThrough(undefined);
    move();
  }

  #rotate(around: number, over: number): void {
    this.#orbit((spherical) => {
      spherical.theta += around;
      spherical.phi += over;
      spherical.makeSafe();
    });
  }

  #zoom(factor: number): void {
    this.#orbit((spherical) => {
      spherical.radius *= factor;
    });
  }

  /**
   * Changes the orbit camera's position by spherical coordinates around its target. The Spherical of three.js has y up,
   * our scene z.
   */
  #orbit(change: (spherical: Spherical) => void): void {
    const offset = this.#camera.position.clone().sub(this.#controls.target);
    this.#spherical.setFromCartesianCoords(offset.x, offset.z, -offset.y);
    change(this.#spherical);
    const turned = new Vector3().setFromSpherical(this.#spherical);
    this.#camera.position.set(turned.x, -turned.z, turned.y).add(this.#controls.target);
    this.#controls.update();
    this.invalidate();
  }
}

function worldBox(grid: Grid): Box3 {
  const box = new Box3(new Vector3(-0.5, -0.5, -0.5), new Vector3(...grid.dims).subScalar(0.5));
  return box.applyMatrix4(new Matrix4().fromArray(grid.affine));
}
