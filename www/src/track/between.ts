/** What lies between two slices, by linear interpolation and along the optical flow (figure 5). */
import { Volume } from 'vesicle';
import { quantize } from '../quantize';
import { Refusal } from '../worker/refusal';
import type { Between } from './protocol';

/** The slice half way between `slice` and the next one along the last voxel axis. */
export function betweenSlices(volume: Volume, frame: number, slice: number, window: [number, number]): Between {
  const [width, height, slices] = volume.dims;
  if (slice < 0 || slice + 1 >= slices)
    throw new Refusal('invalid-argument', `slice ${slice} has no next one: there are ${slices}`);
  const pair = new Float32Array(2 * width * height);
  pair.set(volume.slice(2, slice, frame));
  pair.set(volume.slice(2, slice + 1, frame), width * height);
  const greys = (values: Float32Array) => {
    const out = new Uint8Array(width * height);
    quantize(values, window, out, 0);
    return out;
  };
  const middle = (method: 'flow' | 'linear') => {
    // Far from each other, so that it is between these two that a slice is put.
    const two = new Volume({ data: pair, dims: [width, height, 2], spacing: [1, 1, 4] });
    const three = two.enrichSlices({ factor: 2, method });
    try {
      return greys(three.slice(2, 1));
    } finally {
      two.free();
      three.free();
    }
  };
  return {
    width,
    height,
    first: greys(pair.subarray(0, width * height)),
    second: greys(pair.subarray(width * height)),
    linear: middle('linear'),
    flow: middle('flow'),
  };
}
