/**
 * Runs the same extraction by the deformable model twice, for comparison: on the volume itself, and coarse to fine
 * (section 5.2 of Lachaud and Montanvert's paper).
 */
import type { StepReport, Volume } from 'vesicle';

import { buildModel } from './models';
import type { ComparisonProgressEvent, ExtractionRun, Requests, Setup } from './protocol';

/**
 * Largest number of iterations of each of the two compared runs; one that has not converged by then is compared in its
 * present state.
 */
const MOST_ITERATIONS = 4000;
/**
 * Least time between two progress reports of a run to the page, milliseconds; the report of convergence is sent at
 * once.
 */
const TELL_EVERY = 150;

type OnReport = (run: ComparisonProgressEvent['run'], report: StepReport) => void;

/**
 * Runs the extraction directly and coarse to fine, and returns both results for display; undefined if the signal
 * aborts.
 */
export async function compare(
  volume: Volume,
  setup: Setup,
  isSmall: boolean,
  signal: AbortSignal,
  onReport: OnReport,
): Promise<Requests['compare']['reply']> {
  try {
    const direct = await once(volume, { ...setup, levels: 0 }, isSmall, signal, (report) => onReport('direct', report));
    const coarseToFine = await once(volume, setup, isSmall, signal, (report) => onReport('coarseToFine', report));
    return { direct, coarseToFine };
  } catch (error) {
    if (signal.aborted) return undefined;
    throw error;
  }
}

async function once(
  volume: Volume,
  setup: Setup,
  isSmall: boolean,
  signal: AbortSignal,
  onReport: (report: StepReport) => void,
): Promise<ExtractionRun> {
  const model = buildModel(volume, setup, isSmall);
  try {
    const byLevel = Array.from({ length: setup.levels + 1 }, (_, i) => ({
      level: setup.levels - i,
      iterations: 0,
      times: {} as Record<string, number>,
    }));
    let reportedAt = 0;
    // A step belongs to the level on which it began: the last one of a level includes the change to the next.
    let level = model.level;
    const onStep = (report: StepReport) => {
      const entry = byLevel[setup.levels - level];
      level = model.level;
      if (entry) {
        entry.iterations += 1;
        for (const [part, time] of Object.entries(report.times)) entry.times[part] = (entry.times[part] ?? 0) + time;
      }
      if (performance.now() - reportedAt < TELL_EVERY && !report.done) return;
      reportedAt = performance.now();
      onReport(report);
    };
    const report = await model.run({ signal, onStep, maxIterations: MOST_ITERATIONS });
    return { levels: setup.levels, byLevel, report, info: model.mesh.info() };
  } finally {
    model.free();
  }
}
