/**
 * Adapter for vtk.js and itk-wasm: converts their images, and shows a vtk.js surface that follows a mesh.
 *
 * Nothing of either is imported: the caller passes vtk's classes.
 *
 * @module vesicle/vtk
 */
import { choice, invalid } from '../check.js';
import type { Space, VolumeInit } from '../data.js';
import { affineOf, MeshReader, type MeshSource, type SurfaceArrays, voxels } from './source.js';

export type { MeshSource } from './source.js';

/** The methods of a `vtkImageData` of vtk.js that {@link volumeFromVtk} calls. */
export interface VtkImage {
  getDimensions(): number[];
  getExtent(): number[];
  getIndexToWorld(): ArrayLike<number>;
  getPointData(): { getScalars(): { getData(): ArrayLike<number>; getNumberOfComponents(): number } | null };
}

/** The properties of an itk-wasm `Image` that {@link volumeFromItk} reads. */
export interface ItkImage {
  imageType: { dimension: number; components: number; pixelType: string };
  size: ArrayLike<number>;
  spacing: ArrayLike<number>;
  origin: ArrayLike<number>;
  /** Direction cosines of the image axes, row-major, with one axis per column. */
  direction: ArrayLike<number | bigint>;
  data: unknown;
}

/**
 * Converts a `vtkImageData` of vtk.js to the options of a `Volume`: `new Volume(volumeFromVtk(image))`.
 *
 * @param options - `space`: orientation of the image's world axes, which vtk.js does not know; default LPS, as produced
 *   by itk and DICOM readers.
 * @throws `VesicleError` `invalid-argument`: no such image, no scalars, several numbers a voxel, a voxel type that a
 *   `Volume` does not store, or no such space.
 */
export function volumeFromVtk(image: VtkImage, options: { space?: Space } = {}): VolumeInit {
  const scalars = scalarsOf(image);
  const matrix = image.getIndexToWorld();
  const [x = 0, , y = 0, , z = 0] = image.getExtent();
  const columns = [0, 4, 8].map((first) => [0, 1, 2].map((row) => Number(matrix[first + row])));
  // The first voxel is at the start of the extent, which need not be 0.
  const first = [0, 1, 2].map((row) => Number(matrix[12 + row]) + dot([x, y, z], columns, row));
  return {
    ...voxels(scalars.getData(), image.getDimensions()),
    affine: affineOf(columns, first),
    space: choice('space', options.space ?? 'LPS', ['RAS', 'LPS']),
  };
}

const dot = (index: number[], columns: number[][], row: number): number =>
  index.reduce((sum, value, k) => sum + value * (columns[k]?.[row] ?? 0), 0);

function scalarsOf(image: VtkImage) {
  const { getIndexToWorld, getPointData } = Object(image) as Partial<VtkImage>;
  if (!getIndexToWorld || !getPointData) throw invalid('image', 'must be a vtkImageData');
  const scalars = getPointData().getScalars();
  if (!scalars) throw invalid('image', 'has no scalars; must be a vtkImageData with one number per voxel');
  const components = scalars.getNumberOfComponents();
  if (components === 1) return scalars;
  throw invalid('image', `${components} numbers per voxel; only one is supported`);
}

/**
 * Converts an `Image` of itk-wasm, 3D, or 4D with frames last, to the options of a `Volume`:
 * `new Volume(volumeFromItk(image))`. World space is LPS. The caller adds the seconds between frames, because not all
 * files state them.
 *
 * @throws `VesicleError` `invalid-argument`: no such image, another dimension, several numbers a voxel, or a voxel type
 *   that a `Volume` does not store.
 */
export function volumeFromItk(image: ItkImage): VolumeInit {
  const { imageType, size, spacing, origin, direction, data } = Object(image) as ItkImage;
  if (!imageType || !size || !direction) throw invalid('image', 'must be an Image of itk-wasm');
  const { dimension, components, pixelType } = imageType;
  if (dimension !== 3 && dimension !== 4) throw invalid('image', `must be a 3D or 4D image, got ${dimension}D`);
  if (components !== 1) throw invalid('image', `${components} numbers per voxel, ${pixelType}; only one is supported`);
  const cosine = (row: number, column: number) => Number(direction[column + row * dimension]);
  const columns = [0, 1, 2].map((column) => [0, 1, 2].map((row) => cosine(row, column) * Number(spacing[column])));
  return { ...voxels(data, Array.from(size)), affine: affineOf(columns, origin), space: 'LPS' };
}

interface DataArray {
  setData(values: Float32Array | Uint32Array, components?: number): void;
}

/** The methods of a `vtkPolyData` of vtk.js that {@link VtkSurface} calls. */
export interface VtkPolyData {
  getPoints(): DataArray;
  getPolys(): DataArray;
  getPointData(): { setNormals(array: DataArray): unknown };
  modified(): void;
  delete(): void;
}

/** The classes of vtk.js that {@link VtkSurface} needs: `{ vtkPolyData, vtkDataArray }`. */
export interface VtkClasses<P extends VtkPolyData> {
  vtkPolyData: { newInstance(): P };
  vtkDataArray: { newInstance(values: { name: string; numberOfComponents: number; values: Float32Array }): DataArray };
}

/**
 * A `vtkPolyData` that follows a mesh, through all changes of connectivity.
 *
 * ```js
 * const surface = new VtkSurface({ vtkPolyData, vtkDataArray });
 * mapper.setInputData(surface.polyData);
 * surface.update(model.mesh); // after every step, then render
 * ```
 *
 * Points are those of the mesh, in its volume's world space unless `worldSpace` is another one; they have outward
 * normals.
 */
export class VtkSurface<P extends VtkPolyData> {
  /** The surface as input of a `vtkMapper`; the same object from start to end. */
  readonly polyData: P;
  readonly #normals: DataArray;
  readonly #reader: MeshReader;

  /**
   * Creates a surface that is empty before the first update.
   *
   * @param vtk - The classes of vtk.js.
   * @param options - `space` of the mesh and `worldSpace` of the view: if both are given and differ, the signs of x and
   *   y are flipped.
   * @throws `VesicleError` `invalid-argument`: classes that are missing, or no such space.
   */
  constructor(vtk: VtkClasses<P>, options: { space?: Space; worldSpace?: Space } = {}) {
    for (const name of ['vtkPolyData', 'vtkDataArray'] as const) {
      if (typeof Object(vtk)[name]?.newInstance !== 'function') throw invalid('vtk', `has no ${name} of vtk.js`);
    }
    this.#reader = new MeshReader(options.space, options.worldSpace);
    this.polyData = vtk.vtkPolyData.newInstance();
    this.#normals = vtk.vtkDataArray.newInstance({
      name: 'Normals',
      numberOfComponents: 3,
      values: new Float32Array(),
    });
    this.polyData.getPointData().setNormals(this.#normals);
  }

  /**
   * Updates the poly data if `mesh` has changed since the last call; the next rendering uploads it. Returns whether
   * `mesh` had changed.
   *
   * @throws `VesicleError` `invalid-argument`: no mesh.
   */
  update(mesh: MeshSource): boolean {
    const frame = this.#reader.read(mesh);
    if (!frame) return false;
    // vtk.js keeps the arrays, so they are copied.
    this.polyData.getPoints().setData(frame.positions.slice(), 3);
    this.#normals.setData(frame.normals.slice(), 3);
    if (frame.topology) this.polyData.getPolys().setData(polygons(frame));
    this.polyData.modified();
    return true;
  }

  /** Deletes the poly data; remove its actor from the view first. */
  dispose(): void {
    this.#reader.clear();
    this.polyData.delete();
  }
}

/** Returns the triangles as vtk cells: each preceded by its number of corners. */
function polygons({ indices }: SurfaceArrays): Uint32Array {
  const cells = new Uint32Array((indices.length / 3) * 4);
  for (let from = 0, to = 0; from < indices.length; from += 3, to += 4) {
    cells[to] = 3;
    cells[to + 1] = indices[from] as number;
    cells[to + 2] = indices[from + 1] as number;
    cells[to + 3] = indices[from + 2] as number;
  }
  return cells;
}
