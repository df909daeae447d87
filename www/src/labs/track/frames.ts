/** Collects the data that the page displays for a tracked frame. */
import type { SurfaceTracker } from 'vesicle';
import { snapshotOf } from '../../engine/surface';
import { type CineSpec, wallDistances } from './cine';
import type { SurfaceError, TrackedFrame } from './protocol';

/** Returns the surface of a tracked frame with its facts and measures, and its error if `spec` gives the true wall. */
export function trackedFrame(tracker: SurfaceTracker, index: number, spec: CineSpec | undefined): TrackedFrame {
  const mesh = tracker.meshAt(index);
  try {
    const surface = snapshotOf(mesh);
    const facts = tracker.statistics[index];
    if (!facts) throw new Error(`frame ${index} has no facts`);
    const error = spec && errorOf(spec, index, surface.positions.subarray(0, 3 * surface.vertices));
    return { surface, facts, measures: { info: mesh.info(), report: mesh.check() }, error };
  } finally {
    mesh.free();
  }
}

/**
 * Returns the mean and the 95th percentile of the distances, mm, of points from the true wall of the phantom; undefined
 * without points.
 */
export function errorOf(spec: CineSpec, frame: number, points: Float32Array): SurfaceError | undefined {
  if (points.length === 0) return undefined;
  const distances = wallDistances(spec, frame, points);
  const mean = distances.reduce((sum, distance) => sum + distance, 0) / distances.length;
  return { mean, p95: distances[Math.floor(0.95 * distances.length)] ?? 0 };
}
