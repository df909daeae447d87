/** Measures the solve time for growing numbers of constraints (figure 4d of the paper). Used by the worker only. */
import { ImplicitSurface } from 'vesicle';
import type { CameraView, Cloud, Requests, Setup, Timing } from './protocol';

/**
 * Solves that take at most this many milliseconds are timed twice, and the shorter time counts: other load on the
 * machine only adds time.
 */
const RETIME_BELOW_MS = 2000;

type TimingRequest = Requests['timing']['body'];

/**
 * Measures the solve time for each number of points in `sizes` and each kernel, and passes each result to `onTiming`
 * when it is known. Returns all results; undefined if `signal` aborts.
 */
export async function timeSolves(
  cloud: Cloud,
  cameras: CameraView[],
  setup: Setup,
  { sizes, kernels }: TimingRequest,
  signal: AbortSignal,
  onTiming: (timing: Timing) => void,
): Promise<Timing[] | undefined> {
  const timings: Timing[] = [];
  for (const size of sizes) {
    for (const kernel of kernels) {
      const timing = await timeOne(
        cloud,
        cameras,
        { ...setup, params: { ...setup.params, kernel }, maxPoints: size },
        signal,
      );
      if (!timing) return undefined;
      timings.push(timing);
      onTiming(timing);
    }
  }
  return timings;
}

async function timeOne(
  { points }: Cloud,
  cameras: CameraView[],
  { params, maxPoints = 20_000 }: Setup,
  signal: AbortSignal,
): Promise<Timing | undefined> {
  const withoutImages = cameras.map(({ image: _, ...camera }) => camera);
  const model = new ImplicitSurface({ points, cameras: withoutImages, maxPoints, params });
  try {
    const first = await solveTime(model, signal);
    // Time a quick solve again: other load on the machine only ever adds time. Changing the tolerance is the least
    // change that triggers a new solve.
    model.setParams({ tolerance: 1.0001 * model.params.tolerance });
    const second = first === undefined || first > RETIME_BELOW_MS ? first : await solveTime(model, signal);
    const milliseconds = first !== undefined && second !== undefined ? Math.min(first, second) : undefined;
    const { surface, exterior } = model.constraints();
    const constraints = (surface.length + exterior.length) / 3;
    return milliseconds === undefined ? undefined : { kernel: String(params.kernel), constraints, milliseconds };
  } finally {
    model.free();
  }
}

/**
 * Runs the model until its solve has ended; returns the milliseconds spent solving, or undefined if the signal aborts.
 */
async function solveTime(model: ImplicitSurface, signal: AbortSignal): Promise<number | undefined> {
  const solved = new AbortController();
  let milliseconds = 0;
  const onStep = ({ phase, times }: { phase: string; times: Record<string, number> }) => {
    milliseconds += times.solve ?? 0;
    if (phase === 'extract') solved.abort();
  };
  try {
    await model.run({ signal: AbortSignal.any([signal, solved.signal]), onStep });
  } catch (error) {
    if (signal.aborted) return undefined;
    if (!solved.signal.aborted) throw error;
  }
  return milliseconds;
}
