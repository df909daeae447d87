/**
 * Adapter for Cornerstone3D, as in OHIF: surfaces of its label maps, which follow the brush.
 *
 * Nothing of Cornerstone is imported: the caller passes its modules.
 *
 * @module vesicle/cornerstone
 */
import { invalid } from '../check.js';
import type { VolumeInit, VoxelArray } from '../data.js';
import type { LabelOptions, LabelParams } from '../label-surfaces.js';
import type { Mesh } from '../mesh.js';
import { withPause } from '../pause.js';
import { checkedSlices, type SliceOptions } from '../stepper.js';
import type { Warning } from '../warning.js';
import { mergedWarnings } from '../warnings.js';
import { type LabelClasses, LabelMap } from './label-map.js';
import { affineOf, MeshReader, polygons, voxels } from './source.js';

export {
  type Cornerstone,
  type CornerstoneAddOn,
  type CornerstoneClasses,
  cornerstoneAddOn,
} from './cornerstone-add-on.js';
export type { LabelClasses } from './label-map.js';

const REMEDY = 'Cornerstone3D cannot draw it there; move the volume to the origin';

/** The properties of a volume in Cornerstone's cache, `cache.getVolume(volumeId)`, that the adapter reads. */
export interface CornerstoneVolume {
  dimensions: ArrayLike<number>;
  spacing: ArrayLike<number>;
  /** Position of the centre of the first voxel, LPS. */
  origin: ArrayLike<number>;
  /** Unit vectors along the axes of the volume, one after the other. */
  direction: ArrayLike<number>;
  metadata?: { FrameOfReferenceUID?: string };
  voxelManager?: {
    getCompleteScalarDataArray?(): ArrayLike<number>;
    getScalarData?(): ArrayLike<number>;
  };
}

/**
 * Converts a volume of Cornerstone to the options of a `Volume`: `new Volume(volumeFromCornerstone(cache.getVolume(id)))`.
 * World space is LPS.
 *
 * @throws `VesicleError` `invalid-argument`: no such volume, one whose voxels are not loaded, several numbers a voxel, or
 *   a voxel type that a `Volume` does not store.
 */
export function volumeFromCornerstone(volume: CornerstoneVolume): VolumeInit {
  const { dimensions, spacing, origin, direction } = Object(volume) as CornerstoneVolume;
  if (!dimensions || !spacing || !origin || !direction) {
    throw invalid('volume', 'must be a volume of Cornerstone, such as cache.getVolume(volumeId)');
  }
  const columns = [0, 1, 2].map((k) => [0, 1, 2].map((row) => Number(direction[3 * k + row]) * Number(spacing[k])));
  return { ...voxels(scalarsOf(volume), Array.from(dimensions)), affine: affineOf(columns, origin), space: 'LPS' };
}

function scalarsOf({ voxelManager }: CornerstoneVolume): VoxelArray {
  // The whole volume; some have it as one array, others slice by slice.
  const data = voxelManager?.getCompleteScalarDataArray?.() ?? voxelManager?.getScalarData?.();
  if (data) return data as VoxelArray;
  throw invalid('volume', 'has no voxels; must be a label map that is loaded');
}

/** A surface as `Surface` of `@cornerstonejs/core` takes it. */
export interface CornerstoneGeometry {
  /** Position of each vertex, packed xyz, LPS. */
  points: Float32Array;
  /** Cells as in vtk.js: for each triangle 3 and the indices of its corners. */
  polys: Uint32Array;
}

/** Options of {@link CornerstoneSurfaces}. */
export interface CornerstoneSurfacesOptions extends LabelParams {
  /** Segments that get a surface; all others count as background. Default all, including those that are added later. */
  segments?: number[];
}

const labelOptions = ({ segments, ...params }: CornerstoneSurfacesOptions): Omit<LabelOptions, 'volume'> => ({
  ...(segments && { labels: segments }),
  ...params,
});

/**
 * The surfaces of a label map in Cornerstone's cache, in the form of its surface representation; they follow the voxels.
 *
 * ```js
 * const surfaces = new CornerstoneSurfaces({ Volume, LabelSurfaces }, cache.getVolume(volumeId));
 * const { points, polys } = surfaces.geometry(1);
 * surfaces.update(slices); // after voxels of these slices have changed; returns the segments to show again
 * ```
 */
export class CornerstoneSurfaces {
  readonly #map: LabelMap;
  readonly #volume: CornerstoneVolume;
  readonly #shown = new Map<number, { reader: MeshReader; geometry: CornerstoneGeometry }>();

  /**
   * Creates the surfaces of all segments.
   *
   * @throws `VesicleError` `invalid-argument`: classes that are missing, no such volume, one that is no label map,
   *   segments that it does not have; `too-large`.
   */
  constructor(classes: LabelClasses, volume: CornerstoneVolume, options: CornerstoneSurfacesOptions = {}) {
    this.#volume = volume;
    if (options instanceof LabelMap) this.#map = options;
    else {
      this.#map = LabelMap.make(classes, volumeFromCornerstone(volume), labelOptions(options));
      this.#map.settle();
      this.#read();
    }
  }

  /**
   * Creates surfaces as the constructor does, yielding to the event loop between slices of work, and smooths them until they
   * are settled: those of a large label map take seconds.
   *
   * @param slices - `signal`: aborts the creation; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws As the constructor; `signal.reason` when aborted.
   */
  static async create(
    classes: LabelClasses,
    volume: CornerstoneVolume,
    options: CornerstoneSurfacesOptions = {},
    slices?: SliceOptions,
  ): Promise<CornerstoneSurfaces> {
    const checked = checkedSlices(slices);
    const map = await LabelMap.create(classes, volumeFromCornerstone(volume), labelOptions(options), checked);
    try {
      const made = new CornerstoneSurfaces(classes, volume, map as CornerstoneSurfacesOptions);
      await withPause(checked.signal, async (pause) => {
        for (const segment of made.segments) {
          made.#readOne(segment);
          await pause.turn();
        }
      });
      return made;
    } catch (error) {
      map.free();
      throw error;
    }
  }

  /** The frame of reference of the volume, `'unknown'` if it states none, which Cornerstone does not accept. */
  get frameOfReferenceUID(): string {
    return this.#volume.metadata?.FrameOfReferenceUID || 'unknown';
  }

  /** Indices of the segments that have voxels, in ascending order. */
  get segments(): readonly number[] {
    return this.#map.surfaces.labels;
  }

  /** Warnings about the surfaces; empty if there are none. */
  get warnings(): Warning[] {
    return mergedWarnings(...this.segments.map((one) => this.mesh(one).warnings));
  }

  /** Returns the surface of a segment as a live mesh of this library, in LPS, such as to save it. */
  mesh(segment: number): Mesh {
    return this.#map.surfaces.mesh(segment);
  }

  /** Returns the surface of a segment; empty without voxels. The arrays are not modified afterwards. */
  geometry(segment: number): CornerstoneGeometry {
    return this.#shown.get(segment)?.geometry ?? { points: new Float32Array(), polys: new Uint32Array() };
  }

  /**
   * Adopts the voxels that have changed, and returns the segments whose surface is another one than at the last call;
   * some of them may have no voxels any more.
   *
   * @param slices - Indices of the slices along the third axis that have changed, such as `modifiedSlicesToUse` of the
   *   event `SEGMENTATION_DATA_MODIFIED`; default all.
   * @throws `VesicleError` `invalid-argument`: another type or number of voxels, or too many segments. Nothing has changed
   *   then.
   */
  update(slices?: readonly number[]): number[] {
    const range = slices?.length ? { first: Math.min(...slices), last: Math.max(...slices) } : undefined;
    this.#map.follow(scalarsOf(this.#volume), range);
    this.#map.settle();
    return this.#read();
  }

  #read(): number[] {
    const segments = new Set([...this.#shown.keys(), ...this.segments]);
    return [...segments].filter((segment) => this.#readOne(segment)).sort((a, b) => a - b);
  }

  /** Returns whether the surface has changed. */
  #readOne(segment: number): boolean {
    const reader = this.#shown.get(segment)?.reader ?? new MeshReader(undefined, undefined, REMEDY);
    const frame = reader.read(this.mesh(segment));
    if (!frame) return false;
    this.#shown.set(segment, { reader, geometry: { points: frame.positions.slice(), polys: polygons(frame) } });
    return true;
  }

  /** Frees the surfaces. */
  dispose(): void {
    this.#shown.clear();
    this.#map.free();
  }
}
