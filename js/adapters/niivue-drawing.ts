// Follows the drawing layer of NiiVue: a surface for each pen value.
import { invalid } from '../check.js';
import type { Vec3, VolumeInit } from '../data.js';
import type { LabelParams } from '../label-surfaces.js';
import type { Mesh } from '../mesh.js';
import { type Pause, withPause } from '../pause.js';
import { type LabelClasses, LabelMap } from './label-map.js';
import { type Niivue, NiivueSurface, type NVMeshClass } from './niivue-surface.js';
import { affineOf } from './source.js';

/** Options of {@link followDrawing}. */
export interface DrawingOptions extends LabelClasses, LabelParams {
  /** The class `NVMesh` of NiiVue; required by NiiVue 0.69, not used by 1.0. */
  NVMesh?: NVMeshClass;
  /** Width of the outlines in slices, as in {@link NiivueSurface}. */
  outline?: number;
  /** Called each time that the surfaces have changed, with the pen values that have one. */
  onChange?: (labels: readonly number[]) => void;
  /**
   * Called with the error of an update that nobody called, such as after a stroke; by default it is reported to the
   * page, as an error that nobody caught. A drawing so far from the origin that NiiVue cannot show its surfaces has one
   * with the code `precision`.
   */
  onError?: (error: unknown) => void;
}

/** Surfaces of NiiVue's drawing layer, which follow it. */
export interface FollowedDrawing {
  /**
   * The surface of each pen value that has been drawn with, in RAS world space: live meshes, which are freed when the
   * drawing is closed or no longer followed.
   */
  readonly meshes: ReadonlyMap<number, Mesh>;
  /**
   * Follows the drawing now. Not needed after strokes, undo and whatever else calls NiiVue's `refreshDrawing`; needed
   * after another colormap. Resolves when NiiVue has the surfaces.
   *
   * @throws `VesicleError` `invalid-argument`: a drawing that does not fit to the first volume; `precision`: one so far
   *   from the origin that NiiVue cannot show its surfaces.
   */
  update(): Promise<void>;
  /** Stops following for good, and removes the surfaces from NiiVue. */
  stop(): Promise<void>;
}

/** The members of NiiVue that hold the drawing, in 0.69 and in 1.0. */
interface Drawer extends Niivue {
  volumes?: { dimsRAS?: ArrayLike<number>; matRAS?: ArrayLike<number> }[];
  drawBitmap?: Uint8Array | null;
  drawingVolume?: { img?: unknown; dimsRAS?: ArrayLike<number>; matRAS?: ArrayLike<number> } | null;
  drawLut?: { lut: ArrayLike<number> };
  _drawLut?: { lut: ArrayLike<number>; min?: number } | null;
  refreshDrawing(...given: unknown[]): void;
  drawScene(): void;
  addEventListener(type: string, listener: () => void): void;
  removeEventListener(type: string, listener: () => void): void;
}

/**
 * Shows the surfaces of NiiVue's drawing layer, one for each pen value in its colour, in the 3D view and as outlines in
 * the slices, and keeps them up to date: under the pen, after undo, and when a drawing is loaded or closed.
 *
 * ```js
 * const drawing = followDrawing(nv, { NVMesh, Volume, LabelSurfaces }); // 1.0: without NVMesh
 * drawing.meshes.get(1)?.toBytes('stl'); // of pen value 1
 * ```
 *
 * @param nv - A NiiVue attached to its canvas; drawing may begin later.
 * @param options - Classes of NiiVue and of this library, on the main thread.
 * @throws `VesicleError` `invalid-argument`: no NiiVue, one without a canvas, or missing classes.
 */
export function followDrawing(nv: Niivue, options: DrawingOptions): FollowedDrawing {
  const follower = new DrawingFollower(nv, options);
  follower.start();
  return follower;
}

class DrawingFollower implements FollowedDrawing {
  readonly meshes = new Map<number, Mesh>();
  readonly #nv: Drawer;
  readonly #options: DrawingOptions;
  readonly #shown = new Map<number, { surface: NiivueSurface; color: string }>();
  #map: { labels: LabelMap; grid: string } | undefined;
  #frame: number | undefined;
  /** Aborted when the drawing is no longer followed. */
  readonly #stopping = new AbortController();
  #last: Promise<void> = Promise.resolve();

  constructor(nv: Niivue, options: DrawingOptions) {
    const { refreshDrawing, addEventListener } = Object(nv) as Partial<Drawer>;
    if (!refreshDrawing || !addEventListener) throw invalid('nv', 'must be a Niivue that can draw');
    for (const name of ['Volume', 'LabelSurfaces'] as const) {
      if (typeof Object(options)[name] !== 'function') {
        throw invalid(name, "needs the class of this library: import { LabelSurfaces, Volume } from 'vesicle'");
      }
    }
    // A surface that is never shown checks the rest.
    new NiivueSurface(nv, options);
    this.#nv = nv as Drawer;
    this.#options = options;
  }

  start(): void {
    const nv = this.#nv;
    const refresh = nv.refreshDrawing;
    // NiiVue has no event for movements of the pen, but calls this method at each.
    nv.refreshDrawing = (...given) => {
      refresh.apply(nv, given);
      this.#schedule();
    };
    nv.addEventListener('drawingChanged', this.#schedule);
    this.#schedule();
  }

  async stop(): Promise<void> {
    if (this.#isStopped) return;
    this.#stopping.abort();
    // Uncovers the method of the class.
    delete (this.#nv as Partial<Drawer>).refreshDrawing;
    this.#nv.removeEventListener('drawingChanged', this.#schedule);
    if (this.#frame !== undefined) cancelAnimationFrame(this.#frame);
    await this.#last.catch(() => {});
    await this.#clear();
  }

  /** Many movements of the pen in one frame are followed at once. */
  readonly #schedule = (): void => {
    this.#frame ??= requestAnimationFrame(() => {
      this.#frame = undefined;
      this.update().catch((error: unknown) => {
        if (!this.#options.onError) throw error;
        this.#options.onError(error);
      });
    });
  };

  update(): Promise<void> {
    // NiiVue 1.0 adds meshes asynchronously.
    this.#last = this.#last.catch(() => {}).then(() => this.#update());
    return this.#last;
  }

  get #isStopped(): boolean {
    return this.#stopping.signal.aborted;
  }

  async #update(): Promise<void> {
    try {
      if (!this.#isStopped) await this.#follow();
    } catch (error) {
      if (!this.#isStopped) throw error;
    }
  }

  async #follow(): Promise<void> {
    const init = drawingOf(this.#nv);
    if (!init) return this.#clear();
    const labels = await this.#labelsOf(init);
    const isSettled = labels.settle();
    if (await this.#show(labels)) {
      this.#nv.drawScene();
      this.#options.onChange?.(labels.surfaces.labels);
    }
    if (!isSettled) this.#schedule();
  }

  /** Returns the surfaces of the drawing: those that exist if it has the same grid, else new ones. */
  async #labelsOf(init: VolumeInit): Promise<LabelMap> {
    const grid = [init.dims, init.affine].join();
    if (this.#map?.grid === grid) {
      this.#map.labels.follow(init.data);
      return this.#map.labels;
    }
    await this.#clear();
    const { smoothing, edge } = this.#options;
    const params = { ...(smoothing !== undefined && { smoothing }), ...(edge !== undefined && { edge }) };
    // A large drawing that is loaded takes seconds.
    const labels = await LabelMap.create(this.#options, init, params, { signal: this.#stopping.signal });
    this.#map = { labels, grid };
    return labels;
  }

  /** Updates NiiVue's meshes; returns whether any has changed. */
  #show(labels: LabelMap): Promise<boolean> {
    return withPause(this.#stopping.signal, (pause) => this.#showInSlices(labels, pause));
  }

  async #showInSlices({ surfaces }: LabelMap, pause: Pause): Promise<boolean> {
    const wanted = new Set(surfaces.labels);
    let changed = false;
    for (const label of this.#shown.keys()) {
      if (wanted.has(label) && this.#shown.get(label)?.color === String(colorOf(this.#nv, label))) continue;
      await this.#hide(label);
      changed = true;
    }
    for (const label of wanted) {
      const mesh = surfaces.mesh(label);
      this.meshes.set(label, mesh);
      if (await this.#surfaceOf(label).update(mesh)) changed = true;
      await pause.turn();
    }
    return changed;
  }

  #surfaceOf(label: number): NiivueSurface {
    const shown = this.#shown.get(label);
    if (shown) return shown.surface;
    const color = colorOf(this.#nv, label);
    const { NVMesh, outline } = this.#options;
    const surface = new NiivueSurface(this.#nv, {
      ...{ name: `drawing ${label}`, color },
      ...(NVMesh && { NVMesh }),
      ...(outline !== undefined && { outline }),
    });
    this.#shown.set(label, { surface, color: String(color) });
    return surface;
  }

  async #hide(label: number): Promise<void> {
    const shown = this.#shown.get(label);
    this.#shown.delete(label);
    this.meshes.delete(label);
    await shown?.surface.dispose();
  }

  async #clear(): Promise<void> {
    if (!this.#map) return;
    for (const label of [...this.#shown.keys()]) await this.#hide(label);
    this.#map.labels.free();
    this.#map = undefined;
    this.#nv.drawScene();
    this.#options.onChange?.([]);
  }
}

/**
 * Returns the drawing as options of a `Volume`, undefined if there is none. Its voxels are in the RAS order of the first
 * volume, whatever the order of the file is.
 */
function drawingOf(nv: Drawer): VolumeInit | undefined {
  const drawing = nv.drawingVolume ?? (nv.drawBitmap ? { ...ras(nv.volumes?.[0]), img: nv.drawBitmap } : undefined);
  if (!drawing) return undefined;
  const { img, dimsRAS, matRAS } = drawing;
  const dims = [1, 2, 3].map((axis) => Number(dimsRAS?.[axis])) as Vec3;
  if (!(img instanceof Uint8Array) || !matRAS || img.length !== dims[0] * dims[1] * dims[2]) {
    throw invalid('nv', 'the drawing must have one byte for each voxel of the first volume');
  }
  // Stored row by row.
  const columns = [0, 1, 2, 3].map((column) => [0, 4, 8].map((row) => Number(matRAS[row + column])));
  return { data: img, dims, affine: affineOf(columns, columns[3] ?? []), space: 'RAS' };
}

const ras = ({ dimsRAS, matRAS }: NonNullable<Drawer['volumes']>[number] = {}) => ({ dimsRAS, matRAS });

/** Returns the colour of a pen value in NiiVue's drawing colormap, rgb, 0..1, opaque. */
function colorOf(nv: Drawer, label: number): [number, number, number, number] {
  const { lut, min = 0 } = nv.drawLut ? { lut: nv.drawLut.lut } : (nv._drawLut ?? { lut: [] });
  // As in NiiVue, values beyond the colormap have its last colour.
  const entry = Math.max(0, Math.min(label - min, lut.length / 4 - 1));
  const part = (k: number) => Number(lut[4 * entry + k] ?? 255) / 255;
  return [part(0), part(1), part(2), 1];
}
