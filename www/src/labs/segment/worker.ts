/** Worker of the Segment lab: holds one volume, its label map and their surfaces, and serves the page's requests. */
import { LabelSurfaces, type Volume } from 'vesicle';
import { VesicleError, withTransfer } from 'vesicle/channel';
import type { LabelArray } from '../../engine/labels';
import { quantize } from '../../engine/quantize';
import { type Handlers, serveLab } from '../../engine/serving';
import { withLabels } from '../../engine/slicer';
import { areSmall, SEGMENT_OF_SMALL, tooManyLabels } from '../../engine/small-files';
import { snapshotOf } from '../../engine/surface';
import { triangleArea } from '../../engine/triangle-area';
import { displayOf, fitsNifti, viewOf } from '../../engine/volumes';
import type { Warning } from '../../engine/warnings';
import { text } from '../../texts';
import type {
  LabelBlock,
  LabelSurface,
  OpenedImage,
  OpenedLabels,
  ParamValues,
  Region,
  Requests,
  StepUpdate,
  Surface,
  SurfaceUpdate,
} from './protocol';
import { forEachRow } from './region';
import { mapLike, type OpenMap, type OpenVolume, openImage, openLabels } from './source';

let maps = 0;

/** Voxels beyond which the labels of a map are not kept a second time: before a change, they are read from the map. */
const MOST_KEPT = 2 ** 24;
/** Largest label that is read from a map exactly. */
const LARGEST_READ = 2 ** 24;

/** A label map with its surfaces. */
class LiveMap {
  readonly id = ++maps;
  readonly map: Volume;
  /** The labels; undefined if they are read from the map. */
  readonly #voxels: LabelArray | undefined;
  readonly surfaces: LabelSurfaces;
  /** Number of voxels of each label, the background included. */
  readonly #counts = new Map<number, number>();
  readonly #voxelVolume: number;
  /** Version of each label's surface when it was last sent. */
  readonly #sent = new Map<number, number>();

  constructor(
    image: Pick<OpenVolume, 'volume' | 'unit'>,
    voxels: LabelArray,
    warnings: readonly Warning[],
    params: ParamValues,
    { isSmall = false, state }: { isSmall?: boolean | undefined; state?: Uint8Array | undefined },
  ) {
    this.map = mapLike(image, voxels, warnings);
    this.#voxelVolume = Math.abs(determinant(image.volume.affine));
    try {
      const refusal = isSmall && tooManyLabels(this.map.labels().length);
      if (refusal) throw new VesicleError('too-large', refusal);
      this.surfaces = new LabelSurfaces({ volume: this.map, ...params, ...(isSmall && SEGMENT_OF_SMALL) });
      if (state) this.surfaces.restore(state);
    } catch (error) {
      this.map.free();
      throw error;
    }
    this.#countAll(voxels);
    const isReadExactly = [...this.#counts.keys()].every((label) => Math.abs(label) <= LARGEST_READ);
    if (voxels.length <= MOST_KEPT || !isReadExactly) this.#voxels = voxels;
  }

  /** Returns the labels, which the map was made of, for the page: a copy if they are kept here, too. */
  forPage(voxels: LabelArray): LabelArray {
    return this.#voxels ? voxels.slice() : voxels;
  }

  /** Labels whose surfaces have changed since they were last sent; also those that have lost all voxels. */
  get changed(): number[] {
    const known = [...this.#counts.keys()].filter((label) => label !== 0);
    return known.filter((label) => this.surfaces.mesh(label).geometryVersion !== this.#sent.get(label));
  }

  /** Changes voxels; the surfaces follow them by the next steps. */
  write(block: LabelBlock): void {
    const { min, dims } = block;
    this.#countRows(block, -1);
    this.map.write(block);
    let at = 0;
    forEachRow(block, this.map.dims, (first) => {
      const row = block.data.subarray(at, at + dims[0]);
      this.#voxels?.set(row, first);
      for (const label of row) this.#count(label, 1);
      at += dims[0];
    });
    this.surfaces.refresh({ min, dims });
  }

  describe(value: number): LabelSurface {
    const voxels = this.#counts.get(value) ?? 0;
    const surface = voxels > 0 ? snapshotOf(this.surfaces.mesh(value)) : undefined;
    this.#sent.set(value, this.surfaces.mesh(value).geometryVersion);
    return { value, voxels, volume: voxels * this.#voxelVolume, area: surface ? areaOf(surface) : 0, surface };
  }

  free(): void {
    this.surfaces.free();
    this.map.free();
  }

  /** Counts the present labels of a box, each as `change`. */
  #countRows(box: Region, change: number): void {
    const [nx, ny] = this.map.dims;
    let [plane, read] = [-1, new Float32Array() as ArrayLike<number>];
    forEachRow(box, this.map.dims, (first) => {
      const z = Math.floor(first / (nx * ny));
      if (z !== plane && !this.#voxels) [plane, read] = [z, this.map.slice(2, z)];
      const [labels, start] = this.#voxels ? [this.#voxels, first] : [read, first - z * nx * ny];
      for (let i = start; i < start + box.dims[0]; i++) this.#count(labels[i] ?? 0, change);
    });
  }

  #countAll(voxels: LabelArray): void {
    for (let first = 0, end = 0; first < voxels.length; first = end) {
      const label = voxels[first] ?? 0;
      while (end < voxels.length && voxels[end] === label) end += 1;
      this.#count(label, end - first);
    }
  }

  #count(label: number, change: number): void {
    this.#counts.set(label, (this.#counts.get(label) ?? 0) + change);
  }
}

class Session {
  #open: Pick<OpenVolume, 'volume' | 'unit'> | undefined;
  #live: LiveMap | undefined;

  readonly handlers: Handlers<Requests> = {
    open: (body) => this.#openImage(body),
    openLabels: ({ files }) => this.#openLabels(files),
    edit: ({ map, block }) => this.#step(map, block),
    step: ({ map }) => this.#step(map),
    save: () => this.#current().surfaces.save(),
    setParams: (params) => {
      const { surfaces } = this.#current();
      surfaces.setParams(params);
      return { ...surfaces.params };
    },
    mask: ({ low, high }) => this.#mask(low, high),
    exportMap: ({ format, labels }) => {
      const { map } = this.#current();
      if (format === 'nifti' && !fitsNifti(map)) throw new VesicleError('precision', text('segment.tooFarForNifti'));
      const file = map.toBytes(format, { gzip: true });
      return format === 'nrrd' ? withLabels(file, labels, map.dims) : file;
    },
    exportMesh: ({ value, format, ...options }) => this.#current().surfaces.mesh(value).toBytes(format, options),
  };

  async #openImage({ name, source, params, labels, ...session }: Requests['open']['body']): Promise<OpenedImage> {
    const began = performance.now();
    const known = { isSmall: !labels && areSmall(source.files), ...session };
    const opened = await openImage(source, known.isSmall);
    try {
      const voxels = labels ?? opened.map.voxels;
      const live = new LiveMap(opened, voxels, opened.map.warnings, params, known);
      this.#adopt(live);
      this.#open?.volume.free();
      this.#open = { volume: opened.volume, unit: opened.unit };
      const all = this.#all(live, { ...opened.map, voxels }, began);
      const volume = { ...viewOf(opened.volume, name, opened.voxels), ...displayOf(source) };
      const { looksLike } = opened;
      return withTransfer({ ...all, volume, looksLike, params: { ...live.surfaces.params } }, [
        ...arraysOf(all),
        all.voxels,
        volume.voxels,
      ]);
    } catch (error) {
      opened.volume.free();
      throw error;
    }
  }

  async #openLabels(files: Requests['openLabels']['body']['files']): Promise<OpenedLabels> {
    const began = performance.now();
    const image = this.#image();
    const isSmall = areSmall(files);
    const opened = await openLabels(files, image.volume, isSmall);
    const params = { ...this.#current().surfaces.params };
    const live = new LiveMap(image, opened.voxels, opened.warnings, params, { isSmall });
    this.#adopt(live);
    const all = this.#all(live, opened, began);
    return withTransfer(all, [...arraysOf(all), all.voxels]);
  }

  /** Makes a step, after a change of voxels if there is one, which a single step settles unless it is a large one. */
  #step(map: number, block?: LabelBlock): StepUpdate {
    const began = performance.now();
    const live = this.#current();
    if (map !== live.id) return { surfaces: [], milliseconds: 0, done: true, warnings: [] };
    if (block) live.write(block);
    const { done, warnings } = live.surfaces.step(1);
    const update = this.#update(done || block ? live.changed : [], began);
    return withTransfer({ ...update, done, warnings }, arraysOf(update));
  }

  #adopt(live: LiveMap): void {
    this.#live?.free();
    this.#live = live;
  }

  #all(live: LiveMap, { voxels, known, file }: OpenMap, began: number): OpenedLabels {
    const update = this.#update(live.surfaces.labels, began);
    const { warnings } = live.map;
    return { ...update, map: live.id, voxels: live.forPage(voxels), known, labelFile: file, warnings };
  }

  #update(labels: Iterable<number>, began: number): SurfaceUpdate {
    const live = this.#current();
    const surfaces = Array.from(labels, (label) => live.describe(label));
    const update = { surfaces, milliseconds: performance.now() - began };
    return withTransfer(update, arraysOf(update));
  }

  #mask(low: number, high: number): Uint8Array {
    const mask = this.#image().volume.threshold(low, high);
    try {
      const [nx, ny, nz] = mask.dims;
      const voxels = new Uint8Array(nx * ny * nz);
      for (let z = 0; z < nz; z++) quantize(mask.slice(2, z), [0, 1], voxels, z * nx * ny);
      return withTransfer(voxels, [voxels]);
    } finally {
      mask.free();
    }
  }

  #image(): Pick<OpenVolume, 'volume' | 'unit'> {
    if (!this.#open) throw new VesicleError('invalid-argument', text('segment.noVolume'));
    return this.#open;
  }

  #current(): LiveMap {
    if (!this.#live) throw new VesicleError('invalid-argument', text('segment.noVolume'));
    return this.#live;
  }
}

/** Returns the arrays of an update's surfaces, to be transferred. */
function arraysOf({ surfaces }: SurfaceUpdate): ArrayBufferView[] {
  return surfaces.flatMap(({ surface }) => (surface ? [surface.positions, surface.normals, surface.indices] : []));
}

function areaOf({ positions, indices, triangles }: Surface): number {
  let area = 0;
  for (let at = 0; at < 3 * triangles; at += 3) area += triangleArea(positions, indices, at);
  return area;
}

/** Returns the volume of a voxel, negative for a mirrored grid. */
function determinant(affine: ArrayLike<number>): number {
  const a = (column: number, row: number) => affine[4 * column + row] ?? 0;
  return (
    a(0, 0) * (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) -
    a(1, 0) * (a(0, 1) * a(2, 2) - a(0, 2) * a(2, 1)) +
    a(2, 0) * (a(0, 1) * a(1, 2) - a(0, 2) * a(1, 1))
  );
}

serveLab('labels', new Session().handlers);
