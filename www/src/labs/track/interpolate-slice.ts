/**
 * Interpolates a measured slice from its two neighbours, linearly and along the optical flow, to compare the results
 * with it (figure 5 of the paper).
 */

import { Volume } from 'vesicle';
import { VesicleError } from 'vesicle/channel';
import { quantize } from '../../engine/quantize';
import { text } from '../../texts';
import type { InterpolatedSlice } from './protocol';

/**
 * Interpolates slice number `slice` across the last voxel axis from its two neighbours, and returns both interpolations
 * with the measured slice, the neighbours and the errors. Throws a `VesicleError` for the first and last slice.
 */
export function interpolateSlice(
  volume: Volume,
  frame: number,
  slice: number,
  window: [number, number],
): InterpolatedSlice {
  const [width, height, slices] = volume.dims;
  if (slice < 1 || slice + 1 >= slices)
    throw new VesicleError('invalid-argument', text('track.noNeighbours', { slice, slices }));
  const [before, measured, after] = [-1, 0, 1].map((off) => volume.slice(2, slice + off, frame)) as Three;
  const interpolated = (method: 'flow' | 'linear') => interpolate(before, after, width, height, method);
  const [linear, flow] = [interpolated('linear'), interpolated('flow')];
  const greys = (values: Float32Array) => {
    const out = new Uint8Array(width * height);
    quantize(values, window, out, 0);
    return out;
  };
  const rmsError = { linear: rms(linear, measured), flow: rms(flow, measured) };
  return {
    ...{ width, height, rmsError, before: greys(before), flow: greys(flow), measured: greys(measured) },
    ...{ linear: greys(linear), after: greys(after) },
  };
}

type Three = [Float32Array, Float32Array, Float32Array];

function interpolate(
  one: Float32Array,
  other: Float32Array,
  width: number,
  height: number,
  method: 'flow' | 'linear',
): Float32Array {
  const data = new Float32Array(2 * width * height);
  data.set(one);
  data.set(other, width * height);
  // The spacing makes enrichSlices insert a slice between these two.
  const two = new Volume({ data, dims: [width, height, 2], spacing: [1, 1, 4] });
  const three = two.enrichSlices({ factor: 2, method });
  try {
    return three.slice(2, 1);
  } finally {
    two.free();
    three.free();
  }
}

function rms(one: Float32Array, other: Float32Array): number {
  const squares = one.reduce((sum, value, i) => sum + (value - (other[i] ?? 0)) ** 2, 0);
  return Math.sqrt(squares / one.length);
}
