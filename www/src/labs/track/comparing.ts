/** Repeats the whole tracking run with another setup, for the comparison panel of the Track lab. */
import { SurfaceTracker, type Volume } from 'vesicle';
import type { CineSpec } from './cine';
import { errorOf } from './frames';
import type { ComparedTrack, Setup, SurfaceError } from './protocol';
import { inWords, prepareInSlices, trackerOptions } from './source';

type OnProgress = (part: number, phase: string) => void;

/**
 * Prepares the image, tracks all frames with `setup` and returns the results for the comparison. Undefined if the
 * signal aborts.
 */
export async function trackForComparison(
  original: Volume,
  spec: CineSpec | undefined,
  setup: Setup,
  isSmall: boolean,
  signal: AbortSignal,
  onProgress: OnProgress,
): Promise<ComparedTrack | undefined> {
  const began = performance.now();
  try {
    const volume = await prepareInSlices(original, setup.preparation, (what) => onProgress(0, what), signal);
    try {
      return await trackAll(volume, spec, setup, isSmall, signal, onProgress, began);
    } finally {
      if (volume !== original) volume.free();
    }
  } catch (error) {
    if (signal.aborted) return undefined;
    throw inWords(error);
  }
}

async function trackAll(
  volume: Volume,
  spec: CineSpec | undefined,
  setup: Setup,
  isSmall: boolean,
  signal: AbortSignal,
  onProgress: OnProgress,
  began: number,
): Promise<ComparedTrack> {
  const tracker = await SurfaceTracker.create({ volume, ...trackerOptions(volume, setup, isSmall) }, { signal });
  try {
    const { threshold } = setup.params;
    if (threshold !== undefined) tracker.setParams({ threshold: threshold as number });
    await tracker.run({ signal, onStep: ({ progress, phase }) => onProgress(progress, phase) });
    const duration = performance.now() - began;
    const errors: SurfaceError[] = [];
    let selfIntersections = 0;
    for (let frame = 0; frame < tracker.frames; frame++) {
      const mesh = tracker.meshAt(frame);
      selfIntersections += mesh.check().selfIntersections;
      const error = spec && errorOf(spec, frame, mesh.arrays().positions);
      if (error) errors.push(error);
      mesh.free();
    }
    const mean = (of: 'mean' | 'p95') => errors.reduce((sum, error) => sum + error[of], 0) / errors.length;
    const error = errors.length > 0 ? { mean: mean('mean'), p95: mean('p95') } : undefined;
    return { facts: tracker.statistics, closing: tracker.cycleClosureError, error, duration, selfIntersections };
  } finally {
    tracker.free();
  }
}
