/**
 * Converts intensities to grey values for display: writes `values` as bytes into `out` from `offset` on, linear from 0
 * at `window[0]` and below to 255 at `window[1]` and above. NaN becomes 0; so do all values if the window is empty.
 */
export function quantize(values: Float32Array, window: [number, number], out: Uint8Array, offset: number): void {
  const [low, high] = window;
  const scale = high > low ? 255 / (high - low) : 0;
  for (let i = 0; i < values.length; i++) {
    const value = ((values[i] ?? 0) - low) * scale;
    out[offset + i] = Math.min(255, Math.max(0, value));
  }
}
