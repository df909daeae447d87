import {
  Box3,
  DirectionalLight,
  HemisphereLight,
  Matrix4,
  type Object3D,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Spherical,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { anatomicalSigns, type Grid } from './anatomy';

const FIELD_OF_VIEW = 30;
/** Radians the arrow keys turn the view, and the factor + and - zoom it by. */
const KEY_TURN = 0.12;
const KEY_ZOOM = 1.12;
/** Pixels a pointer may travel between down and up and still be a click, and not a turn of the view. */
const CLICK_SLACK = 4;

/** The 3D view: a canvas, a camera that orbits by mouse, touch and keyboard, and light that comes with the camera. */
export class Viewport {
  readonly canvas: HTMLCanvasElement;
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 1, 1000);
  readonly #controls: OrbitControls;
  readonly #observer = new ResizeObserver(() => this.#resize());
  readonly #spherical = new Spherical();
  /** Called before each drawing, with the camera's place. */
  onDraw: (viewer: Vector3) => void = () => undefined;
  /** Called with the ray through the place that was clicked. */
  onClick: (ray: Raycaster) => void = () => undefined;
  #pending = 0;
  #home = { position: new Vector3(), target: new Vector3() };
  /** Width by height of the view, at most 1: in a narrow view the camera stands farther off. */
  #narrowness = 1;

  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.#camera.up.set(0, 0, 1);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener('change', () => this.invalidate());
    canvas.addEventListener('keydown', (event) => this.#onKey(event));
    this.#followClicks();
    this.#light();
    this.#observer.observe(canvas);
  }

  add(object: Object3D): void {
    this.#scene.add(object);
  }

  remove(object: Object3D): void {
    this.#scene.remove(object);
  }

  /** Draws at the next animation frame; calling it more often costs nothing. */
  invalidate(): void {
    this.#pending ||= requestAnimationFrame(() => {
      this.#pending = 0;
      this.#draw();
    });
  }

  /** Looks at the whole of a volume, from before and a little to the patient's left and above. */
  frame(grid: Grid): void {
    const box = worldBox(grid);
    const target = box.getCenter(new Vector3());
    const radius = box.getSize(new Vector3()).length() / 2;
    const [x, y, z] = anatomicalSigns(grid.space);
    const direction = new Vector3(-0.55 * x, 1 * y, 0.32 * z).normalize();
    const distance = (0.97 * radius) / Math.sin((FIELD_OF_VIEW * Math.PI) / 360) / this.#narrowness;
    this.#home = { position: target.clone().addScaledVector(direction, distance), target };
    this.#camera.near = radius / 50;
    this.#camera.far = radius * 50;
    this.#camera.updateProjectionMatrix();
    this.goHome();
  }

  goHome(): void {
    this.#camera.position.copy(this.#home.position);
    this.#controls.target.copy(this.#home.target);
    this.#controls.update();
    this.invalidate();
  }

  dispose(): void {
    cancelAnimationFrame(this.#pending);
    this.#observer.disconnect();
    this.#controls.dispose();
    this.#renderer.dispose();
  }

  #light(): void {
    const sky = new HemisphereLight('#ffffff', '#8d8577', 1.1);
    sky.position.set(0, 0, 1);
    const key = new DirectionalLight('#fff6e8', 2.1);
    key.position.set(-0.6, 0.9, 1);
    const fill = new DirectionalLight('#cfe2ff', 0.5);
    fill.position.set(1, -0.2, 0.4);
    this.#camera.add(key, fill, key.target, fill.target);
    this.#scene.add(sky, this.#camera);
  }

  #followClicks(): void {
    let down = { x: 0, y: 0 };
    this.canvas.addEventListener('pointerdown', ({ offsetX: x, offsetY: y }) => {
      down = { x, y };
    });
    this.canvas.addEventListener('pointerup', ({ offsetX: x, offsetY: y, button }) => {
      if (button !== 0 || Math.hypot(x - down.x, y - down.y) > CLICK_SLACK) return;
      const { clientWidth, clientHeight } = this.canvas;
      const ray = new Raycaster();
      ray.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.#camera);
      this.onClick(ray);
    });
  }

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#standOff(Math.min(1, this.#camera.aspect));
    this.#camera.updateProjectionMatrix();
    // Setting the size clears the canvas: draw at once, or it flashes.
    this.#draw();
  }

  /** Keeps in sight what was in sight, when a window or a phone is turned. */
  #standOff(narrowness: number): void {
    const factor = this.#narrowness / narrowness;
    this.#narrowness = narrowness;
    if (factor === 1) return;
    const { position, target } = this.#home;
    position.sub(target).multiplyScalar(factor).add(target);
    this.#zoom(factor);
  }

  #draw(): void {
    this.onDraw(this.#camera.position);
    this.#renderer.render(this.#scene, this.#camera);
  }

  #onKey(event: KeyboardEvent): void {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const moves: Record<string, () => void> = {
      ArrowLeft: () => this.#turn(-KEY_TURN, 0),
      ArrowRight: () => this.#turn(KEY_TURN, 0),
      ArrowUp: () => this.#turn(0, -KEY_TURN),
      ArrowDown: () => this.#turn(0, KEY_TURN),
      '+': () => this.#zoom(1 / KEY_ZOOM),
      '=': () => this.#zoom(1 / KEY_ZOOM),
      '-': () => this.#zoom(KEY_ZOOM),
      Home: () => this.goHome(),
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
  }

  #turn(around: number, over: number): void {
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

  /** Changes the camera's place around its target. three's Spherical has y up, our world z. */
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
