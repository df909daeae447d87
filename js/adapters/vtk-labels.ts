// Label maps of vtk.js: their surfaces, which follow them, and new ones from volumes.
import { choice, invalid } from '../check.js';
import type { Space, VoxelArray } from '../data.js';
import type { LabelOptions, LabelParams } from '../label-surfaces.js';
import type { Mesh } from '../mesh.js';
import { withPause } from '../pause.js';
import { checkedSlices, type SliceOptions } from '../stepper.js';
import type { Volume } from '../volume.js';
import type { Warning } from '../warning.js';
import { mergedWarnings } from '../warnings.js';
import { type LabelClasses, LabelMap } from './label-map.js';
import { type VtkImage, volumeFromVtk } from './vtk-image.js';
import { type VtkActor, type VtkClasses, type VtkPolyData, VtkSurface } from './vtk-surface.js';

/** Options of {@link VtkLabelSurfaces}. */
export interface VtkLabelSurfacesOptions extends LabelParams {
  /** Labels that get a surface; all others count as background. Default all, including those that are added later. */
  labels?: number[];
  /**
   * Returns the `vtkActor` that shows the surface of a label; called once for each. Needed for an image that is far from
   * the origin for its size: the actors are moved to the origins of the surfaces.
   */
  actorOf?: (label: number) => VtkActor;
}

const labelOptions = ({ actorOf: _, ...options }: VtkLabelSurfacesOptions): Omit<LabelOptions, 'volume'> => options;

/** Surfaces that are created already, for the constructor. */
class Made {
  readonly map: LabelMap;
  readonly actorOf: VtkLabelSurfacesOptions['actorOf'];

  constructor(map: LabelMap, actorOf: VtkLabelSurfacesOptions['actorOf']) {
    [this.map, this.actorOf] = [map, actorOf];
  }
}

/**
 * A `vtkPolyData` for each label of a `vtkImageData`, which follow its voxels.
 *
 * ```js
 * const surfaces = new VtkLabelSurfaces({ Volume, LabelSurfaces, vtkPolyData, vtkDataArray }, image);
 * for (const label of surfaces.labels) mapperOf(label).setInputData(surfaces.polyData(label));
 * surfaces.update(); // after voxels of the image have changed, then render
 * ```
 *
 * Points are in the world of the image; they have outward normals.
 */
export class VtkLabelSurfaces<P extends VtkPolyData> {
  readonly #map: LabelMap;
  readonly #image: VtkImage;
  readonly #vtk: VtkClasses<P>;
  readonly #actorOf: ((label: number) => VtkActor) | undefined;
  readonly #made = new Map<number, VtkSurface<P>>();

  /**
   * Creates the surfaces of all labels of the image.
   *
   * @param classes - Those of vtk.js and of this library.
   * @param image - A label map: integers, 0 for the background, one number a voxel.
   * @throws `VesicleError` `invalid-argument`: classes that are missing, no such image, one that is no label map, labels
   *   that it does not have; `precision`: an image so far from the origin that single precision is too coarse there,
   *   without `actorOf`; `too-large`.
   */
  constructor(classes: VtkClasses<P> & LabelClasses, image: VtkImage, options: VtkLabelSurfacesOptions = {}) {
    this.#vtk = checkedVtk(classes);
    this.#image = image;
    this.#actorOf = options.actorOf;
    if (options instanceof Made) this.#map = options.map;
    else {
      this.#map = LabelMap.make(classes, volumeFromVtk(image), labelOptions(options));
      this.#map.settle();
      this.#showAtOnce();
    }
  }

  /**
   * Creates surfaces as the constructor does, yielding to the event loop between slices of work, and smooths them until they
   * are settled: those of a large label map take seconds.
   *
   * @param slices - `signal`: aborts the creation; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws As the constructor; `signal.reason` when aborted.
   */
  static async create<P extends VtkPolyData>(
    classes: VtkClasses<P> & LabelClasses,
    image: VtkImage,
    options: VtkLabelSurfacesOptions = {},
    slices?: SliceOptions,
  ): Promise<VtkLabelSurfaces<P>> {
    checkedVtk(classes);
    const checked = checkedSlices(slices);
    const map = await LabelMap.create(classes, volumeFromVtk(image), labelOptions(options), checked);
    const surfaces = new VtkLabelSurfaces(classes, image, new Made(map, options.actorOf) as VtkLabelSurfacesOptions);
    try {
      await withPause(checked.signal, async (pause) => {
        for (const label of surfaces.labels) {
          surfaces.#surfaceOf(label);
          await pause.turn();
        }
      });
      return surfaces;
    } catch (error) {
      surfaces.dispose();
      throw error;
    }
  }

  /** The labels that have voxels, in ascending order. */
  get labels(): readonly number[] {
    return this.#map.surfaces.labels;
  }

  /**
   * Returns the surface of a label as input of a `vtkMapper`: the same object at every call, empty while the label has no
   * voxels.
   *
   * @throws `VesicleError` `invalid-argument`: a label that never had a surface.
   */
  polyData(label: number): P {
    return this.#surfaceOf(label).polyData;
  }

  /** Warnings about the surfaces; empty if there are none. */
  get warnings(): Warning[] {
    return mergedWarnings(...this.labels.map((one) => this.mesh(one).warnings));
  }

  /** Returns the surface of a label as a live mesh of this library, such as to save it. */
  mesh(label: number): Mesh {
    return this.#map.surfaces.mesh(label);
  }

  /**
   * Adopts the voxels of the image that have changed, whether or not it was told that it is modified, and updates the
   * poly data of all labels; the next rendering uploads it. Returns whether anything has changed.
   *
   * @throws `VesicleError` `invalid-argument`: another type or number of voxels, or too many labels. Nothing has changed
   *   then.
   */
  update(): boolean {
    const { data } = volumeFromVtk(this.#image);
    const followed = this.#map.follow(data);
    this.#map.settle();
    return this.#show() || followed !== undefined;
  }

  #showAtOnce(): void {
    try {
      this.#show();
    } catch (error) {
      this.dispose();
      throw error;
    }
  }

  #show(): boolean {
    for (const label of this.labels) this.#surfaceOf(label);
    let changed = false;
    for (const [label, surface] of this.#made) if (surface.update(this.mesh(label))) changed = true;
    return changed;
  }

  #surfaceOf(label: number): VtkSurface<P> {
    const known = this.#made.get(label);
    if (known) return known;
    const mesh = this.mesh(label);
    const actor = this.#actorOf?.(label);
    const surface = new VtkSurface(this.#vtk, actor ? { actor } : {});
    this.#made.set(label, surface);
    surface.update(mesh);
    return surface;
  }

  /** Deletes the poly data and frees the surfaces; remove their actors from the view first. */
  dispose(): void {
    for (const surface of this.#made.values()) surface.dispose();
    this.#made.clear();
    this.#map.free();
  }
}

/** Returns the classes of vtk.js; throws `invalid-argument` if some are missing. */
function checkedVtk<P extends VtkPolyData>(classes: VtkClasses<P>): VtkClasses<P> {
  new VtkSurface(classes).dispose();
  return classes;
}

/** The classes of vtk.js that {@link vtkFromVolume} needs: `{ vtkImageData, vtkDataArray }`. */
export interface VtkImageClasses<I extends VtkImageOut> {
  vtkImageData: { newInstance(values: { spacing: number[]; origin: number[] }): I };
  vtkDataArray: { newInstance(values: { name: string; numberOfComponents: number; values: VoxelArray }): unknown };
}

/** The methods of a `vtkImageData` of vtk.js that {@link vtkFromVolume} calls. */
export interface VtkImageOut {
  setDimensions(dims: number[]): unknown;
  setDirection(direction: number[]): unknown;
  getPointData(): { setScalars(scalars: never): unknown };
}

/**
 * Converts the first frame of a label map to a `vtkImageData` with scalars called `labels`, in the smallest unsigned
 * integers that hold them, or `Int32Array` if some are negative.
 *
 * @param volume - Integers, such as from `Mesh.toVolume` or `Volume.label`.
 * @param options - `worldSpace`: orientation of the view's world axes; default LPS. If it differs from that of the
 *   volume, the signs of x and y are flipped.
 * @throws `VesicleError` `invalid-argument`: classes that are missing, a volume that is no label map, or no such space.
 */
export function vtkFromVolume<I extends VtkImageOut>(
  volume: Volume,
  vtk: VtkImageClasses<I>,
  options: { worldSpace?: Space } = {},
): I {
  for (const name of ['vtkImageData', 'vtkDataArray'] as const) {
    if (typeof Object(vtk)[name]?.newInstance !== 'function') throw invalid('vtk', `has no ${name} of vtk.js`);
  }
  const worldSpace = choice('worldSpace', options.worldSpace ?? 'LPS', ['RAS', 'LPS']);
  const labels = volume.labels().map(({ value }) => value);
  const sign = worldSpace === volume.space ? 1 : -1;
  const column = (k: number) =>
    Array.from(volume.affine.slice(4 * k, 4 * k + 3), (value, row) => (row < 2 ? sign : 1) * value);
  const axes = [0, 1, 2].map(column);
  const spacing = axes.map((axis) => Math.hypot(...axis));
  const image = vtk.vtkImageData.newInstance({ spacing, origin: column(3) });
  image.setDirection(axes.flatMap((axis, k) => axis.map((value) => value / (spacing[k] ?? 1))));
  image.setDimensions(volume.dims);
  const values = integersOf(labels).from(volume.intensities());
  image
    .getPointData()
    .setScalars(vtk.vtkDataArray.newInstance({ name: 'labels', numberOfComponents: 1, values }) as never);
  return image;
}

/** Returns the smallest type of integers for labels, which are in ascending order. */
function integersOf(labels: number[]): { from(values: Float32Array): VoxelArray } {
  const most = labels.at(-1) ?? 0;
  if ((labels[0] ?? 0) < 0) return Int32Array;
  if (most < 2 ** 8) return Uint8Array;
  return most < 2 ** 16 ? Uint16Array : Uint32Array;
}
