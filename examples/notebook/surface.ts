// The browser side of the notebook widget: fits a surface to `volume`, displays it and returns its mesh to Python.
// The library is bundled with its wasm module inline, because a notebook serves no other files.

import type { AnyModel, Initialize, Render } from '@anywidget/types';
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import init, { DeformableModel, type DeformableParams, Volume, type VoxelArray, type Warning } from 'vesicle/inline';
import { type MeshSource, ThreeSurface } from 'vesicle/three';

/** A NumPy array as bytes. The first axis is fastest in volumes, the last in arrays of vertices and triangles. */
export interface Packed {
  kind: string;
  shape: number[];
  data: DataView;
}

/** The traits that the widget shares with Python. */
export interface Traits {
  volume: Packed;
  affine: number[];
  levels: number;
  params: DeformableParams;
  running: boolean;
  state: 'loading' | 'running' | 'paused' | 'done' | 'error';
  message: string;
  iteration: number;
  warnings: Warning[];
  vertices: Packed | null;
  triangles: Packed | null;
}

type Model = AnyModel<Traits>;

/** Approximate time of steps between two rendered images, in milliseconds. */
const SLICE = 30;

const KINDS: Record<string, new (buffer: ArrayBuffer) => VoxelArray> = {
  ...{ uint8: Uint8Array, int8: Int8Array, uint16: Uint16Array, int16: Int16Array },
  ...{ uint32: Uint32Array, int32: Int32Array, float32: Float32Array, float64: Float64Array },
};

/** Returns a typed array from the bytes of a NumPy array. */
function unpacked({ kind, data }: Pick<Packed, 'kind' | 'data'>): VoxelArray {
  const Kind = KINDS[kind];
  if (!Kind) throw new Error(`volume: numbers of kind ${kind}; there are ${Object.keys(KINDS).join(', ')}`);
  // A copy: the bytes of a message may not be aligned.
  return new Kind(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength) as ArrayBuffer);
}

/** Returns an array of triples (positions or triangles) as bytes for Python. */
function packed(kind: 'float32' | 'uint32', triples: Float32Array | Uint32Array): Packed {
  return { kind, shape: [triples.length / 3, 3], data: new DataView(triples.buffer) };
}

/** The deformable model of one widget, shared by all its views. */
class Growth {
  readonly #model: Model;
  #surface: DeformableModel | undefined;
  #growing = false;
  readonly views = new Set<View>();

  constructor(model: Model) {
    this.#model = model;
    model.on('change:volume', () => this.begin());
    model.on('change:params', () => this.#change());
    model.on('change:running', () => this.#grow());
  }

  /** Starts a new model with the current traits. */
  async begin(): Promise<void> {
    this.#tell({ state: 'loading', message: '', iteration: 0, warnings: [], vertices: null, triangles: null });
    try {
      await init();
      const surface = this.#make();
      this.free();
      this.#surface = surface;
      for (const view of this.views) this.enter(view);
      await this.#grow();
    } catch (error) {
      this.free();
      this.#tell({ state: 'error', message: words(error) });
    }
  }

  /** Creates the model from the current traits. */
  #make(): DeformableModel {
    const { shape, ...numbers } = this.#model.get('volume');
    const dims = shape as [number, number, number];
    const volume = new Volume({ data: unpacked(numbers), dims, affine: this.#model.get('affine') });
    try {
      return new DeformableModel({ volume, levels: this.#model.get('levels'), params: this.#model.get('params') });
    } finally {
      volume.free();
    }
  }

  /** Sets the parameters of the running model; a finished one continues. Invalid ones change nothing. */
  async #change(): Promise<void> {
    if (!this.#surface) return this.begin();
    try {
      this.#surface.setParams(this.#model.get('params'));
      this.#tell({ message: '' });
      await this.#grow();
    } catch (error) {
      this.#tell({ message: words(error) });
    }
  }

  /** Steps the model until it is done or paused, yielding to the page between slices. */
  async #grow(): Promise<void> {
    if (this.#growing) return;
    this.#growing = true;
    try {
      while (this.#surface && !this.#slice(this.#surface)) await new Promise((next) => setTimeout(next));
    } finally {
      this.#growing = false;
    }
  }

  /** Steps for one time slice and updates the views; returns whether the model is done or paused. */
  #slice(surface: DeformableModel): boolean {
    if (!this.#model.get('running')) return this.#rest(surface, 'paused');
    const until = performance.now() + SLICE;
    let report = surface.step();
    while (!report.done && performance.now() < until) report = surface.step();
    this.#tell({ state: 'running', iteration: report.iteration });
    for (const view of this.views) view.show(surface.mesh, `Step ${report.iteration}, ${report.vertices} vertices`);
    return report.done && this.#rest(surface, 'done');
  }

  /** Sends the mesh and the state to Python. */
  #rest(surface: DeformableModel, state: 'done' | 'paused'): true {
    const { positions, indices } = surface.mesh.arrays();
    const { warnings } = surface.mesh;
    for (const view of this.views) view.warn(warnings);
    this.#tell({ state, warnings, vertices: packed('float32', positions), triangles: packed('uint32', indices) });
    return true;
  }

  /** Sets traits, in Python as well, and shows a message in all views. */
  #tell(traits: Partial<Traits>): void {
    for (const [name, value] of Object.entries(traits)) this.#model.set(name as keyof Traits, value);
    this.#model.save_changes();
    if (traits.message) for (const view of this.views) view.say(traits.message);
  }

  /** Adds a view and displays the surface in it. */
  enter(view: View): void {
    this.views.add(view);
    if (this.#surface) view.begin(this.#surface.mesh);
    view.say(this.#model.get('message') || `Step ${this.#model.get('iteration')}`);
    view.warn(this.#model.get('warnings') ?? []);
  }

  free(): void {
    this.#surface?.free();
    this.#surface = undefined;
  }
}

/** Returns the message of an error. */
const words = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** A 3D view of the surface in an output cell. */
class View {
  readonly #renderer = new THREE.WebGLRenderer({ antialias: true });
  readonly #camera = new THREE.PerspectiveCamera(40, 16 / 9);
  readonly #scene = new THREE.Scene();
  readonly #object = new THREE.Mesh(undefined, new THREE.MeshStandardMaterial({ color: 0xd8c3a5 }));
  readonly #surface = new ThreeSurface(THREE, this.#object);
  readonly #controls: OrbitControls;
  readonly #status = document.createElement('output');
  readonly #warnings = document.createElement('ul');

  constructor(element: HTMLElement) {
    const canvas = this.#renderer.domElement;
    this.#renderer.setClearColor(0x14171a);
    this.#renderer.setSize(640, 360);
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', 'The surface');
    element.append(canvas, this.#status, this.#warnings);
    this.#camera.add(new THREE.DirectionalLight(0xffffff, 2));
    this.#camera.up.set(0, 0, 1);
    this.#scene.add(this.#camera, this.#object, new THREE.HemisphereLight(0xffffff, 0x665544, 1.5));
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener('change', () => this.#draw());
  }

  /** Displays a new surface, with the camera in front of it at a distance that shows it whole. */
  begin(mesh: MeshSource): void {
    this.#surface.update(mesh);
    const { center, radius } = this.#object.geometry.boundingSphere ?? new THREE.Sphere();
    this.#camera.position
      .set(-0.6, -1, 0.6)
      .setLength(2.6 * radius)
      .add(center);
    [this.#camera.near, this.#camera.far] = [radius / 100, radius * 100];
    this.#camera.updateProjectionMatrix();
    this.#controls.target.copy(center);
    this.#controls.update();
    this.#draw();
  }

  /** Displays the changed surface and a status text. */
  show(mesh: MeshSource, words: string): void {
    if (this.#surface.update(mesh)) this.#draw();
    this.say(words);
  }

  /** Displays a status text. */
  say(words: string): void {
    this.#status.textContent = words;
  }

  /** Lists warnings; an empty list takes no room. */
  warn(warnings: readonly Warning[]): void {
    const items = warnings.map(({ text }) => Object.assign(document.createElement('li'), { textContent: `⚠ ${text}` }));
    this.#warnings.replaceChildren(...items);
    this.#warnings.hidden = items.length === 0;
  }

  #draw(): void {
    this.#renderer.render(this.#scene, this.#camera);
  }

  dispose(): void {
    this.#controls.dispose();
    this.#surface.dispose();
    this.#renderer.dispose();
  }
}

/** Creates the callbacks of a widget; anywidget calls it once per widget. */
export default () => {
  let growth: Growth | undefined;
  const initialize: Initialize<Traits> = ({ model }) => {
    const started = new Growth(model);
    growth = started;
    void started.begin();
    return () => started.free();
  };
  const render: Render<Traits> = ({ el }) => {
    const view = new View(el);
    growth?.enter(view);
    return () => {
      growth?.views.delete(view);
      view.dispose();
    };
  };
  return { initialize, render };
};
