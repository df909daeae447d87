// Converts images of vtk.js and itk-wasm to volumes.
import { choice, invalid } from '../check.js';
import type { Space, VolumeInit } from '../data.js';
import { affineOf, voxels } from './source.js';

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
