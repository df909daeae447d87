import type { Vector3 } from 'three';
import type { Plane, Surface, Vec3, VolumeView } from '../protocol';
import { onSchemeChange, token } from '../ui/dom';
import type { ViewOptions } from '../ui/view-options';
import { invert, sliceFrames, slicePlane, toWorld } from './anatomy';
import { VolumeFrame } from './frame';
import { AXIS_TOKENS, SlicePanel } from './panel';
import { SlicePlane } from './planes';
import { SurfaceObject } from './surface';
import { Viewport } from './viewport';

/** All that belongs to one volume on the screen. */
interface Scene {
  volume: VolumeView;
  inverse: Float64Array;
  panels: SlicePanel[];
  planes: SlicePlane[];
  frame: VolumeFrame;
}

/** The 3D view and the three slices, kept in step with each other. */
export class Stage {
  readonly #viewport: Viewport;
  readonly #slices: HTMLElement;
  readonly #surface = new SurfaceObject();
  readonly #onPlanes: (planes: Plane[]) => void;
  #options: ViewOptions;
  #scene: Scene | undefined;
  /** Voxel index where the three slices meet. */
  #crosshair: Vec3 = [0, 0, 0];

  /** `onPlanes` hears of the slices' planes whenever they move. */
  constructor(
    canvas: HTMLCanvasElement,
    slices: HTMLElement,
    options: ViewOptions,
    onPlanes: (planes: Plane[]) => void,
  ) {
    this.#viewport = new Viewport(canvas);
    this.#slices = slices;
    this.#onPlanes = onPlanes;
    this.#options = options;
    this.#viewport.add(this.#surface.object);
    this.#viewport.onDraw = (viewer) => this.#placeSlices(viewer);
    this.#recolor();
    onSchemeChange(() => this.#recolor());
  }

  setVolume(volume: VolumeView): void {
    this.#clear();
    const inverse = invert(volume.affine);
    const panels = sliceFrames(volume).map(
      (frame) =>
        new SlicePanel(volume, frame, inverse, {
          onIndex: (index) => this.#moveSlice(frame.axis, index),
          onPoint: (index) => this.#moveTo(index),
        }),
    );
    const planes = panels.map(
      ({ frame, picture }) =>
        new SlicePlane(volume, frame, picture, { frame: token(AXIS_TOKENS[frame.axis]), section: token('--outline') }),
    );
    const frame = new VolumeFrame(volume, token('--muted'));
    this.#scene = { volume, inverse, panels, planes, frame };
    for (const { object } of [...planes, frame]) this.#viewport.add(object);
    // Axial first, as in a reading room.
    this.#slices.append(
      ...[...panels].sort((a, b) => a.frame.name.localeCompare(b.frame.name)).map((panel) => panel.element),
    );
    this.setOptions(this.#options);
    this.#viewport.frame(volume);
    this.#moveTo(volume.dims.map((n) => (n - 1) >> 1) as Vec3);
  }

  /** Copies the surface; its arrays may be given away at once. */
  showSurface(surface: Surface): void {
    this.#surface.show(surface);
    this.#viewport.invalidate();
  }

  /** The surface's cuts with the planes last told, in their order. */
  showSections(sections: Float32Array[]): void {
    sections.forEach((section, axis) => {
      this.#scene?.panels[axis]?.setOutline(section);
      this.#scene?.planes[axis]?.showSection(section);
    });
    this.#viewport.invalidate();
  }

  setOptions(options: ViewOptions): void {
    this.#options = options;
    this.#surface.edges = options.edges;
    this.#surface.solid = options.surface;
    this.#surface.byComponent = options.byComponent;
    this.#viewport.invalidate();
  }

  /** The world point where the three slices meet. */
  get crosshair(): Vec3 {
    return this.#scene ? toWorld(this.#scene.volume.affine, this.#crosshair) : [0, 0, 0];
  }

  #moveSlice(axis: 0 | 1 | 2, index: number): void {
    const at: Vec3 = [...this.#crosshair];
    at[axis] = index;
    this.#moveTo(at);
  }

  #moveTo(index: Vec3): void {
    const scene = this.#scene;
    if (!scene) return;
    this.#crosshair = index;
    for (const panel of scene.panels) panel.setCrosshair(index);
    for (const [axis, plane] of scene.planes.entries()) plane.moveTo(index[axis] ?? 0);
    const { volume, inverse } = scene;
    this.#onPlanes(([0, 1, 2] as const).map((axis) => slicePlane(volume.affine, inverse, axis, index[axis])));
    this.#viewport.invalidate();
  }

  #placeSlices(viewer: Vector3): void {
    const { slices } = this.#options;
    for (const plane of this.#scene?.planes ?? []) {
      plane.object.visible = slices !== 'hidden';
      if (slices !== 'hidden') plane.stand(slices, viewer);
    }
  }

  #recolor(): void {
    this.#surface.edgeColor = token('--wire');
    for (const panel of this.#scene?.panels ?? []) panel.draw();
    this.#viewport.invalidate();
  }

  #clear(): void {
    const scene = this.#scene;
    if (!scene) return;
    for (const item of [...scene.planes, scene.frame]) {
      this.#viewport.remove(item.object);
      item.dispose();
    }
    for (const panel of scene.panels) panel.dispose();
    this.#scene = undefined;
  }
}
