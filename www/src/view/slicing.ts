import type { VolumeView } from '../protocol';
import type { SliceFrame } from './anatomy';

/** How many voxels wide and high the pictures of a slice direction are. */
export function pictureSize(volume: VolumeView, frame: SliceFrame): { width: number; height: number } {
  return { width: volume.dims[frame.horizontal.axis], height: volume.dims[frame.vertical.axis] };
}

/** One slice as grey RGBA pixels in reading order, turned the way its frame says. `out` holds 4 × width × height bytes. */
export function paintSlice(volume: VolumeView, frame: SliceFrame, index: number, out: Uint8ClampedArray): void {
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

/**
 * World segments (pairs of points) as picture coordinates in voxels, x y x y per segment; (0, 0) is the picture's top
 * left corner, so that the first voxel's centre is at (½, ½).
 */
export function projectSegments(
  segments: Float32Array,
  inverse: ArrayLike<number>,
  volume: VolumeView,
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
