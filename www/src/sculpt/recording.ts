/** Films as animated GLB. Used by the worker only. */
import { animationGlb, type Mesh, type MultiresolutionModel } from 'vesicle';
import { type Film, lastFrame, poseAt } from './film';

/** Frames in which the surface may come to the first pose: longer ways than that are jumps, and are seen as such. */
const MOST_TO_START = 60;

/**
 * All frames from the first to the last as one file; in a loop the last is left out, as it is the first. Undefined when
 * the signal aborts it. The model ends in the last pose.
 */
export async function recorded(
  model: MultiresolutionModel,
  film: Film,
  frameSeconds: number,
  signal: AbortSignal,
  tell: (part: number) => void,
): Promise<Uint8Array | undefined> {
  const frames: Mesh[] = [];
  const last = lastFrame(film) - (film.loop ? 1 : 0);
  try {
    model.setEllipsoids(poseAt(film, 0));
    for (let i = 0; i < MOST_TO_START && !model.step(1).done; i++) if (await isCancelled(signal)) return undefined;
    for (let frame = 0; frame <= last; frame++) {
      model.setEllipsoids(poseAt(film, frame));
      model.step(1);
      frames.push(model.mesh.clone());
      tell((frame + 1) / (last + 2));
      if (await isCancelled(signal)) return undefined;
    }
    return animationGlb(frames, { frameSeconds });
  } finally {
    for (const frame of frames) frame.free();
  }
}

/** Gives messages their turn: a cancel is one. */
async function isCancelled(signal: AbortSignal): Promise<boolean> {
  await new Promise((resolve) => setTimeout(resolve, 0));
  return signal.aborted;
}
