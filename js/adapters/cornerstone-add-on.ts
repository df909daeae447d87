// An add-on of `@cornerstonejs/tools` that converts label maps to surfaces, and keeps them up to date.
import { invalid } from '../check.js';
import { CornerstoneSurfaces, type CornerstoneVolume } from './cornerstone.js';
import type { LabelClasses } from './label-map.js';

/** A `Surface` of `@cornerstonejs/core`. */
interface CachedSurface {
  points: unknown;
  polys: unknown;
}

interface Segmentation {
  representationData: { Labelmap?: object; Surface?: { geometryIds: Map<number, string> } };
}

/** The parts of Cornerstone that the add-on uses. */
export interface Cornerstone {
  /** `import * as core from '@cornerstonejs/core'`. */
  core: {
    cache: { getGeometry(id: string): { data: unknown } | undefined };
    geometryLoader: { createAndCacheGeometry(id: string, options: never): unknown };
    Enums: { GeometryType: { SURFACE: unknown } };
    eventTarget: {
      addEventListener(type: string, listener: (event: never) => void): void;
      removeEventListener(type: string, listener: (event: never) => void): void;
    };
  };
  /** `import * as tools from '@cornerstonejs/tools'`. */
  tools: {
    Enums: { Events: { SEGMENTATION_DATA_MODIFIED: string; SEGMENTATION_REMOVED: string } };
    segmentation: {
      state: { getSegmentation(id: string): unknown };
      triggerSegmentationEvents: { triggerSegmentationModified(id: string): void };
    };
    utilities: { segmentation: { getOrCreateSegmentationVolume(id: string): unknown } };
  };
}

/** The classes of this library and the modules of Cornerstone that {@link cornerstoneAddOn} needs. */
export interface CornerstoneClasses extends LabelClasses, Cornerstone {}

/** The conversions that Cornerstone's tools call, as returned by {@link cornerstoneAddOn}. */
export interface CornerstoneAddOn {
  init(): void;
  canComputeRequestedRepresentation(segmentationId: string, type: string): boolean;
  computeSurfaceData(segmentationId: string, options?: object): Promise<{ geometryIds: Map<number, string> }>;
  updateSurfaceData(segmentationId: string, options?: object): Promise<void>;
  /** The surfaces of a segmentation, undefined before they were asked for. */
  surfaces(segmentationId: string): CornerstoneSurfaces | undefined;
  /** Stops following, and frees all surfaces. */
  dispose(): void;
}

/** Events of one frame are followed together; without slices, all are compared. */
type Changed = Set<number> | 'all';

/**
 * Returns an add-on that converts label maps to surfaces, in place of `@cornerstonejs/polymorphic-segmentation` or
 * together with it:
 *
 * ```js
 * cornerstoneTools.init({ addons: { polySeg: cornerstoneAddOn({ core, tools, Volume, LabelSurfaces }) } });
 * ```
 *
 * A surface representation of a segmentation is then made from its label map, and follows each change of its voxels in
 * the next frame; nothing is extracted again.
 *
 * @param classes - Cornerstone's modules, and classes of this library, on the main thread.
 * @param polySeg - Another add-on, which makes all other conversions; default none.
 * @throws `VesicleError` `invalid-argument`: modules that are missing.
 */
export function cornerstoneAddOn<T extends object = object>(
  classes: CornerstoneClasses,
  polySeg?: T,
): T & CornerstoneAddOn {
  for (const name of ['core', 'tools'] as const) {
    if (!Object(classes)[name]) throw invalid(name, `needs the module of Cornerstone: import * as ${name} from …`);
  }
  const own = new AddOn(classes, polySeg as Partial<CornerstoneAddOn> | undefined);
  return { ...polySeg, ...own.functions() } as T & CornerstoneAddOn;
}

class AddOn {
  readonly #classes: CornerstoneClasses;
  readonly #other: Partial<CornerstoneAddOn> | undefined;
  readonly #known = new Map<string, CornerstoneSurfaces>();
  /** Ends the creation of the surfaces of a segmentation that is under way. */
  readonly #making = new Map<string, AbortController>();
  readonly #changed = new Map<string, Changed>();
  #frame: number | undefined;

  constructor(classes: CornerstoneClasses, other: Partial<CornerstoneAddOn> | undefined) {
    [this.#classes, this.#other] = [classes, other];
  }

  functions(): CornerstoneAddOn {
    return {
      init: () => this.#init(),
      canComputeRequestedRepresentation: (id, type) =>
        this.#converts(id, type) || Boolean(this.#other?.canComputeRequestedRepresentation?.(id, type)),
      computeSurfaceData: async (id, options) =>
        this.#converts(id, 'Surface') || !this.#other?.computeSurfaceData
          ? this.#compute(id)
          : this.#other.computeSurfaceData(id, options),
      updateSurfaceData: async (id, options) => {
        if (this.#known.has(id)) this.#update(id);
        // Those that are being created follow at the end.
        else if (!this.#making.has(id)) await this.#other?.updateSurfaceData?.(id, options);
      },
      surfaces: (id) => this.#known.get(id),
      dispose: () => this.#dispose(),
    };
  }

  #init(): void {
    const { core, tools } = this.#classes;
    this.#other?.init?.();
    core.eventTarget.addEventListener(tools.Enums.Events.SEGMENTATION_DATA_MODIFIED, this.#note);
    core.eventTarget.addEventListener(tools.Enums.Events.SEGMENTATION_REMOVED, this.#remove);
  }

  #dispose(): void {
    const { core, tools } = this.#classes;
    core.eventTarget.removeEventListener(tools.Enums.Events.SEGMENTATION_DATA_MODIFIED, this.#note);
    core.eventTarget.removeEventListener(tools.Enums.Events.SEGMENTATION_REMOVED, this.#remove);
    if (this.#frame !== undefined) cancelAnimationFrame(this.#frame);
    for (const id of [...this.#known.keys(), ...this.#making.keys()]) this.#forget(id);
  }

  #segmentation(id: string): Segmentation | undefined {
    return this.#classes.tools.segmentation.state.getSegmentation(id) as Segmentation | undefined;
  }

  #converts(id: string, type: string): boolean {
    return type === 'Surface' && this.#segmentation(id)?.representationData.Labelmap !== undefined;
  }

  /** Cornerstone's own listener waits 300 ms for the end of a stroke. */
  readonly #note = ({ detail }: { detail: { segmentationId: string; modifiedSlicesToUse?: number[] } }): void => {
    const { segmentationId: id, modifiedSlicesToUse: slices } = detail;
    if (!this.#known.has(id)) return;
    const before = this.#changed.get(id) ?? new Set<number>();
    if (!slices?.length || before === 'all') this.#changed.set(id, 'all');
    else this.#changed.set(id, new Set([...before, ...slices]));
    this.#frame ??= requestAnimationFrame(() => {
      this.#frame = undefined;
      this.#follow();
    });
  };

  readonly #remove = ({ detail }: { detail: { segmentationId: string } }): void => {
    this.#forget(detail.segmentationId);
  };

  #forget(id: string): void {
    this.#making.get(id)?.abort();
    this.#making.delete(id);
    this.#known.get(id)?.dispose();
    this.#known.delete(id);
  }

  #follow(): void {
    const noted = [...this.#changed];
    this.#changed.clear();
    for (const [id, slices] of noted) {
      if (!this.#known.has(id)) continue;
      if (this.#update(id, slices))
        this.#classes.tools.segmentation.triggerSegmentationEvents.triggerSegmentationModified(id);
    }
  }

  async #compute(id: string): Promise<{ geometryIds: Map<number, string> }> {
    const volume = this.#classes.tools.utilities.segmentation.getOrCreateSegmentationVolume(id);
    this.#forget(id);
    const making = new AbortController();
    this.#making.set(id, making);
    const { signal } = making;
    const surfaces = await CornerstoneSurfaces.create(
      this.#classes,
      volume as CornerstoneVolume,
      {},
      { signal },
    ).finally(() => signal.aborted || this.#making.delete(id));
    this.#known.set(id, surfaces);
    // Voxels may have changed meanwhile.
    surfaces.update();
    return { geometryIds: new Map(surfaces.segments.map((segment) => [segment, this.#cached(id, surfaces, segment)])) };
  }

  /** Updates the cached surfaces; returns whether any has changed. */
  #update(id: string, slices: Changed = 'all'): boolean {
    const surfaces = this.#known.get(id);
    const geometryIds = this.#segmentation(id)?.representationData.Surface?.geometryIds;
    if (!surfaces || !geometryIds) return false;
    const changed = surfaces.update(slices === 'all' ? undefined : [...slices]);
    for (const segment of changed) geometryIds.set(segment, this.#cached(id, surfaces, segment));
    return changed.length > 0;
  }

  /** Puts the surface of a segment into Cornerstone's cache; returns its id there. */
  #cached(id: string, surfaces: CornerstoneSurfaces, segment: number): string {
    const { cache, geometryLoader, Enums } = this.#classes.core;
    const geometryId = `segmentation_${id}_surface_${segment}`;
    const { points, polys } = surfaces.geometry(segment);
    const known = cache.getGeometry(geometryId)?.data as CachedSurface | undefined;
    if (known) {
      Object.assign(known, { points: distinct(points, known), polys });
    } else {
      const { frameOfReferenceUID } = surfaces;
      const geometryData = { id: geometryId, points, polys, segmentIndex: segment, frameOfReferenceUID };
      geometryLoader.createAndCacheGeometry(geometryId, { type: Enums.GeometryType.SURFACE, geometryData } as never);
    }
    return geometryId;
  }
}

/**
 * Cornerstone does not draw a surface again whose arrays have the lengths that they had: then a point is added, which no
 * triangle uses.
 */
function distinct(points: Float32Array, { points: before }: CachedSurface): Float32Array {
  if ((before as ArrayLike<number>).length !== points.length) return points;
  const longer = new Float32Array(points.length + 3);
  longer.set(points);
  longer.set(points.subarray(0, 3), points.length);
  return longer;
}
