import type { Attractor, LevelView, VolumeView } from '../engine/protocol';
import { context2d } from '../kit/dom';
import type { SliceOrientation } from './anatomy';

/** Intensities that are displayed as black and as white. */
export type DisplayWindow = [low: number, high: number];

type Grid = Pick<LevelView, 'dims'>;

/** Returns the size, in voxels, of slice images of a volume in an orientation. */
export function pictureSize(volume: Grid, orientation: SliceOrientation): { width: number; height: number } {
  return { width: volume.dims[orientation.horizontal.axis], height: volume.dims[orientation.vertical.axis] };
}

/**
 * Paints the slice with the given index as grey RGBA pixels, row by row, oriented as specified by `orientation`, linear
 * from black to white over the intensities of the window; NaN is black. `out` holds 4 × width × height bytes.
 */
export function paintSlice(
  volume: LevelView,
  orientation: SliceOrientation,
  index: number,
  out: Uint8ClampedArray,
  [low, high]: DisplayWindow = volume.window,
): void {
  const { width, height } = pictureSize(volume, orientation);
  const strides = [1, volume.dims[0], volume.dims[0] * volume.dims[1]] as const;
  const across = strides[orientation.horizontal.axis] * (orientation.horizontal.flip ? -1 : 1);
  const first = orientation.horizontal.flip ? (width - 1) * strides[orientation.horizontal.axis] : 0;
  const [slope, intercept] = volume.scale ?? [1, 0];
  const black = (low - intercept) / slope;
  const scale = high > low ? (255 * slope) / (high - low) : 0;
  let target = 0;
  for (let j = 0; j < height; j++) {
    const row = (orientation.vertical.flip ? height - 1 - j : j) * strides[orientation.vertical.axis];
    let source = index * strides[orientation.axis] + row + first;
    for (let i = 0; i < width; i++) {
      // The array of pixels rounds and clamps.
      const value = ((volume.voxels[source] ?? 0) - black) * scale;
      const grey = volume.inverted ? 255 - value : value;
      out[target++] = grey;
      out[target++] = grey;
      out[target++] = grey;
      out[target++] = 255;
      source += across;
    }
  }
}

/**
 * Returns the grey values, 0..255, of the slice with the given index, row by row, oriented as specified by
 * `orientation`.
 */
export function greysOf(volume: LevelView, orientation: SliceOrientation, index: number): Uint8Array {
  const { width, height } = pictureSize(volume, orientation);
  const rgba = new Uint8ClampedArray(4 * width * height);
  paintSlice(volume, orientation, index, rgba);
  return Uint8Array.from({ length: width * height }, (_, i) => rgba[4 * i] ?? 0);
}

/**
 * Returns the index of that slice of a coarser pyramid level, `level`, which is at the position of the volume's slice
 * `index`.
 */
export function levelIndex(volume: Grid, level: Grid, orientation: SliceOrientation, index: number): number {
  const last = level.dims[orientation.axis] - 1;
  return Math.min(last, Math.floor(((index + 0.5) * level.dims[orientation.axis]) / volume.dims[orientation.axis]));
}

/**
 * Paints that slice of a coarser pyramid level, `level`, which is at the position of the volume's slice `index`,
 * stretched to the size of the volume's slices so that its voxels are visible.
 */
export function paintLevel(
  volume: LevelView,
  level: LevelView,
  orientation: SliceOrientation,
  index: number,
  picture: HTMLCanvasElement,
  window: DisplayWindow,
): void {
  const small = slicePicture(level, orientation, levelIndex(volume, level, orientation, index), window);
  const context = context2d(picture);
  if (!context) return;
  context.imageSmoothingEnabled = false;
  context.drawImage(small, 0, 0, picture.width, picture.height);
}

/** Returns a new canvas with the slice with the given index as a grey image, one pixel a voxel. */
export function slicePicture(
  volume: LevelView,
  orientation: SliceOrientation,
  index: number,
  window = volume.window,
): HTMLCanvasElement {
  const { width, height } = pictureSize(volume, orientation);
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const pixels = new ImageData(width, height);
  paintSlice(volume, orientation, index, pixels.data, window);
  context2d(canvas)?.putImageData(pixels, 0, 0);
  return canvas;
}

/**
 * Returns the ellipse in which the ball of radius `radius` (world units) around an attractor's `point` intersects a
 * slice, in the image coordinates of {@link projectSegments}, or undefined if it does not. `near`: the point lies
 * within half a voxel of the slice. `inverse` maps world space to voxel indices.
 */
export function ballSection(
  { point, radius }: Pick<Attractor, 'point' | 'radius'>,
  slice: number,
  inverse: ArrayLike<number>,
  volume: Pick<VolumeView, 'dims' | 'spacing'>,
  orientation: SliceOrientation,
): { x: number; y: number; radiusX: number; radiusY: number; near: boolean } | undefined {
  const [x = 0, y = 0] = projectSegments(point, inverse, volume, orientation);
  const { axis } = orientation;
  const row = [0, 4, 8].reduce((sum, column, i) => sum + (inverse[column + axis] ?? 0) * (point[i] ?? 0), 0);
  const off = Math.abs(row + (inverse[12 + axis] ?? 0) - slice);
  const left = radius ** 2 - (off * volume.spacing[axis]) ** 2;
  if (left <= 0) return undefined;
  const [radiusX, radiusY] = [orientation.horizontal, orientation.vertical].map(
    (side) => Math.sqrt(left) / volume.spacing[side.axis],
  );
  return { x, y, radiusX: radiusX ?? 0, radiusY: radiusY ?? 0, near: off <= 0.5 };
}

/**
 * Projects segments in world space (pairs of points, packed xyz) onto a slice image, to draw the surface's outline:
 * returns image coordinates in voxels, x y x y per segment; (0, 0) is the image's top left corner, so that the first
 * voxel's centre is at (½, ½).
 */
export function projectSegments(
  segments: ArrayLike<number>,
  inverse: ArrayLike<number>,
  volume: Pick<VolumeView, 'dims'>,
  orientation: SliceOrientation,
): Float32Array {
  const out = new Float32Array((segments.length / 3) * 2);
  const sides = [orientation.horizontal, orientation.vertical] as const;
  for (let point = 0; 3 * point < segments.length; point++) {
    const x = segments[3 * point] ?? 0;
    const y = segments[3 * point + 1] ?? 0;
    const z = segments[3 * point + 2] ?? 0;
    for (const [side, { axis, flip }] of sides.entries()) {
      const index =
        (inverse[axis] ?? 0) * x +
        (inverse[4 + axis] ?? 0) * y +
        (inverse[8 + axis] ?? 0) * z +
        (inverse[12 + axis] ?? 0);
      out[2 * point + side] = (flip ? volume.dims[axis] - 1 - index : index) + 0.5;
    }
  }
  return out;
}
