// The 3D view of the element.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { ThreeSurface } from '../adapters/three.js';
import type { Vec3 } from '../data.js';
import type { MeshSnapshot } from '../mesh.js';

const FIELD_OF_VIEW = 40;
/** Upper bound of the device pixel ratio at which a `<vesicle-lab>` renders its surface. */
const MAX_PIXEL_RATIO = 2;

/** The 3D view of a `<vesicle-lab>`: renders a surface with three.js whenever the surface or the camera has changed. */
export class View {
  readonly #renderer: THREE.WebGLRenderer;
  readonly #scene = new THREE.Scene();
  readonly #camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW);
  readonly #controls: OrbitControls;
  readonly #object = new THREE.Mesh(
    new THREE.BufferGeometry(),
    new THREE.MeshStandardMaterial({ color: '#d8c3a5', roughness: 0.55 }),
  );
  readonly #surface = new ThreeSurface(THREE, this.#object);
  readonly #observer = new ResizeObserver(() => this.#resize());
  /** Whether the user has not moved the camera yet, so that it may still be adjusted automatically. */
  #untouched = true;
  #asked = 0;

  /** Creates the view of a surface on a canvas; throws if WebGL is not available. */
  constructor(readonly canvas: HTMLCanvasElement) {
    this.#renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    const light = new THREE.DirectionalLight('#ffffff', 2.4);
    light.position.set(0.4, 0.6, 1);
    this.#camera.up.set(0, 0, 1);
    this.#camera.add(light);
    this.#scene.add(this.#camera, this.#object, new THREE.HemisphereLight('#ffffff', '#8d8377', 1.2));
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener('change', () => this.#ask());
    this.#controls.addEventListener('start', () => {
      this.#untouched = false;
    });
    canvas.addEventListener('keydown', (event) => this.#turnByKey(event));
    this.#observer.observe(canvas);
  }

  /** Shows a surface, and requests a rendering. */
  show(surface: MeshSnapshot): void {
    this.#surface.update(surface);
    this.#ask();
  }

  /**
   * Prepares the view for a new surface: the camera may be adjusted automatically again, even if the user moved it
   * before.
   */
  begin(): void {
    this.#untouched = true;
  }

  /** Fits the whole surface into the view from a given direction, unless the user has moved the camera. */
  frame(from: Vec3): void {
    if (!this.#untouched) return;
    const { center, radius } = this.#object.geometry.boundingSphere ?? new THREE.Sphere();
    const away = (0.85 * radius) / Math.sin((FIELD_OF_VIEW * Math.PI) / 360);
    this.#camera.position
      .set(...from)
      .normalize()
      .multiplyScalar(away)
      .add(center);
    this.#camera.near = away / 100;
    this.#camera.far = away * 10;
    this.#camera.updateProjectionMatrix();
    this.#controls.target.copy(center);
    this.#controls.update();
  }

  #turnByKey(event: KeyboardEvent): void {
    const [right, up, closer] = KEYS[event.key] ?? [0, 0, 0];
    if (right === 0 && up === 0 && closer === 0) return;
    event.preventDefault();
    this.#untouched = false;
    const away = this.#camera.position.clone().sub(this.#controls.target);
    // Rotates about the world's up axis, and about the horizontal axis of the screen.
    away.applyAxisAngle(this.#camera.up, 0.12 * right);
    const level = Math.acos(away.z / away.length()) - 0.12 * up;
    if (level > 0.05 && level < Math.PI - 0.05) {
      const across = new THREE.Vector3().crossVectors(this.#camera.up, away).normalize();
      away.applyAxisAngle(across, -0.12 * up);
    }
    this.#camera.position.copy(this.#controls.target).addScaledVector(away, 1 - 0.1 * closer);
    this.#controls.update();
  }

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_PIXEL_RATIO));
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    // Resizing clears the canvas: it is rendered at once to avoid flashing.
    this.#draw();
  }

  #ask(): void {
    if (this.#asked === 0) this.#asked = requestAnimationFrame(() => this.#draw());
  }

  #draw(): void {
    cancelAnimationFrame(this.#asked);
    this.#asked = 0;
    this.#renderer.render(this.#scene, this.#camera);
  }

  dispose(): void {
    cancelAnimationFrame(this.#asked);
    this.#observer.disconnect();
    this.#controls.dispose();
    this.#surface.dispose();
    this.#object.material.dispose();
    this.#renderer.dispose();
  }
}

/** Camera motion of each key, in steps of −1, 0 or 1: to the right, up, and closer. */
const KEYS: Record<string, [number, number, number]> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  '+': [0, 0, 1],
  '-': [0, 0, -1],
};
