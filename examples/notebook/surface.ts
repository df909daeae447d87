// The browser's half of the notebook's widget: grows the surface of `volume`, shows it, and gives its mesh back.
// The library comes with its module inside, for a notebook serves no files beside this one.

import type { AnyModel, Initialize, Render } from '@anywidget/types';
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import init, { DeformableModel, type DeformableParams, Volume, type VoxelArray } from 'vesicle/inline';
import { type MeshSource, ThreeSurface } from 'vesicle/three';

/** An array as it crosses over: its numbers as bytes. Of volumes the first axis is fastest, of lists of three the last. */
export interface Packed {
  kind: string;
  shape: number[];
  data: DataView;
}

/** The traits that Python has, too. */
export interface Traits {
  volume: Packed;
  affine: number[];
  levels: number;
  params: DeformableParams;
  running: boolean;
  state: 'loading' | 'running' | 'paused' | 'done' | 'error';
  message: string;
  iteration: number;
  vertices: Packed | null;
  triangles: Packed | null;
}

type Model = AnyModel<Traits>;

/** Milliseconds of steps between two pictures, about. */
const SLICE = 30;

const KINDS: Record<string, new (buffer: ArrayBuffer) => VoxelArray> = {
  ...{ uint8: Uint8Array, int8: Int8Array, uint16: Uint16Array, int16: Int16Array },
  ...{ uint32: Uint32Array, int32: Int32Array, float32: Float32Array, float64: Float64Array },
};

function unpacked({ kind, data }: Pick<Packed, 'kind' | 'data'>): VoxelArray {
  const Kind = KINDS[kind];
  if (!Kind) throw new Error(`volume: numbers of kind ${kind}; there are ${Object.keys(KINDS).join(', ')}`);
  // A copy: bytes of a message may begin anywhere.
  return new Kind(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength) as ArrayBuffer);
}

/** Rows of three. */
function packed(kind: 'float32' | 'uint32', triples: Float32Array | Uint32Array): Packed {
  return { kind, shape: [triples.length / 3, 3], data: new DataView(triples.buffer) };
}

/** The surface of one widget, however often it is shown. */
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

  /** From the start, with the traits as they are. */
  async begin(): Promise<void> {
    this.#tell({ state: 'loading', message: '', iteration: 0, vertices: null, triangles: null });
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

  /** Parameters are live: what is at rest goes on with others. Wrong ones change nothing. */
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

  /** Until it is done or paused; between slices the page gets its turn. */
  async #grow(): Promise<void> {
    if (this.#growing) return;
    this.#growing = true;
    try {
      while (this.#surface && !this.#slice(this.#surface)) await new Promise((next) => setTimeout(next));
    } finally {
      this.#growing = false;
    }
  }

  /** Some steps and a picture; whether there is nothing more to do. */
  #slice(surface: DeformableModel): boolean {
    if (!this.#model.get('running')) return this.#rest(surface, 'paused');
    const until = performance.now() + SLICE;
    let report = surface.step();
    while (!report.done && performance.now() < until) report = surface.step();
    this.#tell({ state: 'running', iteration: report.iteration });
    for (const view of this.views) view.show(surface.mesh, `Step ${report.iteration}, ${report.vertices} vertices`);
    return report.done && this.#rest(surface, 'done');
  }

  /** What came of it, to Python. */
  #rest(surface: DeformableModel, state: 'done' | 'paused'): true {
    const { positions, indices } = surface.mesh.arrays();
    this.#tell({ state, vertices: packed('float32', positions), triangles: packed('uint32', indices) });
    return true;
  }

  #tell(traits: Partial<Traits>): void {
    for (const [name, value] of Object.entries(traits)) this.#model.set(name as keyof Traits, value);
    this.#model.save_changes();
    if (traits.message) for (const view of this.views) view.say(traits.message);
  }

  /** One more place to show it in. */
  enter(view: View): void {
    this.views.add(view);
    if (this.#surface) view.begin(this.#surface.mesh);
    view.say(this.#model.get('message') || `Step ${this.#model.get('iteration')}`);
  }

  free(): void {
    this.#surface?.free();
    this.#surface = undefined;
  }
}

const words = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** One place where the surface is seen. */
class View {
  readonly #renderer = new THREE.WebGLRenderer({ antialias: true });
  readonly #camera = new THREE.PerspectiveCamera(40, 16 / 9);
  readonly #scene = new THREE.Scene();
  readonly #object = new THREE.Mesh(undefined, new THREE.MeshStandardMaterial({ color: 0xd8c3a5 }));
  readonly #surface = new ThreeSurface(THREE, this.#object);
  readonly #controls: OrbitControls;
  readonly #status = document.createElement('output');

  constructor(element: HTMLElement) {
    const canvas = this.#renderer.domElement;
    this.#renderer.setClearColor(0x14171a);
    this.#renderer.setSize(640, 360);
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', 'The surface');
    element.append(canvas, this.#status);
    this.#camera.add(new THREE.DirectionalLight(0xffffff, 2));
    this.#camera.up.set(0, 0, 1);
    this.#scene.add(this.#camera, this.#object, new THREE.HemisphereLight(0xffffff, 0x665544, 1.5));
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener('change', () => this.#draw());
  }

  /** Another surface: all of it in sight, from before. */
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

  show(mesh: MeshSource, words: string): void {
    if (this.#surface.update(mesh)) this.#draw();
    this.say(words);
  }

  say(words: string): void {
    this.#status.textContent = words;
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

/** anywidget calls this once a widget. */
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
