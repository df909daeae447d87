/** Evaluates the volume of a tracked ventricle over a heartbeat, and warns of suspicious frames. */
import type { FrameStatistics } from './protocol';

export interface Beat {
  /** Index, from 0, of the frame with the largest volume. */
  diastole: number;
  /** Index, from 0, of the frame with the smallest volume. */
  systole: number;
  /** Largest volume of all frames, in the unit of the given volumes. */
  largest: number;
  /** Smallest volume of all frames, in the unit of the given volumes. */
  smallest: number;
  /** Ejection fraction, 0 to 1: (largest − smallest) / largest. */
  ejection: number;
}

/**
 * Returns the largest and smallest of the volumes of all frames, their frames, and the ejection fraction; undefined for
 * fewer than two frames, and if the surface is empty in one: nothing is ejected from an object that is not there.
 */
export function beatOf(volumes: readonly number[]): Beat | undefined {
  if (volumes.length < 2 || volumes.some((volume) => !(volume > 0))) return undefined;
  const [largest, smallest] = [Math.max(...volumes), Math.min(...volumes)];
  const ejection = (largest - smallest) / largest;
  return { diastole: volumes.indexOf(largest), systole: volumes.indexOf(smallest), largest, smallest, ejection };
}

/**
 * Share of folded triangles in a frame's surface above which a warning is shown; a triangle is folded if it faces away
 * from the sum of its three neighbours.
 */
export const MAX_FOLDED_SHARE = 0.01;
/**
 * Relative deviation of the area of a frame's surface from the expected area above which a warning is shown. Expected
 * is the area in the frame before times the ratio of volumes to the power of 2/3, as for a body that only grows or
 * shrinks.
 */
export const MAX_AREA_JUMP = 0.15;

export interface FrameWarning {
  frame: number;
  kind: 'folded' | 'area';
  share: number;
}

type CheckedFacts = Pick<FrameStatistics, 'folded' | 'triangles' | 'area' | 'volume'>;

/**
 * Returns a warning for each frame whose share of folded triangles exceeds `MAX_FOLDED_SHARE` or, after the first
 * frame, whose area deviates from the expected one by more than `MAX_AREA_JUMP`: such frames are suspicious even if
 * their volume and error are plausible.
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
