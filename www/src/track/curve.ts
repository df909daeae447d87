/** Evaluates the volume curve of a heartbeat, and warns of suspicious frames. */
import type { FrameStatistics } from './protocol';

export interface Beat {
  /** Number of the frame with the largest volume. */
  diastole: number;
  /** Number of the frame with the smallest volume. */
  systole: number;
  /** The largest volume, in the unit of the volumes evaluated. */
  largest: number;
  /** The smallest volume, in the unit of the volumes evaluated. */
  smallest: number;
  /** Ejection fraction, 0 to 1: (largest − smallest) / largest. */
  ejection: number;
}

/**
 * Returns the largest and smallest of the volumes of all frames, their frames, and the ejection fraction. Undefined for
 * fewer than two frames.
 */
export function beatOf(volumes: readonly number[]): Beat | undefined {
  if (volumes.length < 2) return undefined;
  const [largest, smallest] = [Math.max(...volumes), Math.min(...volumes)];
  const ejection = largest > 0 ? (largest - smallest) / largest : 0;
  return { diastole: volumes.indexOf(largest), systole: volumes.indexOf(smallest), largest, smallest, ejection };
}

/**
 * Largest share of folded triangles in a frame, which face away from the sum of their three neighbours; above it a
 * warning is shown.
 */
export const MAX_FOLDED_SHARE = 0.01;
/**
 * Largest relative deviation of a frame's area from the expected area; above it a warning is shown. Expected is the
 * area of the frame before times the ratio of volumes to the power of 2/3, as for a body that only grows or shrinks.
 */
export const MAX_AREA_JUMP = 0.15;

export interface FrameWarning {
  frame: number;
  kind: 'folded' | 'area';
  share: number;
}

type CheckedFacts = Pick<FrameStatistics, 'folded' | 'triangles' | 'area' | 'volume'>;

/**
 * Returns a warning for each frame with too many folded triangles or, after the first, an unexpected area: such frames
 * are suspicious even if their volume and error are plausible.
 */
export function warningsOf(facts: readonly CheckedFacts[]): FrameWarning[] {
  return facts.flatMap(({ folded, triangles, area, volume }, frame) => {
    const before = facts[frame - 1];
    const expected = before && before.area * (volume / before.volume) ** (2 / 3);
    const [share, jump] = [folded / (triangles || 1), expected ? area / expected - 1 : 0];
    return [
      ...(share > MAX_FOLDED_SHARE ? [{ frame, kind: 'folded' as const, share }] : []),
      ...(Math.abs(jump) > MAX_AREA_JUMP ? [{ frame, kind: 'area' as const, share: jump }] : []),
    ];
  });
}
