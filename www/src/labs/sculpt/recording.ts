/** Records films of the Sculpt lab as animated GLB. Used by the worker only. */
import { animationGlb, type Mesh, type MultiresolutionModel } from 'vesicle';
import { type Film, lastFrame, poseAt } from './film';

/**
 * Largest number of steps in which the surface may reach the film's first pose before recording starts; motion that
 * remains then is recorded.
 */
const MOST_TO_START = 60;

/**
 * Records all frames of a film as one animated GLB file; in a loop the last frame is left out, as it equals the first.
 * Undefined if the signal aborts. Leaves the model in the last pose.
 */
export async function recorded(
  model: MultiresolutionModel,
  film: Film,
  frameSeconds: number,
  signal: AbortSignal,
  onProgress: (part: number) => void,
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
      onProgress((frame + 1) / (last + 2));
      if (await isCancelled(signal)) return undefined;
    }
    return animationGlb(frames, { frameSeconds });
  } finally {
    for (const frame of frames) frame.free();
  }
}

/** Returns whether the signal has aborted, after handling pending messages, one of which may abort it. */
async function isCancelled(signal: AbortSignal): Promise<boolean> {
  await new Promise((resolve) => setTimeout(resolve, 0));
  return signal.aborted;
}
