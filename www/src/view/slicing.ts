import type { Attractor, LevelView, VolumeView } from '../protocol';
import { pen } from '../ui/dom';
import type { SliceFrame } from './anatomy';

type Voxels = Pick<VolumeView, 'dims' | 'voxels'>;

/** Returns the size of slice images in this direction, voxels. */
export function pictureSize(volume: Voxels, frame: SliceFrame): { width: number; height: number } {
  return { width: volume.dims[frame.horizontal.axis], height: volume.dims[frame.vertical.axis] };
}

/**
 * Paints a slice as grey RGBA pixels in reading order, oriented as specified by `frame`. `out` holds 4 × width × height
 * bytes.
 */
export function paintSlice(volume: Voxels, frame: SliceFrame, index: number, out: Uint8ClampedArray): void {
  const { width, height } = pictureSize(volume, frame);
  const strides = [1, volume.dims[0], volume.dims[0] * volume.dims[1]] as const;
  const across = strides[frame.horizontal.axis] * (frame.horizontal.flip ? -1 : 1);
  const first = frame.horizontal.flip ? (width - 1) * strides[frame.horizontal.axis] : 0;
  let target = 0;
  for (let j = 0; j < height; j++) {
    const row = (frame.vertical.flip ? height - 1 - j : j) * strides[frame.vertical.axis];
    let source = index * strides[frame.axis] + row + first;
    for (let i = 0; i < width; i++) {
      const grey = volume.voxels[source] ?? 0;
      out[target++] = grey;
      out[target++] = grey;
      out[target++] = grey;
      out[target++] = 255;
      source += across;
    }
  }
}

/** Returns the grey values of a slice in reading order. */
export function greysOf(volume: Voxels, frame: SliceFrame, index: number): Uint8Array {
  const { width, height } = pictureSize(volume, frame);
  const rgba = new Uint8ClampedArray(4 * width * height);
  paintSlice(volume, frame, index, rgba);
  return Uint8Array.from({ length: width * height }, (_, i) => rgba[4 * i] ?? 0);
}

/** Returns the index of the slice of a coarser level at the position of the volume's slice with the given index. */
export function levelIndex(volume: Voxels, level: LevelView, frame: SliceFrame, index: number): number {
  const last = level.dims[frame.axis] - 1;
  return Math.min(last, Math.floor(((index + 0.5) * level.dims[frame.axis]) / volume.dims[frame.axis]));
}

/** Paints a slice of a coarser level, stretched to the size of the volume's slices so that its voxels are visible. */
export function paintLevel(
  volume: Voxels,
  level: LevelView,
  frame: SliceFrame,
  index: number,
  picture: HTMLCanvasElement,
): void {
  const small = slicePicture(level, frame, levelIndex(volume, level, frame, index));
  const context = pen(picture);
  if (!context) return;
  context.imageSmoothingEnabled = false;
  context.drawImage(small, 0, 0, picture.width, picture.height);
}

/** Renders a slice as an image on a new canvas. */
export function slicePicture(volume: Voxels, frame: SliceFrame, index: number): HTMLCanvasElement {
  const { width, height } = pictureSize(volume, frame);
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const pixels = new ImageData(width, height);
  paintSlice(volume, frame, index, pixels.data);
  pen(canvas)?.putImageData(pixels, 0, 0);
  return canvas;
}

/**
 * Returns the intersection of an attractor's ball of influence with a slice, in the coordinates of
 * {@link projectSegments}, or undefined if there is none. `near`: the point itself lies within half a voxel of the
 * slice.
 */
export function discOf(
  { point, radius }: Pick<Attractor, 'point' | 'radius'>,
  slice: number,
  inverse: ArrayLike<number>,
  volume: Pick<VolumeView, 'dims' | 'spacing'>,
  frame: SliceFrame,
): { x: number; y: number; radiusX: number; radiusY: number; near: boolean } | undefined {
  const [x = 0, y = 0] = projectSegments(new Float32Array(point), inverse, volume, frame);
  const { axis } = frame;
  const row = [0, 4, 8].reduce((sum, column, i) => sum + (inverse[column + axis] ?? 0) * (point[i] ?? 0), 0);
  const off = Math.abs(row + (inverse[12 + axis] ?? 0) - slice);
  const left = radius ** 2 - (off * volume.spacing[axis]) ** 2;
  if (left <= 0) return undefined;
  const [radiusX, radiusY] = [frame.horizontal, frame.vertical].map(
    (side) => Math.sqrt(left) / volume.spacing[side.axis],
  );
  return { x, y, radiusX: radiusX ?? 0, radiusY: radiusY ?? 0, near: off <= 0.5 };
}

/**
 * Projects world segments (pairs of points) onto a slice: image coordinates in voxels, x y x y per segment; (0, 0) is
 * the image's top left corner, so that the first voxel's centre is at (½, ½).
 */
export function projectSegments(
  segments: Float32Array,
  inverse: ArrayLike<number>,
  volume: Pick<VolumeView, 'dims'>,
  frame: SliceFrame,
): Float32Array {
  const out = new Float32Array((segments.length / 3) * 2);
  const sides = [frame.horizontal, frame.vertical] as const;
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
