/** What the volumes of a heartbeat say. */
import type { FrameFacts } from './protocol';

export interface Beat {
  /** Frame of the largest and of the smallest volume. */
  diastole: number;
  systole: number;
  /** Volumes then. */
  largest: number;
  smallest: number;
  /** Share of the largest that is driven out. */
  ejection: number;
}

/** Nothing of fewer than two frames, which have no largest and smallest. */
export function beatOf(volumes: readonly number[]): Beat | undefined {
  if (volumes.length < 2) return undefined;
  const [largest, smallest] = [Math.max(...volumes), Math.min(...volumes)];
  const ejection = largest > 0 ? (largest - smallest) / largest : 0;
  return { diastole: volumes.indexOf(largest), systole: volumes.indexOf(smallest), largest, smallest, ejection };
}

/** Of the triangles, more than this share facing the other way is worth a warning. */
export const FOLDED = 0.01;
/** From one frame to the next the area of a body that only grows or shrinks goes with its volume to the power of 2/3; more than this share off is worth a warning. */
export const AREA_JUMP = 0.15;

export interface Warned {
  frame: number;
  kind: 'folded' | 'area';
  share: number;
}

type Suspect = Pick<FrameFacts, 'folded' | 'triangles' | 'area' | 'volume'>;

/** The frames that are suspect even where volume and error look well. */
export function warningsOf(facts: readonly Suspect[]): Warned[] {
  return facts.flatMap(({ folded, triangles, area, volume }, frame) => {
    const before = facts[frame - 1];
    const expected = before && before.area * (volume / before.volume) ** (2 / 3);
    const [share, jump] = [folded / (triangles || 1), expected ? area / expected - 1 : 0];
    return [
      ...(share > FOLDED ? [{ frame, kind: 'folded' as const, share }] : []),
      ...(Math.abs(jump) > AREA_JUMP ? [{ frame, kind: 'area' as const, share: jump }] : []),
    ];
  });
}
